import { expect, it } from "vitest";
import { FETCH_DEFAULTS, FetchQueue } from "../core/fetchqueue.ts";
import { Tree } from "../core/tree.ts";
import { publish } from "../test/fixture.ts";
import { type ServerOptions, serveFiles } from "../test/serve.ts";
import { openScene } from "./opening.ts";
import { NoSuchScene } from "./problem.ts";

const LIST = "/v1/scenes/index.json";

/** Opens what a link names in a tree that holds one scene, `rooms`. */
function open(link: string, options: ServerOptions = {}) {
  const { fetch } = serveFiles(publish({ rooms: 2 }), options);
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, digest: undefined, fetch });
  return openScene(queue, new Tree("https://host/sub/"), new URL(link, "https://host/sub/"));
}

it("opens the scene that is named although the list of all is silent", async () => {
  const answerAfter_ms = (path: string) => (path === LIST ? 1e9 : 0);
  const { scene, scenes, frame } = await open("?scene=rooms", { answerAfter_ms });
  expect([scene.pointer.scene, scenes]).toEqual(["rooms", []]);
  expect(frame).toEqual(scene.manifest.bounds);
});

it.each(["../x", "Rooms", "index", "a b"])(
  "says of %j that no scene is called so, and which there are",
  async (name) => {
    const opening = open(`?scene=${encodeURIComponent(name)}`);
    await expect(opening).rejects.toBeInstanceOf(NoSuchScene);
    await expect(opening).rejects.toMatchObject({ scene: name });
  },
);
