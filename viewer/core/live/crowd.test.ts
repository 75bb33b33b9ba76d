import { describe, expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { colourOf, Gait, isFar, nearestFrame, type Pose } from "./crowd.ts";
import type { Quaternion } from "./motion.ts";

const ROUND = { frames: 8, stride_m: 1.2, standing: 8 };
const AHEAD: Quaternion = [0, 0, 0, 1];
const TO_THE_LEFT: Quaternion = [0, Math.SQRT1_2, 0, Math.SQRT1_2];

/** What is shown at each of some places, a twentieth of a second apart. */
function shown(places: readonly Vec3[], orientation: Quaternion, gait = new Gait(ROUND)): Pose[] {
  return places.map((place, i) => gait.step(place, orientation, 50 * i));
}

const along = (way: Vec3, count: number): Vec3[] =>
  Array.from({ length: count }, (_, i) => way.map((x) => x * i) as unknown as Vec3);

/** The moment between 0 and 8 of a pose of a walker. */
const moment = ({ from, share }: Pose) => from + share;

describe("who walks", () => {
  it("is shown by the way that was gone, however fast", () => {
    for (const step_m of [0.02, 0.05, 0.11]) {
      const last = shown(along([0, 0, -step_m], 21), AHEAD).at(-1) as Pose;
      expect(moment(last)).toBeCloseTo((((20 * step_m) / 1.2) % 1) * 8, 6);
      expect(last.to).toBe((last.from + 1) % 8);
    }
  });

  it("goes through all frames in order, and back again backwards", () => {
    const frames = shown(along([-0.05, 0, 0], 25), TO_THE_LEFT)
      .slice(1)
      .map(nearestFrame);
    expect([...new Set(frames)]).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
    const back = shown(along([0.05, 0, 0], 25), TO_THE_LEFT)
      .slice(1)
      .map(nearestFrame);
    expect([...new Set(back)]).toEqual([0, 7, 6, 5, 4, 3, 2, 1]);
  });

  it("takes no steps up and down, nor where somebody is put", () => {
    const gait = new Gait(ROUND);
    gait.step([0, 0, 0], AHEAD, 0);
    expect(gait.step([0, 5, 0], AHEAD, 50).from).toBe(8);
    expect(gait.step([40, 5, 0], AHEAD, 100).from).toBe(8);
  });
});

describe("who stands", () => {
  it("is shown standing, at once when new and soon after walking", () => {
    const gait = new Gait(ROUND);
    expect(gait.step([0, 0, 0], AHEAD, 0)).toEqual({ from: 8, to: 8, share: 0 });
    const walking = along([0, 0, -0.07], 10);
    walking.forEach((place, i) => {
      gait.step(place, AHEAD, 50 * i);
    });
    const place = walking.at(-1) as Vec3;
    const settling = gait.step(place, AHEAD, 550);
    expect(settling.to).toBe(8);
    expect(settling.share).toBeGreaterThan(0.3);
    expect(settling.share).toBeLessThan(0.7);
    expect(gait.step(place, AHEAD, 800)).toEqual({ from: 8, to: 8, share: 0 });
    expect(moment(gait.step([0, 0, -0.7], AHEAD, 850))).toBeCloseTo((0.07 / 1.2) * 8, 6);
  });
});

it("draws far people by pictures, and does not flicker at the border", () => {
  const eye = { position: [0, 0, 0] as Vec3, viewAngle_rad: Math.PI / 3, height_px: 1080 };
  const near = [...Array(80).keys()].filter((m) => !isFar(m + 1, 0.03, eye, 1.5, false));
  const stays = [...Array(80).keys()].filter((m) => !isFar(m + 1, 0.03, eye, 1.5, true));
  expect(near.length).toBe(18);
  expect(stays.length).toBe(14);
});

it("gives neighbours unlike colours, and everybody always the same", () => {
  const hues = Array.from({ length: 20 }, (_, i) => colourOf(100_000_000 + i).hue);
  hues.slice(1).forEach((hue, i) => {
    const apart = Math.abs(hue - (hues[i] ?? 0));
    expect(Math.min(apart, 1 - apart)).toBeGreaterThan(0.2);
  });
  expect(colourOf(7)).toEqual(colourOf(7));
});
