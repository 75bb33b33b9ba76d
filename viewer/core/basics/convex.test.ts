import { describe, expect, it } from "vitest";
import { distanceToCell, nearestPoint } from "./convex.ts";
import { length, type Plane, subtract, type Vec3 } from "./geometry.ts";

const BOX = { bounds: { min: [0, 0, 0], max: [10, 3, 4] }, planes: [] } as const;
/** The half of a square room below its diagonal. */
const DIAGONAL: Plane = { normal: [Math.SQRT1_2, 0, Math.SQRT1_2], offset: 4 * Math.SQRT1_2 };
const HALF = { bounds: { min: [0, 0, 0], max: [4, 3, 4] }, planes: [DIAGONAL] } as const;

describe("the nearest point of a cell", () => {
  it("is the point itself where that lies deep enough", () => {
    expect(nearestPoint(BOX, [3, 1.6, 2], 0.2)).toEqual([3, 1.6, 2]);
    expect(nearestPoint(HALF, [1, 1.6, 1], 0.2)).toEqual([1, 1.6, 1]);
  });

  it("keeps off the walls of a box, and to the middle of one that is too narrow", () => {
    expect(nearestPoint(BOX, [20, -5, 2], 0.5)).toEqual([9.5, 0.5, 2]);
    expect(nearestPoint(BOX, [20, 9, 2], 2)).toEqual([8, 1.5, 2]);
  });

  it("lies before a slanted wall, or where that meets another", () => {
    const far = (from: Vec3, expected: Vec3) => length(subtract(nearestPoint(HALF, from, 0), expected));
    expect(far([6, 1, 3], [3.5, 1, 0.5])).toBeLessThan(1e-6);
    // The foot of this one's perpendicular lies outside the box.
    expect(far([7, 1, 2], [4, 1, 0])).toBeLessThan(1e-3);
    expect(distanceToCell(HALF, nearestPoint(HALF, [6, 1, 3], 0.2))).toBe(0);
  });
});
