import { expect, it } from "vitest";
import { FrameBudget } from "./framebudget.ts";
import type { Grade } from "./grades.ts";
import { ResidencySet } from "./residency.ts";

const level = (number: number): Grade => ({ kind: "level", number, triangles: 1, geometricError: 0 });
const ANY = { spare_bytes: 0, within_steps: -1 };

it("holds one level of a model, the last that came", () => {
  const set = new ResidencySet(1000);
  set.hold(1, { grade: level(2), bytes: 10 });
  set.hold(1, { grade: level(0), bytes: 90 });
  expect(set.held(1)).toMatchObject({ grade: level(0) });
  expect(set.bytes).toBe(90);
});

it("what is visible stays, and nothing is promised beyond the limit", () => {
  const set = new ResidencySet(100);
  set.need(new Set([1, 2, 3]));
  set.hold(1, { grade: level(0), bytes: 60 });
  expect(set.promise(2, 30, ANY)).toEqual([]);
  expect(set.promise(3, 20, ANY)).toBeUndefined();
  expect([set.bytes, set.promised_bytes]).toEqual([60, 30]);
  set.withdraw(2);
  expect(set.promise(3, 20, { ...ANY, spare_bytes: 21 })).toBeUndefined();
  expect(set.promise(3, 20, { ...ANY, spare_bytes: 20 })).toEqual([]);
  set.hold(3, { grade: level(0), bytes: 50 });
  expect([set.bytes, set.promised_bytes, set.evict()]).toEqual([110, 0, []]);
});

it("what is needed furthest away goes first, then what was unused longest, and only as much as must", () => {
  const set = new ResidencySet(200);
  for (const model of [1, 2, 3, 4]) {
    set.need(new Set([model]));
    set.hold(model, { grade: level(0), bytes: 40 });
  }
  const steps: Record<number, number> = { 1: 1, 2: 3, 3: 3 };
  set.need(new Set([4]), (model) => steps[model] ?? Number.POSITIVE_INFINITY);
  expect(set.inOrderOfLeaving().map(([model]) => model)).toEqual([2, 3, 1]);
  expect(set.promise(5, 60, ANY)).toEqual([2]);
  expect(set.promise(6, 80, { ...ANY, within_steps: 1 })).toBeUndefined();
  expect(set.promise(6, 80, ANY)).toEqual([3, 1]);
  expect(set.grades()).toEqual({ 0: 1 });
});

it("decoding waits for the next frame once this one's time is used", async () => {
  let now_ms = 0;
  const budget = new FrameBudget(8, () => now_ms);
  const done: number[] = [];
  const work = (id: number) =>
    budget.run(async () => {
      now_ms += 5;
      done.push(id);
    });
  const all = Promise.all([1, 2, 3, 4, 5].map(work));
  const turn = () => new Promise((resolve) => setTimeout(resolve, 0));
  await turn();
  expect(done).toEqual([1, 2]);
  budget.beginFrame(16);
  await turn();
  expect(done).toEqual([1, 2, 3, 4]);
  budget.beginFrame(16);
  await all;
  expect(done).toEqual([1, 2, 3, 4, 5]);
});
