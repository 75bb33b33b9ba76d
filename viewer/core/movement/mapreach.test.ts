import { describe, expect, it } from "vitest";
import type { Bounds, Vec3 } from "../basics/geometry.ts";
import type { CellEntry, Manifest } from "../documents/documents.ts";
import { MapFrame } from "./floorplan.ts";
import { builtAround, builtOf, firstReach, groundOf, reachRange, scaleBar, withinReach } from "./mapreach.ts";

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
    const reach_m = firstReach(range, ground, grid(2, size_m / 2), eye, size);
    expect(reach_m).toBeCloseTo(0.55 * size_m, 9);
    expect(withinReach(range, 2 * reach_m)).toBe(reach_m);
  });

  it("shows some cells around the eye when it has many", () => {
    const around = firstReach(range, ground, grid(100, size_m / 100), eye, size);
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
  const ground = groundOf(world(box([0, 0, 0], [100, 3, 100])));
  const range = reachRange(ground, 1);
  expect(firstReach(range, ground, grid(20, 0.1), [1, 1, 1], 1)).toBe(12);
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

it("what is built is where both cells and objects are, else where any are", () => {
  const [house, far, beside] = [
    box([0, 0, 0], [21, 5, 8]),
    box([-40, -1, -40], [61, 30, 48]),
    box([30, 0, 0], [40, 5, 8]),
  ];
  expect(builtOf(world(house, far), house)).toEqual(house);
  expect(builtOf(world(far, house), far)).toEqual(house);
  expect(builtOf(world(far, house, beside), far)).toEqual(box([0, 0, 0], [40, 5, 8]));
  expect(builtOf(world(house, beside), house)).toEqual(box([0, 0, 0], [40, 5, 8]));
  expect(builtOf(world(house), house)).toEqual(house);
});

describe("a house of 40 m × 16 m with 200 m of air around", () => {
  const house = box([0, 0, 0], [40, 6, 16]);
  const ground = groundOf(world(house, box([-80, 0, -92], [120, 100, 108])));
  const range = reachRange(ground, 1);
  const first = (eye: Vec3) => {
    const matters = builtAround(house, eye, ground);
    const reach_m = firstReach(range, matters, grid(4, 10), eye, 1);
    return { reach_m, frame: new MapFrame(eye, ground, 220, 220, reach_m, matters) };
  };

  it("fills the map at first, and all of the air is a way out", () => {
    const { reach_m, frame } = first([1, 1.6, 1]);
    expect(frame.rectangle(house).map(Math.round)).toEqual([10, 70, 200, 80]);
    expect(reach_m).toBeLessThan(range.most_m / 4);
    const whole = new MapFrame([1, 1.6, 1], ground, 220, 220, range.most_m, builtAround(house, [1, 1.6, 1], ground));
    const [left, top, width, height] = whole.rectangle(ground);
    expect([left, top, width, height].map(Math.round)).toEqual([0, 0, 220, 220]);
  });

  it("stays in the middle while one zooms out, and does not leave the map while one zooms in", () => {
    const eye: Vec3 = [1, 1.6, 1];
    const matters = builtAround(house, eye, ground);
    const at = (reach_m: number) => new MapFrame(eye, ground, 220, 220, reach_m, matters);
    expect(at(40).spot([20, 0, 8])).toEqual({ x: 110, y: 110 });
    expect(at(5).place({ x: 0, y: 0 })[0]).toBeCloseTo(matters.min[0], 9);
  });

  it("is on the map together with who is in the air beside it", () => {
    const { frame, reach_m } = first([100, 30, 8]);
    expect(frame.spot([100, 0, 8]).x).toBeLessThan(220);
    expect(frame.spot([0, 0, 8]).x).toBeGreaterThan(0);
    expect(reach_m).toBeLessThan(range.most_m);
    // Who is beyond all of it makes it no smaller than all of it is.
    expect(first([5000, 30, 8]).reach_m).toBeLessThanOrEqual(range.most_m);
  });
});
