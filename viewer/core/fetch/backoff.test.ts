import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { BackOff } from "./backoff.ts";
import { FETCH_DEFAULTS, FetchQueue } from "./fetchqueue.ts";
import type { Silence } from "./silences.ts";
import { FetchError } from "./transfer.ts";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** A queue whose server is busy until a moment, and what it was asked for when. */
function busyUntil(end_ms: number, retryAfter: string, status = 503) {
  const asked: { url: string; at_ms: number }[] = [];
  const told: (Silence | undefined)[] = [];
  const started_ms = performance.now();
  const fetch = async (url: string) => {
    const at_ms = performance.now() - started_ms;
    asked.push({ url, at_ms });
    const isBusy = url.startsWith("https://busy/") && at_ms < end_ms;
    return isBusy ? new Response("", { status, headers: { "Retry-After": retryAfter } }) : new Response("well");
  };
  const silent = (silence: Silence | undefined) => told.push(silence);
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, concurrency: 2, digest: undefined, fetch, silent });
  return { queue, asked, told };
}

test.each([429, 503])(
  "after %i with Retry-After nothing at all is asked of that server for so long",
  async (status) => {
    const { queue, asked, told } = busyUntil(10_000, "10", status);
    const all = ["a", "b", "c", "d"].map((name) => queue.request(`https://busy/${name}`, 1));
    const other = queue.request("https://other/e", 2);
    await vi.advanceTimersByTimeAsync(9_900);
    expect(asked.filter(({ url }) => url.startsWith("https://busy/")).map(({ url }) => url)).toEqual([
      "https://busy/a",
      "https://busy/b",
    ]);
    expect(told[0]).toMatchObject({ how: "backing off", url: "https://busy/a" });
    await vi.advanceTimersByTimeAsync(3_000);
    await Promise.all([...all, other]);
    // Each was asked for once more, or once.
    expect(asked).toHaveLength(7);
    expect([queue.tally.retries, told.at(-1)]).toEqual([2, undefined]);
  },
);

test("another server goes on", async () => {
  const { queue, asked } = busyUntil(10_000, "10");
  // As many as there may be at once wait for the busy one.
  void queue.request("https://busy/a", 1);
  void queue.request("https://busy/c", 1);
  await vi.advanceTimersByTimeAsync(100);
  await queue.request("https://other/b", 2);
  expect(asked.map(({ url }) => url)).toEqual(["https://busy/a", "https://busy/c", "https://other/b"]);
  queue.close();
});

test("what asks for no back-off is asked again as ever", async () => {
  const { queue, asked } = busyUntil(200, "0");
  const one = queue.request("https://busy/a", 1);
  await vi.advanceTimersByTimeAsync(400);
  await one;
  expect(asked).toHaveLength(2);
});

test("a back-off is bounded, is as long as the longest that was asked for, and ends once", async () => {
  let ended = 0;
  const backOff = new BackOff(
    () => {
      ended += 1;
    },
    () => 0,
  );
  const hears = (after: string, status = 503) =>
    backOff.hears(
      new FetchError("unreachable", "https://host/a", "busy", status, new Headers({ "Retry-After": after })),
    );
  hears("20");
  hears("10");
  hears("99999", 500);
  expect(backOff.left_ms("https://host/b")).toBe(20_000);
  await vi.advanceTimersByTimeAsync(19_999);
  expect([backOff.isOn("https://host/b"), backOff.isOn("https://else/b"), ended]).toEqual([true, false, 0]);
  await vi.advanceTimersByTimeAsync(1);
  expect([backOff.isOn("https://host/b"), ended]).toEqual([false, 1]);
  hears("99999");
  expect(backOff.left_ms("https://host/b")).toBe(300_000);
  backOff.close();
  await vi.advanceTimersByTimeAsync(400_000);
  expect(ended).toBe(1);
});
