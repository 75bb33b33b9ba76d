/** How does a model that was grown here become what draws levels? With materials as the bake writes them for rules. */
import type { GrownModel, Surface } from "../procedural/index.ts";
import { glbOf } from "./glb.ts";

/** A GLB of what grew. */
export function grownGlb({ meshes, materials }: GrownModel): ArrayBuffer {
  const triangles = meshes.map(({ positions, normals, indices, material }) => ({
    vertices: { positions, others: [["NORMAL", normals, "VEC3"] as const] },
    indices,
    material,
  }));
  return glbOf(triangles, { materials: materials.map(materialOf) });
}

/** As `crates/bake/src/import/procedural/scene.rs` does it. */
function materialOf({ name, colour, opacity, metallic, roughness, emissive, doubleSided }: Surface): object {
  return {
    name,
    pbrMetallicRoughness: {
      baseColorFactor: [...colour, opacity],
      metallicFactor: metallic,
      roughnessFactor: roughness,
    },
    ...(emissive.some((channel) => channel !== 0) && { emissiveFactor: emissive }),
    ...(opacity < 1 && { alphaMode: "BLEND" }),
    ...(doubleSided && { doubleSided: true }),
  };
}
