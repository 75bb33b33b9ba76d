import { expect, it } from "vitest";
import { readEvent } from "./events.ts";
import { extrapolate, type MoverPose, SmoothMotion } from "./motion.ts";
import { Speaker } from "./speaker.ts";

const UPRIGHT = [0, 0, 0, 1] as const;
const pose = (t_ms: number, x: number, speed = 0): MoverPose => ({
  t_ms,
  position: [x, 0, 0],
  orientation: UPRIGHT,
  velocity: [speed, 0, 0],
  acceleration: [0, 0, 0],
});

it("between poses a mover goes on as it went, but not for ever", () => {
  const accelerating = { ...pose(0, 1, 2), acceleration: [4, 0, 0] as const };
  expect(extrapolate(accelerating, 500, 2000)[0]).toBeCloseTo(1 + 1 + 0.5, 9);
  expect(extrapolate(pose(0, 1, 2), 5000, 2000)[0]).toBe(5);
  expect(extrapolate(pose(100, 1, 2), 0, 2000)[0]).toBe(1);
});

it("what is drawn never jumps when a pose contradicts, and soon agrees with it", () => {
  const motion = new SmoothMotion(pose(0, 0, 1), 0, 2000);
  const before = motion.at(1000).position[0];
  motion.correct(pose(1000, 2, 1), 1000);
  expect(motion.at(1000).position[0]).toBeCloseTo(before, 9);
  expect(motion.at(1090).position[0]).toBeCloseTo(2 + 0.09 - 0.5, 6);
  expect(motion.at(2000).position[0]).toBeCloseTo(3, 2);
  motion.correct(pose(500, -50), 2000);
  expect(motion.at(2000).position[0]).toBeCloseTo(3, 2);
});

it("but a teleport is one", () => {
  const motion = new SmoothMotion(pose(0, 0), 0, 2000);
  motion.correct(pose(10, 40), 10);
  expect(motion.at(10).position[0]).toBe(40);
});

it("whoever wears a model is told of with its pictures, and how large it is", () => {
  const picture = (letter: string) => ({ url: `/o/${letter.repeat(64)}.png`, bytes: 9 });
  const info = {
    object: "o100000001",
    transform: [2, 0, 0, 0, 0, 0, 3, 0, 0, -4, 0, 0, 5, 6, 7, 1],
    pose: { t_ms: 0, position: [5, 6, 7], orientation: UPRIGHT, velocity: [0, 0, 0] },
    radius_m: 0.5,
    period_ms: 100,
  };
  const impostor = {
    colour: picture("a"),
    shape: picture("b"),
    mapping: "octahedral",
    views: 6,
    size_px: 32,
    centre: [0, 1, 0],
    radius: 1,
    error_m: 0.1,
    switch_distance_m: 90,
    frames: 4,
    stride_m: 1.5,
  };
  const worn = (told: object) => {
    const event = readEvent("object-info", JSON.stringify({ ...info, ...told }));
    return event?.kind === "appear" ? event.worn : undefined;
  };
  expect(worn({ impostor })).toMatchObject({ scale: [2, 3, 4], impostor: { frames: 4, stride: 1.5 } });
  expect(worn({})).toBeUndefined();
  expect(worn({ impostor: { ...impostor, mapping: "spherical" } })).toBeUndefined();
});

it("one speaks only when others would be wrong, and not while nobody looks", () => {
  const speaker = new Speaker();
  const speak = (t_ms: number, x: number, speed: number) => speaker.speak(t_ms, [x, 0, 0], UPRIGHT, [speed, 0, 0]);
  expect(speak(0, 0, 1)).toMatchObject({ t_ms: 0, position: [0, 0, 0], velocity: [1, 0, 0] });
  expect(speak(500, 0.5, 1)).toBeUndefined();
  expect(speak(600, 0.5, 0)).toMatchObject({ t_ms: 600 });
  expect(speak(610, 0.9, 4)).toBeUndefined();
  speaker.keepQuiet({ center: [0, 0, 0], radius_m: 3, until_ms: 5000 });
  expect(speak(1000, 2, 1)).toBeUndefined();
  expect(speak(1100, 3.5, 1)).toMatchObject({ t_ms: 1100 });
  speaker.keepQuiet({ center: [0, 0, 0], radius_m: 9, until_ms: 5000 });
  expect(speak(4900, 2, 1)).toBeUndefined();
  expect(speak(5100, 2, 1)).toMatchObject({ t_ms: 5100 });
});
