import { createHash } from "node:crypto";
import { describe, expect, it } from "vitest";
import { DcgError } from "../error.ts";
import { grow } from "../evaluator/index.ts";
import { type Amounts, MAX_CODE } from "../limits.ts";
import { type Program, readProgram } from "../link.ts";
import type { Module, Statement } from "../syntax.ts";
import { planOf } from "./planner.ts";

type Planned = Extract<Statement, { kind: "for" | "heights" }>;

/** Calls back with each loop and field of a program. */
function eachPlanned(of: unknown, visit: (statement: Planned) => void): void {
  if (typeof of !== "object" || of === null || ArrayBuffer.isView(of)) return;
  if ("kind" in of && (of.kind === "for" || of.kind === "heights")) visit(of as Planned);
  for (const [name, inner] of Object.entries(of)) if (name !== "plan" && name !== "code") eachPlanned(inner, visit);
}

const read = (text: string) => readProgram("test.dcg", text, () => "");

/** The same program, visited node by node. */
function unplanned(text: string): Program {
  const program = read(text);
  eachPlanned(program.modules, (statement) => {
    statement.plan = null;
  });
  return program;
}

/** How many of its loops and fields have plans. */
function plansOf(program: Program): number {
  let plans = 0;
  eachPlanned(program.modules, ({ plan }) => {
    if (plan) plans += 1;
  });
  return plans;
}

/** All that a program gives, or what is said of it and where. */
function outcome(program: Program, limits: Partial<Amounts> = {}) {
  try {
    const { parts, usage, materials } = grow(program, { limits, seed: 7 });
    const hash = createHash("sha256");
    for (const { name, meshes, placements, bounds } of parts) {
      hash.update(JSON.stringify([name, placements, bounds]));
      for (const { material, positions, normals, indices } of meshes) {
        hash.update(`${material}`).update(positions).update(normals).update(indices);
      }
    }
    const grown = hash.digest("hex");
    return { grown, usage, materials };
  } catch (error) {
    expect(error).toBeInstanceOf(DcgError);
    const { problem, line, column } = error as DcgError;
    return { problem, line, column };
  }
}

const TEXTS = [
  // Ends in calls, which come back to the loop.
  `rule branch(length, radius) levels 3 {
     cone(radius, length, sides = 3)
     for i in 3 move(0, length * (0.5 + 0.1 * i), 0) turn(i * 120 + random(-9, 9)) tilt(random(38, 62))
       branch(length * random(0.6, 0.8), radius * 0.8)
   } then box(length, 1, radius) branch(2, 0.1)`,
  "rule r(a, b = a + random()) levels 2 { for i in 4 { let c = a * i move(c, b, 0) r(c + i) } } then sphere(b / 9, sides = 3) r(1)",
  "part p(n) { box(1, 1 + n, random() + 1) } material m { colour = #888 } paint m box(1, 1, 1) for i in 26 paint m scale(1, 2, i + 1) p(mod(i, 3))",
  "rule r(n) { if n > 0 for i in 3 r(n - 1 - i * 0.4) if n <= 0 box(1, 1 - n, 1) } r(2)",
  "rule r(n) { if n > 2 box(1, n, 1) } for i in 5 r(sqrt(3 - i))",
  "rule r(n) levels 1 { box(n, 1, 1) } for i in 4 move(2e8 * i, 0, 0) move(2e8 * i, 0, 0) r(i)",
  "function f(n) = n * n rule r(n) { if n > 2 box(f(n) / 9, n, 1) } for i in 4 r(f(i) + fractal(i / 3, 0.2, 3))",
  "rule r(n) { if level < 2 for i in 3 r(n + i) box(1, level + 1, n + 1) } r(0)",
  // Nothing but solids.
  `rule leaf(size) { mesh([[0, 0, 0], [size, 1, 0], [0, size, size]], [[0, 1, 2]]) }
   for i in 30 scale(1, i - 3, 1) move(random(), i / 7, 1) turn(i * 137.5) tilt(random(30, 115)) leaf(size = i / 9)`,
  "for i in 3 scale(3e4) scale(3e4) box(i, 1, 1)",
  "let w = 4 for i in 9 { let a = clamp(i / w, 0.5, 1) box(a * a, power(a, 2), random(a, w)) turn(a / (i - 20)) cone(1, a) }",
  "for i in 3 box(clamp(1 / (i - 1), 0, 1), 1, 1)",
  "for i in 3 box(1 / (1 / (i - 1)), 1, 1)",
  // Beyond the longest length in their last turns.
  "for i in 4 box(clamp(i, 0, 3) * 700 * 700, 1, 1)",
  "for i in 9 box(random(0, 1500000), 1, 1)",
  "for i in 4 box(clamp(i, clamp(500000 * i, 0, 1500000), 2), 1, 1)",
  // Fields.
  "let h = 3 heights x, z in 5 by 7 steps 5 by 30 = h * fractal(x / 3, z / 4, 3) + noise(z, z) * power(z, 2) / h",
  "let h = 3 heights x, z in 5 by 7 steps 30 by 2 = sqrt(h + z) + clamp(x / h, z, 2 / h)",
  "heights x, z in 2 by 2 steps 2 by 2 = fractal(x, z, 2 + z)",
];

describe("plans", () => {
  it.each(TEXTS)("do what a visit of nodes does, however little may be taken: %s", (text) => {
    const program = read(text);
    const all = outcome(program);
    expect(all).toEqual(outcome(unplanned(text)));
    expect(plansOf(program)).toBeGreaterThan(0);
    const usage = all.usage ?? { steps: 200, nesting: 8, levels: 2, triangles: 0 };
    for (const limit of ["steps", "nesting", "levels", "triangles"] as const) {
      const stride = Math.ceil((usage[limit] + 1) / (limit === "steps" ? 150 : 20));
      for (let most = 0; most <= usage[limit]; most += stride) {
        const limits = { [limit]: most };
        expect([limits, outcome(program, limits)]).toEqual([limits, outcome(unplanned(text), limits)]);
      }
    }
  });

  it("are asked again for other files, levels of detail and materials", () => {
    const text = `parameter w = 1 material m { colour = [w, 0, 0] } part p(n) { paint m box(1, 1, 1)
      for i in 4 paint m move(w * i, detail, n) box(w / 2, 1 + detail, i + 1) } p(1) p(2)`;
    const program = read(text);
    for (const w of [0.25, 1, 0.5]) {
      for (const detail of [0, 4]) {
        const settings = { detail, parameters: new Map([["w", w]]) };
        const { parts, materials } = grow(program, settings);
        const slow = grow(unplanned(text), settings);
        expect(parts.map(({ meshes, bounds }) => [bounds, meshes[0]?.positions])).toEqual(
          slow.parts.map(({ meshes, bounds }) => [bounds, meshes[0]?.positions]),
        );
        expect(materials).toEqual(slow.materials);
      }
    }
    expect(plansOf(program)).toBe(1);
  });

  it("are not made of what makes choices", () => {
    for (const text of [
      "for i in 3 if i box(1, 1, 1)",
      "let l = [1, 2, 3] for i in 3 box(l[i], 1, 1)",
      "rule r(n) { if n box(1, 1, 1) } for i in 3 { r(i) box(1, 1, 1) }",
      "rule r(n) { if n box(1, 1, 1) } for i in 3 { box(1, 1, 1) r(i) }",
      "rule r(n) { if n box(1, 1, 1) } for i in 4 r(fractal(i / 3, 0.2, 1 + i))",
      "heights x, z in 1 by 1 steps 1 by 1 = if x then 1 else 2",
    ]) {
      const program = read(text);
      expect(outcome(program)).toEqual(outcome(unplanned(text)));
      expect(plansOf(program)).toBe(0);
    }
  });

  it("are looked for no longer than a text may take", () => {
    const rules = Array.from({ length: 12 }, (_, i) => `rule r${i}() { r${i + 1}() r${i + 1}() }`);
    const program = read(`${rules.join(" ")} rule r12() {} for i in 3 { r0() box(1, 1, 1) } for i in 3 box(1, 1, 1)`);
    const loops: Statement[] = [];
    eachPlanned(program.modules, (statement) => {
      if (statement.kind === "for") loops.push(statement.body);
    });
    const [hard, easy] = loops as [Statement, Statement];
    const module = program.modules[0] as Module;
    expect(planOf(module, 0, easy)).not.toBeNull();
    for (let i = 0; i < MAX_CODE / 4096; i += 1) expect(planOf(module, 0, hard)).toBeNull();
    expect(planOf(module, 0, easy)).toBeNull();
  });
});

const TRANSFORMS = [
  "move(N, N, N)",
  "turn(N)",
  "tilt(N)",
  "roll(N)",
  "scale(N + 2)",
  "scale(2, N + 1.5, -3)",
  "paint m",
];
const SOLIDS = [
  "box(A, A, 1)",
  "cone(A, 1, top = A)",
  "cylinder(A, A, sides = 3)",
  "sphere(A, sides = 4)",
  "mesh([[0, N, 0], [N, 1, N], [1, 0, N], [N, N, 3]], [[0, 1, 2], [2, 3, 0]])",
];
const CALLS = ["plain(N, N)", "plain(N)", "deep(N)", "shared(floor(N))", "choosing(N)"];
const NUMBERS = [
  "i",
  "w",
  "random()",
  "random(-2, 2)",
  "0.5",
  "N + N",
  "N * N",
  "N - N",
  "N / w",
  "sin(40 * N)",
  "level",
];

it("does the same with any statements", () => {
  let state = 3;
  const random = (below: number) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
  const oneOf = (texts: readonly string[]) => texts[random(texts.length)] as string;
  const filled = (text: string, depth: number): string =>
    text
      .replace(/\bA\b/g, () => `abs(${filled("N", depth)})`)
      .replace(/\bN\b/g, () => (depth === 0 ? oneOf(NUMBERS.slice(0, 5)) : `(${filled(oneOf(NUMBERS), depth - 1)})`));
  const statement = (calls: readonly string[]): string => {
    const kind = random(6);
    if (kind < 2) return `${filled(oneOf(TRANSFORMS), 2)} ${statement(calls)}`;
    if (kind === 2) return `{ let v = ${filled("N", 2)} move(v, 0, 0) ${statement(calls)} }`;
    if (kind === 3) return `{ ${statement(calls)} ${statement(calls)} }`;
    return filled(oneOf(kind === 4 ? SOLIDS : calls), 2);
  };
  let planned = 0;
  for (let round = 0; round < 300; round += 1) {
    const inner = statement(["box(1, 1, 1)"]);
    const text = `let w = 3 material m { colour = #fff } paint m box(1, 1, 1)
      rule plain(a, w = a * random()) { let i = a + w ${inner} }
      rule choosing(i) { if i > 1 box(1, 1, i) }
      part shared(i) { box(1, 1, abs(i)) }
      rule deep(w) levels 2 { for i in 4 ${statement(CALLS)} }
      rule all(level0) { for i in 27 ${statement(CALLS)} deep(1) } all(0)`;
    const program = read(text);
    expect([text, outcome(program)]).toEqual([text, outcome(unplanned(text))]);
    planned += plansOf(program);
  }
  expect(planned).toBeGreaterThan(200);
});
