import { describe, expect, it } from "vitest";
import type { Bounds, Vec3 } from "../basics/geometry.ts";
import type { CellEntry, Manifest } from "../documents/documents.ts";
import { firstReach, groundOf, reachRange, scaleBar, withinReach } from "./mapreach.ts";

const box = (min: Vec3, max: Vec3): Bounds => ({ min, max });
const world = (bounds: Bounds, ...cells: Bounds[]) =>
  ({ bounds, cells: { entries: cells.map((cell) => ({ bounds: cell })) } }) as unknown as Manifest;
/** Square cells, side by side. */
const grid = (count: number, size_m: number): CellEntry[] =>
  Array.from({ length: count * count }, (_, i) => {
    const [x, z] = [(i % count) * size_m, Math.floor(i / count) * size_m];
    return { cell: i, bounds: box([x, 0, z], [x + size_m, 3, z + size_m]) } as unknown as CellEntry;
  });

it("the ground holds objects and cells, with some room around them", () => {
  const { min, max } = groundOf(world(box([0, 0, 0], [100, 9, 50]), box([-50, -1, 10], [50, 5, 60])));
  expect([min[0], max[0], min[2], max[2]]).toEqual([-57.5, 107.5, -7.5, 67.5]);
  expect(groundOf(world(box([3, 0, 3], [3, 0, 3]))).max[0]).toBeGreaterThan(3);
});

describe.each([
  { what: "a model of 10 cm", size_m: 0.1, size: 0.005 },
  { what: "a house", size_m: 14, size: 1 },
  { what: "a land of 6 km", size_m: 6000, size: 1 },
])("a map of $what", ({ size_m, size }) => {
  const ground = groundOf(world(box([0, 0, 0], [size_m, 3, size_m])));
  const range = reachRange(ground, size);
  const eye: Vec3 = [size_m / 2, 1, size_m / 2];

  it("shows all of it at first when it has few cells, and never more", () => {
    const reach_m = firstReach(range, grid(2, size_m / 2), eye, size);
    expect(reach_m).toBeCloseTo(0.55 * size_m, 9);
    expect(withinReach(range, 2 * reach_m)).toBe(reach_m);
  });

  it("shows some cells around the eye when it has many", () => {
    const around = firstReach(range, grid(100, size_m / 100), eye, size);
    expect(around).toBeLessThan(0.55 * size_m + 1e-9);
    expect((2 * around) / (size_m / 100)).toBeGreaterThanOrEqual(7 - 1e-9);
    if (size_m > 100 * size) expect(around).toBeLessThan(size_m / 10);
  });

  it("can be seen nearer, and no nearer than a small cell", () => {
    expect(range.least_m).toBeLessThanOrEqual(range.most_m / 4);
    expect(range.least_m).toBeLessThanOrEqual(2 * size);
    expect(withinReach(range, range.least_m / 2)).toBe(range.least_m);
  });
});

it("cells that are cut to slivers show no less than what is around a person", () => {
  const range = reachRange(groundOf(world(box([0, 0, 0], [100, 3, 100]))), 1);
  expect(firstReach(range, grid(20, 0.1), [1, 1, 1], 1)).toBe(12);
});

it.each([
  [2000, 0.02],
  [1000, 0.05],
  [8, 10],
  [220 / 6600, 2000],
  [0.0079, 10_000],
])("at %d px a metre, 80 px hold a scale of %d m", (px_per_m, length_m) => {
  expect(scaleBar(px_per_m, 80)).toEqual({ length_m, length_px: length_m * px_per_m });
});
