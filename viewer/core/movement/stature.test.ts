import { expect, it } from "vitest";
import { type Bounds, planesOfBounds, type Vec3 } from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";
import type { Page } from "../documents/documents.ts";
import { PERSON, statureIn } from "./stature.ts";
import { IDLE, WALK_SPEED_MPS, Walker } from "./walker.ts";

const box = (x: number, y: number, z: number): Bounds => ({ min: [0, 0, 0], max: [x, y, z] });
const pageOf = (bounds: Bounds): Page => ({
  entries: [{ kind: "chunk", url: "/o/a", bytes: 1, first: 0, count: 1, bounds }],
});
const stature = (bounds: Bounds, space = bounds) => statureIn({ bounds, cells: pageOf(space) });

it("is a person's wherever a person can stand, however small the room", () => {
  expect(stature(box(60, 12, 40))).toEqual(PERSON);
  expect(stature(box(2, 2.3, 2))).toEqual(PERSON);
  expect(stature(box(3, 0.1, 3), box(3, 3, 3))).toEqual(PERSON);
});

it("is smaller where the space is too low, so that one stands upright and needs some steps to the other side", () => {
  const tiny = stature(box(0.1, 0.034, 0.1), box(0.14, 0.054, 0.14));
  expect(tiny.size).toBeLessThan(0.01);
  expect(EYE_HEIGHT_M * tiny.size).toBeLessThan(0.034);
  expect(WALK_SPEED_MPS * tiny.size * 10).toBeGreaterThan(0.1);
  // A doll's house as a house of low rooms.
  expect(stature(box(20, 0.5, 20)).size).toBe(0.25);
  const flat = stature(box(1, 0, 1));
  expect(flat.size).toBe(1);
});

it("crosses a world of kilometres in two minutes on the wing", () => {
  const { size, flight_mps } = stature(box(6000, 100, 6000));
  expect(size).toBe(1);
  expect(flight_mps * 120).toBeCloseTo(8486, 0);
});

it("makes who walks smaller and slower, and who flies faster", () => {
  const hall = box(0.14, 0.054, 0.14);
  const space = {
    isShut: () => false,
    isLost: () => false,
    cell: () => ({ cell: 0, planes: planesOfBounds(hall), adjacent: [], portals: undefined }),
  };
  const small = stature(box(0.1, 0.034, 0.1), hall);
  const who = new Walker(space, small);
  const middle: Vec3 = [0.07, 0.03, 0.07];
  who.land(middle, 0);
  const stroll = (seconds: number) => {
    for (let frame = 0; frame < seconds * 60; frame += 1) who.step(1 / 60, { ...IDLE, forward: 1 });
  };
  for (let frame = 0; frame < 120; frame += 1) who.step(1 / 60, IDLE);
  expect(who.position[1]).toBeCloseTo(EYE_HEIGHT_M * small.size, 4);
  stroll(1);
  const way = 0.07 - who.position[2];
  expect(way).toBeGreaterThan(0.5 * who.walkSpeed_mps);
  expect(way).toBeLessThan(1.1 * who.walkSpeed_mps);
  stroll(20);
  expect(who.position[2]).toBeGreaterThan(who.bodyRadius_m / 2);
  expect(who.position[2]).toBeLessThan(2 * who.bodyRadius_m);
  const bird = new Walker(space, stature(box(6000, 100, 6000)));
  bird.place([0, 0, 0]);
  bird.mode = "fly";
  for (let frame = 0; frame < 120; frame += 1) bird.step(1 / 60, { ...IDLE, forward: 1, fast: true });
  expect(-bird.position[2]).toBeGreaterThan(250);
});
