import { expect, it } from "vitest";
import { FrameBudget } from "./framebudget.ts";

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
