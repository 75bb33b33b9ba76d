import validator from "gltf-validator";
import { describe, expect, it, vi } from "vitest";
import { explore } from "../../test/explore.ts";
import type { Vec3 } from "../basics/geometry.ts";
import { growModel } from "../procedural/index.ts";
import { limitsOf, type Port, type Seedling, WorkerGrowing } from "./growing.ts";
import { grownGlb } from "./grownglb.ts";
import { ModelLoads } from "./modelloads.ts";

/** From here it takes the finest level of the ball. */
const NEAR: Vec3 = [1.5, 0.5, 2.4];
const BALL = 3;
const TREE: Seedling = {
  rules: `material bark { colour = #6b5844 metallic = 0.25 emissive = #102030 }
    material glass { opacity = 0.5 double_sided = 1 }
    part tree(height) { paint bark cylinder(0.1, height) paint glass move(0, height, 0) sphere(height / 2, 8) }`,
  imports: new Map(),
  part: "tree",
  parameters: { height: 3 },
  seed: 7,
  triangles: 100,
};

const isRules = (path: string) => path.endsWith(".dcg");

describe("an explorer of what has grown from rules", () => {
  it("fetches rules once, and grows instead of fetching the finest level", async () => {
    const { explorer, requests, problems, go, quiet } = await explore({ grown: true });
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.residency.grades()).toHaveProperty("g0", 1);
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    const rules = requests.filter(isRules);
    expect(rules.length).toBe(2);
    expect(new Set(rules).size).toBe(2);
    const finest = explorer.visible.find(({ model }) => model.model === BALL)?.model.levels[0]?.url;
    expect(finest).toBeDefined();
    expect(requests.some((path) => path.endsWith(finest ?? ""))).toBe(false);
  });

  it("draws levels where the rules are wrong, and says why", async () => {
    const spoil = (files: Map<string, Uint8Array>) => {
      for (const [path, bytes] of files) {
        if (isRules(path) && new TextDecoder().decode(bytes).includes("part ball")) files.delete(path);
      }
    };
    const { explorer, problems, go, quiet } = await explore({ grown: true, spoil });
    go(NEAR);
    await quiet();
    expect(problems).toEqual([]);
    expect(explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
    expect(explorer.residency.grades()).not.toHaveProperty("g0");
    expect(explorer.models.noteOf(BALL)).toMatch(/dcg/);
  });

  it("fetches a coarser level once where memory is short, however one walks meanwhile", async () => {
    const { explorer, requests, go, quiet } = await explore({ grown: true, populated: true, delay_ms: 60 });
    go(NEAR);
    await quiet();
    const coarsest = explorer.visible.find(({ model }) => model.model === BALL)?.model.levels.at(-1)?.url ?? "none";
    const short = vi.spyOn(ModelLoads.prototype, "short", "get").mockReturnValue(true);
    try {
      for (let step = 0; step < 8; step += 1) {
        go([1.5 + 0.3 * (step % 2), 0.5, 2.4]);
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      await quiet();
    } finally {
      short.mockRestore();
    }
    expect(requests.filter((path) => path.endsWith(coarsest)).length).toBe(1);
    expect(explorer.residency.base(BALL)?.grade).toMatchObject({ kind: "level" });
  });
});

describe("a grown model", () => {
  it("is a sound GLB with the materials of the rules", async () => {
    const { parameters, rules, imports, part, seed } = TREE;
    const glb = grownGlb(growModel({ rules, imports, part, parameters }, { seed }));
    const report = await validator.validateBytes(new Uint8Array(glb), { format: "glb" });
    expect(report.issues.messages.filter(({ severity }) => severity === 0)).toEqual([]);
    const json = new TextDecoder().decode(new Uint8Array(glb, 20, new DataView(glb).getUint32(12, true)));
    const { materials, meshes } = JSON.parse(json);
    expect(meshes[0].primitives.length).toBe(2);
    const named = (name: string) => materials.find((material: { name: string }) => material.name === name);
    expect(named("bark").pbrMetallicRoughness.metallicFactor).toBe(0.25);
    expect(named("bark").emissiveFactor.every((channel: number) => channel > 0)).toBe(true);
    expect(named("glass")).toMatchObject({ alphaMode: "BLEND", doubleSided: true });
    expect(named("bark").alphaMode).toBeUndefined();
  });

  it("takes no more than a model of its size may", () => {
    const limits = limitsOf(12);
    const grown = (body: string) => () =>
      growModel({ rules: `part p() { ${body} }`, imports: new Map(), part: "p", parameters: {} }, { limits });
    expect(grown("box(1, 1, 1)")().meshes[0]?.triangles).toBe(12);
    expect(grown("for i in 1000000 box(1, 1, 1)")).toThrow(`more than ${limits.triangles} triangles`);
    expect(grown("for j in 1000 for i in 100000 if i < 0 box(1, 1, 1)")).toThrow(`more than ${limits.steps} steps`);
  });

  it("comes from a worker that starts with the first one", async () => {
    let [started, ended] = [0, 0];
    const books: Pick<Seedling, "rules" | "imports">[] = [];
    const told: boolean[] = [];
    const begin = (): Port => {
      started += 1;
      return {
        onmessage: null,
        onerror: null,
        terminate: () => {
          ended += 1;
        },
        postMessage({ id, seed, book, texts, ...making }) {
          if (texts) books[book] = texts;
          const recipe = { ...making, ...(books[book] ?? TREE) };
          told.push(texts !== undefined);
          if (recipe.part === "never") return;
          const grown = recipe.part === "tree" && { id, result: grownGlb(growModel(recipe, { seed })) };
          queueMicrotask(() => this.onmessage?.({ data: grown || { id, error: `no ${recipe.part} here` } }));
        },
      };
    };
    const growing = new WorkerGrowing(begin);
    expect(started).toBe(0);
    const [tree, stone] = await Promise.allSettled([growing.grow(TREE), growing.grow({ ...TREE, part: "stone" })]);
    expect(tree).toMatchObject({ status: "fulfilled", value: { byteLength: expect.any(Number) } });
    expect(stone).toMatchObject({ status: "rejected", reason: { message: "no stone here" } });
    const never = growing.grow({ ...TREE, part: "never" });
    growing.end();
    await expect(never).rejects.toThrow("any more");
    expect([started, ended]).toEqual([1, 1]);
    // Texts travel once.
    expect(told).toEqual([true, false, false]);
  });
});
