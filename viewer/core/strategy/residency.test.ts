import { expect, it } from "vitest";
import type { Grade } from "./grade.ts";
import { NO_PICTURES } from "./pictures.ts";
import { ResidencySet } from "./residency.ts";

const level = (number: number): Grade => ({ kind: "level", number, triangles: 1, geometricError: number });
const ANY = { spare_bytes: 0, within_steps: 0, sharp_within_steps: -1 };
const NOTHING = { details: [], models: [] };

/** Takes a grade in as what it should be. */
function hold(set: ResidencySet, model: number, number: number, bytes: number, pictures = NO_PICTURES): void {
  set.hold(model, set.partFor(model, level(number), true), { grade: level(number), bytes, pictures });
}

it("holds of a model what came first, and the finest that came later", () => {
  const set = new ResidencySet(1000);
  hold(set, 1, 2, 10);
  hold(set, 1, 1, 50);
  hold(set, 1, 0, 90);
  expect([set.held(1)?.grade, set.base(1)?.grade, set.bytes]).toEqual([level(0), level(2), 100]);
  expect(set.grades()).toEqual({ 0: 1 });
});

it("what is coarser than the base, or comes where that is of no use, takes the place of all", () => {
  const set = new ResidencySet(1000);
  hold(set, 1, 1, 50);
  hold(set, 1, 0, 90);
  hold(set, 1, 2, 10);
  expect([set.held(1)?.grade, set.bytes]).toEqual([level(2), 10]);
  expect(set.partFor(1, level(0), false)).toBe("base");
});

it("what is visible stays, and nothing is promised beyond the limit", () => {
  const set = new ResidencySet(100);
  set.need(new Set([1, 2, 3]));
  hold(set, 1, 0, 60);
  expect(set.promise(2, 30, ANY)).toEqual(NOTHING);
  expect(set.promise(3, 20, ANY)).toBeUndefined();
  expect([set.bytes, set.promised_bytes]).toEqual([60, 30]);
  set.withdraw(2);
  expect(set.promise(3, 20, { ...ANY, spare_bytes: 21 })).toBeUndefined();
  expect(set.promise(3, 20, { ...ANY, spare_bytes: 20 })).toEqual(NOTHING);
  hold(set, 3, 0, 50);
  expect([set.bytes, set.promised_bytes, set.evict()]).toEqual([110, 0, NOTHING]);
});

it("details go before bases, what is needed furthest away first, and only as much as must", () => {
  const set = new ResidencySet(240);
  for (const model of [1, 2, 3, 4]) {
    set.need(new Set([model]));
    hold(set, model, 2, 40);
  }
  hold(set, 1, 0, 20);
  hold(set, 2, 0, 20);
  hold(set, 4, 0, 20);
  const steps: Record<number, number> = { 1: 1, 2: 3, 3: 3 };
  set.need(new Set([4]), (model) => steps[model] ?? Number.POSITIVE_INFINITY);
  const order = set.inOrderOfLeaving().map(({ model, part }) => [part, model]);
  expect(order).toEqual([
    ["detail", 2],
    ["detail", 1],
    ["base", 2],
    ["base", 3],
    ["base", 1],
  ]);
  expect(set.promise(5, 40, { ...ANY, sharp_within_steps: 0 })).toEqual({ details: [2], models: [] });
  expect(set.promise(6, 60, { ...ANY, within_steps: 3, sharp_within_steps: 0 })).toBeUndefined();
  expect(set.promise(6, 60, { ...ANY, sharp_within_steps: 0 })).toEqual({ details: [1], models: [2] });
  expect(set.promise(7, 20, ANY)).toEqual({ details: [4], models: [] });
  expect([set.held(1)?.grade, set.held(2), set.held(4)?.grade]).toEqual([level(2), undefined, level(2)]);
  expect(set.bytes + set.promised_bytes).toBeLessThanOrEqual(240);
});

it("counts what stands beside meshes, which goes with the base", () => {
  const set = new ResidencySet(100);
  hold(set, 1, 0, 40);
  set.keepBeside(1, { bytes: 30, pictures: NO_PICTURES });
  set.keepBeside(1, { bytes: 20, pictures: NO_PICTURES });
  expect(set.bytes).toBe(60);
  expect(set.promise(2, 100, ANY)).toEqual({ details: [], models: [1] });
  expect(set.bytes).toBe(0);
});

it("counts pictures that models share once, until the last of them goes", () => {
  const set = new ResidencySet(100);
  const wood = new Map([["/o/wood.png", 60]]);
  hold(set, 1, 0, 5, wood);
  hold(set, 2, 0, 5, wood);
  hold(set, 3, 0, 15);
  set.need(new Set([2]), (model) => 9 - model);
  expect(set.bytes).toBe(85);
  // The first of them, which is furthest away, frees little more than nothing.
  expect(set.inOrderOfLeaving().map(({ model, bytes }) => [model, bytes])).toEqual([
    [1, 5],
    [3, 15],
  ]);
  expect(set.promise(4, 30, ANY)).toEqual({ details: [], models: [1, 3] });
  expect(set.bytes).toBe(65);
  set.withdraw(4);
  set.need(new Set());
  expect(set.inOrderOfLeaving().map(({ bytes }) => bytes)).toEqual([65]);
  expect(set.promise(4, 100, ANY)).toEqual({ details: [], models: [2] });
  expect(set.bytes).toBe(0);
});

it("a picture of a mesh and of what is finer of it stays with the mesh", () => {
  const set = new ResidencySet(100);
  const wood = new Map([["/o/wood.png", 60]]);
  hold(set, 1, 2, 5, wood);
  hold(set, 1, 0, 20, wood);
  set.keepBeside(1, { bytes: 0, pictures: wood });
  expect(set.bytes).toBe(85);
  expect(set.promise(2, 35, ANY)).toEqual({ details: [1], models: [] });
  expect(set.bytes).toBe(65);
  hold(set, 1, 3, 1);
  expect(set.bytes).toBe(61);
  set.keepBeside(1, { bytes: 0, pictures: NO_PICTURES });
  expect(set.bytes).toBe(1);
});

it("what turns out larger than was promised blunts even what is visible, and never makes a hole", () => {
  const set = new ResidencySet(100);
  set.need(new Set([1, 2]));
  hold(set, 1, 2, 30);
  hold(set, 1, 0, 40);
  hold(set, 2, 2, 50);
  expect(set.evict()).toEqual({ details: [1], models: [] });
  expect(set.bytes).toBe(80);
});

it("knows what had to go once, so that it comes back only for what is further away", () => {
  const set = new ResidencySet(100);
  for (const model of [1, 2]) hold(set, model, 2, 10);
  hold(set, 1, 0, 60);
  set.need(new Set([2]), () => 1);
  expect(set.promise(2, 60, { ...ANY, sharp_within_steps: 0 })).toEqual({ details: [1], models: [] });
  expect([set.wasBlunted(1), set.wasBlunted(2)]).toEqual([true, false]);
  hold(set, 2, 0, 60);
  set.need(new Set([1]), () => 1);
  expect(set.promise(1, 60, { ...ANY, within_steps: 2, sharp_within_steps: 2 })).toBeUndefined();
  set.need(new Set([1]), () => 3);
  expect(set.promise(1, 60, { ...ANY, within_steps: 2, sharp_within_steps: 2 })).toEqual({ details: [2], models: [] });
});

it("keeps blunt what went while it was near until little of that is left, or one has been away", () => {
  const set = new ResidencySet(100);
  hold(set, 1, 2, 10);
  hold(set, 1, 0, 50);
  set.need(new Set([1]), () => 1);
  expect(set.promise(2, 80, ANY)).toEqual({ details: [1], models: [] });
  expect([...set.stayBlunt()]).toEqual([1]);
  hold(set, 2, 2, 15);
  expect([...set.stayBlunt()]).toEqual([]);
  hold(set, 3, 2, 1);
  expect([...set.stayBlunt()]).toEqual([1]);
  set.need(new Set([1]), (model) => model);
  expect([...set.stayBlunt()]).toEqual([]);
  set.need(new Set([1]), () => 1);
  expect([...set.stayBlunt()]).toEqual([1]);
  set.need(new Set(), () => 2);
  set.need(new Set([1]), () => 1);
  expect([...set.stayBlunt()]).toEqual([]);
});
