/** Which scene does a link mean, and what is there when it is not? */
import type { SceneSummary } from "../core/documents.ts";
import type { FetchQueue } from "../core/fetchqueue.ts";
import { frameOf } from "../core/framing.ts";
import type { Bounds } from "../core/geometry.ts";
import { fetchSceneList, PublishedScene } from "../core/published.ts";
import { isRoofed } from "../core/roofed.ts";
import { FetchError, pause } from "../core/transfer.ts";
import { isSceneName, type Tree } from "../core/tree.ts";
import { NoSuchScene, NoSuchTree } from "./problem.ts";

export interface Opened {
  readonly scene: PublishedScene;
  /** All that are published beside it, as far as that is known. */
  readonly scenes: readonly SceneSummary[];
  /** Whether one would begin below a roof where no author says where to. */
  readonly isRoofed: boolean;
  /** What of it belongs into a picture of all of it. */
  readonly frame: Bounds;
}

const isMissing = (error: unknown) => error instanceof FetchError && error.kind === "status";

/** A list of other scenes that takes longer than this after the scene is done without. */
const LIST_MS = 2000;

/** Opens the scene that a link names, else the first of the tree. */
export async function openScene(queue: FetchQueue, tree: Tree, link: URL): Promise<Opened> {
  const [named, base] = [link.searchParams.get("scene"), link.searchParams.get("base")];
  const listing = fetchSceneList(queue, tree);
  const wrongBase = (error: unknown) => (base && isMissing(error) ? new NoSuchTree(base) : error);
  // A tree may hold a scene that its list does not name; the list is only needed to choose from.
  const listed = listing.catch((): readonly SceneSummary[] => []);
  if (named && !isSceneName(named)) throw new NoSuchScene(named, await listed);
  const [first] = named ? [] : await listing.catch((error) => Promise.reject(wrongBase(error)));
  const name = named || first?.scene;
  if (!name) throw new NoSuchScene(undefined, []);
  try {
    const scene = await PublishedScene.open(queue, tree, name);
    const frame = await frameOf(scene);
    const [roofed, scenes] = await Promise.all([isRoofed(scene, frame), soon(listed)]);
    return { scene, scenes, isRoofed: roofed, frame };
  } catch (error) {
    if (!isMissing(error)) throw error;
    const scenes = await listed;
    if (scenes.some(({ scene }) => scene === name)) throw error;
    const wrong = await listing.then(() => error, wrongBase);
    throw wrong instanceof NoSuchTree ? wrong : new NoSuchScene(name, scenes);
  }
}

async function soon(listed: Promise<readonly SceneSummary[]>): Promise<readonly SceneSummary[]> {
  const waiting = new AbortController();
  const scenes = await Promise.race([listed, pause(LIST_MS, waiting.signal).then(() => [])]);
  waiting.abort();
  return scenes;
}
