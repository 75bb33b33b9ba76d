import { expect, it } from "vitest";
import { HEADER_BYTES, LineMeter } from "./linemeter.ts";

/** What a request costs after some seconds on a line that is always busy. */
function after({ bytes_per_s, latency_ms }: { bytes_per_s: number; latency_ms: number }, lanes = 8): number {
  let now_ms = 0;
  const meter = new LineMeter(lanes, () => now_ms);
  for (let i = 0; i < 100; i += 1) {
    const trace = meter.starts();
    now_ms += latency_ms;
    trace.receives(1);
    // Others travel while one waits, so the line carries all the time.
    trace.receives((bytes_per_s * latency_ms) / 1000);
    for (let piece = 0; piece < 10; piece += 1) {
      now_ms += 10;
      trace.receives(bytes_per_s / 100);
    }
    trace.ends();
    now_ms += 1000;
  }
  return meter.request_bytes;
}

it("a request costs its headers and what could have come while one waits", () => {
  const slow = after({ bytes_per_s: 16_000, latency_ms: 50 });
  expect(slow).toBeGreaterThan(HEADER_BYTES + 80);
  expect(slow).toBeLessThan(HEADER_BYTES + 120);
  const fast = after({ bytes_per_s: 1_000_000, latency_ms: 50 });
  expect(fast).toBeGreaterThan(HEADER_BYTES + 5000);
  expect(fast).toBeLessThan(HEADER_BYTES + 7500);
  expect(after({ bytes_per_s: 1e9, latency_ms: 100 })).toBe(16_384);
});

it("a line of which nothing is known costs headers alone", () => {
  expect(new LineMeter(8, () => 0).request_bytes).toBe(HEADER_BYTES);
});
