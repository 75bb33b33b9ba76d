import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { explore } from "../../test/explore.ts";
import { type Files, PITCH_M } from "../../test/fixture.ts";
import type { Vec3 } from "../basics/geometry.ts";

const POINTER = "/v1/scenes/rooms/index.json";
const room = (i: number): Vec3 => [i * PITCH_M + 1, 1.6, 3];
const count = (requests: readonly string[]) => requests.filter((path) => path === POINTER).length;

beforeEach(() => void vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"], shouldAdvanceTime: true }));
afterEach(() => void vi.useRealTimers());

/** Takes away all objects of a kind. */
function lose(files: Files, isLost: (path: string, text: string) => boolean): void {
  for (const [path, bytes] of [...files]) {
    if (path.startsWith("/o/") && isLost(path, new TextDecoder().decode(bytes))) files.delete(path);
  }
}

/** The pointer names another revision from now on. */
function publishAnew(files: Files): void {
  const pointer = JSON.parse(new TextDecoder().decode(files.get(POINTER)));
  files.set(POINTER, new TextEncoder().encode(JSON.stringify({ ...pointer, revision: "f".repeat(64) })));
}

it("whoever is in a world that was published anew without its old objects is told once", async () => {
  const { explorer, files, told, requests, go, quiet } = await explore({ rooms: 12, perChunk: 2 });
  go(room(0));
  await quiet();
  lose(files, () => true);
  publishAnew(files);
  for (const i of [5, 11, 8]) {
    go(room(i));
    await quiet();
    vi.advanceTimersByTime(15_000);
  }
  await quiet();
  expect([told, count(requests)]).toEqual([["outdated"], 2]);
  explorer.close();
});

it("where something is missing though nothing was published, the pointer is not read at every loss", async () => {
  const { explorer, files, told, requests, go, quiet } = await explore({ rooms: 12, perChunk: 2 });
  go(room(0));
  await quiet();
  lose(files, (path) => path.endsWith(".glb") || path.endsWith(".cell"));
  for (const i of [5, 11]) {
    go(room(i));
    await quiet();
  }
  expect(count(requests)).toBe(2);
  vi.advanceTimersByTime(15_000);
  await quiet();
  expect(told).toEqual([]);
  const lost = requests.filter((path) => path.startsWith("/o/") && !files.has(path));
  expect(lost.length).toBeGreaterThan(10);
  expect(count(requests)).toBeLessThanOrEqual(4);
  explorer.close();
});

it.each([
  ["record", (path: string) => path.endsWith(".cell") || path.endsWith(".steps")],
  ["map", (path: string, text: string) => path.endsWith(".json") && /"cells":\s*\[/.test(text)],
])("what was visible from another place is not shown where the %s of this one is lost", async (_, isLost) => {
  const { explorer, files, go, quiet } = await explore({ rooms: 24, perChunk: 2 });
  go(room(0));
  await quiet();
  const before = explorer.visible.map(({ entry }) => entry.object);
  lose(files, isLost);
  go(room(20));
  await quiet();
  const now = explorer.visible.map(({ entry }) => entry.object);
  expect(now.filter((object) => before.includes(object))).toEqual([]);
  expect(explorer.visibleCount).toBe(now.length);
  go(room(0));
  await quiet();
  expect(explorer.cellId).toBe(0);
  expect(explorer.visible.map(({ entry }) => entry.object)).toEqual(before);
  explorer.close();
});
