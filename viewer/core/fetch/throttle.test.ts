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

it("counts what travels of a body that is unpacked here, however long that is, and loses no byte", async () => {
  const clock = virtualClock();
  const encoded = (bytes: number) => ({ headers: { "Content-Encoding": "zstd", "Content-Length": String(bytes) } });
  const throttle = new Throttle(async (url) => new Response(new Uint8Array(60_000), encoded(Number(url))), clock);
  throttle.line = { name: "8k", bits_per_s: 8000, latency_ms: 0 };
  const get = async (url: string) => (await (await throttle.fetch(url, {})).arrayBuffer()).byteLength;
  expect(await get("10000")).toBe(60_000);
  expect(clock.now_ms()).toBeCloseTo(10_000, -2);
  // Both take turns on the same line.
  expect(await Promise.all([get("5000"), get("500")])).toEqual([60_000, 60_000]);
  expect(clock.now_ms()).toBeCloseTo(15_500, -2);
});

it("counts what it sees of a body whose length on the line nobody tells", async () => {
  const clock = virtualClock();
  const headers = { "Content-Encoding": "zstd", "Content-Length": "many" };
  const throttle = new Throttle(async () => new Response(new Uint8Array(3000), { headers }), clock);
  throttle.line = { name: "8k", bits_per_s: 8000, latency_ms: 0 };
  await (await throttle.fetch("a", {})).arrayBuffer();
  expect(clock.now_ms()).toBeCloseTo(3000, -2);
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

/** A body that comes when it is told to. */
function tap() {
  let controller: ReadableStreamDefaultController<Uint8Array> | undefined;
  const body = new ReadableStream<Uint8Array>({
    start: (one) => {
      controller = one;
    },
  });
  return { body, pour: (bytes: number) => controller?.enqueue(new Uint8Array(bytes)), end: () => controller?.close() };
}

const SLOW = { name: "8k", bits_per_s: 8000, latency_ms: 100 };

it("slows down what was under way when a line was chosen", async () => {
  const clock = virtualClock();
  const { body, pour, end } = tap();
  const throttle = new Throttle(async () => new Response(body), clock);
  const reader = (await throttle.fetch("a", {})).body?.getReader();
  pour(5000);
  expect((await reader?.read())?.value?.byteLength).toBe(5000);
  expect(clock.now_ms()).toBe(0);
  throttle.line = SLOW;
  pour(5000);
  end();
  let came = 0;
  for (let part = await reader?.read(); part?.value; part = await reader?.read()) came += part.value.byteLength;
  expect(came).toBe(5000);
  expect(clock.now_ms()).toBeCloseTo(5000, -2);
});

it("slows down an answer that was asked for before a line was chosen, and one without a body", async () => {
  const clock = virtualClock();
  let reply: (response: Response) => void = () => {};
  const throttle = new Throttle(() => new Promise((resolve) => (reply = resolve)), clock);
  const early = throttle.fetch("a", {});
  throttle.line = SLOW;
  reply(new Response(new Uint8Array(1000)));
  await (await early).arrayBuffer();
  expect(clock.now_ms()).toBeCloseTo(1100, -1);
  const empty = throttle.fetch("b", { method: "HEAD" });
  reply(new Response(null));
  await empty;
  expect(clock.now_ms()).toBeCloseTo(1200, -1);
});

it("lets go of what waits when another line is chosen", async () => {
  const forever = { now_ms: () => 0, pause: () => new Promise<void>(() => {}) };
  const throttle = new Throttle(answer(3000), forever);
  throttle.line = { ...SLOW, latency_ms: 0 };
  const response = await throttle.fetch("a", {});
  const whole = response.arrayBuffer();
  await new Promise((resolve) => setTimeout(resolve, 0));
  throttle.line = undefined;
  expect((await whole).byteLength).toBe(3000);
});
