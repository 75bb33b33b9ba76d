import { expect, it } from "vitest";
import { HEADER_BYTES, LineMeter } from "./linemeter.ts";

/** What a request costs where so many wait side by side for so long, and their answers then come one after the other. */
function after({
  lanes,
  latency_ms,
  coming_ms,
  bytes,
}: Record<"lanes" | "latency_ms" | "coming_ms" | "bytes", number>) {
  let now_ms = 0;
  const meter = new LineMeter(() => now_ms);
  for (let round = 0; round < 50; round += 1) {
    const traces = Array.from({ length: lanes }, () => meter.starts());
    now_ms += latency_ms;
    for (const trace of traces) {
      trace.receives(bytes / 2);
      now_ms += coming_ms;
      trace.receives(bytes / 2);
    }
    for (const trace of traces) trace.ends();
    // Nobody waits while nothing is asked for.
    now_ms += 10_000;
  }
  return meter.request_bytes;
}

it("a request costs its headers, and what could have come while everyone waited", () => {
  // 50 ms for 8 requests at 1000 bytes a millisecond.
  const fast = after({ lanes: 8, latency_ms: 50, coming_ms: 5, bytes: 5000 });
  expect(fast).toBeGreaterThan(HEADER_BYTES + 5500);
  expect(fast).toBeLessThan(HEADER_BYTES + 7000);
  expect(after({ lanes: 1, latency_ms: 50, coming_ms: 5, bytes: 5000 })).toBe(16_384);
  const slow = after({ lanes: 8, latency_ms: 50, coming_ms: 300, bytes: 5000 });
  expect(slow).toBeLessThan(HEADER_BYTES + 120);
});

it("answers that come at once make requests dear, and nothing known makes them cheap", () => {
  expect(after({ lanes: 8, latency_ms: 50, coming_ms: 0, bytes: 5000 })).toBe(16_384);
  expect(new LineMeter(() => 0).request_bytes).toBe(HEADER_BYTES);
});
