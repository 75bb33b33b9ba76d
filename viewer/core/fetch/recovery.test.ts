import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Recovery } from "./recovery.ts";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** Pauses until each of some tries, when each of them loses something again at once. */
function pauses(count: number, random = 0.5): number[] {
  const tried: number[] = [];
  const recovery: Recovery = new Recovery(
    () => {
      tried.push(Date.now());
      recovery.lost();
      recovery.lost();
    },
    () => random,
  );
  const begun = Date.now();
  recovery.lost();
  while (tried.length < count) vi.advanceTimersToNextTimer();
  recovery.close();
  expect(vi.getTimerCount()).toBe(0);
  return tried.map((at, i) => (at - (tried[i - 1] ?? begun)) / 1000);
}

it("tries again after pauses that grow up to a minute, and differ from visitor to visitor", () => {
  expect(pauses(6)).toEqual([5, 10, 20, 40, 60, 60]);
  expect(pauses(2, 0)).toEqual([4, 8]);
  expect(pauses(2, 1)).toEqual([6, 12]);
});

it("begins with the shortest pause again when nothing was lost for long enough, but not where tries take long", () => {
  const again = vi.fn();
  const recovery = new Recovery(again, () => 0.5);
  for (const pause_ms of [5000, 10_000, 20_000]) {
    // Longer than nothing comes of the four tries of a download.
    vi.advanceTimersByTime(210_000);
    recovery.lost();
    vi.advanceTimersByTime(pause_ms - 1);
    const before = again.mock.calls.length;
    vi.advanceTimersByTime(1);
    expect(again.mock.calls.length).toBe(before + 1);
  }
  vi.advanceTimersByTime(301_000);
  recovery.lost();
  vi.advanceTimersByTime(5000);
  expect(again).toHaveBeenCalledTimes(4);
  expect(vi.getTimerCount()).toBe(0);
});

it("does not try again before the server says", () => {
  const again = vi.fn();
  const recovery = new Recovery(again, () => 0.5);
  recovery.lost({ headers: new Headers({ "Retry-After": "60" }) });
  vi.advanceTimersByTime(59_000);
  expect(again).not.toHaveBeenCalled();
  vi.advanceTimersByTime(8000);
  expect(again).toHaveBeenCalledTimes(1);
});
