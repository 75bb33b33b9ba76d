import { expect, it } from "vitest";
import { cellBounds, PITCH_M, publish } from "../../test/fixture.ts";
import { serveFiles } from "../../test/serve.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { Tree } from "../fetch/tree.ts";
import { webCryptoDigest } from "../fetch/verify.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { CellIndex } from "./cellindex.ts";
import { ObjectDirectory } from "./objects.ts";
import { fetchSceneList, PublishedScene } from "./published.ts";

it("learns the chunks nearest to a point, and no more than it should", async () => {
  const index = new CellIndex((await openRooms(12)).scene);
  await index.learn([9 * PITCH_M, 1.6, 3], 2);
  const met = [...index.met()].map(({ cell }) => cell);
  expect(met.length).toBe(6);
  expect(met).toContain(18);
  await index.learn([0, 0, 0], 100);
  expect([...index.met()].length).toBe(23);
});

async function openRooms(rooms: number) {
  const { fetch, requests } = serveFiles(publish({ rooms, perChunk: 3 }));
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch, digest: webCryptoDigest() });
  const tree = new Tree("https://host/sub/");
  const scene = await PublishedScene.open(queue, tree, "rooms");
  return { scene, queue, tree, requests };
}

it("the list of scenes names the scenes", async () => {
  const { queue, tree } = await openRooms(2);
  expect((await fetchSceneList(queue, tree)).map(({ scene }) => scene)).toEqual(["rooms"]);
});

it("every cell is found by a point in it, reading few pages", async () => {
  const { scene, requests } = await openRooms(20);
  expect(scene.manifest.cells.entries.some(({ kind }) => kind === "page")).toBe(true);
  for (let cell = 0; cell < 39; cell += 1) {
    const index = new CellIndex(scene);
    const { min, max } = cellBounds(cell);
    const before = requests.length;
    const located = await index.locate([(min[0] + max[0]) / 2, 1, 3]);
    expect(located).toMatchObject({ entry: { cell }, distance_m: 0 });
    expect(requests.length - before).toBeLessThanOrEqual(4);
  }
});

it("where cells touch, the lowest id wins; outside, the nearest", async () => {
  const { scene } = await openRooms(5);
  const index = new CellIndex(scene);
  expect((await index.locate([PITCH_M - 0.4, 1, 3]))?.entry.cell).toBe(0);
  expect((await index.locate([PITCH_M, 1, 3]))?.entry.cell).toBe(1);
  expect(await index.locate([-3, 1, 3])).toMatchObject({ entry: { cell: 0 }, distance_m: 3 });
});

it("a step next door needs no request; on a border the index decides", async () => {
  const { scene, requests } = await openRooms(5);
  const index = new CellIndex(scene);
  const from = await index.entry(1, PRIORITY.document);
  await index.entry(2, PRIORITY.document);
  const before = requests.length;
  expect(index.nextDoor(from, [PITCH_M - 0.1, 1, 3])?.cell).toBe(1);
  expect(index.nextDoor(from, [PITCH_M, 1, 3])).toBeUndefined();
  expect(index.nextDoor(from, [PITCH_M + 0.1, 1, 3])?.cell).toBe(2);
  expect(index.nextDoor(from, [PITCH_M * 3 + 0.1, 1, 3])).toBeUndefined();
  expect(requests.length).toBe(before);
});

it("a cell that the index does not hold is an error that names it", async () => {
  const { scene } = await openRooms(2);
  await expect(new CellIndex(scene).entry(99, PRIORITY.document)).rejects.toThrow("does not hold c99");
});

it("objects are joined with their models, each chunk read once", async () => {
  const { scene, requests } = await openRooms(12);
  const directory = new ObjectDirectory(scene);
  const last = scene.manifest.counts.objects - 1;
  const { objects } = await directory.resolve([last, 0, 3, 3], PRIORITY.document);
  expect(objects.map(({ entry }) => entry.object)).toEqual([last, 0, 3, 3]);
  expect(objects.every(({ entry, model }) => entry.model === model.model)).toBe(true);
  const before = requests.length;
  await directory.resolve([0, last], PRIORITY.document);
  expect(requests.length).toBe(before);
  const { loss } = await directory.resolve([last + 1], PRIORITY.document);
  expect(String(loss?.error)).toContain(`does not hold o${last + 1}`);
});
