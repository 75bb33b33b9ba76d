import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Pacer } from "./pacer.ts";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

it("does at once what is asked for first, and once what is asked for many times after that", () => {
  const work = vi.fn();
  const pacer = new Pacer(work, 15);
  for (let i = 0; i < 5; i += 1) pacer.ask();
  expect([work.mock.calls.length, pacer.isAsked]).toEqual([1, true]);
  vi.advanceTimersByTime(15);
  expect([work.mock.calls.length, pacer.isAsked]).toEqual([2, false]);
  vi.advanceTimersByTime(15);
  pacer.ask();
  expect(work.mock.calls.length).toBe(3);
});

it("asks no more for what was done meanwhile, and does nothing once it is closed", () => {
  const work = vi.fn();
  const pacer = new Pacer(work, 15);
  pacer.ask();
  pacer.ask();
  pacer.now();
  vi.advanceTimersByTime(15);
  expect(work.mock.calls.length).toBe(2);
  pacer.ask();
  pacer.ask();
  pacer.close();
  vi.advanceTimersByTime(100);
  expect([work.mock.calls.length, pacer.isAsked]).toEqual([3, false]);
});

it("rests the longer the longer the work takes", () => {
  let now_ms = 0;
  const work = vi.fn(() => {
    now_ms += 20;
  });
  const pacer = new Pacer(work, 15, () => now_ms);
  pacer.ask();
  pacer.ask();
  vi.advanceTimersByTime(179);
  expect(work.mock.calls.length).toBe(1);
  vi.advanceTimersByTime(1);
  expect(work.mock.calls.length).toBe(2);
});
