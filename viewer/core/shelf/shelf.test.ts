import { describe, expect, it } from "vitest";
import { explore } from "../../test/explore.ts";
import type { Vec3 } from "../basics/geometry.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { webCryptoDigest } from "../fetch/verify.ts";
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

async function opened(cache: Compartments, limit_bytes = 1000, origin = "https://host"): Promise<Shelf> {
  const shelf = await Shelf.open(cache, limit_bytes, origin);
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

  it("takes nothing back that had to go while it was read", async () => {
    const cache = compartments();
    const shelf = await opened(cache, 300);
    for (const i of [1, 2, 3]) shelf.keep(url(i), bytes(100));
    await shelf.done();
    const reading = shelf.read(url(1));
    shelf.keep(url(4), bytes(100));
    await shelf.done();
    await reading;
    expect([shelf.has(url(1)), shelf.bytes]).toEqual([false, 300]);
    expect(await shelf.read(url(1))).toBeUndefined();
    for (const i of [5, 6, 7, 8]) shelf.keep(url(i), bytes(100));
    await shelf.done();
    const objects = [...cache.held].filter(([name]) => !name.endsWith("index"));
    expect([shelf.bytes, objects.length]).toEqual([300, 3]);
  });

  it("keeps rungs, which nothing vouches for, apart by the server that sent them", async () => {
    const cache = compartments();
    const rung = url(1).replace(".glb", ".r0.slod");
    const first = await opened(cache);
    first.keep(rung, bytes(300));
    await first.done();
    const same = await opened(cache);
    expect([same.has(rung), same.has(`/o/${"1".padStart(64, "0")}.r0.slod`), same.size]).toEqual([true, true, 1]);
    expect((await same.read(rung))?.byteLength).toBe(300);
    const other = await opened(cache, 1000, "https://elsewhere");
    expect([other.has(rung), await other.read(rung), other.size]).toEqual([false, undefined, 1]);
    same.forget(rung);
    await same.done();
    expect((await opened(cache)).size).toBe(0);
  });

  it("lets go of rungs that were kept when nobody noted who sent them", async () => {
    const cache = compartments();
    const [rung, object] = [url(1).replace(".glb", ".r0.slod"), url(2)];
    const place = (of: string) => `https://objects.invalid/${of.split("/").at(-1)}`;
    for (const kept of [rung, object]) cache.held.set(place(kept), bytes(300));
    // A server whose own name looks like the end of a rung's.
    const host = `https://${"a".repeat(50)}.r${"b".repeat(8)}.example`;
    const there = await opened(cache, 1000, host);
    there.keep(rung, bytes(200));
    await there.done();
    const list = new TextEncoder().encode(JSON.stringify([[rung.split("/").at(-1), 300]]));
    cache.held.set(place(rung), bytes(300));
    cache.held.set("https://objects.invalid/index", list.buffer);
    const shelf = await opened(cache, 1000, host);
    expect([shelf.has(object), shelf.has(rung), shelf.size, shelf.bytes]).toEqual([true, true, 2, 500]);
    expect(cache.held.has(place(rung))).toBe(false);
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
    expect(await Shelf.open(undefined, 1000, "https://host")).toBeUndefined();
    const refused: Compartments = { open: () => Promise.reject(new DOMException("no", "SecurityError")) };
    expect(await Shelf.open(refused, 1000, "https://host")).toBeUndefined();
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

  it("is not deceived by what another page of its origin has put there under a name that is not its own", async () => {
    const cache = compartments();
    const digest = webCryptoDigest();
    const file = "https://host/o/2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824.bin";
    const ask = async () => {
      const shelf = await opened(cache);
      const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch: async () => new Response("hello"), digest, shelf });
      const come = new TextDecoder().decode(await queue.request(file, 1));
      await shelf.done();
      return [come, queue.tally.requests, queue.tally.kept_bytes];
    };
    expect(await ask()).toEqual(["hello", 1, 0]);
    const name = [...cache.held.keys()].find((one) => one.endsWith(".bin")) ?? "";
    cache.held.set(name, new TextEncoder().encode("wrong").buffer);
    expect(await ask()).toEqual(["hello", 1, 0]);
    expect(await ask()).toEqual(["hello", 0, 5]);
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
