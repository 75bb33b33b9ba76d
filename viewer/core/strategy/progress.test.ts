import { expect, it } from "vitest";
import { EYE, placedAhead } from "../../test/placed.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { Grade, Holding } from "./grade.ts";
import { firstProgress, type Scope, sharpProgress } from "./progress.ts";

const TEXTURE = { url: "/o/t", bytes: 50 };

/** All levels show the same picture. */
const object = (id: number, model: number, distance_m: number, errors: number[]) =>
  placedAhead(id, model, distance_m, errors, [TEXTURE]);

const level = (number: number, geometricError = 0): Grade => ({ kind: "level", number, triangles: 1, geometricError });
const having = (grade: Grade | undefined): Holding => ({ held: grade, taken: 0, failed: new Set<string>() });
const nothing = () => having(undefined);
const all = (objects: readonly PlacedObject[], told_bytes?: number): Scope => ({
  objects,
  count: objects.length,
  told_bytes,
  isHiding: false,
});

/** Three objects of two models: 500, 1,000 and 50 bytes of what is coarsest. */
const THREE = [object(0, 0, 1, [0, 1]), object(1, 0, 1, [0, 1]), object(2, 2, 1, [0])];

it("counts each model and each texture once, by coarsest levels whatever is held", () => {
  expect(firstProgress(all(THREE), nothing)).toMatchObject({ loaded_bytes: 0, total_bytes: 1550, bound: "exact" });
  const first = firstProgress(all(THREE), (model) => having(model === 0 ? level(0) : undefined));
  expect(first.loaded_bytes).toBe(550);
  expect(firstProgress(all(THREE), () => having(level(0)))).toMatchObject({ loaded_bytes: 1550, total_bytes: 1550 });
});

it("has the same total from the first moment to the last: what the record says", () => {
  const totals = [0, 1, 2, 3].map((known) => {
    const scope = { ...all(THREE.slice(0, known), 1550), count: 3 };
    return [nothing, () => having(level(0))].map((of) => firstProgress(scope, of));
  });
  expect(totals.flat().map(({ total_bytes, bound }) => [total_bytes, bound])).toEqual(Array(8).fill([1550, "exact"]));
  expect(totals.map(([, all]) => all?.loaded_bytes)).toEqual([0, 550, 550, 1550]);
});

it("estimates what is here and whose size is still to come", () => {
  const standIn = { ...object(3, 3, 1, []), model: { model: 3, levels: [] } };
  const scope = { ...all([...THREE, standIn], 1950), count: 5 };
  const of = (model: number) => having(model === 3 ? { ...level(0), kind: "grown" } : undefined);
  expect(firstProgress(scope, of)).toEqual({ loaded_bytes: 200, isAbout: true, total_bytes: 1950, bound: "exact" });
});

it("is at most what the record says where closed doors hide something, until all of the rest is known", () => {
  const behindDoors = (known: number) => ({ ...all(THREE.slice(0, known), 9000), count: 3, isHiding: true });
  const told = (known: number) => firstProgress(behindDoors(known), nothing);
  expect(told(2)).toMatchObject({ total_bytes: 9000, bound: "most" });
  expect(told(3)).toMatchObject({ total_bytes: 1550, bound: "exact" });
});

it("towards the sharp picture counts what the nearest of a model's objects needs, whatever is here", () => {
  const [near, far] = [object(0, 0, 1, [0, 0.01, 0.1]), object(1, 0, 200, [0, 0.01, 0.1])];
  const sharp = (objects: PlacedObject[], held: Grade | undefined) =>
    sharpProgress(all(objects), () => having(held), EYE, 1.5);
  expect(sharp([far, near], undefined)).toMatchObject({ loaded_bytes: 0, total_bytes: 1050, bound: "exact" });
  expect(sharp([far, near], level(1, 0.01))).toMatchObject({ loaded_bytes: 50, total_bytes: 1050 });
  expect(sharp([far, near], level(0))).toMatchObject({ loaded_bytes: 1050, total_bytes: 1050 });
  expect(sharp([far], level(1, 0.01))).toMatchObject({ loaded_bytes: 300, total_bytes: 300 });
});

it("towards the sharp picture is at least what is known", () => {
  const scope = { ...all(THREE, 2000), count: 4 };
  expect(sharpProgress(scope, nothing, EYE, 1.5)).toMatchObject({ total_bytes: 2050, bound: "least" });
});
