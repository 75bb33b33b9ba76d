import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { explore } from "../test/explore.ts";
import { PITCH_M } from "../test/fixture.ts";
import type { Vec3 } from "./geometry.ts";
import type { Silence } from "./silences.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];
const STALL_MS = 20_000;
/** Answers are verified by other threads, which take real time while this one lets hours pass. */
const SOON = { timeout: STALL_MS };

beforeEach(() => void vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"], shouldAdvanceTime: true }));
afterEach(() => void vi.useRealTimers());

/** Lets a time pass, and what follows from that happen. */
async function pass(ms: number): Promise<void> {
  for (let left_ms = ms; left_ms > 0; left_ms -= 500) {
    vi.advanceTimersByTime(Math.min(500, left_ms));
    for (const _ of [1, 2, 3]) await new Promise((resolve) => setImmediate(resolve));
  }
}

/** Rooms whose server begins to answer some files only after a time. */
async function slow(isSlow: (path: string, bytes: Uint8Array) => boolean, first_ms: number, started = false) {
  const told: (Silence | undefined)[] = [];
  const delays_ms = { now: 0 };
  let delayed = 0;
  const explored = await explore({
    rooms: 24,
    perChunk: 2,
    started,
    silent: (silence) => told.push(silence),
    answerAfter_ms: (path, bytes) => {
      if (delays_ms.now === 0 || !isSlow(path, bytes)) return 0;
      delayed += 1;
      return delays_ms.now;
    },
  });
  delays_ms.now = first_ms;
  /** Waits until something slow is asked for. */
  const asked = () => vi.waitFor(() => expect(delayed).toBeGreaterThan(0), SOON);
  return { ...explored, told, delays_ms, asked };
}

const saysCells = (_: string, bytes: Uint8Array) => new TextDecoder().decode(bytes).startsWith('{"cells"');

it("a map that takes 50 s to begin comes, one is told of that from the first 20 s, and sees what is around meanwhile", async () => {
  const { explorer, told, problems, go, asked } = await slow(saysCells, 50_000);
  go(ROOM_0);
  await asked();
  await pass(STALL_MS / 2);
  expect(told).toEqual([]);
  await pass(STALL_MS);
  expect(told[0]).toMatchObject({ attempt: 1, attempts: 4, waited_ms: STALL_MS });
  expect(explorer.cellId).toBeUndefined();
  await vi.waitFor(() => expect(explorer.visible.length).toBeGreaterThan(0), SOON);
  expect(explorer).toMatchObject({ settled: false, visibleCount: undefined });
  for (let tens = 0; tens < 90 && explorer.pending > 0; tens += 1) await pass(STALL_MS / 2);
  expect(explorer).toMatchObject({ cellId: 0, settled: true, missing: 0 });
  expect([problems, told.at(-1)]).toEqual([[], undefined]);
  explorer.close();
});

it("the end of all tries is told, and what is around stays", async () => {
  const { explorer, told, problems, go, delays_ms, asked } = await slow(saysCells, 1e9);
  go(ROOM_0);
  await asked();
  for (let tens = 0; tens < 90 && problems.length === 0; tens += 1) await pass(STALL_MS / 2);
  expect(told.filter((silence) => silence !== undefined).length).toBeGreaterThanOrEqual(3);
  expect(String(problems[0])).toContain("map of cells is incomplete");
  await vi.waitFor(() => expect(explorer.visible.length).toBeGreaterThan(0), SOON);
  delays_ms.now = 0;
  explorer.retry();
  await pass(STALL_MS);
  await vi.waitFor(() => expect(explorer.cellId).toBe(0), SOON);
  explorer.close();
});

it("a start that takes long is done without", async () => {
  const isStart = (_: string, bytes: Uint8Array) => new TextDecoder().decode(bytes).startsWith('{"start"');
  const { explorer, told, go, asked } = await slow(isStart, 1e9, true);
  go(ROOM_0);
  await asked();
  await pass(STALL_MS + 5000);
  await vi.waitFor(() => expect(explorer.cellId).toBe(0), SOON);
  expect(told.filter((silence) => silence !== undefined).length).toBe(1);
  explorer.close();
});

it("what sends its header and takes its time, again and again, is not given up", async () => {
  const isModel = (path: string) => path.endsWith(".glb");
  const { explorer, told, problems, go, asked } = await slow(isModel, STALL_MS - 1000);
  go([PITCH_M + 1, 1.6, 3]);
  await asked();
  for (let tens = 0; tens < 90 && explorer.pending > 0; tens += 1) await pass(STALL_MS / 2);
  expect(explorer).toMatchObject({ settled: true, missing: 0 });
  expect([told, problems]).toEqual([[], []]);
  explorer.close();
});
