import { describe, expect, it } from "vitest";
import { explore } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import { IncompleteMapError } from "./lostpages.ts";
import { bySolidAngle } from "./surroundings.ts";

const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];

/** The chunks of the index of cells, with the first cell of each. */
function cellChunks(files: Files): { path: string; first: number }[] {
  return [...files].flatMap(([path, bytes]) => {
    if (!path.endsWith(".json")) return [];
    const { cells, start } = JSON.parse(new TextDecoder().decode(bytes));
    if (!Array.isArray(cells) || start) return [];
    return [{ path, first: Number(cells[0].cell.slice(1)) }];
  });
}

/** Takes those chunks away; answers how to put them back. */
function lose(files: Files, which: (first: number) => boolean): () => void {
  const lost = cellChunks(files).filter(({ first }) => which(first));
  expect(lost.length).toBeGreaterThan(0);
  const before = lost.map(({ path }) => [path, files.get(path) ?? new Uint8Array()] as const);
  for (const [path] of before) files.delete(path);
  return () => {
    for (const [path, bytes] of before) files.set(path, bytes);
  };
}

describe("where a chunk of the map of cells is lost", () => {
  it("the nearest cell that is known has to do, and that is told once, until one tries again", async () => {
    let restore = () => {};
    const spoil = (files: Files) => {
      restore = lose(files, (first) => first === 0);
    };
    const { explorer, problems, requests, go, quiet } = await explore({ perChunk: 3, spoil });
    go(room(0));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 3, inside: false, settled: true, missing: 0 });
    expect(problems).toEqual([expect.any(IncompleteMapError)]);
    expect(explorer.notes).toEqual([expect.stringContaining("the map of cells is incomplete")]);
    const before = requests.length;
    for (const x of [1, 2, 3]) {
      go([x, 1.6, 3]);
      await quiet();
    }
    expect([requests.length, problems.length]).toEqual([before, 1]);
    restore();
    explorer.retry();
    await quiet();
    go([1.2, 1.6, 3]);
    await quiet();
    expect(explorer).toMatchObject({ cellId: 0, inside: true, settled: true, missing: 0, notes: [] });
    expect(problems.length).toBe(1);
  });

  it("damaged or unreadable ones are done without as well", async () => {
    const spoil = (files: Files) => {
      for (const { path, first } of cellChunks(files)) if (first === 3) files.set(path, new TextEncoder().encode("{}"));
    };
    const { explorer, problems, go, quiet } = await explore({ perChunk: 3, spoil });
    go(room(0));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 0, settled: true });
    go(room(2));
    await quiet();
    expect(explorer).toMatchObject({ inside: false, settled: true, missing: 0 });
    expect(problems).toEqual([expect.any(IncompleteMapError)]);
    expect([explorer.isLost(4), explorer.isLost(0), explorer.isLost(7)]).toEqual([true, false, false]);
  });

  it("what is next door is learnt as far as it is there", async () => {
    const { explorer, problems, go, quiet } = await explore({
      perChunk: 3,
      spoil: (files) => void lose(files, (first) => first === 3),
    });
    go(room(1));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 2, settled: true });
    expect(explorer.recordOf(1)?.cell).toBe(1);
    expect(explorer.isLost(3)).toBe(true);
    expect(problems).toEqual([expect.any(IncompleteMapError)]);
  });
});

describe("where no cell is known at all", () => {
  it("everything of a small world is shown, what fills most of the view first", async () => {
    let restore = () => {};
    const { explorer, problems, scene, go, quiet } = await explore({
      whole: true,
      spoil: (files) => {
        restore = lose(files, () => true);
      },
    });
    go(room(4));
    await quiet();
    expect(explorer).toMatchObject({ cellId: undefined, settled: true, missing: 0, holes: 0 });
    expect(explorer.visible.length).toBe(scene.manifest.counts.objects);
    expect(explorer.visible).toEqual(bySolidAngle(explorer.visible, room(4)));
    expect(explorer.visible[0]?.entry.sourceNode).not.toMatch(/ 0$/);
    expect(problems).toEqual([expect.any(IncompleteMapError)]);
    const { loaded_bytes, total_bytes } = explorer.progress() ?? {};
    expect(loaded_bytes).toBe(total_bytes);
    restore();
    explorer.retry();
    await quiet();
    expect(explorer).toMatchObject({ cellId: 8, settled: true });
  });

  it("what is around is shown of a larger one, and the first cell that is found takes its place", async () => {
    let restore = () => {};
    const { explorer, problems, go, quiet } = await explore({
      rooms: 24,
      spoil: (files) => {
        restore = lose(files, () => true);
      },
    });
    go(room(0));
    await quiet();
    expect(explorer).toMatchObject({ cellId: undefined, settled: true, missing: 0, holes: 0 });
    const names = explorer.visible.map(({ entry }) => entry.sourceNode);
    expect(names).toContain("ball 0 0");
    expect(names).not.toContain("floor 23");
    expect(explorer.quality()?.here).toBe(1);
    go(room(23));
    await quiet();
    expect(explorer.visible.map(({ entry }) => entry.sourceNode)).toContain("floor 23");
    expect(problems.length).toBe(1);
    restore();
    explorer.retry();
    await quiet();
    expect(explorer).toMatchObject({ cellId: 46, settled: true });
    expect((await explorer.record(46)).opvs.length).toBeLessThan(explorer.visible.length);
  });

  it("a lost record of the first cell is no reason to show nothing", async () => {
    const { explorer, problems, go, quiet } = await explore({
      spoil: (files) => {
        for (const path of [...files.keys()]) if (/\.(cell|steps)$/.test(path)) files.delete(path);
      },
    });
    go(room(0));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0 });
    expect(explorer.visible.length).toBeGreaterThan(0);
    expect(problems.length).toBe(1);
  });
});
