import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import type { Vec3 } from "../basics/geometry.ts";
import { axesOf, directionOf, type Mapping, pointOf, viewsAround } from "./impostors.ts";

interface Case {
  readonly mapping: Mapping;
  readonly direction: Vec3;
  readonly views: number;
  readonly point: [number, number];
  readonly nearest: readonly [number, number, number][];
  readonly right: Vec3;
  readonly up: Vec3;
}

/** As the tests in Rust wrote them. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/impostors.json");
const cases = JSON.parse(readFileSync(GOLDEN, "utf8")) as Case[];

it("finds the views that Rust finds", () => {
  expect(cases.length).toBeGreaterThan(100);
  const close = (found: readonly number[], wanted: readonly number[]) => {
    found.forEach((x, i) => {
      expect(x).toBeCloseTo(wanted[i] ?? Number.NaN, 8);
    });
  };
  for (const { mapping, direction, views, point, nearest, right, up } of cases) {
    close(pointOf(mapping, direction), point);
    viewsAround(mapping, direction, views).forEach(({ column, row, weight }, i) => {
      const wanted = nearest[i] ?? [];
      expect([column, row]).toEqual(wanted.slice(0, 2));
      expect(weight).toBeCloseTo(wanted[2] ?? Number.NaN, 8);
    });
    const axes = axesOf(direction);
    close(axes.right, right);
    close(axes.up, up);
    const again = pointOf(mapping, directionOf(mapping, ...point));
    if (Math.max(...point.map((x) => Math.abs(2 * x - 1))) < 1) close(again, point);
  }
});
