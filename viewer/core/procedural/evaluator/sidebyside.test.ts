import { describe, expect, it } from "vitest";
import { DcgError } from "../error.ts";
import type { Amounts } from "../limits.ts";
import { readProgram } from "../link.ts";
import { grow } from "./index.ts";

/** Loops in which something is done at one go, or could be but for one thing; `AS` stands before what a turn does. */
const TEXTS = [
  "for i in 5 AS move(2e8 * i, 0, 0) move(2e8 * i, 0, 0) box(1, 1, 1)",
  "scale(1e5) turn(45) for i in 3 AS scale(14000) turn(-45) box(1, 1, 1)",
  `rule leaf(size, w = 0.3 * size + random()) {
     let h = size * random(1, 2)
     mesh([[0, 0, 0], [w, h, 0], [0, size, h], [-w, 0.5 * h, 0]], [[0, 1, 2], [0, 2, 3], [0, 1, 2, 3]]) box(w, h, size)
   }
   for i in 27 AS move(random(-1, 1), i, -random() / 2) turn(i * 137.5) tilt(random(5, 90)) roll(-i) leaf(0.5 + i / 10)`,
  "rule tip(w) { mesh([[0, 0, 0], [w, 1, 0], [0, 1, w]], [[0, 1, 2]]) } for i in 40 AS tip(1 - i / 20)",
  `rule spike(l, k) { mesh([[0.1, 0, 0], [0, 0.1, 0], [l * (k == 0), l * (k == 1), l * (k == 2)]], [[0, 1, 2]]) }
   part star(k, d) { box(1, 1, 1) for j in 4 for t in 4 for i in 4 AS move(0, 0.5, 0) turn(t * 90) roll(j * 90) spike((1 + i / 9) * d, k) }
   for d in [-1, 1] for k in 3 star(k, d)`,
  "let k = [1, 2] for i in 5 AS box(k[0], i, 1)",
  "for i in 20 AS box(1, 9 - i, 1)",
  "for i in 20 AS move(i, 0, 0) sphere(1, sides = i)",
  "for i in 20 AS move(i, 0, 0) { cylinder(i, 1, closed = 0) cone(i, 2, top = i / 2, sides = i) }",
  "material m { colour = #fff } for i in 12 AS { box(1, 1, 1) paint m { box(1, 2, i) } cone(1, 1, sides = 5) }",
  "material m(a) { colour = [a, 0, 0] } for i in 4 AS paint m(i / 4) box(1, 1, 1)",
  "scale(1e8) turn(30) for i in 3 AS scale(10) turn(45) { box(1, 1, 1) scale(3) box(1, 1, 1) }",
  "for i in 9 AS scale(i - 4) box(1, 1, 1)",
  "for i in 9 AS scale(-1, 1, i + 1) turn(i) { box(1, 1, 1) sphere(i / 9) }",
  "for i in 9 AS move(power(10, i + 1), 0, 0) turn(1) box(1, 1, 1)",
  "for i in 9 AS box(1, 1 / (1e308 * (i * 10)), 1)",
  "for i in 9 AS { let a = 1e308 * (i + 1) box(1, 1, 1) }",
  "for i in 9 AS box(noise(i * 2e8, 0) + 1, fractal(0.1, 3e8 * (i - 1), 3) + 2, 1)",
  "for i in 9 AS box(2 + fractal(i / 3, 0.4, 1 + i), 2 + fractal(i / 3, 0.4, 3), 1)",
  "for i in 9 AS box(abs(-i) + sqrt(5 - i), clamp(i, 1, 3) + mod(i, 2), round(i / 2) + (not i) + (i < 4) + min(i, 2))",
  "for i in 9 AS box(power(2, i), sin(i * 30) + 1 + cos(-i * 1e9), 1 + atan2(i, -1) / 400)",
  "rule r(a) { box(a, 1, 1) } for i in 5 AS { r(i) r(a = i / (i - 3)) }",
  `rule r(n) { box(1, level + 1, n + detail) } for i in 3 AS r(i)
   rule s(n) { if n > 0 s(n - 1) for i in 3 AS r(n) } s(3)`,
  `rule a(n) { box(n, 1, 1) b(n + 1) } rule b(n) { move(1, n, 0) c(n * 2) } rule c(n) { sphere(n) box(random(), n, g(n)) }
   function g(n) = h(n) * random() function h(n, k = n * level + random()) = n + k
   for i in 7 AS a(i)`,
  "part p(n) { for i in 3 AS move(i, n, 0) box(1, random(), n) } for i in 3 p(i)",
  "rule r(n) { box(1, 1, 1) r(n + 1) } for i in 3 AS r(i)",
];

function outcome(text: string, limits: Partial<Amounts>) {
  try {
    const { parts, usage } = grow(
      readProgram("test.dcg", text, () => ""),
      { limits, seed: 5 },
    );
    const meshes = parts.map(({ meshes, bounds }) => [
      bounds,
      meshes.map(({ material, positions, normals, indices }) => [material, positions, normals, indices]),
    ]);
    return { meshes, usage, problem: "" };
  } catch (error) {
    expect(error).toBeInstanceOf(DcgError);
    return { meshes: [], usage: undefined, problem: (error as DcgError).problem };
  }
}

describe("turns side by side", () => {
  it.each(TEXTS)("are what they are one by one: %s", (text) => {
    const limits = { steps: 100_000 };
    const atOnce = outcome(text.replaceAll("AS", ""), limits);
    // A choice, though there is only one, has each turn visited alone; it is a node more.
    const alone = outcome(text.replaceAll("AS", "if 1"), limits);
    expect(atOnce.problem).toBe(alone.problem);
    expect(atOnce.meshes).toEqual(alone.meshes);
    expect(atOnce.usage?.triangles).toBe(alone.usage?.triangles);
    expect(atOnce.usage?.levels).toBe(alone.usage?.levels);
  });

  it("take what they take one by one", () => {
    const text = "rule r(n) { move(n, random(), 0) turn(n) { box(1, n, 1) cone(n, 1) } } for i in 20 AS r(i)";
    const { usage: atOnce } = outcome(text.replace("AS", ""), {});
    const { usage: alone } = outcome(text.replace("AS", "if 1"), {});
    expect(atOnce && { ...atOnce, steps: atOnce.steps + 20, nesting: atOnce.nesting + 1 }).toEqual(alone);
    for (const limit of ["steps", "nesting", "levels"] as const) {
      const most = atOnce?.[limit] ?? 0;
      expect(outcome(text.replace("AS", ""), { [limit]: most }).problem).toBe("");
      expect(outcome(text.replace("AS", ""), { [limit]: most - 1 }).problem).toContain("more than");
    }
  });
});
