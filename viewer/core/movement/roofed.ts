/**
 * Is there a roof over where one would begin? Then one would see nothing of the world from high up but that roof. Climbs from cell to
 * cell, each above the one before, until one reaches above what belongs into the picture, or none goes on.
 */
import { CellIndex } from "../atlas/cellindex.ts";
import type { PublishedScene } from "../atlas/published.ts";
import type { Bounds } from "../basics/geometry.ts";
import type { CellEntry, Viewpoint } from "../documents/documents.ts";
import { PRIORITY } from "../strategy/priority.ts";
import { madeUp, reachesAbove } from "./overview.ts";

/** So many storeys are climbed. */
const MOST_STEPS = 64;

/** Whether the place that a bake has made up has a roof above it, as far as the index says so before it is enough. */
export async function isRoofed(scene: PublishedScene, frame: Bounds, enough: Promise<void>): Promise<boolean> {
  const place = madeUp(scene.manifest);
  if (!place || !reachesAbove(scene.manifest, frame)) return false;
  const climbing = new AbortController();
  // What cannot be had says nothing of a roof.
  const climbed = endsBelow(scene, place, frame.max[1], climbing.signal).catch(() => false);
  const roofed = await Promise.race([climbed, enough.then(() => false)]);
  climbing.abort();
  return roofed;
}

async function endsBelow(
  scene: PublishedScene,
  { cell, position }: Viewpoint,
  height_m: number,
  signal: AbortSignal,
): Promise<boolean> {
  const index = new CellIndex(scene);
  const [x, , z] = position;
  const isOver = ({ bounds: { min, max } }: CellEntry) => min[0] <= x && x <= max[0] && min[2] <= z && z <= max[2];
  let here = await index.entry(cell, PRIORITY.document);
  for (let step = 0; step < MOST_STEPS && !signal.aborted; step += 1) {
    const top = here.bounds.max[1];
    if (top > height_m) return false;
    const nextDoor = await index.entriesOf(here.adjacent, PRIORITY.document);
    const above = nextDoor.filter((entry) => isOver(entry) && entry.bounds.max[1] > top);
    const [highest] = above.sort((a, b) => b.bounds.max[1] - a.bounds.max[1]);
    if (!highest) return true;
    here = highest;
  }
  return false;
}
