import { describe, expect, it } from "vitest";
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { areSame, farObjects } from "./farobjects.ts";
import { costAlone_bytes } from "./file.ts";
import { type Grade, goalOf, gradesOf, type Holding, impostorGrade, isHereWellEnough, levelGrade } from "./grade.ts";
import { plan, type Stock } from "./plan.ts";
import type { Eye } from "./sight.ts";

const EYE: Eye = { position: [0, 0, 0], viewAngle_rad: Math.PI / 3, height_px: 1080 };
const TARGET_PX = 1.5;
const NONE: ReadonlySet<string> = new Set();
const NOBODY: ReadonlySet<number> = new Set();

/** A tree: 4,000 triangles, or 50 that are a metre off, or pictures that are 10 cm off. */
const TREE: Model = {
  model: 0,
  levels: [0, 1].map((geometricError, level) => ({
    level,
    url: `/o/${level}.glb`,
    bytes: level === 0 ? 300_000 : 3_000,
    triangles: level === 0 ? 4_000 : 50,
    geometricError,
    textures: [],
    pack: undefined,
  })),
  impostor: {
    colour: { url: "/o/colour.png", bytes: 30_000 },
    shape: { url: "/o/shape.png", bytes: 40_000 },
    mapping: "hemi-octahedral",
    views: 8,
    size_px: 64,
    centre: [0, 5, 0],
    radius: 6,
    geometricError: 0.1,
    frames: 1,
    stride: 0,
  },
};
const [FINEST, COARSEST] = TREE.levels.map(levelGrade) as [Grade, Grade];
const PICTURES = impostorGrade(TREE.impostor as NonNullable<Model["impostor"]>);
/** Its error covers 1.5 pixels from here. */
const FAR_M = (0.1 * 1080) / (2 * TARGET_PX * Math.tan(Math.PI / 6));

function tree(id: number, distance_m: number): PlacedObject {
  const entry = {
    object: id,
    sourceNode: `tree ${id}`,
    bounds: { min: [-1, 0, -distance_m - 1], max: [1, 9, -distance_m] },
    worldFromObject: [],
    scale: 1,
    model: 0,
  } as const;
  return { entry, model: TREE };
}

const holding = (held: Grade | undefined, hasImpostor: boolean): Holding => ({
  held,
  taken: 0,
  failed: NONE,
  hasImpostor,
});
const stock = (of: Holding): Stock => ({ of: () => of, costOf: costAlone_bytes });
const wanted = (visible: PlacedObject[], of: Holding) =>
  plan(visible, stock(of), EYE, TARGET_PX).map(({ grade }) => `${grade.kind} ${grade.number}`);
const far = (distances: number[], of: Holding, before = NOBODY) => [
  ...farObjects(
    distances.map((m, i) => tree(i, m)),
    () => of,
    EYE,
    TARGET_PX,
    before,
  ),
];

describe("impostors among grades", () => {
  it("are one more grade: what costs least of all that will do", () => {
    expect(gradesOf(TREE).map(({ kind }) => kind)).toEqual(["level", "level", "impostor"]);
    const goal = (most_error: number) => goalOf(TREE, most_error, holding(undefined, false), costAlone_bytes);
    expect([goal(0.05), goal(0.1), goal(1)].map((grade) => grade?.kind)).toEqual(["level", "impostor", "level"]);
    expect(goal(0.05)?.number).toBe(0);
  });

  it("will do beside a mesh that will not, and not where they were lost", () => {
    expect(isHereWellEnough(TREE, holding(COARSEST, true), 0.1)).toBe(true);
    expect(isHereWellEnough(TREE, holding(COARSEST, true), 0.09)).toBe(false);
    expect(isHereWellEnough(TREE, holding(COARSEST, false), 0.1)).toBe(false);
    const lost: Holding = { held: COARSEST, taken: 0, failed: new Set(["impostor 0"]) };
    expect(goalOf(TREE, 0.1, lost, costAlone_bytes)).toEqual(FINEST);
  });
});

describe("the plan with impostors", () => {
  it("fetches pictures for what is far, and the mesh for what is near", () => {
    expect(wanted([tree(0, FAR_M + 1)], holding(COARSEST, false))).toEqual(["impostor 0"]);
    expect(wanted([tree(0, FAR_M + 1)], holding(COARSEST, true))).toEqual([]);
    expect(wanted([tree(0, FAR_M - 1)], holding(COARSEST, true))).toEqual(["level 0"]);
    expect(wanted([tree(0, FAR_M + 1), tree(1, 5)], holding(PICTURES, true))).toEqual(["level 0"]);
  });

  it("fetches them last of all where many far objects would be drawn by the mesh of a near one", () => {
    const grove = (count: number) => [tree(0, 5), ...Array.from({ length: count }, (_, i) => tree(i + 1, 2 * FAR_M))];
    expect(wanted(grove(30), holding(FINEST, false))).toEqual(["impostor 0"]);
    expect(wanted(grove(30), holding(FINEST, true))).toEqual([]);
    expect(wanted(grove(30), holding(COARSEST, false))).toEqual(["level 0"]);
    expect(wanted(grove(1), holding(FINEST, false))).toEqual([]);
    expect(wanted(grove(30), { held: FINEST, taken: 0, failed: new Set(["impostor 0"]) })).toEqual([]);
  });
});

describe("what is drawn by pictures", () => {
  it("is what is far, each by itself, and all where there is nothing else", () => {
    expect(far([5, FAR_M - 1, FAR_M + 1, 900], holding(FINEST, true))).toEqual([2, 3]);
    expect(far([5, 900], holding(PICTURES, true))).toEqual([0, 1]);
    expect(far([5, 900], holding(FINEST, false))).toEqual([]);
  });

  it("stays so a little nearer, and no nearer", () => {
    const before = new Set([0, 1]);
    expect(far([FAR_M / 1.2, FAR_M / 1.3], holding(FINEST, true), before)).toEqual([0]);
    expect(areSame(before, new Set([1, 0]))).toBe(true);
    expect(areSame(before, new Set([0, 2]))).toBe(false);
  });
});
