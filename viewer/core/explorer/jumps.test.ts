import { expect, it, vi } from "vitest";
import { explore } from "../../test/explore.ts";
import { PITCH_M } from "../../test/fixture.ts";
import { HeldAnswers } from "../../test/serve.ts";
import type { Vec3 } from "../basics/geometry.ts";

const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];
const isIndex = (path: string) => path.endsWith(".json");
const isRecord = (path: string) => path.endsWith(".cell");
const isLevel = (path: string) => path.endsWith(".glb");
const UNKNOWN = { missing: undefined, visibleCount: undefined, settled: false };

it("what is missing after a jump, and how good the picture is, is unknown until it is known what can be seen there", async () => {
  const held = new HeldAnswers();
  const { explorer, go, quiet } = await explore({ rooms: 12, perChunk: 2, answer: held.answer });
  const waits = () => vi.waitFor(() => expect(held.count).toBeGreaterThan(0));
  expect(explorer, "nowhere yet").toMatchObject(UNKNOWN);
  go(room(0));
  await quiet();
  expect(explorer).toMatchObject({ cellId: 0, missing: 0, settled: true });

  held.hold(isIndex);
  go(room(11));
  await waits();
  expect(explorer, "while the index is asked").toMatchObject({ cellId: 0, ...UNKNOWN });
  expect(explorer.quality()).toBeUndefined();

  held.hold((path) => isRecord(path) || isLevel(path));
  await vi.waitFor(() => expect(explorer.cellId).toBe(22));
  await waits();
  expect(explorer, "while the record is asked for").toMatchObject(UNKNOWN);
  expect(explorer.quality()).toBeUndefined();

  held.hold(isLevel);
  await waits();
  const { lpvs, opvs } = await explorer.record(22);
  await vi.waitFor(() => expect(explorer.visibleCount).toBe(lpvs.length + opvs.length));
  expect(explorer.missing, "while levels are on their way").toBeGreaterThan(0);
  expect(explorer.settled).toBe(false);

  held.release();
  await quiet();
  expect(explorer).toMatchObject({ missing: 0, settled: true });
  expect(explorer.quality()).toEqual({ here: 1, sharp: 1 });
});

it("what is missing stays known on a jump within a cell, and in a world that is whole everywhere", async () => {
  const held = new HeldAnswers();
  const rooms = await explore({ answer: held.answer });
  rooms.go(room(0));
  await rooms.quiet();
  rooms.go([2, 1.6, 2]);
  expect(rooms.explorer).toMatchObject({ cellId: 0, missing: 0, settled: true });
  const whole = await explore({ whole: true, rooms: 8, perChunk: 2, answer: held.answer });
  whole.go(room(0));
  await whole.quiet();
  held.hold(isIndex);
  whole.go(room(7));
  expect([whole.explorer.missing, whole.explorer.quality()?.here]).toEqual([0, 1]);
  held.release();
});

it("nothing is refined while nobody knows in which cell the eye is", async () => {
  const held = new HeldAnswers();
  const { explorer, log, go, quiet } = await explore({ rooms: 8, perChunk: 2, whole: true, answer: held.answer });
  go([0, 1.6, 500]);
  await quiet();
  const { length } = log.entries;
  const finer = () => log.entries.slice(length).filter(({ purpose }) => purpose === "finer");
  const { bounds } = explorer.visible.at(-1)?.entry ?? {};
  held.hold(isIndex);
  go([bounds?.min[0] ?? 0, 1.6, bounds?.min[2] ?? 0]);
  await vi.waitFor(() => expect(held.count).toBeGreaterThan(0));
  await new Promise((resolve) => setTimeout(resolve, 60));
  expect([explorer.settled, finer()]).toEqual([false, []]);
  held.release();
  await quiet();
  expect(explorer.settled).toBe(true);
  expect(finer().length).toBeGreaterThan(0);
});
