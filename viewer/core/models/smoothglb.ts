/** How does the mesh of a smooth LOD become what draws levels? With the materials of the model's glTF document. */
import type { Snapshot } from "../smooth/index.ts";
import { type Attribute, glbOf, type Vertices } from "./glb.ts";

/** A GLB of a mesh; `materials` is the text of a glTF document whose material *i* is the mesh's *i*. */
export function smoothGlb({ positions, normals, uvs, colours, indices }: Snapshot, materials: string): ArrayBuffer {
  const others: Attribute[] = uvs.map((set, i) => [`TEXCOORD_${i}`, set, "VEC2"]);
  if (normals.length > 0) others.push(["NORMAL", normals, "VEC3"]);
  if (colours.length > 0) others.push(["COLOR_0", colours, "VEC4"]);
  const vertices: Vertices = { positions, others };
  const triangles = indices.map((corners, material) => ({ vertices, indices: corners, material }));
  return glbOf(triangles, JSON.parse(materials) as Record<string, unknown>);
}
