import { Mesh, MeshStandardMaterial } from "three";
import { expect, it } from "vitest";
import { Materials, type Origin } from "./materials.ts";

/** A model of meshes that are painted so, as a loader makes it. */
function model(...definitions: object[]): { parts: Mesh[]; origin: Origin; own: MeshStandardMaterial[] } {
  const own = definitions.map(() => new MeshStandardMaterial());
  const parts = own.map((material) => new Mesh(undefined, material));
  const associations = new Map(own.map((material, i) => [material, { materials: i }]));
  return { parts, origin: { json: { materials: definitions }, associations }, own };
}

const paints = (parts: Mesh[]) => parts.map(({ material }) => material);

const BRICK = { name: "brick", pbrMetallicRoughness: { baseColorFactor: [0.6, 0.3, 0.2, 1] } };
const SLATE = { pbrMetallicRoughness: { baseColorFactor: [0.2, 0.2, 0.3, 1] } };
const PHOTO = { pbrMetallicRoughness: { baseColorTexture: { index: 0 } } };

it("models that are painted alike use one material, whatever it is called, and pictures stay with their model", () => {
  const materials = new Materials();
  const [house, tower] = [model(BRICK, PHOTO), model(SLATE, { ...BRICK, name: "wall" }, PHOTO)];
  materials.share(house.parts, house.origin);
  materials.share(tower.parts, tower.origin);
  expect(paints(house.parts)).toEqual(house.own);
  expect(paints(tower.parts)).toEqual([tower.own[0], house.own[0], tower.own[2]]);
});

it("a material goes with the last model that uses it", () => {
  const materials = new Materials();
  const [house, tower] = [model(BRICK, BRICK), model(BRICK)];
  const [used, usedToo] = [materials.share(house.parts, house.origin), materials.share(tower.parts, tower.origin)];
  expect([...usedToo]).toEqual([...used]);
  const [brick] = house.own;
  if (!brick) throw new Error("there is no brick");
  expect([materials.release(brick), materials.release(brick)]).toEqual([false, true]);
  const next = model(BRICK);
  materials.share(next.parts, next.origin);
  expect(paints(next.parts)).toEqual(next.own);
});
