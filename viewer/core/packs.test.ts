import { describe, expect, it } from "vitest";
import type { Level } from "./documents.ts";
import { outOf, packsWorth } from "./packs.ts";
import { type CostOf, costAlone_bytes } from "./travel.ts";

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
    expect(worth([level(0, 30)], () => 0)).toEqual(new Map([["/o/a.pack", 1]]));
  });

  it("give each level its bytes, or nothing when they are too short", () => {
    const whole = Uint8Array.from({ length: 100 }, (_, i) => i).buffer;
    const pack = { url: "/o/a.pack", bytes: 100, from: 30 };
    expect([...new Uint8Array(outOf(whole, pack, level(30, 3)) ?? [])]).toEqual([30, 31, 32]);
    expect(outOf(whole, pack, level(30, 71))).toBeUndefined();
  });
});
