import { expect, it } from "vitest";
import { type Pad, readPads } from "./gamepad.ts";

const pad = (axes: number[], ...pressed: number[]): Pad => ({
  axes,
  buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i) })),
});

it("sticks that almost rest want nothing", () => {
  const { intent, yaw, pitch } = readPads([null, pad([0.1, -0.14, 0.05, 0])]);
  expect([intent.forward, intent.right, intent.up, yaw, pitch].map(Math.abs)).toEqual([0, 0, 0, 0, 0]);
  expect(readPads([]).intent.fast).toBe(false);
});

it("pushing the left stick away walks on, the right one to the right turns right, shoulders and trigger do the rest", () => {
  const { intent, yaw, pitch } = readPads([pad([0.5, -1, 1, -1], 5, 7)]);
  expect(intent).toMatchObject({ forward: 1, up: 1, fast: true });
  expect(intent.right).toBeCloseTo(0.412, 3);
  expect(yaw).toBeLessThan(0);
  expect(pitch).toBeGreaterThan(0);
});
