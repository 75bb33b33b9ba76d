import { expect, it } from "vitest";
import { FrameBudget } from "./framebudget.ts";
import { ResidencySet } from "./residency.ts";

it("a finer level takes the place of a coarser one, never the reverse", () => {
  const set = new ResidencySet(1000);
  expect(set.hold(1, { level: 2, bytes: 10 })).toBe(true);
  expect(set.hold(1, { level: 0, bytes: 90 })).toBe(true);
  expect(set.hold(1, { level: 1, bytes: 50 })).toBe(false);
  expect(set.held(1)).toMatchObject({ level: 0 });
  expect(set.bytes).toBe(90);
});

it("what is visible stays, whatever the limit", () => {
  const set = new ResidencySet(100);
  set.need(new Set([1, 2]));
  set.hold(1, { level: 0, bytes: 80 });
  set.hold(2, { level: 0, bytes: 80 });
  expect(set.evict()).toEqual([]);
  expect(set.full).toBe(true);
});

it("what was left goes in the order of its last use, and only as much as it must", () => {
  const set = new ResidencySet(100);
  for (const model of [1, 2, 3]) {
    set.need(new Set([model]));
    set.hold(model, { level: 0, bytes: 40 });
  }
  set.need(new Set([1, 3]));
  set.need(new Set([3]));
  expect(set.evict()).toEqual([2]);
  expect(set.bytes).toBe(80);
  expect(set.levels()).toEqual({ 0: 2 });
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
