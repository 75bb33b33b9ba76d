import { describe, expect, it, vi } from "vitest";
import { explore, type SetUp } from "../../test/explore.ts";
import { PITCH_M } from "../../test/fixture.ts";
import { HeldAnswers } from "../../test/serve.ts";
import type { Vec3 } from "../basics/geometry.ts";

const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];
/** Its doorways to the rooms before and after it stand in other chunks of the index than it does, or in the same one. */
const HERE = room(1);
/** Who goes there comes through a doorway into the room beyond, from which one sees what cannot be seen from here. */
const AHEAD: Vec3 = [1.5, 0, 0];
const BEYOND = 4;
/** Waits however long the machine takes. */
const eventually = (check: () => void) => vi.waitFor(check, { timeout: 60_000 });
/** So many levels keep a picture from being whole, and leave room on the line. */
const MOST_HELD = 2;
const isLevel = (path: string) => path.endsWith(".glb") || path.endsWith(".pack");

/** An explorer of many rooms that is answered as the test says, and what it asked for. */
async function prepared(options: SetUp = {}) {
  const held = new HeldAnswers();
  // Few entries of a chunk, so that neighbours have to be asked for.
  const visit = await explore({ rooms: 8, perChunk: 2, answer: held.answer, ...options });
  const { log, requests } = visit;
  const holdLevels = () => held.hold((path) => isLevel(path) && held.count < MOST_HELD);
  /** What requests were for, in the order in which they went. */
  const purposes = () => {
    const all = new Map(log.entries.map(({ url, purpose }) => [url, purpose]));
    return requests.map((path) => all.get(`https://host/sub${path}`));
  };
  /** What levels were asked for, in the order of asking. */
  const levels = () => log.entries.filter(({ url }) => isLevel(url)).map(({ purpose }) => purpose);
  /** Waits until levels are all that is on its way, and everything that could be asked for was. */
  const onlyLevels = async () => {
    await eventually(() => {
      const running = log.entries.filter(({ result }) => result === "running" || result === "waiting");
      expect(held.count).toBeGreaterThan(0);
      expect(visit.explorer.visibleCount).toBeGreaterThan(0);
      expect(running.filter(({ url }) => !isLevel(url))).toEqual([]);
    });
    await new Promise((resolve) => setTimeout(resolve, 60));
  };
  return { ...visit, held, holdLevels, purposes, levels, onlyLevels };
}

describe("before the first picture is there", () => {
  it.each([{}, { packed: true }, { whole: true }])(
    "what is next door is read of once all is asked for that is missing: %o",
    async (options) => {
      const { explorer, held, holdLevels, purposes, onlyLevels, go, quiet } = await prepared(options);
      holdLevels();
      go(HERE);
      await eventually(() => expect(explorer.recordOf(1)).toBeDefined());
      await onlyLevels();
      expect(explorer.missing).toBeGreaterThan(0);
      const went = purposes();
      expect(went).toContain("coarsest");
      expect(went.indexOf("prefetch")).toBeGreaterThan(went.lastIndexOf("coarsest"));
      held.release();
      await quiet();
      expect(explorer).toMatchObject({ settled: true, missing: 0 });
    },
  );

  it("what lies ahead is read of, and not fetched", async () => {
    const { explorer, held, holdLevels, levels, onlyLevels, go, quiet } = await prepared();
    holdLevels();
    go(HERE, AHEAD);
    await eventually(() => expect(explorer.prepares(BEYOND)).toBe(true));
    await onlyLevels();
    expect(explorer.recordOf(BEYOND)).toBeDefined();
    expect(explorer.missing).toBeGreaterThan(0);
    expect(levels()).not.toContain("prefetch");
    held.release();
    await quiet();
    expect(levels()).toContain("prefetch");
  });

  it("who stands still waits for hulls next door until one knows what can be seen, and who walks does not", async () => {
    const { explorer, held, go } = await prepared();
    held.hold((path) => path.endsWith(".cell"));
    go(HERE);
    await eventually(() => expect(held.count).toBe(1));
    await new Promise((resolve) => setTimeout(resolve, 60));
    expect(explorer.entryOf(1)).toBeUndefined();
    go(HERE, AHEAD);
    await eventually(() => expect(explorer.entryOf(1)).toBeDefined());
    expect([explorer.visibleCount, held.count]).toEqual([undefined, 1]);
    held.release();
  });
});

it("after the first picture what lies ahead comes behind what is missing elsewhere, and does not wait until that is there", async () => {
  const { explorer, held, holdLevels, levels, go, quiet } = await prepared();
  go(HERE);
  await quiet();
  const before = levels().length;
  const since = () => levels().slice(before);
  holdLevels();
  go(room(4), AHEAD);
  await eventually(() => expect(since()).toContain("prefetch"));
  expect(explorer.cellId).toBe(8);
  expect(explorer.missing).toBe(MOST_HELD);
  expect(since().indexOf("prefetch")).toBeGreaterThan(since().lastIndexOf("coarsest"));
  held.release();
  await quiet();
  expect(explorer).toMatchObject({ settled: true, missing: 0 });
});
