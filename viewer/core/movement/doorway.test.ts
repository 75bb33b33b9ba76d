/**
 * Through which openings does a walker get? Two rooms with a cell of a doorway in the wall between them, as an author draws it: over a
 * sill, and less deep than a body is wide.
 */
import { describe, expect, it } from "vitest";
import { type Bounds, distanceToBounds, planesOfBounds, type Vec3 } from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";
import { IDLE, type NavigationCell, type NavigationSpace, Walker } from "./walker.ts";

interface Doorway {
  readonly width_m: number;
  /** How much its floor is higher than those of the rooms. */
  readonly sill_m: number;
  readonly height_m: number;
}

/** The cells and the door. */
const [FRONT, BETWEEN, BACK, DOOR] = [0, 1, 2, 7] as const;
/** How thick the wall is, and where the doorway in it begins. */
const [DEPTH_M, LEFT_M] = [0.2, 1];
const PLAIN: Doorway = { width_m: 1, sill_m: 0.2, height_m: 2.1 };
const RADIUS_M = new Walker({ cell: () => undefined, isShut: () => false, isLost: () => false }).bodyRadius_m;

/** The rooms before and behind a wall along x, and the doorway in it from x = 1 on. */
const boxesOf = ({ width_m, sill_m, height_m }: Doorway): readonly [Bounds, Bounds, Bounds] => [
  { min: [-3, 0, -4], max: [5, 3, -DEPTH_M / 2] },
  { min: [LEFT_M, sill_m, -DEPTH_M / 2], max: [LEFT_M + width_m, sill_m + height_m, DEPTH_M / 2] },
  { min: [-3, 0, DEPTH_M / 2], max: [5, 3, 4] },
];

class House implements NavigationSpace {
  readonly shut = new Set<number>();
  readonly met = new Set<number>([FRONT, BETWEEN, BACK]);
  readonly read = new Set(this.met);
  readonly boxes: readonly [Bounds, Bounds, Bounds];
  private readonly cells: readonly NavigationCell[];

  constructor(doorway: Doorway) {
    this.boxes = boxesOf(doorway);
    const { min, max } = this.boxes[BETWEEN];
    const polygonAt = (z: number): Vec3[] => [
      [min[0], min[1], z],
      [max[0], min[1], z],
      [max[0], max[1], z],
      [min[0], max[1], z],
    ];
    const portal = (to: number, z: number) => ({ to, polygon: polygonAt(z), door: DOOR });
    const portals = [
      [portal(BETWEEN, min[2])],
      [portal(FRONT, min[2]), portal(BACK, max[2])],
      [portal(BETWEEN, max[2])],
    ];
    this.cells = this.boxes.map((box, cell) => ({
      cell,
      planes: planesOfBounds(box),
      adjacent: (portals[cell] ?? []).map(({ to }) => to),
      portals: portals[cell],
    }));
  }

  cell(id: number): NavigationCell | undefined {
    const cell = this.met.has(id) ? this.cells[id] : undefined;
    return cell && !this.read.has(id) ? { ...cell, portals: undefined } : cell;
  }

  isShut(door: number): boolean {
    return this.shut.has(door);
  }

  isLost(): boolean {
    return false;
  }
}

/** Somebody in the room before the doorway, or behind it, whose way meets the wall at x so many degrees askew. */
function comer(house: House, x: number, slant_deg: number, from: "before" | "behind" = "before"): Walker {
  const [side, slant] = [from === "before" ? 1 : -1, (slant_deg * Math.PI) / 180];
  const away_m = 1.5;
  const who = new Walker(house);
  who.place([x - Math.tan(slant) * away_m, EYE_HEIGHT_M, -side * away_m], side > 0 ? FRONT : BACK);
  who.look(Math.atan2(-Math.sin(slant), -side * Math.cos(slant)), 0);
  return who;
}

/** Walks for some seconds, and learns after each frame what is next door to where it is. */
function walk(who: Walker, house: House, seconds = 4): void {
  for (let frame = 0; frame < seconds * 60; frame += 1) {
    who.step(1 / 60, { ...IDLE, forward: 1 });
    const at = house.boxes.findIndex((box) => distanceToBounds(box, who.position) === 0);
    for (const cell of house.cell(at)?.adjacent ?? []) house.met.add(cell);
    house.read.add(at);
  }
}

/** Whether somebody stands with all of the body on the other side. */
const isThrough = ({ position: [, , z] }: Walker, from: "before" | "behind" = "before") =>
  (from === "before" ? z : -z) > DEPTH_M / 2 + RADIUS_M;

describe("a doorway that a person fits through", () => {
  const all = [0, 0.1, 0.2, 0.3].flatMap((sill_m) =>
    [0.8, 1].flatMap((width_m) => (["before", "behind"] as const).map((from) => ({ sill_m, width_m, from }))),
  );
  it.each(all)("lets one in over a sill of $sill_m m, $width_m m wide, from $from", ({ sill_m, width_m, from }) => {
    expect(width_m).toBeGreaterThan(2 * RADIUS_M);
    for (const slant_deg of [0, 20, 50]) {
      for (const share of [0.05, 0.5, 0.95]) {
        const house = new House({ ...PLAIN, sill_m, width_m });
        const who = comer(house, LEFT_M + share * width_m, slant_deg, from);
        walk(who, house);
        expect(isThrough(who, from), `${slant_deg}° askew at ${share} of its width: ${who.position}`).toBe(true);
        expect(who.position[1]).toBeCloseTo(EYE_HEIGHT_M, 2);
      }
    }
  });

  it("is found by who slides along the wall", () => {
    const house = new House(PLAIN);
    const who = comer(house, LEFT_M - 1, 50);
    walk(who, house);
    expect(isThrough(who)).toBe(true);
  });

  it("raises who stands in it by its sill", () => {
    const house = new House(PLAIN);
    const who = comer(house, LEFT_M + 0.5, 0);
    for (let frame = 0; frame < 120 && who.position[2] < 0; frame += 1) who.step(1 / 60, { ...IDLE, forward: 1 });
    for (let frame = 0; frame < 60; frame += 1) who.travel([0.001 * (frame % 2 ? 1 : -1), 0, 0], 1 / 60);
    expect(who.position[1]).toBeCloseTo(PLAIN.sill_m + EYE_HEIGHT_M, 2);
  });

  it.each([
    ["known", [FRONT, BETWEEN]],
    ["not read", [FRONT]],
  ])("lets one in who learns only there what is behind it, its own record being %s", (_, read) => {
    expect(DEPTH_M).toBeLessThan(RADIUS_M);
    for (const slant_deg of [0, 20, 50]) {
      const house = new House(PLAIN);
      house.met.delete(BACK);
      house.read.clear();
      for (const cell of read) house.read.add(cell);
      const who = comer(house, LEFT_M + 0.5, slant_deg);
      walk(who, house);
      expect(isThrough(who), `${slant_deg}° askew: ${who.position}`).toBe(true);
    }
  });

  it("leads nowhere while nobody knows what is behind it", () => {
    const house = new House(PLAIN);
    house.met.delete(BACK);
    const who = comer(house, LEFT_M + 0.5, 0);
    for (let frame = 0; frame < 240; frame += 1) who.step(1 / 60, { ...IDLE, forward: 1 });
    expect(who.position[2]).toBeGreaterThan(-DEPTH_M / 2);
    expect(who.position[2]).toBeLessThanOrEqual(DEPTH_M / 2);
  });
});

describe("nobody gets", () => {
  const stopped = (house: House, x: number, slant_deg = 0) => {
    const who = comer(house, x, slant_deg);
    walk(who, house);
    return who.position[2];
  };
  const before_m = -DEPTH_M / 2 - RADIUS_M + 1e-3;

  it("through a wall beside it", () => {
    expect(stopped(new House(PLAIN), LEFT_M - RADIUS_M)).toBeLessThan(before_m);
    expect(stopped(new House(PLAIN), LEFT_M + PLAIN.width_m + RADIUS_M)).toBeLessThan(before_m);
  });

  it("through a wall beside one of which it is not known what is behind it", () => {
    const house = new House(PLAIN);
    house.met.delete(BETWEEN);
    expect(stopped(house, LEFT_M - RADIUS_M)).toBeLessThan(before_m);
  });

  it("below a lintel that is lower than their eyes", () => {
    expect(stopped(new House({ ...PLAIN, sill_m: 0, height_m: EYE_HEIGHT_M - 0.1 }), LEFT_M + 0.5)).toBeLessThan(
      before_m,
    );
  });

  it("over a parapet that is higher than their eyes", () => {
    expect(stopped(new House({ ...PLAIN, sill_m: EYE_HEIGHT_M + 0.1, height_m: 1 }), LEFT_M + 0.5)).toBeLessThan(
      before_m,
    );
  });

  it.each([
    ["known", true],
    ["unknown", false],
  ])("through a door that is closed, what is behind it being %s", (_, isMet) => {
    const house = new House(PLAIN);
    house.shut.add(DOOR);
    if (!isMet) house.met.delete(BETWEEN);
    expect(stopped(house, LEFT_M + 0.5)).toBeLessThan(before_m);
  });
});
