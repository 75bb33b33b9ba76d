import { expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { clearance_m } from "./clearance.ts";

const boxAt = (x: number) => ({ entry: { bounds: { min: [x, 0, 0] as Vec3, max: [x + 1, 1, 1] as Vec3 } } });

it("is the distance to the nearest box, and no more exact than is asked for", () => {
  expect(clearance_m([boxAt(9), boxAt(4), boxAt(7)], [0, 0.5, 0.5], 1)).toBe(4);
  expect(clearance_m([boxAt(9), boxAt(4), boxAt(2)], [0, 0.5, 0.5], 5)).toBe(4);
  expect(clearance_m([], [0, 0, 0], 1)).toBe(Number.POSITIVE_INFINITY);
});
