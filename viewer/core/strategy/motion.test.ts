import { expect, it } from "vitest";
import { length } from "../basics/geometry.ts";
import { Motion } from "./motion.ts";

it("who walks has a direction, and who stands, has come to rest or jumps has none", () => {
  const motion = new Motion();
  expect(motion.velocity_mps).toEqual([0, 0, 0]);
  for (let tick = 0; tick < 20; tick += 1) motion.observe(100 * tick, [0.15 * tick, 1.5, 0]);
  expect(motion.velocity_mps[0]).toBeCloseTo(1.5, 2);
  expect(motion.velocity_mps.slice(1)).toEqual([0, 0]);
  for (let tick = 20; tick < 30; tick += 1) motion.observe(100 * tick, [2.85, 1.5, 0]);
  expect(length(motion.velocity_mps)).toBe(0);
  motion.observe(3000, [3.2, 1.5, 0]);
  expect(length(motion.velocity_mps)).toBeGreaterThan(0.5);
  motion.observe(3100, [900, 1.5, 0]);
  expect(motion.velocity_mps).toEqual([0, 0, 0]);
});
