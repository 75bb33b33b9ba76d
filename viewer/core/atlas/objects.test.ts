import { expect, it, vi } from "vitest";
import { publish } from "../../test/fixture.ts";
import { serveFiles } from "../../test/serve.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { Tree } from "../fetch/tree.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { ObjectDirectory } from "./objects.ts";
import { PublishedScene } from "./published.ts";
import { Surroundings } from "./surroundings.ts";

/** A world whose index says that each of its chunks holds as many objects as there are ids. */
async function boastful() {
  const files = publish({ rooms: 2 });
  const pointer = JSON.parse(new TextDecoder().decode(files.get("/v1/scenes/rooms/index.json")));
  const manifest = JSON.parse(new TextDecoder().decode(files.get(pointer.manifest)));
  for (const entry of manifest.objects.entries) entry.count = 0xffff_ffff;
  files.set(pointer.manifest, new TextEncoder().encode(JSON.stringify(manifest)));
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch: serveFiles(files).fetch, digest: undefined });
  const scene = await PublishedScene.open(queue, new Tree("https://host/sub/"), "rooms");
  return { scene, directory: new ObjectDirectory(scene) };
}

it("finds the objects that there are, however many are said to be", async () => {
  const { scene, directory } = await boastful();
  const { objects } = await directory.everything(PRIORITY.prefetch);
  const ids = new Set(objects.map(({ entry }) => entry.object));
  expect(ids.size).toBe(scene.manifest.counts.objects);
});

it("looks around among the objects that there are, however many are said to be", async () => {
  const { scene, directory } = await boastful();
  const surroundings = new Surroundings(scene, directory, () => {});
  const around = await surroundings.look([1, 1.6, 3], () => {});
  expect(around?.objects.length).toBe(scene.manifest.counts.objects);
});

it("finds what it knows of one chunk without going through all that it knows", async () => {
  const { scene, directory } = await boastful();
  const { objects } = await directory.everything(PRIORITY.prefetch);
  const [chunk] = scene.manifest.objects.entries;
  if (chunk?.kind !== "chunk") throw new Error("the world has more than a page of objects");
  const two = { ...chunk, count: 2 };
  const keys = vi.spyOn(Map.prototype, "keys");
  const found = await directory.below(two, PRIORITY.document);
  expect(keys).not.toHaveBeenCalled();
  keys.mockRestore();
  const ids = [two.first, two.first + 1];
  expect(found.objects.map(({ entry }) => entry.object)).toEqual(ids);
  expect(objects.length).toBeGreaterThan(2);
  const known = directory.knownBelow([two]).map(({ entry }) => entry.object);
  expect(known).toEqual(ids);
});
