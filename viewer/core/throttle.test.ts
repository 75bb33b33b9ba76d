import { expect, it } from "vitest";
import { LINES, Throttle } from "./throttle.ts";

/** A clock that jumps to the end of the longest pause, once all who wait have said so. */
function virtualClock() {
  let now_ms = 0;
  const pause = async (ms: number) => {
    const until_ms = now_ms + ms;
    await new Promise((resolve) => setTimeout(resolve, 0));
    now_ms = Math.max(now_ms, until_ms);
  };
  return { now_ms: () => now_ms, pause };
}

const answer = (bytes: number) => async () => new Response(new Uint8Array(bytes));

it("all bodies together take as long as the line takes, and no byte is lost", async () => {
  const clock = virtualClock();
  const throttle = new Throttle(answer(10_000), clock);
  throttle.line = { name: "8k", bits_per_s: 8000, latency_ms: 100 };
  const bodies = await Promise.all(
    ["a", "b"].map(async (url) => (await (await throttle.fetch(url, {})).arrayBuffer()).byteLength),
  );
  expect(bodies).toEqual([10_000, 10_000]);
  expect(clock.now_ms()).toBeCloseTo(20_100, -2);
});

it("stands back when no line is chosen", async () => {
  const clock = virtualClock();
  const response = await new Throttle(answer(10_000), clock).fetch("a", {});
  expect((await response.arrayBuffer()).byteLength).toBe(10_000);
  expect(clock.now_ms()).toBe(0);
});

it("keeps status and headers", async () => {
  const throttle = new Throttle(
    async () => new Response("no", { status: 404, headers: { "X-Why": "gone" } }),
    virtualClock(),
  );
  throttle.line = LINES[0];
  const response = await throttle.fetch("a", {});
  expect([response.status, response.headers.get("X-Why"), await response.text()]).toEqual([404, "gone", "no"]);
});
