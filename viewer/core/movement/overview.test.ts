import { describe, expect, it } from "vitest";
import { direction, dot, length, middle, subtract, type Vec3 } from "../basics/geometry.ts";
import { madeUp, overview } from "./overview.ts";

const BOUNDS = { min: [-10, 0, -20] as Vec3, max: [30, 5, 20] as Vec3 };
const MADE_UP = "made up";
const viewpoint = (name: string) => ({
  name,
  position: [0, 1, 0] as Vec3,
  orientation: [0, 0, 0, 1],
  cell: 0,
  isMadeUp: name === MADE_UP,
});
const world = (top_m: number, ...names: string[]) => ({
  bounds: BOUNDS,
  cells: {
    entries: [
      {
        kind: "chunk" as const,
        url: "/o/a",
        bytes: 1,
        first: 0,
        count: 1,
        bounds: { min: BOUNDS.min, max: [30, top_m, 20] as Vec3 },
      },
    ],
  },
  viewpoints: names.map(viewpoint),
});

describe("a view of everything", () => {
  it.each([0.5, 1, 2])("has all of the world in the picture, from above, at an aspect of %d", (aspect) => {
    const pose = overview(world(9, MADE_UP), BOUNDS, 1, aspect);
    if (!pose) return expect.fail("no view");
    expect(pose.position[1]).toBeGreaterThan(BOUNDS.max[1]);
    const ahead = direction(pose.yaw, pose.pitch);
    const way = subtract(middle(BOUNDS), pose.position);
    expect(dot(ahead, way)).toBeCloseTo(length(way), 6);
    const [up, right] = [direction(pose.yaw, pose.pitch + Math.PI / 2), direction(pose.yaw - Math.PI / 2)];
    const places = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => {
      const at = (axis: 0 | 1 | 2) => (i & (1 << axis) ? BOUNDS.max : BOUNDS.min)[axis];
      const to = subtract([at(0), at(1), at(2)], pose.position);
      const deep = dot(ahead, to) * Math.tan(0.5);
      return Math.max(Math.abs(dot(up, to)) / deep, Math.abs(dot(right, to)) / (deep * aspect));
    });
    expect(Math.max(...places)).toBeLessThan(1);
    expect(Math.max(...places)).toBeGreaterThan(0.8);
  });

  it("is for who is given no other place, and where one would not look at a roof", () => {
    expect(overview(world(5, MADE_UP), BOUNDS, 1, 1)).toBeUndefined();
    expect(overview(world(9, "West room"), BOUNDS, 1, 1)).toBeUndefined();
    expect(overview(world(9, "start"), BOUNDS, 1, 1)).toBeUndefined();
    const low = { min: BOUNDS.min, max: [30, 4, 20] as Vec3 };
    expect(overview(world(5, MADE_UP), low, 1, 1), "below a dome").toBeDefined();
    expect(madeUp(world(5, MADE_UP))?.name).toBe(MADE_UP);
    expect(madeUp(world(5, "start"))).toBeUndefined();
  });
});
