import { describe, expect, it, vi } from "vitest";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { FetchQueue } from "../fetch/fetchqueue.ts";
import { FetchError } from "../fetch/transfer.ts";
import type { Tree } from "../fetch/tree.ts";
import { FrameBudget } from "../pace/framebudget.ts";
import { goalOf, gradesOf } from "../strategy/grade.ts";
import type { Want } from "../strategy/priority.ts";
import { ResidencySet } from "../strategy/residency.ts";
import type { Growing } from "./growing.ts";
import { type ModelHost, ModelLoads } from "./modelloads.ts";
import type { SmoothLods } from "./smoothlods.ts";

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

const settle = () => new Promise((resolve) => setTimeout(resolve, 5));

/** Loads rungs of that model, which a renderer takes in; its other methods do nothing. */
function setUp(host: Pick<ModelHost, "decode">, budget = new FrameBudget(1e9, () => 0)) {
  const answers = new Map<string, (bytes: ArrayBuffer) => void>();
  const losses = new Map<string, (error: unknown) => void>();
  const decoded: number[] = [];
  const changed = vi.fn();
  const forgotten = vi.fn();
  const loads = new ModelLoads({
    queue: {
      request: (url: string) =>
        new Promise<ArrayBuffer>((resolve, reject) => {
          answers.set(url, resolve);
          losses.set(url, reject);
        }),
      forget: forgotten,
      cancel: () => {},
      reprioritise: () => {},
    } as unknown as FetchQueue,
    tree: { resolve: (url: string) => url } as unknown as Tree,
    host: { needsTexture: () => true, ...host } as unknown as ModelHost,
    residency: new ResidencySet(1e9),
    budget,
    smooth: {
      refine: async (_: number, __: object, rung: number) => {
        decoded.push(rung);
        return { glb: new ArrayBuffer(1), state_bytes: 0 };
      },
      close: forgotten,
      taken: () => 0,
      end: () => {},
    } as unknown as SmoothLods,
    growing: { end: () => {} } as unknown as Growing,
    changed,
    problem: (error) => {
      throw error;
    },
  });
  const rung = gradesOf(MODEL).find(({ kind, number }) => kind === "rung" && number === 0);
  const want = { object: OBJECT, grade: rung, cause: { kind: "missing" }, priority: 0 } as Want;
  const arrive = () => {
    for (const answer of answers.values()) answer(new ArrayBuffer(2));
  };
  return { loads, want, answers, losses, arrive, decoded, changed, forgotten };
}

it("a load that is cancelled when all of it has come decodes nothing", async () => {
  const host = { decode: async () => ({ bytes: 1, draw: () => {}, release: () => {} }) };
  const { loads, want, answers, arrive, decoded } = setUp(host);
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

it("rungs that are left for levels let these be planned at once, are told as no loss, and may come another time", async () => {
  const { loads, want, losses, changed, forgotten } = setUp({
    decode: () => Promise.reject(new Error("nothing came")),
  });
  loads.follow([want]);
  const url = "/o/a.r0.slod";
  losses.get(url)?.(new FetchError("forgone", url, "all of its stream would come"));
  await settle();
  expect(changed).toHaveBeenCalledTimes(1);
  expect(goalOf(MODEL, 0, loads.of(3), () => 0)?.kind).toBe("level");
  const failed = new Set([...loads.of(3).failed, "level 0"]);
  expect(
    goalOf(MODEL, 0, { ...loads.of(3), failed }, () => 0),
    "they are asked for no more",
  ).toBeUndefined();
  expect([loads.notes, forgotten.mock.calls]).toEqual([[], []]);
  loads.forgive("passing");
  expect(loads.of(3).failed.size).toBe(0);
});

describe("what the graphics card gets ready for", () => {
  const slow = () => {
    const clock = { now_ms: 0 };
    const budget = new FrameBudget(1e9, () => clock.now_ms);
    const happened: string[] = [];
    let prepared = () => {};
    const ready = new Promise<void>((resolve) => {
      prepared = resolve;
    });
    const decode = async () => {
      clock.now_ms += 2;
      happened.push("decoded");
      return {
        bytes: 1,
        ready,
        draw: (part: string) => happened.push(`drawn as ${part}`),
        release: () => happened.push("released"),
      };
    };
    const made = setUp({ decode }, budget);
    made.loads.follow([made.want]);
    made.arrive();
    return { ...made, clock, budget, happened, prepared: () => prepared() };
  };

  it("takes no time of frames meanwhile, and holds up no other work", async () => {
    const { loads, clock, budget, happened, prepared } = slow();
    await settle();
    expect(happened).toEqual(["decoded"]);
    clock.now_ms += 5000;
    void budget.run(() => happened.push("others"));
    void budget.begin(async () => happened.push("a request"));
    await settle();
    expect([happened, budget.taken_ms]).toEqual([["decoded", "others", "a request"], 2]);
    expect([loads.isComing(3), loads.of(3).held]).toEqual([true, undefined]);
    prepared();
    await settle();
    expect([happened.at(-1), budget.taken_ms]).toEqual(["drawn as base", 2]);
    expect([loads.isComing(3), loads.of(3).held?.number]).toEqual([false, 0]);
  });

  it("goes without being drawn where all is cancelled meanwhile", async () => {
    const { loads, happened, prepared } = slow();
    await settle();
    loads.close();
    prepared();
    await settle();
    expect(happened).toEqual(["decoded", "released"]);
    expect(loads.of(3).held).toBeUndefined();
  });

  it("is drawn before what is still to be decoded", async () => {
    const { budget, happened, prepared } = slow();
    await settle();
    let over = () => {};
    void budget.run(
      () =>
        new Promise<void>((resolve) => {
          over = resolve;
        }),
    );
    void budget.run(() => happened.push("the next"));
    prepared();
    await settle();
    over();
    await settle();
    expect(happened).toEqual(["decoded", "drawn as base", "the next"]);
  });
});
