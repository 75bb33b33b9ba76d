import { describe, expect, it } from "vitest";
import { EYE_HEIGHT_M } from "../core/basics/person.ts";
import { growPerson } from "./person.ts";

const person = growPerson();
const numbers = person.positions.image.data as Float32Array;
const corner = (moment: number, vertex: number) => {
  const at = 4 * (moment * person.vertices + vertex);
  return [...numbers.subarray(at, at + 3)] as [number, number, number];
};
const all = (moment: number) => Array.from({ length: person.vertices }, (_, vertex) => corner(moment, vertex));
const moments = [...Array(person.frames + 1).keys()];

describe("a person", () => {
  it("is as tall as its eyes are high, and on the ground at every moment", () => {
    for (const moment of moments) {
      const heights = all(moment).map(([, y]) => y);
      expect(Math.abs(Math.min(...heights))).toBeLessThan(0.04);
      expect(Math.max(...heights)).toBeGreaterThan(EYE_HEIGHT_M + 0.05);
      expect(Math.max(...heights)).toBeLessThan(EYE_HEIGHT_M + 0.2);
    }
  });

  it("has a foot that goes back on the ground as far as the person goes ahead", () => {
    const [before, middle, after] = [3, 4, 5];
    const left = Array.from({ length: person.vertices }, (_, i) => i).filter((i) => corner(middle, i)[0] < 0);
    const sole = left.reduce((low, i) => (corner(middle, i)[1] < corner(middle, low)[1] ? i : low));
    const step_m = person.stride_m / person.frames;
    expect(corner(middle, sole)[2] - corner(before, sole)[2]).toBeCloseTo(step_m, 1);
    expect(corner(after, sole)[2] - corner(middle, sole)[2]).toBeCloseTo(step_m, 1);
  });

  it("has its own skin and hair, and clothes that each chooses", () => {
    const chosen = person.own.filter((own) => own === 0).length;
    expect(chosen).toBeGreaterThan(0.2 * person.vertices);
    expect(chosen).toBeLessThan(0.6 * person.vertices);
  });

  it("keeps within the ball that its pictures show", () => {
    for (const [x, y, z] of moments.flatMap(all)) {
      const [cx, cy, cz] = person.centre;
      expect(Math.hypot(x - cx, y - cy, z - cz)).toBeLessThanOrEqual(person.radius * (1 + 1e-6));
    }
  });
});
