import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { describe, expect, it } from "vitest";
import { type Affine, columns } from "./affine.ts";
import type { Bounds } from "./bounds.ts";
import { DcgError } from "./error.ts";
import { grow } from "./evaluator/index.ts";
import { insideFolder } from "./folder.ts";
import { type Grown, instancesOf, type Part } from "./grown.ts";
import { LIMITS, type Usage } from "./limits.ts";
import { readProgram } from "./link.ts";
import { growModel, Rulebook } from "./recipe.ts";
import { type Value, valueFromJson } from "./value.ts";

/** Rules, how they are grown and what they give, as the tests in Rust wrote it. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/procedural");

interface Case {
  readonly file: string;
  readonly seed?: number;
  readonly detail?: number;
  readonly parameters?: Record<string, unknown>;
}

const json = <T>(name: string) => JSON.parse(readFileSync(join(GOLDEN, name), "utf8")) as T;

function grown({ file, parameters = {}, ...settings }: Case): Grown {
  const path = join(GOLDEN, `${file}.dcg`);
  const load = (name: string) => readFileSync(join(dirname(path), name), "utf8");
  const values = Object.entries(parameters).map(([name, value]) => [name, valueFromJson(value) as Value] as const);
  return grow(readProgram(basename(path), load(basename(path)), load), { ...settings, parameters: new Map(values) });
}

/** The same as in Rust: everything that was grown, as little-endian bytes in order. */
function hash(model: Grown): string {
  const sum = createHash("sha256");
  const counts = (...numbers: number[]) => sum.update(Uint32Array.from(numbers));
  const frame = (place: Affine) => sum.update(Float64Array.from(columns(place)));
  for (const part of model.parts) {
    sum.update(part.name);
    counts(part.meshes.length);
    for (const mesh of part.meshes) {
      counts(mesh.material, mesh.vertices, 3 * mesh.triangles);
      sum.update(mesh.positions);
      sum.update(mesh.normals);
      sum.update(mesh.indices);
    }
    counts(part.placements.length);
    for (const placement of part.placements) {
      counts(placement.part);
      frame(placement.frame);
    }
    if (part.impostor) counts(part.impostor.views, part.impostor.size_px, part.impostor.below ? 1 : 0);
    if (part.impostor && part.impostor.frames > 1) {
      counts(part.impostor.frames);
      sum.update(Float64Array.of(part.impostor.stride));
    }
    for (const viewpoint of part.viewpoints) {
      sum.update(viewpoint.name);
      frame(viewpoint.frame);
    }
    for (const placed of part.models) {
      sum.update(placed.path);
      frame(placed.frame);
    }
  }
  for (const instance of instancesOf(model)) {
    sum.update(instance.name);
    frame(instance.worldFromPart);
  }
  for (const { name, colour, emissive, roughness, metallic, opacity, doubleSided, recolour } of model.materials) {
    sum.update(name);
    sum.update(Float64Array.of(...colour, ...emissive, roughness, metallic, opacity, doubleSided ? 1 : 0));
    if (recolour) sum.update("recolour");
  }
  return sum.digest("hex");
}

describe("what grows is what grows in Rust, bit for bit", () => {
  const wanted = json<({ case: Case; hash: string; bounds: Bounds } & Usage)[]>("grown.json");
  it.each(wanted)("$case", ({ case: settings, hash: golden, bounds, ...usage }) => {
    const model = grown(settings);
    expect(model.parts[0]?.bounds).toEqual(bounds);
    expect(model.usage).toEqual(usage);
    expect(hash(model)).toBe(golden);
  });
});

describe("what is said of a mistake is what is said in Rust", () => {
  it.each(json<{ text: string; said: string }[]>("mistakes.json"))("$text", ({ text, said }) => {
    const load = () => {
      throw new Error("there are no other files here");
    };
    let found: unknown;
    try {
      grow(readProgram("test.dcg", text, load));
    } catch (error) {
      found = error;
    }
    expect(found).toBeInstanceOf(DcgError);
    expect((found as DcgError).message).toBe(said);
  });
});

it("has bounds that hold corners as they are written", () => {
  // In single precision the box begins at 100000.296875.
  const texts = [
    "move(0.1, 100000.3, 0) box(1, 1, 1)",
    "part p() { move(0.1, 100000.3, 0) box(1, 1, 1) } scale(0.3) p()",
  ];
  for (const text of texts) {
    const model = grow(readProgram("test.dcg", text, () => ""));
    const { min, max } = (model.parts[0] as Part).bounds;
    for (const { part, worldFromPart } of instancesOf(model)) {
      const frame = columns(worldFromPart);
      const [scale, up] = [frame[5] ?? 0, frame[13] ?? 0];
      for (const mesh of model.parts[part]?.meshes ?? []) {
        for (let i = 1; i < mesh.positions.length; i += 3) {
          const along = scale * (mesh.positions[i] ?? 0) + up;
          expect(along).toBeGreaterThanOrEqual(min[1]);
          expect(along).toBeLessThanOrEqual(max[1]);
        }
      }
    }
  }
});

it("tells of a parameter that there is not, at no place of the text", () => {
  const program = readProgram("test.dcg", "parameter height = 2 box(1, height, 1)", () => "");
  const told = "`heigth` is not a parameter of `test.dcg`; did you mean `height`?";
  expect(() => grow(program, { parameters: new Map([["heigth", 3]]) })).toThrow(
    new RegExp(`^${told.replace("?", "\\?")}$`),
  );
});

it("tells what there is in place of a parameter that there is not, and what is out of its range", () => {
  const text = "parameter size = 2 from 1 to 3 // metres\nparameter lean = 0 from -1 // to the left\n to size";
  const refused = (name: string, value: number) => () =>
    grow(
      readProgram("test.dcg", text, () => ""),
      { parameters: new Map([[name, value]]) },
    );
  const known = "`size from 1 to 3`, `lean from -1 to size`";
  expect(refused("heigth", 3)).toThrow(/^`heigth` is not a parameter of `test.dcg`; it takes /);
  expect(refused("heigth", 3)).toThrow(known);
  expect(refused("size", 4)).toThrow(/^`size` is 4; it must be from 1 to 3$/);
});

it("names a parameter that was given what its default is not with the mistake", () => {
  const text = "parameter footprint = [[0, 0], [4, 0], [0, 3]] parameter height = 2 + 1\nprism(footprint, height)";
  const grownOf = (name: string, value: unknown) =>
    grow(
      readProgram("test.dcg", text, () => ""),
      { parameters: new Map([[name, valueFromJson(value) as Value]]) },
    );
  expect(() => grownOf("footprint", 4)).toThrow(/\n {4}`footprint` was given a number, and its default is a list$/);
  expect(() => grownOf("height", [1, 2])).toThrow(/\n {4}`height` was given a list, and its default is a number$/);
  expect(grownOf("height", 4).parts[0]?.bounds.max[1]).toBe(4);
});

it("names what a file gives another in place of a list, or of a number", () => {
  const files: Record<string, string> = {
    "tree.dcg":
      "parameter height = 2 from 0 to 9 parameter at = [0, 1] parameter size = 1 box(at[0] + size, height, 1)",
    "wood.dcg": 'import "tree.dcg" as tree parameter size = 3 tree(size = size)',
  };
  const told = (text: string) => {
    const imports = 'import "tree.dcg" as tree import "wood.dcg" as wood\n';
    try {
      grow(readProgram("test.dcg", imports + text, (path) => files[path] ?? ""));
    } catch (error) {
      return (error as DcgError).message.split("\n");
    }
    return [];
  };
  expect(told("tree(at = 3)").slice(-2)).toEqual([
    "    called from line 2, column 1 of test.dcg",
    '    `at` of "tree.dcg" was given a number, and its default is a list',
  ]);
  const size = "was given a list, and its default is a number";
  expect(told("tree(size = [1])").at(-1)).toBe(`    \`size\` of "tree.dcg" ${size}`);
  expect(told("wood(size = [1])").at(-1)).toBe(`    \`size\` of "wood.dcg" ${size}`);
  expect(told("tree(height = [1])").at(-1)).toBe("    tree(height = [1])");
});

it("tells what looks like a known name by its odd letter", () => {
  const program = readProgram("test.dcg", "parameter height = 2 box(1, height, 1)", () => "");
  for (const [name, number] of [
    ["h\u0435ight", "U+0435"],
    ["height\u200b", "U+200B"],
  ] as const) {
    const told = `\`${name}\`, with ${number}, is not a parameter of \`test.dcg\`; did you mean \`height\`?`;
    expect(() => grow(program, { parameters: new Map([[name, 3]]) })).toThrow(told);
  }
});

it("has nothing in a name that leaves no trace, but joiners and variation selectors", () => {
  for (let code = 0x80; code < 0x110000; code += 1) {
    if (code >= 0xd800 && code < 0xe000) continue;
    const letter = String.fromCodePoint(code);
    if (!/\p{DI}/u.test(letter)) continue;
    const stays = /\p{VS}|[\u200c\u200d]/u.test(letter);
    const read = () => readProgram("test.dcg", `called "a${letter}" box(1, 1, 1)`, () => "");
    if (stays) expect(read).not.toThrow();
    else expect(read).toThrow(DcgError);
  }
});

it("repeats no more of what was given than of a line", () => {
  const program = readProgram("test.dcg", "parameter size = 2 box(1, 1, 1)", () => "");
  const told = `\`${"x".repeat(120)}…\` is not a parameter of \`test.dcg\`; it takes \`size\``;
  expect(() => grow(program, { parameters: new Map([["x".repeat(100_000), 3]]) })).toThrow(told);
});

it("blames no parameter for a mistake that is about something else", () => {
  const text = "parameter posts = 3 for i in posts box(1, 1, 1)\n";
  const parameters = new Map([["posts", valueFromJson([1, 2]) as Value]]);
  for (const [wrong, said] of [
    ["box(1, 1 / 0, 1)", "division by zero"],
    ["rule r() { r() } r()", "more than 64 levels"],
    ["box(-1, 1, 1)", "it must be from 0"],
    ["let a = [1] box(a[1], 1, 1)", "there is no item 1"],
    ["scale(0) box(1, 1, 1)", "a scale must be"],
    ["box(power(2, 0.5), 1, 1)", "a power must be"],
    ["box(sqrt(-1), 1, 1)", "what a root is taken of must be"],
    ["lathe([[-1, 0], [1, 1]])", "a radius of a profile must be"],
    ["prism([[0, 0], [1, 1]], 1)", "this outline must be"],
    ["polygon([[0, 0, 0], [1, 0, 0], [0, 2e6, 0]])", "a point must be"],
    ["polygon([[0, 0, 0], [1, 0, 0]])", "a face must be"],
    ["material m { colour = [0, 0, 2] } paint m box(1, 1, 1)", "a colour must be"],
    ["part p() within [1, 1, 1] to [0, 0, 0] { box(1, 1, 1) } p()", "`within` must be"],
    ["impostor(size = 3)", "size must be"],
  ] as const) {
    let found: unknown;
    try {
      const program = readProgram("test.dcg", text + wrong, () => "");
      grow(program, { parameters });
    } catch (error) {
      found = error;
    }
    expect((found as DcgError).message).toContain(said);
    expect((found as DcgError).message).not.toContain("posts");
  }
});

it("says of a path that leads to no file of the folder why", () => {
  for (const [path, why] of [
    ["../a.dcg", "outside of the source's folder"],
    ["https://a.org/a.dcg", "it is an address"],
    ["C:/a.dcg", "no `:`"],
    ["lib\\a.dcg", "write `/` behind each folder"],
    ["/a.dcg", "at the root of a disk"],
    ["a\0.dcg", "no U+0000"],
    ["", "it names no file"],
  ] as const) {
    expect(() => insideFolder(path)).toThrow(why);
  }
  expect(insideFolder("./lib//a.dcg")).toBe("lib/a.dcg");
});

it("tells what is kept, and needs no more than that", () => {
  const text = `material m(n) {} part p(l) { paint m(l[0]) box(1, 1, 1) } let a = [1, 2, 3]
    for i in 5 p([i, 1]) called "sixteen letters." box(1, 1, 1) viewpoint "eight le"`;
  const program = readProgram("test.dcg", text, () => "");
  const { kept, files } = grow(program).usage;
  expect([kept, files]).toEqual([44, 1]);
  expect(grow(program, { limits: { kept } }).usage.kept).toBe(kept);
  expect(() => grow(program, { limits: { kept: kept - 1 } })).toThrow("more than 43 numbers kept");
});

it("takes no room for what calls do not give", () => {
  const formals = Array.from({ length: 1000 }, (_, i) => `a${i} = ${i}`).join();
  const calls = Array.from({ length: 1000 }, (_, i) => `r(a${(i + 1) % 1000} = 2)`).join(" ");
  const [module] = readProgram("test.dcg", `rule r(${formals}) {} r() ${calls} r(5, a999 = 1)`, () => "").modules;
  const slots = module?.calls.map((call) => call.slots) ?? [];
  expect([slots[0], slots[1], slots.at(-1)]).toEqual([[], [1], [0, 999]]);
  const lists = module?.calls.flatMap((call) => Object.values(call).filter(Array.isArray)) ?? [];
  expect(Math.max(...lists.map((list) => list.length))).toBe(2);
});

it("reads calls with as many arguments as a text has room for", () => {
  const count = 130_000;
  const formals = Array.from({ length: count }, (_, i) => `q${i.toString(36)}`);
  const text = `rule r(${formals.join()}) { box(q0, q${(count - 1).toString(36)}, 1) } r(${"1,".repeat(count - 1)}2)`;
  expect(grow(readProgram("test.dcg", text, () => "")).parts[0]?.bounds.max).toEqual([0.5, 2, 0.5]);
});

it("says of rules that go deeper than the stack is large that they do", () => {
  const onLittleStack = (does: () => unknown): unknown => {
    try {
      return onLittleStack(does);
    } catch (error) {
      if (!(error instanceof RangeError)) return error;
    }
    // Not within the handler: it is what had no room.
    return does();
  };
  const told = "its rules go deeper into one another than this device can follow";
  const brackets = `box(${"(".repeat(90)}1${")".repeat(90)}, 1, 1)`;
  const read = (text: string) => readProgram("test.dcg", text, () => "");
  const calls = read("rule r(n) { if n == 0 box(1, 1, 1) else { { { { r(n - 1) } } } } } r(60)");
  for (const does of [() => read(brackets), () => grow(calls)]) {
    const found = onLittleStack(does);
    expect(found).toBeInstanceOf(DcgError);
    expect((found as DcgError).message).toContain(told);
  }
  expect(grow(read(brackets)).usage.triangles + grow(calls).usage.triangles).toBe(24);
});

it("imports a file once, however it is written", () => {
  const asked: string[] = [];
  const load = (path: string) => {
    asked.push(path);
    return "box(1, 1, 1)";
  };
  const paths = ["./a.dcg", "a.dcg", "sub/../a.dcg", "./sub/./deep/../../a.dcg"];
  const calls = paths.map((path, i) => `import "${path}" as a${i} a${i}()`);
  readProgram("test.dcg", calls.join("\n"), load);
  expect(asked).toEqual(["a.dcg"]);
});

it("takes no path for blank that has more in it than the language's own blanks", () => {
  const read = (path: string) => readProgram("test.dcg", `import "${path}" as a a()`, () => "");
  for (const path of ["\ufeff", "\u00a0"]) {
    expect(read(path).modules[0]?.imports[0]?.path).toBe(path);
    expect(() => readProgram("test.dcg", `model "${path}"`, () => "")).not.toThrow();
  }
  for (const path of ["", "  ", " \t"]) {
    expect(() => read(path)).toThrow("no file is named here");
    expect(() => readProgram("test.dcg", `model "${path}"`, () => "")).toThrow("no file is named here");
  }
});

/** The same in Rust: `crates/scene/src/procedural/tests/placed.rs`. */
describe("glTF files that are placed", () => {
  const boxes = new Map<string, Bounds>([["bench.glb", { min: [-1, 0, -0.5], max: [5, 1, 0.5] }]]);
  const models = (path: string) => boxes.get(path);
  const program = (text: string) => readProgram("test.dcg", text, () => "");

  it("are in the bounds where their boxes are known", () => {
    const text = 'part p() { move(50, 0, 0) model "bench.glb" model "unknown.glb" } box(1, 1, 1) turn(90) p()';
    const { parts } = grow(program(text), { models });
    expect(parts[1]?.bounds).toEqual({ min: [49, 0, -0.5], max: [55, 1, 0.5] });
    expect(parts[0]?.bounds).toEqual({ min: [-0.5, 0, -55], max: [0.5, 1, 0.5] });
    expect(grow(program(text)).parts[0]?.bounds.max).toEqual([0.5, 1, 0.5]);
  });

  it.each([
    [
      'part p() within [0, 0, 0] to [1, 1, 1] {\n  move(50, 0, 0) model "bench.glb"\n}\np()',
      "test.dcg, line 2, column 18: part `p` reaches 54 m beyond what it declares with `within`, towards +x; widen that\n" +
        '    move(50, 0, 0) model "bench.glb"\n    called from line 4, column 1 of test.dcg',
    ],
    [
      'part q() { model "bench.glb" }\npart p() within [-1, 0, -1] to [4, 1, 1] { box(1, 1, 1) called "x" q() }\np()',
      "test.dcg, line 1, column 12: part `p` reaches 1 m beyond what it declares with `within`, towards +x; widen that\n" +
        '    part q() { model "bench.glb" }\n    called from line 3, column 1 of test.dcg',
    ],
    [
      'part p() within [-1, 0, -1] to [5, 1, 1] { model "bench.glb" box(1, 2, 1) } p()',
      "test.dcg, line 1, column 6: part `p` reaches 1 m beyond what it declares with `within`, towards +y; widen that\n" +
        '    part p() within [-1, 0, -1] to [5, 1, 1] { model "bench.glb" box(1, 2, 1) } p()\n' +
        "    called from line 1, column 77 of test.dcg",
    ],
  ])("must lie in what a part declares: %s", (text, said) => {
    let found: unknown;
    try {
      grow(program(text), { models });
    } catch (error) {
      found = error;
    }
    expect((found as DcgError).message).toBe(said);
    expect(grow(program(text.replace("box(1, 2, 1)", ""))).parts.length).toBeGreaterThan(1);
  });
});

/** The same in Rust: `crates/scene/src/procedural/tests/bounded.rs`. */
it("takes long rows of transforms and chains of conditions, and as many brackets as it says", () => {
  const grownOf = (text: string) => grow(readProgram("test.dcg", text, () => ""));
  const row = grownOf(`${"move(1, 0, 0) ".repeat(256)}box(1, 1, 1)`);
  expect(row.parts[0]?.bounds.max).toEqual([256.5, 1, 0.5]);
  const chain = (one: (i: number) => string) => Array.from({ length: 256 }, (_, i) => one(i)).join(" else ");
  const statement = `rule r(a) { ${chain((i) => `if a == ${i} box(1, ${i} + 1, 1)`)} }`;
  expect(grownOf(`${statement} r(255)`).parts[0]?.bounds.max[1]).toBe(256);
  const value = `function f(a) = ${chain((i) => `if a == ${i} then ${i} + 1`)} else 0`;
  expect(grownOf(`${value} box(1, f(255), 1)`).parts[0]?.bounds.max[1]).toBe(256);
  const braces = (count: number) => `${"{".repeat(count)}box(1, 1, 1)${"}".repeat(count)}`;
  expect(grownOf(braces(95)).usage.triangles).toBe(12);
  expect(() => grownOf(braces(96))).toThrow("more than 96 brackets");
  const inCalls = `rule r(n) { ${"move(1, 0, 0) ".repeat(250)} { if n > 0 r(n - 1) } } r(99)`;
  expect(() => grownOf(inCalls)).toThrow("more than 640 levels of nesting");
  const dangling = "rule r(a, b) { if a if b box(1, 1, 1) else box(1, 2, 1) else box(1, 3, 1) } r(1, 0)";
  expect(grownOf(dangling).parts[0]?.bounds.max[1]).toBe(2);
  expect(grownOf(dangling.replace("r(1, 0)", "r(0, 0)")).parts[0]?.bounds.max[1]).toBe(3);
});

it("grows a part alone as it is in the whole", () => {
  const whole = grown({ file: "modules", seed: 5 });
  const text = (name: string) => readFileSync(join(GOLDEN, name), "utf8");
  const imports = new Map([["fence.dcg", text("fence.dcg")]]);
  const stone = whole.parts.find((part) => part.name === "stone");
  const upright = whole.parts.filter((part) => part.name === "upright").at(-1);
  const rulebook = new Rulebook({ rules: text("modules.dcg"), imports });
  for (const size of [0.25, 0.5, 0.75]) {
    const { meshes } = rulebook.grow({ part: "stone", parameters: { size } }, { seed: 5 });
    expect(meshes.length).toBe(1);
    const same = whole.parts.some((part) => part.meshes[0]?.positions.join() === meshes[0]?.positions.join());
    expect(same || stone === undefined).toBe(true);
  }
  const recipe = { rules: text("fence.dcg"), imports: new Map(), part: "upright", parameters: { height: 2 } };
  const { meshes, materials } = growModel(recipe, { seed: 5 });
  expect(meshes[0]?.positions).toEqual(upright?.meshes[0]?.positions);
  expect(materials[meshes[0]?.material ?? 0]?.name).toBe("wood");
  expect(() => rulebook.grow({ part: "stome", parameters: {} })).toThrow(/`stome`.*`stone`/s);
  expect(() => rulebook.grow({ part: 'stone(size = 1) import "b.dcg" as b b.x', parameters: {} })).toThrow(DcgError);
});

it("writes nothing without a radius, and of a wire in a profile only its ends", () => {
  const meshes = (text: string) => grow(readProgram("test.dcg", text, () => "")).parts[0]?.meshes;
  const nothing = "sphere(0, 256) cone(0, 1) cylinder(0, 2) for s in 2 lathe([[0, 0], [0, 1], [0, 2]], smooth = s)";
  expect(meshes(nothing)).toEqual([]);
  const profile = "[[0, 0], [0, 1], [0, 2], [1, 3], [0, 4], [0, 5], [0, 6], [1, 7]]";
  for (const [smooth, vertices] of [
    [0, 3 * 2 * 8],
    [1, 5 * 8],
  ]) {
    expect(meshes(`lathe(${profile}, 8, ${smooth})`)).toMatchObject([{ vertices, triangles: 3 * 8 }]);
  }
});

it("refuses lists that are too deep, however they were put together", () => {
  const lets = Array.from({ length: 40_000 }, (_, i) => `let a${i + 1} = [a${i}]`);
  const text = `let a0 = 1\n${lets.join("\n")}`;
  const said = "test.dcg, line 66, column 11: more than 64 lists inside each other; make it smaller";
  expect(() => grow(readProgram("test.dcg", text, () => ""))).toThrow(said);
  const nested = (depth: number) => JSON.parse(`${"[".repeat(depth)}1${"]".repeat(depth)}`);
  expect(valueFromJson(nested(64))).toMatchObject({ depth: 64 });
  expect(valueFromJson(nested(65))).toBeUndefined();
});

/** The same in Rust: `crates/scene/src/procedural/tests/bounded.rs`. */
it("counts lists that were needed before no more, and one that calls hand down once", () => {
  const list = "function long(n) = if n < 1 then [0] else [long(n - 1), long(n - 1)]";
  const shared = `${list} function new(x) = mix(big, big, x) let big = long(14)`;
  for (const text of [
    "for i in 66 { let a = new(i / 66) box(1, 1, 1) }",
    "function f(n, l) = if n < 1 then count(l) else f(n - 1, l) for i in 9 { let l = new(i) box(f(20, l), 1, 1) }",
    "for i in 33 box(count([new(i), 1]), count(new(i)[0]), 1)",
  ]) {
    expect(grow(readProgram("test.dcg", `${shared} ${text}`, () => "")).usage.triangles).toBeGreaterThan(0);
  }
  const parameters = Array.from({ length: 60 }, (_, i) => `parameter p${i} = mix(big, big, 0.5)`).join(" ");
  const given = `${list} parameter big = long(14) ${parameters} box(1, 1, 1)`;
  const wanted = "more than 2097152 numbers in lists at once; name long lists outside of rules, with `let`";
  expect(() => grow(readProgram("test.dcg", given, () => ""))).toThrow(wanted);
});

/** As docs/PROCEDURAL.md says, "What keeps its dice". */
it("rolls dice anew behind what is added, and nowhere else", () => {
  const height = (text: string, name: string, parameters = new Map<string, Value>()) => {
    const { parts } = grow(
      readProgram("test.dcg", text, () => ""),
      { parameters },
    );
    return parts.filter((part) => part.name === name).map(({ bounds }) => bounds.max[1]);
  };
  const called = (name: string) => `called "${name}" box(1, random(), 1)`;
  const inner = `rule inner() { ${called("inner")} }`;
  const text = `parameter unused = 1 part p(n) { box(1, random(), 1) } ${inner} rule r() { ${called("r")} } p(1) r() ${called("last")}`;
  const named = ["p", "r", "last"] as const;
  const heights = (text: string, given?: Map<string, Value>) => named.map((name) => height(text, name, given)[0]);
  const before = heights(text);
  const same = (after: readonly unknown[]) => named.filter((_, i) => after[i] === before[i]);
  expect(same(heights(`${text} sphere(random())`))).toEqual(["p", "r", "last"]);
  expect(same(heights(text.replace("p(1) r()", "p(1) r() let q = sin(1)")))).toEqual(["p", "r"]);
  expect(same(heights(text.replace("p(1) r()", "move(1, 0, 0) { p(1) } box(1, 0, 1) r()")))).toEqual([
    "p",
    "r",
    "last",
  ]);
  expect(same(heights(text.replace("p(1) r()", "let q = abs(0) r()")))).toEqual(["r", "last"]);
  expect(same(heights(text.replace("rule r() {", "rule r() { let q = random()")))).toEqual(["p", "last"]);
  expect(same(heights(`let q = random() ${text}`))).toEqual(["p"]);
  expect(same(heights(text, new Map([["unused", 2]])))).toEqual(["p"]);
  const turns = (count: number) => height(`for i in ${count} ${called("turn")}`, "turn");
  expect(turns(9).slice(0, 5)).toEqual(turns(5));
});

/** The same numbers in every run, up to `below`. */
function randomNumbers(seed: number): (below: number) => number {
  let state = seed;
  return (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * below);
  };
}

it("gives a model or a DcgError for any text", () => {
  const random = randomNumbers(3);
  const files = ["worm", "solids", "numbers", "fence"].map((name) => readFileSync(join(GOLDEN, `${name}.dcg`), "utf8"));
  const pieces = files.join(" ").split(/\b/);
  for (let round = 0; round < 300; round += 1) {
    const words = (files[round % files.length] as string).split(/\b/);
    for (let change = random(4); change >= 0; change -= 1) {
      words.splice(random(words.length), random(3), pieces[random(pieces.length)] as string);
    }
    try {
      const limits = { ...LIMITS, steps: 100_000, triangles: 20_000 };
      grow(
        readProgram("test.dcg", words.join(""), () => ""),
        { limits },
      );
    } catch (error) {
      expect(error).toBeInstanceOf(DcgError);
    }
  }
});
