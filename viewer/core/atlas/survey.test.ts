import { expect, it } from "vitest";
import { publish } from "../../test/fixture.ts";
import { serveFiles } from "../../test/serve.ts";
import { FETCH_DEFAULTS, FetchQueue } from "../fetch/fetchqueue.ts";
import { Tree } from "../fetch/tree.ts";
import { webCryptoDigest } from "../fetch/verify.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { ObjectDirectory } from "./objects.ts";
import { PublishedScene } from "./published.ts";
import { hiddenFrom, preparationOf, reasonsAt, type Surveyed } from "./survey.ts";

async function rooms() {
  const { fetch } = serveFiles(publish({ rooms: 6, perChunk: 3 }));
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, fetch, digest: webCryptoDigest() });
  const scene = await PublishedScene.open(queue, new Tree("https://host/sub/"), "rooms");
  const directory = new ObjectDirectory(scene);
  const { objects: all } = await directory.everything(PRIORITY.prefetch);
  return { scene, directory, all };
}

it("finds every object, and counts as saved only models of which nothing is here", async () => {
  const { scene, all } = await rooms();
  expect(all.length).toBe(scene.manifest.counts.objects);
  const firstRoom = all.filter(({ entry }) => entry.bounds.max[0] < 6);
  const hidden = hiddenFrom(firstRoom, all, () => false);
  expect(hidden.objects.length).toBe(all.length - firstRoom.length);
  const shown = new Set(firstRoom.map(({ model }) => model.model));
  const others = new Map(all.filter(({ model }) => !shown.has(model.model)).map(({ model }) => [model.model, model]));
  const textures = (used: typeof all) =>
    new Set(used.flatMap(({ model }) => model.levels[0]?.textures ?? []).map(({ url }) => url));
  expect(textures(all).size).toBe(1);
  const geometry = [...others.values()].reduce((sum, { levels }) => sum + (levels[0]?.bytes ?? 0), 0);
  const pictures =
    textures(firstRoom).size > 0
      ? 0
      : (all.find(({ model }) => model.levels[0]?.textures[0])?.model.levels[0]?.textures[0]?.bytes ?? 0);
  expect(hidden.saved_bytes).toBe(geometry + pictures);
  expect(hiddenFrom(all, all, () => false)).toMatchObject({ objects: [], absent: 0, saved_bytes: 0 });
  const hiddenModels = hidden.objects.filter(({ model }) => !shown.has(model.model));
  expect(hidden.absent).toBe(hiddenModels.length);
  // What was fetched ahead is hidden, and not saved.
  const [ahead] = [...others.values()].filter(({ levels }) => levels[0]?.textures.length === 0);
  if (!ahead) throw new Error("the fixture has no model without textures");
  const later = hiddenFrom(firstRoom, all, (model) => model === ahead.model);
  const fetched = hidden.objects.filter(({ model }) => model.model === ahead.model);
  expect(later.objects).toEqual(hidden.objects);
  expect(later.absent).toBe(hidden.absent - fetched.length);
  expect(later.saved_bytes).toBe(hidden.saved_bytes - (ahead.levels[0]?.bytes ?? 0));
});

it("tells apart what is next door: unknown, known, coming and ready; and why things are visible", async () => {
  const { directory, all } = await rooms();
  const [one, two] = all;
  if (!one || !two) throw new Error("the fixture has no objects");
  const seen = ({ entry }: typeof one) => ({ object: entry.object, fraction: 1, solidAngle: 1, doors: [] });
  const record = { lpvs: [seen(one)], opvs: [seen(two)], cpvs: [1] };
  const held = new Set<number>();
  const ahead: { cell: number | undefined } = { cell: undefined };
  const world = {
    recordOf: (cell: number) => (cell === 0 ? record : undefined),
    entryOf: (cell: number) => ({ cell, bounds: two.entry.bounds }),
    placed: (object: number) => directory.known(object),
    holds: (model: number) => held.has(model),
    prepares: (cell: number) => ahead.cell === cell,
  } as unknown as Surveyed;
  expect([preparationOf(world, 1), preparationOf(world, 0)]).toEqual(["unknown", "known"]);
  ahead.cell = 0;
  expect(preparationOf(world, 0)).toBe("coming");
  for (const { model } of all) held.add(model.model);
  expect(preparationOf(world, 0)).toBe("ready");
  expect(reasonsAt(world, 0)).toEqual({
    local: [one.entry.bounds],
    objects: [two.entry.bounds],
    cells: [two.entry.bounds],
  });
});
