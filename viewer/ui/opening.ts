/** Which scene does a link mean, and what is there when it is not? */
import { fetchSceneList, PublishedScene } from "../core/atlas/published.ts";
import type { Bounds } from "../core/basics/geometry.ts";
import type { SceneSummary } from "../core/documents/documents.ts";
import type { FetchQueue } from "../core/fetch/fetchqueue.ts";
import { FetchError, pause } from "../core/fetch/transfer.ts";
import { isSceneName, type Tree } from "../core/fetch/tree.ts";
import { frameOf } from "../core/movement/framing.ts";
import { isRoofed } from "../core/movement/roofed.ts";
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

/** What takes longer than this is done without where it can be. */
const LONGEST_MS = 2000;

/** Opens the scene that a link names, else the first of the tree. */
export async function openScene(queue: FetchQueue, tree: Tree, link: URL): Promise<Opened> {
  const [named, base] = [link.searchParams.get("scene"), link.searchParams.get("base")];
  const listing = fetchSceneList(queue, tree);
  const wrongBase = (error: unknown) => (base && isMissing(error) ? new NoSuchTree(base) : error);
  // A tree may hold a scene that its list does not name; the list is only needed to choose from.
  const listed = listing.catch((): undefined => undefined);
  if (named && !isSceneName(named)) throw new NoSuchScene(named, await soon(listed, undefined));
  const [first] = named ? [] : await listing.catch((error) => Promise.reject(wrongBase(error)));
  const name = named || first?.scene;
  if (!name) throw new NoSuchScene(undefined, []);
  try {
    const scene = await PublishedScene.open(queue, tree, name);
    const [picture, scenes] = await Promise.all([pictureOf(scene), soon(listed, undefined)]);
    return { scene, scenes: scenes ?? [], ...picture };
  } catch (error) {
    if (!isMissing(error)) throw error;
    const reasons = Promise.all([listed, listing.then(() => error, wrongBase)]);
    const [scenes, wrong] = await soon(reasons, [undefined, error]);
    if (scenes?.some(({ scene }) => scene === name)) throw error;
    throw wrong instanceof NoSuchTree ? wrong : new NoSuchScene(name, scenes);
  }
}

/** What is learnt of a scene before it is shown, all of it within the same time. */
async function pictureOf(scene: PublishedScene): Promise<Pick<Opened, "frame" | "isRoofed">> {
  const waiting = new AbortController();
  const enough = pause(LONGEST_MS, waiting.signal);
  const frame = await frameOf(scene, enough);
  const roofed = await isRoofed(scene, frame, enough);
  waiting.abort();
  return { frame, isRoofed: roofed };
}

/** What comes soon, or what has to do in its place. */
async function soon<T>(coming: Promise<T>, otherwise: T): Promise<T> {
  const waiting = new AbortController();
  const come = await Promise.race([coming, pause(LONGEST_MS, waiting.signal).then(() => otherwise)]);
  waiting.abort();
  return come;
}
