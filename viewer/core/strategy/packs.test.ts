import { describe, expect, it, vi } from "vitest";
import { explore } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { Level } from "../documents/modeldocument.ts";
import { type CostOf, costAlone_bytes } from "./file.ts";
import { packsWorth } from "./packs.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];

const level = (from: number, bytes: number, url = "/o/a.pack"): Level => ({
  level: 0,
  url: `/o/${from}.glb`,
  bytes,
  triangles: 1,
  geometricError: 0,
  textures: [],
  pack: { url, bytes: 100, from },
});

describe("packs", () => {
  it("are worth fetching when at least half of their bytes is wanted, each file counted once", () => {
    const worth = (levels: Level[], costOf: CostOf = costAlone_bytes) => packsWorth(levels, costOf);
    expect(worth([level(0, 30), level(30, 20)])).toEqual(new Map([["/o/a.pack", 2]]));
    expect(worth([level(0, 30), level(0, 30)])).toEqual(new Map());
    expect(worth([level(0, 30), level(30, 20, "/o/b.pack")])).toEqual(new Map());
    expect(worth([{ ...level(0, 100), pack: undefined }])).toEqual(new Map());
    const costsNothing =
      (...urls: string[]): CostOf =>
      (file) =>
        urls.includes(file.url) ? 0 : costAlone_bytes(file);
    expect(worth([level(0, 30)], costsNothing("/o/a.pack"))).toEqual(new Map([["/o/a.pack", 1]]));
    expect(worth([level(0, 30), level(30, 40)], costsNothing("/o/30.glb")), "one is here").toEqual(new Map());
  });
});

/** Waits however long the machine takes. */
const eventually = (check: () => void) => vi.waitFor(check, { timeout: 60_000 });
const isPack = (path: string) => path.endsWith(".pack");
const isGlb = (path: string) => path.endsWith(".glb");

/** An explorer in the first room whose pack comes only as far as it is let. */
async function withSlowPack() {
  let pack: ReadableStreamDefaultController<Uint8Array> | undefined;
  let whole = new Uint8Array();
  const visit = await explore({
    packed: true,
    answer: (path, bytes) => {
      if (!isPack(path)) return undefined;
      whole = new Uint8Array(bytes);
      return new ReadableStream({
        start: (controller) => {
          pack = controller;
        },
      });
    },
  });
  let sent = 0;
  /** Lets the pack come up to a share of it. */
  const send = (share: number, damage: (bytes: Uint8Array) => Uint8Array = (bytes) => bytes) => {
    const to = Math.ceil(share * whole.length);
    pack?.enqueue(damage(whole.slice(sent, to)));
    sent = to;
  };
  visit.go(ROOM_0);
  await eventually(() => expect(pack).toBeDefined());
  const { host } = visit;
  /** Models out of the pack that are drawn: no pedestals, which stand in none. */
  const drawn = () => new Set(host.uploads.flatMap(({ model }) => (model < 5 ? [model] : [])));
  /** Waits until more of them are drawn than before. */
  const draws = (before: number) => eventually(() => expect(drawn().size).toBeGreaterThan(before));
  const end = () => pack?.close();
  /** What has come in the end is all of the room, whatever became of its pack, which was asked for once. */
  const hasAll = () => {
    expect(visit.problems).toEqual([]);
    expect(visit.explorer).toMatchObject({ settled: true, missing: 0, holes: 0 });
    expect(visit.requests.filter(isPack).length).toBe(1);
  };
  const breakOff = () => pack?.error(new TypeError("the line broke"));
  return { ...visit, send, drawn, draws, end, breakOff, hasAll };
}

describe("a pack that is still coming", () => {
  it("gives each level as soon as that has come, counts what has come, and is fetched once", async () => {
    const { explorer, scene, quiet, send, drawn, draws, end, hasAll } = await withSlowPack();
    const loaded: number[] = [];
    for (const share of [0.3, 0.6, 0.999]) {
      const before = drawn().size;
      send(share);
      await draws(before);
      loaded.push(explorer.progress()?.loaded_bytes ?? 0);
    }
    expect(loaded).toEqual([...loaded].sort((a, b) => a - b));
    expect(loaded.at(-1)).toBeLessThan(explorer.progress()?.total_bytes ?? 0);
    expect(explorer.settled).toBe(false);
    send(1);
    end();
    await quiet();
    hasAll();
    expect(scene.queue.pending).toBe(0);
    const { loaded_bytes, total_bytes } = explorer.progress() ?? {};
    expect(loaded_bytes).toBe(total_bytes);
  });

  it("counts the part of a level that has come", async () => {
    const { explorer, send } = await withSlowPack();
    const loaded = () => explorer.progress()?.loaded_bytes ?? 0;
    for (const share of [0.01, 0.02, 0.03]) {
      const before = loaded();
      send(share);
      await eventually(() => expect(loaded()).toBeGreaterThan(before));
    }
  });

  it("that breaks off keeps what was right, and the rest is fetched alone", async () => {
    const { host, requests, quiet, send, drawn, draws, breakOff, hasAll } = await withSlowPack();
    send(0.6);
    await draws(0);
    const kept = drawn();
    const before = host.uploads.length;
    const alone = requests.filter(isGlb).length;
    breakOff();
    await quiet();
    hasAll();
    expect(requests.filter(isGlb).length).toBeGreaterThan(alone);
    const again = host.uploads.slice(before).filter(({ model, missing }) => missing !== 0 && kept.has(model));
    expect(again).toEqual([]);
  });

  it("that is damaged somewhere brings the other levels", async () => {
    const { scene, quiet, send, end, hasAll } = await withSlowPack();
    send(0.02);
    send(0.04, (bytes) => bytes.map((byte) => byte ^ 1));
    send(1);
    end();
    await quiet();
    hasAll();
    expect(scene.queue.tally.retries).toBe(0);
  });
});

it("a pack that was damaged is not kept, and one that was right is", async () => {
  const spoil = (files: Files) => {
    for (const [path, bytes] of files)
      if (isPack(path))
        files.set(
          path,
          bytes.map((byte, i) => (i === 9 ? 1 : byte)),
        );
  };
  for (const damaged of [true, false]) {
    const kept: string[] = [];
    const shelf = { has: () => false, read: async () => undefined, keep: (url: string) => kept.push(url) };
    const { go, quiet, explorer } = await explore({
      packed: true,
      shelf: shelf as never,
      ...(damaged && { spoil }),
    });
    go([PITCH_M + 1, 1.6, 3]);
    await quiet();
    expect(explorer).toMatchObject({ settled: true, missing: 0 });
    expect(kept.some(isPack)).toBe(!damaged);
  }
});
