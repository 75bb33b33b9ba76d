import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetch/fetchqueue.ts";
import { Tree } from "../core/fetch/tree.ts";
import { publish } from "../test/fixture.ts";
import { type ServerOptions, serveFiles } from "../test/serve.ts";
import { openScene } from "./opening.ts";
import { explain, NoSuchScene } from "./problem.ts";

const LIST = "/v1/scenes/index.json";

/** Opens what a link names in a tree that holds one scene, `rooms`. */
function open(link: string, options: ServerOptions = {}) {
  const { fetch } = serveFiles(publish({ rooms: 2 }), options);
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, digest: undefined, fetch });
  return openScene(queue, new Tree("https://host/sub/"), new URL(link, "https://host/sub/"));
}

const isSilentList = (path: string) => (path === LIST ? 1e9 : 0);
const textOf = (bytes: Uint8Array) => new TextDecoder().decode(bytes);
/** What can be done without is waited for so long, all of it, and a little longer for the rest. */
const [LONGEST_MS, STEP_MS] = [2000, 50];
const SOON_MS = LONGEST_MS + 20 * STEP_MS;

beforeEach(() => void vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] }));
afterEach(() => void vi.useRealTimers());

/** Lets time pass until something has come or failed, but not for long. */
async function soon<T>(opening: Promise<T>): Promise<T> {
  let isPending = true;
  const settled = () => {
    isPending = false;
  };
  opening.then(settled, settled);
  for (let at_ms = 0; isPending && at_ms < SOON_MS; at_ms += STEP_MS) {
    for (const _ of [1, 2, 3]) await new Promise((resolve) => setImmediate(resolve));
    vi.advanceTimersByTime(STEP_MS);
  }
  return isPending ? expect.fail("it takes too long") : opening;
}

it("opens the scene that is named although the list of all is silent", async () => {
  const { scene, scenes, frame } = await soon(open("?scene=rooms", { answerAfter_ms: isSilentList }));
  expect([scene.pointer.scene, scenes]).toEqual(["rooms", []]);
  expect(frame).toEqual(scene.manifest.bounds);
});

it("waits for all that can be done without together no longer than for one of it", async () => {
  const isChunk = (bytes: Uint8Array) => /^{"(cells|objects)":\[/.test(textOf(bytes));
  const answer = (_: string, bytes: Uint8Array) => {
    const manifest = textOf(bytes);
    if (!manifest.includes('"guarantee"')) return undefined;
    const { viewpoints, bounds, ...rest } = JSON.parse(manifest);
    // So low that there is something above it: one asks whether that is a roof.
    const low = { ...bounds, max: [bounds.max[0], 1, bounds.max[2]] };
    return JSON.stringify({ ...rest, bounds: low, viewpoints: [{ ...viewpoints[0], made_up: true }] });
  };
  const asked = { chunks: new Set<string>() };
  const answerAfter_ms = (path: string, bytes: Uint8Array) => {
    if (isChunk(bytes)) asked.chunks.add(textOf(bytes).slice(2, 7));
    return isChunk(bytes) ? 1e9 : isSilentList(path);
  };
  const { frame, isRoofed, scene } = await soon(open("?scene=rooms", { answer, answerAfter_ms }));
  expect([frame, isRoofed]).toEqual([scene.manifest.bounds, false]);
  expect([...asked.chunks]).toEqual(["objec", "cells"]);
});

it("what a pointer names and is not there is not taken for a scene that is not there", async () => {
  const isManifest = (bytes: Uint8Array) => textOf(bytes).includes('"guarantee"');
  const answer = (_: string, bytes: Uint8Array) => (isManifest(bytes) ? new Response("", { status: 404 }) : undefined);
  const error = await soon(open("?scene=rooms", { answer })).catch((it) => it);
  const { text } = explain(error, { host: "host", isElsewhere: false });
  expect(text).toMatch(/^On host, the pointer of `rooms` names .*: a cache on the way holds an old pointer/);
});

it.each(["../x", "tower"])("says soon that %j is not there although the list of all is silent", async (name) => {
  const opening = open(`?scene=${encodeURIComponent(name)}`, { answerAfter_ms: isSilentList });
  await expect(soon(opening)).rejects.toMatchObject({ name: "NoSuchScene", scene: name, others: undefined });
});

it.each(["../x", "Rooms", "index", "a b"])(
  "says of %j that no scene is called so, and which there are",
  async (name) => {
    const opening = soon(open(`?scene=${encodeURIComponent(name)}`));
    await expect(opening).rejects.toBeInstanceOf(NoSuchScene);
    await expect(opening).rejects.toMatchObject({ scene: name });
  },
);
