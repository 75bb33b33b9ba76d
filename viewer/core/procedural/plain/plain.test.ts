import { describe, expect, it } from "vitest";
import { DcgError } from "../error.ts";
import { grow } from "../evaluator/index.ts";
import type { Grown } from "../grown.ts";
import { type Amounts, LIMITS } from "../limits.ts";
import { readProgram } from "../link.ts";
import type { Module, Row, Statement } from "../syntax.ts";
import { codeOf } from "./compiler.ts";

/** The same as in Rust. */
const PYRAMID = `let w = 3 parameter h = 2
mesh([[-w / 2, 0, -w / 2], [w / 2, 0, -w / 2], [0, sqrt(h * h) + noise(w, 1) * 0, 0]], [[0, 2, 1], [0, 1, 2]])`;

function grown(text: string, limits: Partial<Amounts> = {}): Grown {
  return grow(
    readProgram("test.dcg", text, () => ""),
    { limits, seed: 5 },
  );
}

/** What is drawn, and which materials it names. */
const drawn = ({ parts }: Grown) =>
  parts.map(({ meshes }) => meshes.map(({ positions, normals }) => [positions, normals]));

describe("what is computed at one go", () => {
  it("costs what its nodes cost", () => {
    const all = grown(PYRAMID);
    // The same with an item of a list in each number, which is visited node by node.
    const slow = grown(PYRAMID.replaceAll("w / 2", "[w][0] / 2"));
    expect(drawn(slow)).toEqual(drawn(all));
    // Four numbers, and each item and its list are two nodes more.
    expect(slow.usage.steps - all.usage.steps).toBe(4 * 2);
    for (const limit of ["steps", "nesting"] as const) {
      expect(() => grown(PYRAMID, { [limit]: all.usage[limit] })).not.toThrow();
      expect(() => grown(PYRAMID, { [limit]: all.usage[limit] - 1 })).toThrow(limit);
    }
  });

  it.each([
    ["w / 2, 0, -w / 2], [w", "w / (w - 3), 0, 1], [w", 11, "division"],
    ["sqrt(h * h)", "sqrt(-h)", 57, "root"],
    ["sqrt(h * h)", "[h][0] * [1]", 59, "list"],
    ["noise(w, 1)", "noise(w, 2 * power(10, 9))", 75, "noise"],
    ["[0, 2, 1]", "[0, 2, h + 1]", 88, "points"],
    ["[0, 2, 1]", "[0, 2]", 88, "three"],
  ])("is found amiss where it stands: %s, %s", (from, to, column, what) => {
    const text = PYRAMID.replace(from, to);
    expect(text).not.toBe(PYRAMID);
    expect(() => grown(text)).toThrow(new RegExp(`line 2, column ${column}: .*${what}`));
  });

  it("is not more than may be computed", () => {
    const text = "box(1, 1, 1) { let a = detail + detail + detail }";
    const { steps } = grown(text).usage;
    expect(() => grown(text, { steps })).not.toThrow();
    expect(() => grown(text, { steps: steps - 1 })).toThrow("steps");
  });

  it("goes to the parameters that are given", () => {
    expect(grown("rule r(a = 5, b = 2, c = 1) { box(a, b, c) } r(c = 4, b = 3)").parts[0]?.bounds.max).toEqual([
      2.5, 3, 2,
    ]);
  });

  it("knows the same faces again, but not for fewer points", () => {
    const rule = "rule m(points) { mesh(points, [[0, 1, 2]]) }";
    const triangle = "m([[0, 0, 0], [1, 0, 0], [0, 1, 0]])";
    expect(grown(`${rule} ${triangle} ${triangle}`).usage.triangles).toBe(2);
    expect(() => grown(`${rule} ${triangle} m([[0, 0, 0], [1, 0, 0]])`)).toThrow(
      "face 0 has a corner 2, and there are 2 points",
    );
  });

  it("tells noise of more octaves from noise of fewer", () => {
    const [x = 0, y = 0] =
      grown("box(2 + fractal(0.3, 0.7, 3), 2 + fractal(0.3, 0.7, 4), 1)").parts[0]?.bounds.max ?? [];
    expect(y - 2 * x).not.toBe(0);
    expect(Math.abs(y - 2 * x)).toBeLessThan(1 / 8);
  });

  it("counts calls inside each other", () => {
    const text = "function a(x) = x + 1 function b(x) = if x then a(a(x)) else 0 box(b(1), b(0), 1)";
    expect(grown(text).usage.levels).toBe(2);
    expect(grown(text.replace("b(1)", "b(0)")).usage.levels).toBe(1);
    expect(() => grown(text, { levels: 1 })).toThrow("levels");
  });

  it("may do without what is not known", () => {
    expect(() => grown("let a = if 1 then 1 else b let b = [1] box(a, 1, 1)")).not.toThrow();
    const said = "`b` is not computed yet";
    expect(() => grown("let a = if 0 then 1 else b + 1 let b = 1 box(a, 1, 1)")).toThrow(said);
  });

  it("is asked again for another file, another level of detail and another rule", () => {
    const program = readProgram(
      "test.dcg",
      "function f(x) = x + level parameter w = 1 rule r(x) levels 2 { box(1 + x * w, 1 + detail, 1 + level + f(0)) move(9, 0, 0) r(x + 1) } r(0)",
      () => "",
    );
    const sizes = (detail: number, w: number) => {
      const { parts } = grow(program, { detail, parameters: new Map([["w", w]]) });
      const { min, max } = parts[0]?.bounds ?? { min: [], max: [] };
      return max.map((most, axis) => most - (min[axis] ?? 0));
    };
    expect(sizes(4, 1)).toEqual([9 + 1 + 0.5, 5, 2]);
    expect(sizes(1, 1)).toEqual([9 + 1 + 0.5, 2, 2]);
    expect(sizes(1, 3)).toEqual([9 + 2 + 0.5, 2, 2]);
  });
});

/** The row of the heights in so many braces. */
function heightOf(statement: Statement | undefined): Row {
  if (statement?.kind === "group") return heightOf(statement.of[0]);
  if (statement?.kind === "heights") return statement.height;
  throw new Error("there are no heights");
}

/** The same numbers in every run, up to `below`. */
function randomNumbers(seed: number): (below: number) => number {
  let state = seed;
  return (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
}

const LEAVES = [
  "x",
  "z",
  "g",
  "0",
  "1",
  "2.5",
  "-3",
  "-0",
  "detail",
  "level",
  "h[x]",
  "h[3][z + 1]",
  "count(h)",
  "random()",
  "fractal(x, z, 3)",
];
const NODES = [
  "(A + B)",
  "(A - B)",
  "(A * B)",
  "(A / B)",
  "(A < B)",
  "(A >= B)",
  "(A == B)",
  "(A != B)",
  "-A",
  "(not A)",
  "(A and B)",
  "(A or B)",
  "(if A then B else C)",
  "abs(A)",
  "atan2(A, B)",
  "ceil(A)",
  "clamp(A, B, C)",
  "cos(A)",
  "floor(A)",
  "fractal(A, B, 4)",
  "fractal(A, B, C)",
  "max(A, B)",
  "min(A, B)",
  "mix(A, B, C)",
  "mod(A, B)",
  "noise(A, B)",
  "power(A, 2)",
  "random(A, B)",
  "round(A)",
  "sin(A)",
  "sqrt(A)",
  "f(A, B)",
  "k(b = A)",
  "u(A, B)",
];

it("is what a visit of its nodes gives, step by step", () => {
  const random = randomNumbers(1);
  const expression = (depth: number): string => {
    if (depth === 0 || random(5) === 0) return LEAVES[random(LEAVES.length)] as string;
    const node = NODES[random(NODES.length)] as string;
    return node.replace(/\b[ABC]\b/g, () => expression(depth - 1));
  };
  const before = `let g = 7 let h = [4, -5, 6, [1, 2, 3]] function k(b, c = b + g) = c * random(b, c) + level
    function f(x, z) = if x > z then k(x) - z else x + k(z, x) function u(x, z, y = z / x) = if x > 0 then z else 3`;
  // Deeper than the lists before, so that the nesting is that of the heights.
  const field = (height: string) => `${before}\n{{{{ heights x, z in 4 by 4 steps 2 by 2 =\n${height} }}}}`;
  const outcome = (text: string) => {
    try {
      const model = grown(text, { ...LIMITS, steps: 1_000_000 });
      return { drawn: drawn(model), usage: model.usage, problem: "" };
    } catch (error) {
      expect(error).toBeInstanceOf(DcgError);
      return { problem: (error as DcgError).problem, line: (error as DcgError).line };
    }
  };
  let sound = 0;
  for (let round = 0; round < 2000; round += 1) {
    const of = `(${expression(4)} + 0)`;
    const plain = outcome(field(of));
    const slow = outcome(field(`[${of}][0]`));
    expect([of, plain.problem, plain.line]).toEqual([of, slow.problem, slow.line]);
    if (!plain.usage || !slow.usage) continue;
    sound += 1;
    expect(plain.drawn).toEqual(slow.drawn);
    // An item and a list more for each sample.
    const { steps, nesting, ...usage } = plain.usage;
    expect([of, slow.usage]).toEqual([of, { steps: steps + 2 * 5 * 5, nesting: nesting + 2, ...usage }]);
    const module = readProgram("test.dcg", field(of), () => "").modules[0] as Module;
    expect(codeOf(module, heightOf(module.body[0]))).not.toBeNull();
  }
  expect(sound).toBeGreaterThan(300);
});
