import { expect, it } from "vitest";
import type { Bounds, Plane, Vec3 } from "../basics/geometry.ts";
import type { CellEntry, Page } from "../documents/documents.ts";
import { CellSearch } from "./cellindex.ts";
import { walkTo } from "./cellwalk.ts";

const url = `/o/${"0".repeat(64)}.json`;

function cell(id: number, bounds: Bounds, planes: Plane[], adjacent: number[]): CellEntry {
  return { cell: id, bounds, planes, adjacent, record: url, recordBytes: 1, steps: undefined };
}

/** A square of 2 m cut along its diagonal, and a row of boxes east of it, all 1 m high. */
const half = Math.SQRT1_2;
const square: Bounds = { min: [0, 0, 0], max: [2, 1, 2] };
const CELLS = [
  cell(0, square, [{ normal: [half, 0, half], offset: 2 * half }], [1]),
  cell(1, square, [{ normal: [-half, 0, -half], offset: -2 * half }], [0, 2]),
  cell(2, { min: [2, 0, 0], max: [3, 1, 2] }, [], [1, 3]),
  cell(3, { min: [3, 0, 0], max: [4, 1, 2] }, [], [2]),
];

function byIndex(point: Vec3): { cell: number; inside: boolean } {
  const page: Page = {
    entries: [
      { kind: "chunk", url, bytes: 1, first: 0, count: 2, bounds: square },
      { kind: "chunk", url, bytes: 1, first: 2, count: 2, bounds: { min: [2, 0, 0], max: [4, 1, 2] } },
    ],
  };
  const search = new CellSearch(page, point);
  for (let wanted = search.wants(); wanted; wanted = search.wants()) {
    search.giveChunk(CELLS.slice(wanted.first, wanted.first + wanted.count));
  }
  const located = search.finish();
  return { cell: located?.entry.cell ?? -1, inside: located?.distance_m === 0 };
}

function byWalk(from: number, point: Vec3): number | undefined {
  const start = CELLS[from];
  return start && walkTo(start, point, (id) => CELLS[id])?.cell;
}

it("a step next door is answered by the walk, with boxes and without", () => {
  expect(byWalk(0, [0.5, 0.5, 0.5])).toBe(0);
  expect(byWalk(0, [1.5, 0.5, 1.5])).toBe(1);
  expect(byWalk(1, [2.5, 0.5, 0.5])).toBe(2);
  expect(byWalk(0, [3.5, 0.5, 1])).toBe(3);
});

it("walk and index agree at every place of a lattice, also on faces, edges and corners", () => {
  for (let x = -1; x <= 17; x += 1) {
    for (let z = -1; z <= 9; z += 1) {
      for (const y of [0, 0.5, 1]) {
        const point: Vec3 = [x / 4, y, z / 4];
        const truth = byIndex(point);
        for (const from of [0, 1, 2, 3]) {
          const walked = byWalk(from, point);
          if (walked !== undefined) expect({ cell: walked, inside: true }).toEqual(truth);
        }
      }
    }
  }
});

it("on a common face the lowest id counts, and off all cells the index names the nearest", () => {
  expect(byIndex([1, 0.5, 1])).toEqual({ cell: 0, inside: true });
  expect(byWalk(1, [1, 0.5, 1])).toBeUndefined();
  expect(byIndex([2, 0.5, 0.5])).toEqual({ cell: 1, inside: true });
  expect(byIndex([9, 0.5, 0.5])).toEqual({ cell: 3, inside: false });
  expect(byWalk(3, [9, 0.5, 0.5])).toBeUndefined();
});
