import { expect, it } from "vitest";
import type { FetchQueue } from "./fetchqueue.ts";
import { FrameBudget } from "./framebudget.ts";
import { gradesOf } from "./grades.ts";
import type { Growing } from "./growing.ts";
import { type ModelHost, ModelLoads } from "./modelloads.ts";
import type { PlacedObject } from "./objects.ts";
import type { Want } from "./priority.ts";
import { ResidencySet } from "./residency.ts";
import type { SmoothLods } from "./smoothlods.ts";
import type { Tree } from "./tree.ts";

const NOWHERE = { min: [0, 0, 0], max: [1, 1, 1] } as const;
const MODEL = {
  model: 3,
  levels: [{ level: 0, url: "/o/a.glb", bytes: 900, triangles: 9, geometricError: 0, textures: [], pack: undefined }],
  smooth: {
    url: "/o/a.slod",
    bytes: 300,
    materials: { url: "/o/a.gltf", bytes: 10 },
    textures: [],
    rungs: [0, 1].map((number) => ({
      url: `/o/a.r${number}.slod`,
      from: 150 * number,
      to: 150 * (number + 1),
      triangles: 4,
      geometricError: 1 - number,
    })),
  },
};
const OBJECT: PlacedObject = {
  entry: { object: 9, sourceNode: "ball", bounds: NOWHERE, worldFromObject: [], scale: 1, model: 3 },
  model: MODEL,
};

it("a load that is cancelled when all of it has come decodes nothing", async () => {
  const answers = new Map<string, (bytes: ArrayBuffer) => void>();
  const decoded: number[] = [];
  const loads = new ModelLoads({
    queue: {
      request: (url: string) => new Promise<ArrayBuffer>((resolve) => answers.set(url, resolve)),
      cancel: () => {},
      reprioritise: () => {},
    } as unknown as FetchQueue,
    tree: { resolve: (url: string) => url } as unknown as Tree,
    host: { needsTexture: () => true, upload: async () => 1 } as unknown as ModelHost,
    residency: new ResidencySet(1e9),
    budget: new FrameBudget(1e9, () => 0),
    smooth: {
      refine: async (_: number, __: object, rung: number) => {
        decoded.push(rung);
        return { glb: new ArrayBuffer(1), state_bytes: 0 };
      },
      close: () => {},
      taken: () => 0,
    } as unknown as SmoothLods,
    growing: {} as Growing,
    changed: () => {},
    problem: (error) => {
      throw error;
    },
  });
  const rung = gradesOf(MODEL).find(({ kind, number }) => kind === "rung" && number === 0);
  const want = { object: OBJECT, grade: rung, cause: { kind: "missing" }, priority: 0 } as Want;
  const arrive = () => {
    for (const answer of answers.values()) answer(new ArrayBuffer(2));
  };
  const settle = () => new Promise((resolve) => setTimeout(resolve, 5));
  loads.follow([want]);
  expect([...answers.keys()]).toEqual(["/o/a.gltf", "/o/a.r0.slod"]);
  arrive();
  loads.follow([]);
  await settle();
  expect(decoded).toEqual([]);
  expect(loads.of(3).held).toBeUndefined();
  loads.follow([want]);
  arrive();
  await settle();
  expect(decoded).toEqual([0]);
  expect(loads.of(3).held).toMatchObject({ kind: "rung", number: 0 });
});
