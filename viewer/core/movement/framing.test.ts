import { describe, expect, it } from "vitest";
import type { PublishedScene } from "../atlas/published.ts";
import type { Bounds, Vec3 } from "../basics/geometry.ts";
import { frameOf, type WeightedBounds, withoutBackdrop } from "./framing.ts";

const cube = (x: number, y: number, z: number, half: number, count = 1): WeightedBounds => ({
  bounds: { min: [x - half, y - half, z - half], max: [x + half, y + half, z + half] },
  count,
});
/** Nobody waits for it. */
const LONG = new Promise<void>(() => {});
/** A hall of 4 × 4 exhibits, 2 m apart. */
const EXHIBITS = Array.from({ length: 16 }, (_, i) => cube(2 * (i % 4), 1, 2 * Math.floor(i / 4), 0.5));
const FLOOR: WeightedBounds = { bounds: { min: [-4, -0.1, -4], max: [10, 0, 10] }, count: 1 };
const HALL: Bounds = { min: [-4, -0.1, -4], max: [10, 1.5, 10] };

describe("what belongs into a picture of all", () => {
  it("is no dome of sky around it, in one piece or in several, nor what was left far away", () => {
    const dome = cube(3, 0, 3, 150);
    expect(withoutBackdrop([dome, ...EXHIBITS, FLOOR])).toEqual(HALL);
    const pieces = [0, 1, 2, 3].map((i): WeightedBounds => {
      const min: Vec3 = [i & 1 ? 0 : -150, 0, i & 2 ? 0 : -150];
      return { bounds: { min, max: [min[0] + 150, 100, min[2] + 150] }, count: 1 };
    });
    expect(withoutBackdrop([...EXHIBITS, FLOOR, ...pieces])).toEqual(HALL);
    expect(withoutBackdrop([cube(900, 0, 0, 0.1), ...EXHIBITS, FLOOR])).toEqual(HALL);
  });

  it("is all of a world that grows larger little by little, on ground of its own size", () => {
    const houses = Array.from({ length: 60 }, (_, i) => cube(20 * (i % 8), 4, 20 * Math.floor(i / 8), 5));
    expect(withoutBackdrop([cube(80, 0, 80, 110), ...houses])).toBeUndefined();
    expect(withoutBackdrop([...EXHIBITS, FLOOR])).toBeUndefined();
  });

  it("is all where few things are, or many are far away", () => {
    expect(withoutBackdrop([cube(0, 0, 0, 150), ...EXHIBITS.slice(0, 3)])).toBeUndefined();
    const village = EXHIBITS.slice(0, 8).map(({ bounds: { min, max } }) => {
      const far = (at: Vec3): Vec3 => [at[0] + 500, at[1], at[2]];
      return { bounds: { min: far(min), max: far(max) }, count: 1 };
    });
    expect(withoutBackdrop([...EXHIBITS, ...village])).toBeUndefined();
  });

  it("counts how many objects lie in a box of many", () => {
    const chunks = [cube(0, 0, 0, 3, 64), cube(4, 0, 0, 3, 64), cube(8, 0, 0, 3, 64), cube(0, 0, 0, 200, 40)];
    expect(withoutBackdrop(chunks)?.max).toEqual([11, 3, 3]);
    expect(withoutBackdrop([...chunks.slice(0, 3), cube(0, 0, 0, 200, 90)])).toBeUndefined();
  });
});

describe("the frame of a scene", () => {
  const objects = [cube(3, 0, 3, 150), ...EXHIBITS, FLOOR];
  const bounds: Bounds = { min: [-147, -150, -147], max: [153, 150, 153] };
  const entry = { kind: "chunk", url: "/o/a.json", bytes: 9, first: 0, count: objects.length, bounds };
  const sceneOf = (manifest: object, objectChunk = async (): Promise<unknown> => objects) => {
    const viewpoints = [{ name: "start", position: [0, 1, 0], orientation: [0, 0, 0, 1], cell: 0, isMadeUp: true }];
    const all = { bounds, viewpoints, objects: { entries: [entry] }, whole: undefined, ...manifest };
    return { manifest: all, objectChunk } as unknown as PublishedScene;
  };

  it("is told by a small world with its manifest, else by a few chunks", async () => {
    const never = () => expect.fail("asked");
    expect(await frameOf(sceneOf({ whole: { objects, models: new Map() } }, never), LONG)).toEqual(HALL);
    expect(await frameOf(sceneOf({}), LONG)).toEqual(HALL);
  });

  it("is the box around everything where an author says where to begin, or a chunk cannot be had", async () => {
    expect(await frameOf(sceneOf({ viewpoints: [] }), LONG)).toEqual(bounds);
    expect(
      await frameOf(
        sceneOf({}, () => Promise.reject(new Error("lost"))),
        LONG,
      ),
    ).toEqual(bounds);
  });

  it("is the box around everything when it is enough before a silent chunk has come", async () => {
    const silent = () => new Promise(() => {});
    expect(await frameOf(sceneOf({}, silent), Promise.resolve())).toEqual(bounds);
  });
});
