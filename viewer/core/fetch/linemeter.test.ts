import { expect, it } from "vitest";
import { HEADER_BYTES } from "../strategy/file.ts";
import { LineMeter } from "./linemeter.ts";

/** What a request costs where eight at once wait for the answer to begin, and for their turn on the line. */
function after({ latency_ms, bytes_per_ms, bytes }: Record<"latency_ms" | "bytes_per_ms" | "bytes", number>): number {
  let now_ms = 0;
  const meter = new LineMeter(() => now_ms);
  for (let round = 0; round < 50; round += 1) {
    const traces = Array.from({ length: 8 }, () => meter.starts());
    now_ms += latency_ms;
    for (const trace of traces) {
      now_ms += bytes / bytes_per_ms;
      trace.receives(bytes);
      trace.ends();
    }
  }
  return meter.request_bytes;
}

it("a request costs about a file where one mostly waits for answers to begin", () => {
  const distant = after({ latency_ms: 100, bytes_per_ms: 5000, bytes: 4000 });
  expect(distant).toBeGreaterThan(HEADER_BYTES + 3000);
  expect(distant).toBeLessThanOrEqual(HEADER_BYTES + 4000);
});

it("a request costs little more than its headers where answers wait for the line", () => {
  const slow = after({ latency_ms: 50, bytes_per_ms: 16, bytes: 4000 });
  expect(slow).toBeGreaterThan(HEADER_BYTES);
  expect(slow).toBeLessThan(HEADER_BYTES + 400);
});

it("a request costs its headers where nothing has come, and never more than a bundle is worth", () => {
  expect(new LineMeter(() => 0).request_bytes).toBe(HEADER_BYTES);
  expect(after({ latency_ms: 1000, bytes_per_ms: 1e6, bytes: 1e6 })).toBe(16_384);
});
