import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FetchError } from "../core/fetch/transfer.ts";
import { Reopening } from "./reopening.ts";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

const BUSY = new FetchError("unreachable", "a", "busy", 503);
const MISSING = new FetchError("status", "a", "missing", 404);

/** Something to open that fails with these errors, one after the other, before it succeeds. */
function failing(...errors: FetchError[]) {
  const failed = vi.fn();
  const open = vi.fn(async () => {
    const error = errors.shift();
    if (error) throw error;
    return "opened";
  });
  return { reopening: new Reopening(open, failed), open, failed };
}

it("what cannot be opened for a reason that passes is tried again until it can be", async () => {
  const { reopening, open, failed } = failing(BUSY, BUSY);
  await vi.advanceTimersByTimeAsync(3000);
  expect([open.mock.calls.length, failed.mock.calls]).toEqual([1, [[BUSY]]]);
  await vi.advanceTimersByTimeAsync(20_000);
  expect(await reopening.opened).toBe("opened");
  expect([open.mock.calls.length, reopening.now()]).toEqual([3, false]);
  expect(vi.getTimerCount()).toBe(0);
});

it("is tried at once when somebody asks for that, and not twice at the same time", async () => {
  const { reopening, open } = failing(BUSY);
  await vi.advanceTimersByTimeAsync(1);
  expect([reopening.now(), reopening.now()]).toEqual([true, true]);
  expect(await reopening.opened).toBe("opened");
  expect(open).toHaveBeenCalledTimes(2);
});

it("is not tried again by itself before the server says", async () => {
  const busy = new FetchError("unreachable", "a", "busy", 503, new Headers({ "Retry-After": "100" }));
  const { reopening, open } = failing(busy);
  await vi.advanceTimersByTimeAsync(99_000);
  expect(open).toHaveBeenCalledTimes(1);
  await vi.advanceTimersByTimeAsync(22_000);
  expect(await reopening.opened).toBe("opened");
});

it("ends with what does not pass", async () => {
  const { reopening, open, failed } = failing(BUSY, MISSING);
  await vi.advanceTimersByTimeAsync(10_000);
  await expect(reopening.opened).rejects.toBe(MISSING);
  expect([open.mock.calls.length, failed.mock.calls.length, reopening.now()]).toEqual([2, 1, false]);
});

it("who has left hears nothing, and nothing is tried any more", async () => {
  const { reopening, open, failed } = failing(BUSY);
  reopening.close();
  await vi.advanceTimersByTimeAsync(100_000);
  expect([open.mock.calls.length, failed.mock.calls.length, reopening.now()]).toEqual([1, 0, false]);
});
