import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { explore } from "../../test/explore.ts";
import { PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";
import type { Silence } from "./silences.ts";

const ROOM_0: Vec3 = [1, 1.6, 3];
const [STALL_MS, QUIET_MS] = [20_000, 4000];
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
async function slow(
  isSlow: (path: string, bytes: Uint8Array) => boolean,
  first_ms: number,
  started = false,
  bundles = false,
) {
  const told: (Silence | undefined)[] = [];
  const delays_ms = { now: 0 };
  let delayed = 0;
  const explored = await explore({
    rooms: 24,
    perChunk: 2,
    started,
    bundles,
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

it("a map that takes 50 s to begin comes, one is told of that after a few seconds, and sees what is around meanwhile", async () => {
  const { explorer, told, problems, go, asked } = await slow(saysCells, 50_000);
  go(ROOM_0);
  await asked();
  await pass(QUIET_MS / 2);
  expect(told).toEqual([]);
  await pass(QUIET_MS);
  expect(told[0]).toMatchObject({ how: "quiet", attempt: 1, attempts: 4, waited_ms: QUIET_MS });
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
  await pass(QUIET_MS + 1000);
  await vi.waitFor(() => expect(explorer.cellId).toBe(0), SOON);
  expect(told.map((silence) => silence?.how)).toEqual(["quiet"]);
  explorer.close();
});

it("what sends its header and takes its time, again and again, is not given up, and one is told", async () => {
  const isModel = (path: string) => path.endsWith(".glb");
  const { explorer, told, problems, go, asked } = await slow(isModel, STALL_MS - 1000);
  go([PITCH_M + 1, 1.6, 3]);
  await asked();
  for (let tens = 0; tens < 90 && explorer.pending > 0; tens += 1) await pass(STALL_MS / 2);
  expect(explorer).toMatchObject({ settled: true, missing: 0 });
  expect([told[0]?.how, told.at(-1), problems]).toEqual(["quiet", undefined, []]);
  explorer.close();
});

/** Which of a tree's files a faulty way swallows: a quarter of them, always the same. */
const isSwallowed = (path: string) =>
  Number.parseInt(path.slice(-12, -5).replaceAll(/[^0-9]/g, "") || "0", 10) % 4 === 0;

it("a quarter of all files that never come keeps nothing else waiting", async () => {
  const isGlb = (path: string) => path.endsWith(".glb");
  const { explorer, go, asked, delays_ms } = await slow((path) => isGlb(path) && isSwallowed(path), 1e9);
  go(ROOM_0);
  await asked();
  await pass(2 * QUIET_MS);
  const lacks = () => explorer.visible.filter(({ model }) => !explorer.holds(model.model));
  const mayCome = ({ model }: (typeof explorer.visible)[number]) =>
    model.levels.some(({ url }) => !isSwallowed(url)) || model.levels.length === 0;
  expect(explorer.visible.length).toBeGreaterThan(0);
  await vi.waitFor(() => expect(lacks().filter(mayCome)).toEqual([]), SOON);
  delays_ms.now = 0;
  explorer.close();
});

it("what comes by no other way comes as a bundle of one", async () => {
  const isDocument = (path: string) => path.endsWith(".json") && !path.startsWith("/o/bundle/");
  const { explorer, problems, go, asked } = await slow(isDocument, 1e9, false, true);
  go(ROOM_0);
  await asked();
  const until_ms = performance.now() + SOON.timeout;
  while (!explorer.settled && performance.now() < until_ms) await pass(QUIET_MS);
  expect([explorer.cellId, explorer.settled, explorer.missing]).toEqual([0, true, 0]);
  expect(problems).toEqual([]);
  explorer.close();
});
