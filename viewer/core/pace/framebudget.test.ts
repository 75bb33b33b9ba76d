import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FrameBudget } from "./framebudget.ts";

let now_ms = 0;
let done: number[] = [];
let budget: FrameBudget;

beforeEach(() => {
  vi.useFakeTimers();
  now_ms = 0;
  done = [];
  budget = new FrameBudget(8, () => now_ms);
});

afterEach(() => vi.useRealTimers());

const work = (id: number, urgency?: "urgent") =>
  budget.run(async () => {
    now_ms += 5;
    done.push(id);
  }, urgency);
const turn = () => vi.advanceTimersByTimeAsync(0);

it("decoding waits for the next frame once this one's time is used", async () => {
  const all = Promise.all([1, 2, 3, 4, 5].map((id) => work(id)));
  await turn();
  expect(done).toEqual([1, 2]);
  budget.beginFrame();
  await turn();
  expect(done).toEqual([1, 2, 3, 4]);
  budget.beginFrame();
  await turn();
  await all;
  expect(done).toEqual([1, 2, 3, 4, 5]);
});

it("what others wait for goes before what has waited longer", async () => {
  const all = Promise.all([work(1), work(2), work(3), work(4, "urgent"), work(5, "urgent")]);
  await turn();
  expect(done).toEqual([1, 4]);
  budget.beginFrame();
  await turn();
  budget.beginFrame();
  await turn();
  await all;
  expect(done).toEqual([1, 4, 5, 2, 3]);
});

it("work goes on after the time of a usual frame where the next one is late", async () => {
  const all = Promise.all([1, 2, 3].map((id) => work(id)));
  await vi.advanceTimersByTimeAsync(16);
  expect(done).toEqual([1, 2]);
  await vi.advanceTimersByTimeAsync(2);
  await all;
  expect(done).toEqual([1, 2, 3]);
});

it("what waits runs behind a frame, not in it", async () => {
  const all = Promise.all([1, 2, 3].map((id) => work(id)));
  await turn();
  budget.beginFrame();
  // As far as whoever began the frame goes on at once.
  for (let i = 0; i < 10; i += 1) await Promise.resolve();
  expect(done).toEqual([1, 2]);
  await turn();
  await all;
  expect([done, budget.taken_ms]).toEqual([[1, 2, 3], 5]);
});

it("a frame that took very long grants a share of that", async () => {
  const all = Promise.all([1, 2, 3, 4, 5, 6].map((id) => work(id)));
  await turn();
  expect(done).toEqual([1, 2]);
  expect(budget.beginFrame(64)).toBe(1);
  await turn();
  expect(done).toEqual([1, 2, 3, 4]);
  expect(budget.beginFrame(400)).toBe(5);
  await turn();
  await all;
});

it("work of many pieces stops where the time of a frame is used up, and others go in between", async () => {
  const pieces = budget.runPieces(
    (function* () {
      for (let piece = 1; piece <= 4; piece += 1) {
        now_ms += 5;
        done.push(10 + piece);
        yield;
      }
      return "whole";
    })(),
  );
  const other = work(1, "urgent");
  await turn();
  expect(done).toEqual([11, 12]);
  budget.beginFrame();
  await turn();
  expect(done).toEqual([11, 12, 1, 13, 14]);
  budget.beginFrame();
  await turn();
  await other;
  expect(await pieces).toBe("whole");
});

it("what fails in a piece fails for who waits for the whole, and others go on", async () => {
  const broken = budget.runPieces(
    (function* () {
      yield;
      throw new Error("damaged");
    })(),
  );
  await expect(broken).rejects.toThrow("damaged");
  await work(1);
  expect(done).toEqual([1]);
});
