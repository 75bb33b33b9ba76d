import { describe, expect, it } from "vitest";
import { explore } from "../test/explore.ts";
import { FETCH_DEFAULTS, FetchQueue } from "./fetchqueue.ts";
import type { Vec3 } from "./geometry.ts";
import { type Compartments, Shelf } from "./shelf.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];

/** A cache in memory that outlives the shelf. */
function compartments(): Compartments & { readonly held: Map<string, ArrayBuffer> } {
  const held = new Map<string, ArrayBuffer>();
  return {
    held,
    open: async () => ({
      match: async (url) => {
        const bytes = held.get(url);
        return bytes && new Response(bytes, { headers: { "Content-Length": String(bytes.byteLength) } });
      },
      put: async (url, bytes) => {
        held.set(url, bytes);
      },
      delete: async (url) => held.delete(url),
      keys: async () => [...held.keys()].map((url) => ({ url })),
    }),
  };
}

const url = (i: number) => `https://host/o/${i.toString(16).padStart(64, "0")}.glb`;
const bytes = (length: number) => new ArrayBuffer(length);

async function opened(cache: Compartments, limit_bytes = 1000): Promise<Shelf> {
  const shelf = await Shelf.open(cache, limit_bytes);
  if (!shelf) throw new Error("there is no shelf");
  return shelf;
}

describe("the shelf", () => {
  it("keeps objects for the next visit, and nothing else", async () => {
    const cache = compartments();
    const first = await opened(cache);
    first.keep(url(1), bytes(300));
    first.keep("https://host/v1/scenes/rooms/index.json", bytes(10));
    first.keep("https://host/o/bundle/a+b", bytes(10));
    await first.done();
    const second = await opened(cache);
    expect([second.bytes, second.size, second.has(url(1))]).toEqual([300, 1, true]);
    expect((await second.read(url(1).replace("host", "elsewhere")))?.byteLength).toBe(300);
    expect(await second.read(url(2))).toBeUndefined();
  });

  it("keeps to its limit, and what was used longest ago goes first", async () => {
    const shelf = await opened(compartments());
    for (const i of [1, 2, 3]) shelf.keep(url(i), bytes(300));
    await shelf.done();
    await shelf.read(url(1));
    shelf.keep(url(4), bytes(300));
    shelf.keep(url(5), bytes(1001));
    await shelf.done();
    expect([1, 2, 3, 4, 5].map((i) => shelf.has(url(i)))).toEqual([true, false, true, true, false]);
    expect(shelf.bytes).toBe(900);
  });

  it("takes a smaller limit, and what another tab has kept, into account", async () => {
    const cache = compartments();
    const [one, other] = [await opened(cache), await opened(cache)];
    one.keep(url(1), bytes(300));
    other.keep(url(2), bytes(300));
    await Promise.all([one.done(), other.done()]);
    expect((await opened(cache)).bytes).toBe(600);
    expect((await opened(cache, 400)).bytes).toBe(300);
  });

  it("answers nothing for what the browser has thrown away", async () => {
    const cache = compartments();
    const shelf = await opened(cache);
    shelf.keep(url(1), bytes(300));
    await shelf.done();
    cache.held.clear();
    expect(await shelf.read(url(1))).toBeUndefined();
    await shelf.done();
    expect(shelf.has(url(1))).toBe(false);
  });

  it("can be cleared", async () => {
    const cache = compartments();
    const shelf = await opened(cache);
    shelf.keep(url(1), bytes(300));
    await shelf.clear();
    expect([shelf.bytes, shelf.size, shelf.has(url(1))]).toEqual([0, 0, false]);
    expect((await opened(cache)).size).toBe(0);
  });

  it("is not there where browsers have none, or refuse it", async () => {
    expect(await Shelf.open(undefined, 1000)).toBeUndefined();
    const refused: Compartments = { open: () => Promise.reject(new DOMException("no", "SecurityError")) };
    expect(await Shelf.open(refused, 1000)).toBeUndefined();
  });
});

describe("an explorer that was here before", () => {
  it.each([false, true])("fetches nothing again but the pointer (bundles: %s)", async (bundles) => {
    const cache = compartments();
    const visit = async () => {
      const shelf = await opened(cache, 1e9);
      const { explorer, requests, problems, scene, go, quiet } = await explore({ bundles, smooth: true, shelf });
      go(ROOM_0);
      await quiet();
      await shelf.done();
      expect([problems, explorer.settled, explorer.missing]).toEqual([[], true, 0]);
      return { requests, tally: scene.queue.tally, grades: explorer.residency.grades() };
    };
    const first = await visit();
    const second = await visit();
    expect(first.tally.kept_bytes).toBe(0);
    expect(second.requests).toEqual(["/v1/scenes/rooms/index.json"]);
    expect(second.tally.kept_bytes).toBeGreaterThan(1000);
    expect(second.grades).toEqual(first.grades);
  });

  it("need not travel for what is kept", async () => {
    const shelf = await opened(compartments());
    shelf.keep(url(1), bytes(300));
    await shelf.done();
    const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch, digest: undefined, shelf });
    expect(queue.cost_bytes({ url: url(1), bytes: 300 })).toBe(0);
    expect(queue.cost_bytes({ url: url(2), bytes: 300 })).toBeGreaterThan(0);
  });

  it("does not keep rungs that turn out to be damaged", async () => {
    const cache = compartments();
    const shelf = await opened(cache, 1e9);
    const { explorer, go, quiet } = await explore({
      smooth: true,
      shelf,
      spoil: (files) => {
        for (const [path, sound] of files) {
          if (path.endsWith(".r1.slod"))
            files.set(
              path,
              sound.map((byte, i) => (i === sound.length - 9 ? byte ^ 4 : byte)),
            );
        }
      },
    });
    go([5.5, 1.6, 5.5]);
    await quiet();
    go([1.5, 0.5, 2.4]);
    await quiet();
    await shelf.done();
    expect(explorer.models.noteOf(3)).toBeDefined();
    expect([...cache.held.keys()].filter((name) => name.endsWith(".slod"))).toEqual([]);
    expect(shelf.size).toBeGreaterThan(5);
  });
});
