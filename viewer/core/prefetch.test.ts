import { describe, expect, it, vi } from "vitest";
import { explore, type SetUp } from "../test/explore.ts";
import { PITCH_M } from "../test/fixture.ts";
import { HeldAnswers } from "../test/serve.ts";
import type { Vec3 } from "./geometry.ts";

const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];
/** Its doorways to the rooms before and after it stand in other chunks of the index than it does, or in the same one. */
const HERE = room(1);
/** Waits however long the machine takes. */
const eventually = (check: () => void) => vi.waitFor(check, { timeout: 60_000 });
/** So many levels keep a picture from being whole, and leave room on the line. */
const MOST_HELD = 2;
const isLevel = (path: string) => path.endsWith(".glb") || path.endsWith(".pack");

/** An explorer of many rooms whose first levels come only once they are let. */
async function withSlowLevels(options: SetUp = {}) {
  const held = new HeldAnswers();
  held.hold((path) => isLevel(path) && held.count < MOST_HELD);
  // Few entries of a chunk, so that neighbours have to be asked for.
  const visit = await explore({ rooms: 8, perChunk: 2, answer: held.answer, ...options });
  const release = () => held.release();
  const { explorer, log } = visit;
  /** Waits until levels are all that is on its way, and everything that could be asked for was. */
  const onlyLevels = () =>
    eventually(() => {
      const running = log.entries.filter(({ result }) => result === "running" || result === "waiting");
      expect(held.count).toBeGreaterThan(0);
      expect(explorer.visibleCount).toBeGreaterThan(0);
      expect(running.filter(({ url }) => !isLevel(url))).toEqual([]);
    });
  const pause = () => new Promise((resolve) => setTimeout(resolve, 60));
  return { ...visit, release, onlyLevels, pause };
}

describe("before the first picture of a cell is there", () => {
  it.each([{}, { packed: true }, { whole: true }])(
    "nothing of the cells next door is asked for: %o",
    async (options) => {
      const { explorer, requests, log, go, quiet, release, onlyLevels, pause } = await withSlowLevels(options);
      go(HERE);
      await onlyLevels();
      await pause();
      expect(log.entries.filter(({ purpose }) => purpose === "prefetch")).toEqual([]);
      expect(requests.filter((path) => path.endsWith(".cell") || path.endsWith(".steps")).length).toBe(1);
      expect(explorer.entryOf(1)).toBeUndefined();
      release();
      await quiet();
      expect(explorer).toMatchObject({ settled: true, missing: 0 });
      expect([explorer.entryOf(1)?.cell, explorer.recordOf(1)?.cell]).toEqual([1, 1]);
    },
  );

  it("who walks learns where to go, and no more", async () => {
    const { explorer, requests, go, onlyLevels, pause } = await withSlowLevels();
    go(HERE);
    await onlyLevels();
    go(HERE, [1.5, 0, 0]);
    await eventually(() => expect(explorer.entryOf(1)).toBeDefined());
    await pause();
    expect(requests.filter((path) => path.endsWith(".cell") || path.endsWith(".steps")).length).toBe(1);
  });

  it("what lies ahead waits in the next cell too", async () => {
    const { explorer, log, go, quiet, release } = await withSlowLevels();
    release();
    go(HERE);
    await quiet();
    const { length } = log.entries;
    go(room(4));
    await quiet();
    expect(explorer).toMatchObject({ cellId: 8, settled: true });
    const asked = log.entries.slice(length).map(({ purpose }) => purpose);
    expect(asked).toContain("coarsest");
    expect(asked.slice(0, asked.lastIndexOf("coarsest"))).not.toContain("prefetch");
  });
});
