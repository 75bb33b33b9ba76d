import { expect, it } from "vitest";
import { FrameTimes } from "./frametimes.ts";

it("tells what nearly all of the last frames keep to", () => {
  const times = new FrameTimes(100);
  expect(times.quantile_ms(0.95)).toBe(0);
  for (let ms = 1000; ms > 0; ms -= 1) times.add(ms);
  expect([times.quantile_ms(0.95), times.quantile_ms(0.5), times.quantile_ms(1)]).toEqual([95, 50, 100]);
});
