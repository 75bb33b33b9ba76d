import { expect, it } from "vitest";
import type { Vec3 } from "./geometry.ts";
import { cellAhead } from "./lookahead.ts";

/** An upright opening of a metre at x, across the way. */
const opening = (to: number, x: number) => {
  const polygon: Vec3[] = [
    [x, 0, -0.5],
    [x, 2, -0.5],
    [x, 2, 0.5],
    [x, 0, 0.5],
  ];
  return { to, polygon, door: undefined };
};

it("is the cell behind the nearest opening ahead", () => {
  const portals = [opening(1, 5), opening(2, 3), opening(3, -1), opening(4, 9)];
  expect(cellAhead(portals, [0, 1.6, 0], [1, 0, 0])).toBe(2);
  expect(cellAhead(portals, [0, 1.6, 0], [-1, 0, 0])).toBe(3);
  expect(cellAhead(portals, [4, 1.6, 0], [1, 0, 0])).toBe(1);
});

it("nobody is ahead of who stands, or is far from every opening", () => {
  expect(cellAhead([opening(1, 3)], [0, 1.6, 0], [0.1, 0, 0])).toBeUndefined();
  expect(cellAhead([opening(1, 9)], [0, 1.6, 0], [1, 0, 0])).toBeUndefined();
});
