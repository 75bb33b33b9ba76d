import { describe, expect, it } from "vitest";
import { cellBounds, PITCH_M, ROOM_M } from "../../test/fixture.ts";
import { type Bounds, distanceToBounds, planesOfBounds, planesOfHull, type Vec3 } from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";
import { IDLE, type NavigationSpace, WALK_SPEED_MPS, Walker } from "./walker.ts";

/** Boxes that touch are adjacent. */
function spaceOf(boxes: Bounds[]): NavigationSpace {
  const touch = (a: Bounds, b: Bounds) =>
    [0, 1, 2].every((i) => (a.min[i] ?? 0) <= (b.max[i] ?? 0) && (b.min[i] ?? 0) <= (a.max[i] ?? 0));
  return {
    isShut: () => false,
    isLost: () => false,
    cell(id) {
      const bounds = boxes[id];
      if (!bounds) return undefined;
      const adjacent = boxes.flatMap((other, i) => (i !== id && touch(bounds, other) ? [i] : []));
      return { cell: id, planes: planesOfBounds(bounds), adjacent, portals: undefined };
    },
  };
}

const ROOMS = [0, 1, 2, 3, 4].map(cellBounds);

function walker(boxes: Bounds[], position: Vec3, cell = 0): Walker {
  const result = new Walker(spaceOf(boxes));
  result.place(position, cell);
  return result;
}

/** Walks by an intent until `seconds` have passed, in frames of 1/60 s. */
function stroll(who: Walker, seconds: number, intent = { ...IDLE, forward: 1 }): void {
  for (let frame = 0; frame < seconds * 60; frame += 1) who.step(1 / 60, intent);
}

const within = (boxes: Bounds[], position: Vec3) => Math.min(...boxes.map((box) => distanceToBounds(box, position)));

describe("a walker", () => {
  it("walks through a doorway into the next room", () => {
    const who = walker(ROOMS, [3, 1.6, 3]);
    who.look(-Math.PI / 2, 0);
    stroll(who, (PITCH_M + 1) / WALK_SPEED_MPS);
    expect(who.position[0]).toBeGreaterThan(PITCH_M + 2);
    expect(who.position[1]).toBeCloseTo(1.6, 2);
  });

  it("comes down to the floor when it lands, though it wants to go nowhere", () => {
    const hall: Bounds = { min: [0, 0, 0], max: [10, 12, 10] };
    const who = walker([hall], [5, 11, 5]);
    stroll(who, 1, IDLE);
    expect(who.position[1]).toBe(11);
    who.mode = "fly";
    who.land([5, 11, 5], 0);
    stroll(who, 3, IDLE);
    expect(who.mode).toBe("walk");
    expect(who.position[1]).toBeCloseTo(EYE_HEIGHT_M, 3);
    expect(who.step(1 / 60, IDLE)).toBe(false);
  });

  it("slides along a wall and keeps off it", () => {
    const who = walker(ROOMS, [3, 1.6, 1]);
    who.look(-Math.PI / 2 + 0.5, 0);
    stroll(who, 4);
    expect(who.position[0]).toBeLessThan(ROOM_M - 0.15);
    expect(who.position[2]).toBeGreaterThan(0.15);
    expect(who.position[2]).toBeLessThan(0.5);
  });

  it("finds the doorway by sliding along the wall beside it", () => {
    const who = walker(ROOMS, [5.5, 1.6, 1]);
    who.look(-Math.PI / 2 - 0.6, 0);
    stroll(who, 6);
    expect(who.position[0]).toBeGreaterThan(PITCH_M);
  });

  it("never leaves the union of the cells, whichever way it goes", () => {
    const who = walker(ROOMS, [3, 1.6, 3]);
    let seed = 7;
    for (let leg = 0; leg < 300; leg += 1) {
      seed = (seed * 48271) % 2147483647;
      who.look((seed / 2147483647) * 2 * Math.PI, 0);
      stroll(who, 0.7, { forward: 1, right: 0, up: seed % 3 === 0 ? 1 : 0, fast: seed % 2 === 0 });
      expect(within(ROOMS, who.position), `at ${who.position}`).toBeLessThan(0.01);
    }
  });

  it("a long frame does not carry it through a wall", () => {
    const who = walker(ROOMS, [3, 1.6, 1]);
    who.travel([50, 0, 0], 1);
    expect(who.position[0]).toBeLessThanOrEqual(ROOM_M);
  });

  it("passes only where an opening is, though cells touch all along a wall", () => {
    const boxes: Bounds[] = [
      { min: [0, 0, 0], max: [4, 3, 4] },
      { min: [4, 0, 0], max: [8, 3, 4] },
    ];
    const door: Vec3[] = [
      [4, 0, 1],
      [4, 2, 1],
      [4, 2, 2],
      [4, 0, 2],
    ];
    const touching = spaceOf(boxes);
    const shut = new Set<number>();
    const space: NavigationSpace = {
      isShut: (id) => shut.has(id),
      isLost: () => false,
      cell(id) {
        const cell = touching.cell(id);
        return cell && { ...cell, portals: [{ to: 1 - id, polygon: door, door: 7 }] };
      },
    };
    for (const [z, passes, closed] of [
      [1.5, true, []],
      [3, false, []],
      [1.5, true, [8]],
      [1.5, false, [7]],
    ] as const) {
      shut.clear();
      for (const id of closed) shut.add(id);
      const who = new Walker(space);
      who.place([2, 1.6, z], 0);
      who.look(-Math.PI / 2, 0);
      stroll(who, 3);
      expect(who.position[0] > 4, `at z = ${z}, closed: ${closed}`).toBe(passes);
    }
  });

  it("goes through an opening into a cell that is lost, and comes back", () => {
    const here: Bounds = { min: [0, 0, 0], max: [4, 3, 4] };
    const door: Vec3[] = [
      [4, 0, 1],
      [4, 2, 1],
      [4, 2, 2],
      [4, 0, 2],
    ];
    const space: NavigationSpace = {
      isShut: () => false,
      isLost: (id) => id === 1,
      cell: (id) =>
        id === 0
          ? {
              cell: 0,
              planes: planesOfBounds(here),
              adjacent: [1],
              portals: [{ to: 1, polygon: door, door: undefined }],
            }
          : undefined,
    };
    for (const [z, passes] of [
      [1.5, true],
      [3, false],
    ] as const) {
      const who = new Walker(space);
      who.place([2, 1.6, z], 0);
      who.look(-Math.PI / 2, 0);
      stroll(who, 3);
      expect(who.position[0] > 5, `at z = ${z}`).toBe(passes);
      expect(who.position[1]).toBeCloseTo(1.6, 2);
      who.look(Math.PI / 2, 0);
      stroll(who, 5);
      expect(who.position[0]).toBeGreaterThan(0.1);
      expect(who.position[0]).toBeLessThan(1);
    }
  });

  it("keeps its eye height on a floor that rises, and comes down where it falls", () => {
    const steps: Bounds[] = [
      { min: [0, 0, 0], max: [4, 3, 4] },
      { min: [4, 0.4, 0], max: [8, 3, 4] },
      { min: [8, -1, 0], max: [12, 3, 4] },
    ];
    const who = walker(steps, [2, 1.5, 2]);
    who.look(-Math.PI / 2, 0);
    stroll(who, 4 / WALK_SPEED_MPS);
    expect(who.position[1]).toBeCloseTo(1.9, 1);
    stroll(who, 5 / WALK_SPEED_MPS);
    expect(who.position[1]).toBeCloseTo(0.5, 1);
  });

  it.each([
    ["falls", 2],
    ["climbs", -1],
  ])("stands on the floor in the end when the key is let go while it %s", (_, from_m) => {
    const boxes: Bounds[] = [
      { min: [0, from_m, 0], max: [4, 9, 4] },
      { min: [4, 0, 0], max: [8, 9, 4] },
    ];
    const who = walker(boxes, [3.9, from_m + EYE_HEIGHT_M, 2]);
    who.look(-Math.PI / 2, 0);
    for (let frame = 0; frame < 60 && who.position[0] < 4.01; frame += 1) who.step(1 / 60, { ...IDLE, forward: 1 });
    who.halt();
    stroll(who, 3, IDLE);
    expect(who.position[1]).toBeCloseTo(EYE_HEIGHT_M, 2);
    expect(who.step(1 / 60, IDLE)).toBe(false);
  });

  it("stands at once when it is halted", () => {
    const who = walker(ROOMS, [3, 1.6, 3]);
    stroll(who, 0.5);
    expect(who.speed).not.toEqual([0, 0, 0]);
    who.halt();
    expect(who.speed).toEqual([0, 0, 0]);
    expect(who.step(0.25, IDLE)).toBe(false);
  });

  it("flies through walls in the direction of its gaze", () => {
    const who = walker(ROOMS, [3, 1.6, 3]);
    who.mode = "fly";
    who.look(0, 1);
    stroll(who, 3);
    expect(who.position[1]).toBeGreaterThan(5);
  });

  it("outside all cells is free to come back", () => {
    const who = new Walker(spaceOf(ROOMS));
    who.place([-5, 1.6, 3]);
    who.look(-Math.PI / 2, 0);
    stroll(who, 4);
    expect(who.position[0]).toBeGreaterThan(0);
  });

  it("looks neither over its head nor between its feet", () => {
    const who = walker(ROOMS, [3, 1.6, 3]);
    who.look(7, 4);
    expect(who.pitch).toBeLessThan(Math.PI / 2);
    expect(who.yaw).toBeCloseTo(7 - 2 * Math.PI);
  });
});

it("the planes of a hull are those of its box", () => {
  const bounds = cellBounds(0);
  const corner = (i: number): Vec3 => [i & 1 ? ROOM_M : 0, i & 2 ? 3 : 0, i & 4 ? ROOM_M : 0];
  const faces = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
  ];
  const key = ({ normal, offset }: { normal: Vec3; offset: number }) => `${normal.map((n) => n + 0)} ${offset + 0}`;
  const planes = planesOfHull([0, 1, 2, 3, 4, 5, 6, 7].map(corner), faces);
  expect(planes.map(key).sort()).toEqual(planesOfBounds(bounds).map(key).sort());
});
