/**
 * What of a world belongs into a picture of all of it? The box around all objects, but for a backdrop: a dome of sky, clouds, or something
 * left lying far away would make a speck of everything else. A robust extent (after Rousseeuw and Leroy, *Robust regression and outlier
 * detection*, 1987): reaches are taken from the median of all middles, and what lies beyond a wide gap is left out, as long as most
 * objects stay.
 */
import type { PublishedScene } from "../atlas/published.ts";
import { type Bounds, boundsOf, middle, subtract, type Vec3 } from "../basics/geometry.ts";
import type { PageEntry } from "../documents/documents.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { madeUp } from "./overview.ts";

/** A gap is wide where what lies beyond reaches so many times as far; fewer objects are no backdrop, and at least such a share has to stay. */
const [WIDE, LEAST_SHARE] = [4, 0.75];
/** Of fewer objects any may be what it is all about. */
const LEAST_OBJECTS = 8;
/** A few documents are read for it. */
const MOST_CHUNKS = 4;

/** A box, and how many objects lie in it. */
export interface WeightedBounds {
  readonly bounds: Bounds;
  readonly count: number;
}

/** The box around objects without what is only behind them; `undefined` where nothing is left out. */
export function withoutBackdrop(boxes: readonly WeightedBounds[]): Bounds | undefined {
  const total = boxes.reduce((sum, { count }) => sum + count, 0);
  if (total < LEAST_OBJECTS) return undefined;
  const centre: Vec3 = [median(boxes, 0, total), median(boxes, 1, total), median(boxes, 2, total)];
  const reaching = boxes
    .map((box) => ({ ...box, reach_m: reach(box.bounds, centre) }))
    .sort((a, b) => a.reach_m - b.reach_m);
  let inside = 0;
  for (const [at, { count, reach_m }] of reaching.entries()) {
    inside += count;
    const next = reaching[at + 1];
    if (!next) return undefined;
    if (inside < LEAST_SHARE * total || reach_m === 0 || next.reach_m < WIDE * reach_m) continue;
    return boundsOf(reaching.slice(0, at + 1).flatMap(({ bounds: { min, max } }) => [min, max]));
  }
  return undefined;
}

/** The same of a scene in which no author says where to begin, as far as the index says so before it is enough; else the box around all of it. */
export async function frameOf(scene: PublishedScene, enough: Promise<void>): Promise<Bounds> {
  const { bounds, objects, whole } = scene.manifest;
  if (!madeUp(scene.manifest)) return bounds;
  const boxes = whole
    ? whole.objects.map((entry) => ({ bounds: entry.bounds, count: 1 }))
    : await objectsIn(scene, objects.entries, enough);
  return withoutBackdrop(boxes) ?? bounds;
}

/** The objects of a few chunks; where there are more, chunks have to do. */
async function objectsIn(
  scene: PublishedScene,
  entries: readonly PageEntry[],
  enough: Promise<void>,
): Promise<readonly WeightedBounds[]> {
  if (entries.length > MOST_CHUNKS || entries.some(({ kind }) => kind === "page")) return entries;
  const read = Promise.all(entries.map((entry) => scene.objectChunk(entry, PRIORITY.document)));
  const chunks = await Promise.race([read.catch(() => undefined), enough.then(() => undefined)]);
  return chunks?.flat().map(({ bounds }) => ({ bounds, count: 1 })) ?? entries;
}

/** How far it is to the furthest corner of a box. */
function reach({ min, max }: Bounds, from: Vec3): number {
  const [low, high] = [subtract(from, min), subtract(max, from)];
  return Math.hypot(...[0, 1, 2].map((axis) => Math.max(Math.abs(low[axis] ?? 0), Math.abs(high[axis] ?? 0))));
}

/** Of the middles of boxes along an axis, each as often as there are objects in it. */
function median(boxes: readonly WeightedBounds[], axis: 0 | 1 | 2, total: number): number {
  const inOrder = boxes.map(({ bounds, count }) => ({ at: middle(bounds)[axis], count })).sort((a, b) => a.at - b.at);
  let before = 0;
  for (const { at, count } of inOrder) {
    before += count;
    if (2 * before >= total) return at;
  }
  return 0;
}
