import { expect, it } from "vitest";
import { LineSpeed } from "./meter.ts";

it("learns how fast bytes come that share the line, and not from what waited behind them", () => {
  const speed = new LineSpeed();
  expect(speed.bytes_per_s).toBe(Number.POSITIVE_INFINITY);
  for (let i = 1; i <= 20; i += 1) speed.came(0, 100 * i, 1600);
  expect(speed.bytes_per_s).toBeCloseTo(16_000);
  speed.came(0, 2000, 1e9);
  expect(speed.bytes_per_s).toBeCloseTo(16_000);
  for (let i = 0; i < 40; i += 1) speed.came(9000 + 1000 * i, 9500 + 1000 * i, 20_000);
  expect(speed.bytes_per_s / 40_000).toBeCloseTo(1, 3);
});

it("believes what came in all of the time, however nearly together answers end that share the line", () => {
  const speed = new LineSpeed();
  speed.came(0, 998, 8_000);
  speed.came(0, 1000, 8_000);
  expect(speed.bytes_per_s).toBeGreaterThan(14_000);
  expect(speed.bytes_per_s).toBeLessThan(20_000);
});

it("lets as much be under way as comes in half a second, at least two requests and at most eight", () => {
  const speed = new LineSpeed();
  expect([speed.hasRoom(7, 60_000), speed.hasRoom(7, 70_000)]).toEqual([true, false]);
  speed.came(0, 1000, 16_000);
  expect([speed.hasRoom(1, 1e9), speed.hasRoom(2, 7_999), speed.hasRoom(2, 8_000)]).toEqual([true, true, false]);
  expect(speed.hasRoom(8, 0)).toBe(false);
});
