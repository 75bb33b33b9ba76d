/** Which scene does a link mean, and what is there when it is not? */
import type { SceneSummary } from "../core/documents.ts";
import type { FetchQueue } from "../core/fetchqueue.ts";
import { fetchSceneList, PublishedScene } from "../core/published.ts";
import { isRoofed } from "../core/roofed.ts";
import { FetchError } from "../core/transfer.ts";
import type { Tree } from "../core/tree.ts";
import { NoSuchScene, NoSuchTree } from "./problem.ts";

export interface Opened {
  readonly scene: PublishedScene;
  /** All that are published beside it, as far as that is known. */
  readonly scenes: readonly SceneSummary[];
  /** Whether one would begin below a roof where no author says where to. */
  readonly isRoofed: boolean;
}

const isMissing = (error: unknown) => error instanceof FetchError && error.kind === "status";

/** Opens the scene that a link names, else the first of the tree. */
export async function openScene(queue: FetchQueue, tree: Tree, link: URL): Promise<Opened> {
  const [named, base] = [link.searchParams.get("scene"), link.searchParams.get("base")];
  const listing = fetchSceneList(queue, tree);
  const wrongBase = (error: unknown) => (base && isMissing(error) ? new NoSuchTree(base) : error);
  // A tree may hold a scene that its list does not name; the list is only needed to choose from.
  const listed = listing.catch(() => undefined);
  const scenes = named ? ((await listed) ?? []) : await listing.catch((error) => Promise.reject(wrongBase(error)));
  const name = named || scenes[0]?.scene;
  if (!name) throw new NoSuchScene(undefined, scenes);
  try {
    const scene = await PublishedScene.open(queue, tree, name);
    return { scene, scenes, isRoofed: await isRoofed(scene) };
  } catch (error) {
    const isListed = scenes.some(({ scene }) => scene === name);
    if (!isMissing(error) || isListed) throw error;
    const wrong = await listing.then(() => error, wrongBase);
    throw wrong instanceof NoSuchTree ? wrong : new NoSuchScene(name, scenes);
  }
}
