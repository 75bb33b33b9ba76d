import { describe, expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { anglesOf, type Pose } from "./address.ts";
import { WalkRecorder } from "./walkrecorder.ts";

const at = (x: number, yaw = 0): Pose => ({ position: [x, 1.6, 0], yaw, pitch: 0 });
interface Line {
  t_ms: number;
  position: Vec3;
  orientation: number[];
}
const linesOf = (recorder: WalkRecorder): Line[] =>
  recorder
    .script()
    .split("\n")
    .filter((line) => line !== "")
    .map((line) => JSON.parse(line));

/** Sixty frames a second: where the eye is at each time, from five seconds on the page's clock. */
function record(seconds: number, poseAt: (t_s: number) => Pose): Line[] {
  const recorder = new WalkRecorder();
  for (let frame = 0; frame <= 60 * seconds; frame += 1)
    recorder.observe(5000 + (frame * 1000) / 60, poseAt(frame / 60));
  return linesOf(recorder);
}

function expectToBeAScript(lines: readonly Line[]): void {
  expect(lines[0]?.t_ms).toBe(0);
  for (const [i, { t_ms }] of lines.entries()) {
    const [rest, before] = [lines[i - 2], lines[i - 1]];
    const isRestEnd = rest && before && i === lines.length - 1 && isSame(rest, before);
    if (before) expect(t_ms - before.t_ms).toBeGreaterThanOrEqual(isRestEnd ? 1 : 100);
  }
}

const isSame = ({ t_ms: _, ...a }: Line, { t_ms: __, ...b }: Line) => JSON.stringify(a) === JSON.stringify(b);

describe("a recorded walk", () => {
  it("has at most ten poses a second, rising from zero, with the last", () => {
    const lines = record(3.05, (t_s) => at(1.4 * t_s));
    expectToBeAScript(lines);
    expect(lines.length).toBeGreaterThan(25);
    expect(lines.length).toBeLessThanOrEqual(31);
    expect(lines.at(-1)?.t_ms).toBe(3050);
    expect(lines.at(-1)?.position[0]).toBeCloseTo(1.4 * 3.05, 3);
    for (const { t_ms, position } of lines) expect(position[0]).toBeCloseTo((1.4 * t_ms) / 1000, 2);
  });

  it("begins at its beginning also when the next frame has begun before it, and is a way before any frame", () => {
    const recorder = new WalkRecorder();
    recorder.observe(5000, at(1));
    expect(linesOf(recorder)).toMatchObject([{ t_ms: 0, position: [1, 1.6, 0] }]);
    recorder.observe(4990, at(1));
    recorder.observe(5150, at(2));
    expect(linesOf(recorder).map(({ t_ms }) => t_ms)).toEqual([0, 150]);
  });

  it("has none while nothing moves, but says when a rest ended", () => {
    const lines = record(8, (t_s) => at(t_s < 1 ? t_s : t_s < 6 ? 1 : t_s - 5));
    expectToBeAScript(lines);
    const resting = lines.filter(({ t_ms }) => t_ms > 1100 && t_ms < 5900);
    expect(resting).toEqual([]);
    const setOut = lines.filter(({ position }) => position[0] === 1);
    expect(setOut[0]?.t_ms).toBeLessThanOrEqual(1100);
    expect(setOut.at(-1)?.t_ms).toBeGreaterThanOrEqual(5980);
    expect(lines.at(-1)).toMatchObject({ t_ms: 8000, position: [3, 1.6, 0] });
  });

  it("says when a rest ended also of who is stopped right after it", () => {
    const lines = record(5.05, (t_s) => at(Math.max(0, t_s - 5)));
    expectToBeAScript(lines);
    expect(lines.map(({ position }) => position[0])).toEqual([0, 0, 0.05]);
    expect(lines[1]?.t_ms).toBeGreaterThanOrEqual(4980);
  });

  it("of who only looks around has its turns, as quaternions", () => {
    const lines = record(1, (t_s) => at(0, t_s));
    expect(lines.length).toBeGreaterThan(8);
    const last = lines.at(-1);
    expect(Math.hypot(...(last?.orientation ?? []))).toBeCloseTo(1, 3);
    expect(anglesOf(last?.orientation ?? []).yaw).toBeCloseTo(1, 3);
  });

  it("of who stands still is where it began and ended", () => {
    expect(record(2, () => at(4)).map(({ t_ms }) => t_ms)).toEqual([0, 2000]);
    const one = new WalkRecorder();
    one.observe(77, at(4));
    expect([linesOf(one).length, one.length_ms]).toEqual([1, 0]);
    expect(new WalkRecorder().script()).toBe("");
  });

  it("can be read while it goes on", () => {
    const recorder = new WalkRecorder();
    for (let t_ms = 0; t_ms <= 550; t_ms += 50) {
      recorder.observe(t_ms, at(t_ms));
      // Who has hardly begun has nothing else to leave out.
      if (t_ms !== 50) expectToBeAScript(linesOf(recorder));
      expect(linesOf(recorder).at(-1)?.position[0]).toBe(t_ms);
    }
  });
});
