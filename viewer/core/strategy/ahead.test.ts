import { expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { approaches, isDue, type KnownCells, whenToKnow } from "./ahead.ts";

/** A corridor of cells of four metres along x; one knows the records of some. */
function corridor(cells: number, read: readonly number[] = []): KnownCells {
  const opening = (to: number, x: number) => {
    const corner = (y: number, z: number): Vec3 => [x, y, z];
    return { to, polygon: [corner(0, 1), corner(2, 1), corner(2, 2), corner(0, 2)], door: undefined };
  };
  return {
    entryOf: (cell: number) => ({
      cell,
      bounds: { min: [4 * cell, 0, 0], max: [4 * cell + 4, 3, 4] },
      adjacent: [cell - 1, cell + 1].filter((next) => next >= 0 && next < cells),
    }),
    recordOf: (cell: number) =>
      read.includes(cell) ? { portals: [opening(cell - 1, 4 * cell), opening(cell + 1, 4 * cell + 4)] } : undefined,
  } as unknown as KnownCells;
}

const told = (found: ReturnType<typeof approaches>) => found.map(({ cell, step }) => [cell, step]);

it("cells ahead come in three steps with the time that they take", () => {
  const found = approaches(2, corridor(5), [10, 1.5, 2], [1, 0, 0]);
  expect(told(found)).toEqual([
    [3, 1],
    [1, 2],
    [4, 3],
  ]);
  expect(found.map(({ in_s }) => in_s)).toEqual([2, 3, 4]);
});

it("the way goes to openings where they are known", () => {
  const [first] = approaches(2, corridor(5, [2]), [11, 1.5, 3], [1, 0, 0]);
  expect(first).toMatchObject({ cell: 3, step: 1 });
  expect(first?.in_s).toBeCloseTo(Math.SQRT2);
});

it("who stands may go either way, and who is far from every opening heads nowhere", () => {
  expect(told(approaches(2, corridor(5), [10, 1.5, 2], [0, 0, 0]))).toEqual([
    [1, 2],
    [3, 2],
  ]);
  expect(told(approaches(2, corridor(5), [10, 60, 2], [1, 0, 0]))).toEqual([
    [1, 2],
    [3, 2],
  ]);
  expect(approaches(9, { entryOf: () => undefined, recordOf: () => undefined }, [0, 0, 0], [0, 0, 0])).toEqual([]);
});

it("is due when there is just time enough to fetch it", () => {
  expect([isDue(3, 0, 1000), isDue(3.1, 0, 1000)]).toEqual([true, false]);
  expect([isDue(7, 2000, 1000), isDue(7.1, 2000, 1000)]).toEqual([true, false]);
  expect(isDue(3, 1e9, Number.POSITIVE_INFINITY)).toBe(true);
  expect([2, 20, 40].map((in_s) => whenToKnow(in_s, 1e6))).toEqual(["due", "later", "not yet"]);
  expect(whenToKnow(40, 2000)).toBe("due");
});
