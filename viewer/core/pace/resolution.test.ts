import { expect, it } from "vitest";
import { Resolution } from "./resolution.ts";

function after(resolution: Resolution, frames: number, frame_ms: number): number {
  let scale = 1;
  for (let i = 0; i < frames; i += 1) scale = resolution.after(frame_ms);
  return scale;
}

it("a slow machine draws fewer pixels, down to a limit", () => {
  const resolution = new Resolution(0.4);
  expect(after(resolution, 2, 60)).toBe(1);
  expect(after(resolution, 1, 60)).toBeCloseTo(0.8);
  expect(after(resolution, 3, 100)).toBeCloseTo(0.8 * Math.SQRT1_2);
  expect(after(resolution, 100, 200)).toBe(0.4);
});

it("a quick one gets its pixels back, slowly", () => {
  const resolution = new Resolution(0.4);
  after(resolution, 100, 200);
  expect(after(resolution, 30, 10)).toBe(0.4);
  expect(after(resolution, 1000, 10)).toBe(1);
});

it("a single slow frame changes nothing", () => {
  const resolution = new Resolution(0.4);
  for (let i = 0; i < 50; i += 1) {
    resolution.after(300);
    expect(resolution.after(30)).toBe(1);
  }
});
