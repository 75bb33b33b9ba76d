import { describe, expect, it } from "vitest";
import type { Level, Model } from "../documents/modeldocument.ts";
import { type CostOf, costAlone_bytes, HEADER_BYTES } from "./file.ts";
import {
  ALL_RUNGS,
  cost_bytes,
  filesOf,
  type Grade,
  goalOf,
  gradesOf,
  isGoodEnough,
  nameOf,
  stepTowards,
} from "./grade.ts";

const NOTHING_FAILED: ReadonlySet<string> = new Set();

/** Levels of these bytes, finest first, and rungs up to these bytes; errors double from step to step. */
function model(levels: number[], rungs: number[], { pictures = 0, packed = false } = {}): Model {
  const textures = pictures > 0 ? [{ url: "/o/picture.png", bytes: pictures }] : [];
  return {
    model: 0,
    levels: levels.map(
      (bytes, level): Level => ({
        level,
        url: `/o/${level}.glb`,
        bytes,
        triangles: 100 >> level,
        geometricError: level === 0 ? 0 : 0.1 * 2 ** level,
        textures: [],
        pack: packed && level === levels.length - 1 ? { url: "/o/a.pack", bytes: 2 * bytes, from: 0 } : undefined,
      }),
    ),
    smooth: {
      url: "/o/a.slod",
      bytes: rungs.at(-1) ?? 0,
      materials: { url: "/o/a.gltf", bytes: 100 },
      textures,
      rungs: rungs.map((to, number) => ({
        url: `/o/a.r${number}.slod`,
        from: rungs[number - 1] ?? 0,
        to,
        triangles: 10 << number,
        geometricError: number === rungs.length - 1 ? 0 : 0.4 / 2 ** number,
      })),
    },
  };
}

const grade = (of: Model, name: string) => gradesOf(of).find((one) => nameOf(one) === name) as Grade;
const chosen = (of: Model, most_error: number, held?: string, failed = NOTHING_FAILED) => {
  const drawn = held ? grade(of, held) : undefined;
  const taken = drawn?.kind === "rung" ? drawn.number + 1 : 0;
  const goal = goalOf(of, most_error, { held: drawn, taken, failed }, costAlone_bytes);
  return goal && nameOf(goal);
};

describe("the grade of a model", () => {
  it("is the one of fewest bytes among those that are good enough", () => {
    const cheapRungs = model([9000, 4000, 2000], [300, 700, 1500]);
    expect(chosen(cheapRungs, 0.4)).toBe("rung 0");
    expect(chosen(cheapRungs, 0.2)).toBe("rung 1");
    expect(chosen(cheapRungs, 0)).toBe("rung 2");
    const cheapLevels = model([3000, 900, 500], [2000, 4000, 8000]);
    expect(chosen(cheapLevels, 0.4)).toBe("level 2");
    expect(chosen(cheapLevels, 0.1)).toBe("level 0");
  });

  it("counts requests, and none for what stands in a pack; and how much kinds of files shrink", () => {
    const even = model([9000, 4000, 1000], [600, 1200, 2400]);
    expect(chosen(even, 0.4)).toBe("level 2");
    const one = cost_bytes(even, grade(even, "rung 0"), 0, costAlone_bytes);
    expect(one).toBe(600 + 35 + 2 * HEADER_BYTES);
    expect(cost_bytes(even, grade(even, "level 2"), 0, costAlone_bytes)).toBe(470 + HEADER_BYTES);
    const packed = model([9000, 4000, 1000], [600, 1200, 2400], { packed: true });
    expect(cost_bytes(packed, grade(packed, "level 2"), 0, costAlone_bytes)).toBe(310);
  });

  it("does not count again what is held", () => {
    const refined = model([15_000, 9000, 7000], [1000, 4000, 7000]);
    expect(chosen(refined, 0)).toBe("level 0");
    expect(chosen(refined, 0, "rung 1")).toBe("rung 2");
  });

  it("counts pictures unless they are here", () => {
    const pictured = model([9000, 6000, 5000], [300, 700, 1500], { pictures: 100_000 });
    expect(chosen(pictured, 0)).toBe("level 0");
    const decoded: CostOf = (file) => (file.url.endsWith(".png") ? 0 : costAlone_bytes(file));
    const goal = goalOf(pictured, 0, { held: undefined, taken: 0, failed: NOTHING_FAILED }, decoded);
    expect(goal).toMatchObject({ kind: "rung", number: 2 });
  });

  it("is grown where rules and a byte for each triangle cost less than levels", () => {
    const file = { url: "/o/a.dcg", bytes: 5000 };
    const what = { imports: new Map(), part: "a", parameters: {}, seed: 0, geometricError: 0 };
    const grows = { ...model([900, 200], []), rules: { file, ...what, triangles: 100 } };
    expect(cost_bytes(grows, grade(grows, "grown 0"), 0, costAlone_bytes)).toBe(1450 + HEADER_BYTES + 100);
    expect(chosen(grows, 0)).toBe("level 0");
    const known: CostOf = (file) => (file.url.endsWith(".dcg") ? 0 : costAlone_bytes(file));
    const goal = (most_error: number, triangles: number) => {
      const model = { ...grows, rules: { ...grows.rules, triangles } };
      return nameOf(goalOf(model, most_error, { held: undefined, taken: 0, failed: NOTHING_FAILED }, known) as Grade);
    };
    expect(goal(0, 100)).toBe("grown 0");
    expect(goal(0, 2000)).toBe("level 0");
    expect(goal(0.2, 100)).toBe("grown 0");
    expect(goal(0.2, 600)).toBe("level 1");
    expect(chosen(grows, 0, undefined, new Set(["grown 0"]))).toBe("level 0");
  });

  it("is none that has failed", () => {
    const two = model([9000, 4000], [300, 700]);
    expect(chosen(two, 0, undefined, new Set([ALL_RUNGS]))).toBe("level 0");
    expect(chosen(two, 0.4, undefined, new Set([ALL_RUNGS]))).toBe("level 1");
    expect(chosen(two, 0, undefined, new Set([ALL_RUNGS, "level 0"]))).toBeUndefined();
  });

  it("will do when nothing finer of its kind can be had", () => {
    const two = model([9000, 4000], [300, 700]);
    expect(isGoodEnough(two, grade(two, "rung 1"), -1)).toBe(true);
    expect(isGoodEnough(two, grade(two, "level 0"), -1)).toBe(true);
    expect(isGoodEnough(two, grade(two, "rung 0"), 0.1)).toBe(false);
  });
});

it("a stream that is wanted whole is one file, and after some rungs the rungs that are missing", () => {
  const three = model([9000], [300, 700, 1500]);
  const files = (taken = 0) => filesOf(three, grade(three, "rung 2"), taken).map(({ url }) => url);
  expect(files()).toEqual(["/o/a.slod", "/o/a.gltf"]);
  expect(files(1)).toEqual(["/o/a.r1.slod", "/o/a.r2.slod", "/o/a.gltf"]);
});

it("small rungs come in one step, large ones each by itself, and a level at once", () => {
  const small = model([90_000], [1000, 2000, 16_000, 30_000, 60_000]);
  const steps: string[] = [];
  let held: Grade | undefined;
  const goal = grade(small, "rung 4");
  while (!held || nameOf(held) !== nameOf(goal)) {
    held = stepTowards(small, goal, held);
    steps.push(nameOf(held));
  }
  expect(steps).toEqual(["rung 2", "rung 3", "rung 4"]);
  expect(nameOf(stepTowards(small, grade(small, "level 0"), held))).toBe("level 0");
});

it("no step is coarser than what is held", () => {
  const large = model([90_000, 80_000], [20_000, 40_000, 60_000, 80_000]);
  const step = (held: string) => nameOf(stepTowards(large, grade(large, "rung 3"), grade(large, held)));
  expect([step("rung 0"), step("level 1")]).toEqual(["rung 1", "rung 2"]);
});
