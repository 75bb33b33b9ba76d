import {
  BoxGeometry,
  FrontSide,
  type Material,
  Mesh,
  MeshStandardMaterial,
  type RawShaderMaterial,
  Texture,
} from "three";
import { expect, it } from "vitest";
import { Casters } from "./casters.ts";
import { impostorMaterial } from "./impostormaterial.ts";
import { paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";

const casters = new Casters();
const of = (material: Material | Material[]) => casters.of(new Mesh(new BoxGeometry(), material));
const uniformsOf = (material: Material) => Object.keys((of(material) as RawShaderMaterial).uniforms).sort();

it("all that is solid casts by one material", () => {
  const solid = of(new MeshStandardMaterial());
  expect(of(new MeshStandardMaterial({ map: new Texture() }))).toBe(solid);
  const leaves = new MeshStandardMaterial({ map: new Texture(), alphaTest: 0.5 });
  expect(of([new MeshStandardMaterial(), leaves])).toEqual([solid, of(leaves)]);
});

it("leaves cast by their pictures, paints by their palette, and impostors by their views", () => {
  const leaves = new MeshStandardMaterial({ map: new Texture(), alphaTest: 0.5 });
  expect(uniformsOf(leaves)).toEqual(["least", "picture", "pictureFromUv"]);
  const finish = { side: FrontSide, vertexColors: false, flatShading: false } as const;
  expect(uniformsOf(paintMaterial(new Palette().uniform, finish))).toEqual(["palette"]);
  const impostor = { mapping: "octahedral", views: 2, size_px: 1, frames: 1, centre: [0, 0, 0], radius: 1 } as const;
  expect(uniformsOf(impostorMaterial(impostor, new Texture(), new Texture()))).toContain("colourAtlas");
});

it("what casts for a material is kept, and goes with it", () => {
  const leaves = new MeshStandardMaterial({ map: new Texture(), alphaTest: 0.5 });
  const made = of(leaves) as Material;
  expect(of(leaves)).toBe(made);
  let gone = 0;
  made.addEventListener("dispose", () => {
    gone += 1;
  });
  leaves.dispose();
  expect(gone).toBe(1);
  expect(of(leaves)).not.toBe(made);
});
