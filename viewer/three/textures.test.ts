import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { TextureCache } from "./textures.ts";

const ENCODED = new ArrayBuffer(8);
/** Of 4 × 4 pixels. */
const BYTES = Math.round(16 * (4 * (4 / 3) + 4));

/** Pictures that are being decoded; each is done when its turn is called. */
let turns: (() => void)[] = [];
let closed = 0;

beforeEach(() => {
  turns = [];
  closed = 0;
  const close = () => {
    closed += 1;
  };
  const decode = () => new Promise((resolve) => turns.push(() => resolve({ width: 4, height: 4, close })));
  vi.stubGlobal("createImageBitmap", decode);
});

afterEach(() => void vi.unstubAllGlobals());

/** A cache that holds a picture with one user. */
async function holding(url: string): Promise<TextureCache> {
  const cache = new TextureCache();
  const acquired = cache.acquire([url], new Map([[url, ENCODED]]));
  turns.shift()?.();
  await acquired;
  return cache;
}

it("says of each picture what it takes, whoever brought it", async () => {
  const cache = await holding("/o/wood.png");
  const { pictures, failed } = await cache.acquire(["/o/wood.png"], new Map());
  expect([[...pictures], failed.size]).toEqual([[["/o/wood.png", BYTES]], 0]);
  cache.release("/o/wood.png");
  expect([cache.holds("/o/wood.png"), closed]).toEqual([true, 0]);
  cache.release("/o/wood.png");
  expect([cache.holds("/o/wood.png"), closed]).toEqual([false, 1]);
});

it("what is held is taken at once, so that it cannot go while another picture is decoded", async () => {
  const cache = await holding("/o/wood.png");
  const acquired = cache.acquire(["/o/stone.png", "/o/wood.png"], new Map([["/o/stone.png", ENCODED]]));
  cache.release("/o/wood.png");
  turns.shift()?.();
  const { pictures, failed } = await acquired;
  expect([[...pictures.keys()].sort(), failed.size]).toEqual([["/o/stone.png", "/o/wood.png"], 0]);
  expect(cache.holds("/o/wood.png")).toBe(true);
});

it("what is decoded twice at once is held once", async () => {
  const cache = new TextureCache();
  const encoded = new Map([["/o/wood.png", ENCODED]]);
  const both = [cache.acquire(["/o/wood.png"], encoded), cache.acquire(["/o/wood.png"], encoded)];
  for (const done of turns) done();
  const taken = await Promise.all(both);
  expect(taken.map(({ pictures }) => pictures.get("/o/wood.png"))).toEqual([BYTES, BYTES]);
  expect(closed).toBe(1);
  cache.release("/o/wood.png");
  expect(cache.holds("/o/wood.png")).toBe(true);
});

it("what cannot be had is named, and the others are there", async () => {
  const cache = await holding("/o/wood.png");
  const { pictures, failed } = await cache.acquire(["/o/gone.png", "/o/wood.png"], new Map());
  expect([[...pictures.keys()], [...failed.keys()]]).toEqual([["/o/wood.png"], ["/o/gone.png"]]);
});
