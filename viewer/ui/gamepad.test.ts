import { expect, it } from "vitest";
import { lowerButton, type Pad, readPads } from "./gamepad.ts";

const pad = (axes: number[], ...pressed: number[]): Pad => ({
  id: "some pad",
  mapping: "standard",
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

it("buttons command, whichever pad they are on", () => {
  expect([...readPads([pad([], 0), null, pad([], 3)]).commands]).toEqual(["door", "fly"]);
  expect(readPads([pad([], 1)]).commands.size).toBe(0);
});

it("the lower button is named as it is printed on the pad", () => {
  expect(lowerButton([null, null])).toBeUndefined();
  expect(lowerButton([null, pad([])])).toBe("A");
  expect(lowerButton([{ ...pad([]), id: "DualSense (Vendor: 054c Product: 0ce6)" }])).toBe("×");
});

it("what a browser cannot map to sticks and shoulders moves nothing, wherever its axes rest", () => {
  const unknown = { ...pad([0, 0, -1, 0, 0, -1], 0), mapping: "" };
  const { intent, yaw, pitch, commands } = readPads([unknown, pad([0, -1])]);
  expect([intent.forward, Math.abs(yaw), Math.abs(pitch), commands.size]).toEqual([1, 0, 0, 0]);
  expect(lowerButton([unknown])).toBeUndefined();
});
