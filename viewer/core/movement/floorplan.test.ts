import { describe, expect, it } from "vitest";
import type { Bounds } from "../basics/geometry.ts";
import type { CellEntry } from "../documents/documents.ts";
import { cellOnMap, floorPlan, MapFrame } from "./floorplan.ts";

const WORLD: Bounds = { min: [0, 0, 0], max: [100, 10, 50] };

it("a map of a large world is centred on the eye, north up, and leads back to the same place", () => {
  const map = new MapFrame([40, 1.6, 20], WORLD, 200, 100, 20);
  expect(map.spot([40, 0, 20])).toEqual({ x: 100, y: 50 });
  expect(map.spot([50, 0, 10])).toEqual({ x: 125, y: 25 });
  expect(map.place({ x: 125, y: 25 })).toEqual([50, 1.6, 10]);
  expect(map.rectangle({ min: [40, 0, 20], max: [44, 3, 28] })).toEqual([100, 50, 10, 20]);
});

it("a map that reaches as far as the world shows all of it, wherever the eye is", () => {
  const map = new MapFrame([1, 1.6, 1], WORLD, 220, 220, 55);
  expect(map.spot([50, 0, 25])).toEqual({ x: 110, y: 110 });
  expect(map.spot([100, 0, 25]).x).toBeCloseTo(210, 9);
  expect(map.width_m).toBeCloseTo(110, 9);
});

it("a map of a world of 10 cm shows it as large as any", () => {
  const map = new MapFrame([0.05, 0.02, 0.04], { min: [0, 0, 0], max: [0.1, 0.05, 0.08] }, 220, 220, 0.05);
  const [left, top, width, height] = map.rectangle({ min: [0, 0, 0], max: [0.1, 0.05, 0.08] });
  expect([left, top, width, height].map(Math.round)).toEqual([0, 22, 220, 176]);
});

it("a map shows nothing beyond the world while there is enough of that, and who is beyond at its edge", () => {
  const map = new MapFrame([-500, 90, 49], WORLD, 200, 200, 20);
  expect(map.place({ x: 0, y: 200 })).toEqual([0, 90, 50]);
  const spot = map.nearest(map.spot([-500, 90, 49]), 5);
  expect(spot).toEqual({ x: 5, y: 195 });
});

describe("a floor plan", () => {
  const cell = (id: number, low: number, high: number) =>
    ({ cell: id, bounds: { min: [0, low, 0], max: [1, high, 1] } }) as unknown as CellEntry;
  // Two storeys, a niche in the wall of the lower one, a yard, and the air above the roof and the yard.
  const [niche, hall, attic, yard, air] = [
    cell(0, 1, 3),
    cell(1, 0, 3),
    cell(2, 3.1, 6),
    cell(3, 0, 2.5),
    cell(4, 2.5, 40),
  ];
  const cells = [niche, hall, attic, yard, air];
  const at = (height_m: number, size = 1) => {
    const { below, storey } = floorPlan(cells, height_m, size);
    const ids = (some: readonly CellEntry[]) => some.map(({ cell: id }) => id);
    return { below: ids(below), storey: ids(storey) };
  };

  it("has the storey where one stands on top", () => {
    expect(at(1.6)).toEqual({ below: [], storey: [1, 3, 0] });
    expect(at(4.4)).toEqual({ below: [0, 3, 1], storey: [4, 2] });
    expect(at(4.7), "the air is what one looks down through").toEqual({ below: [4, 0, 3, 1], storey: [2] });
  });

  it("has the ground on top for who flies above everything, inside the uppermost cell and beyond", () => {
    for (const height_m of [20, 50]) expect(at(height_m)).toEqual({ below: [2, 4, 0, 3, 1], storey: [] });
  });

  it("has the lowest cells for who is below all, and takes who is small for standing lower", () => {
    expect(at(-3)).toEqual({ below: [], storey: [1, 3] });
    expect(at(1.6, 0.1)).toEqual({ below: [0, 3, 1], storey: [] });
    expect(floorPlan([], 1.6, 1)).toEqual({ below: [], storey: [] });
  });
});

it("the cell at a point of a map is what is drawn there last, or none", () => {
  const box = (id: number, from: number, to: number): CellEntry => ({
    cell: id,
    bounds: { min: [from, 0, 0], max: [to, 3, 10] },
    planes: [],
    adjacent: [],
    record: "",
    recordBytes: 0,
    steps: undefined,
  });
  const plan = { below: [box(1, 0, 20)], storey: [box(2, 5, 9), box(3, 8, 12)] };
  expect([2, 6, 8.5, 15, 30].map((x) => cellOnMap(plan, [x, 1, 5])?.cell)).toEqual([1, 2, 3, 1, undefined]);
});
