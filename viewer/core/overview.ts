/**
 * From where does one see all of a world at once? Of interest where its author names no place to begin and it is open above: from
 * there it looks like a model on a table.
 */
import type { Pose } from "./address.ts";
import type { Manifest, Viewpoint } from "./documents.ts";
import { length, middle, subtract } from "./geometry.ts";

/** What a bake calls the place where one may begin when the author names none. */
const MADE_UP = "start";
/** From so high, and from the side on which the light falls. */
const [YAW_RAD, PITCH_RAD] = [Math.PI / 6, -Math.PI / 6];

/** The viewpoint that a bake has made up, when the author names none. */
export function madeUp({ viewpoints }: Pick<Manifest, "viewpoints">): Viewpoint | undefined {
  const [first] = viewpoints;
  return viewpoints.length === 1 && first?.name === MADE_UP ? first : undefined;
}

/** A three-quarter view of everything; `undefined` where one begins in a better place, or would look at a roof. */
export function overview(
  manifest: Pick<Manifest, "bounds" | "cells" | "viewpoints">,
  viewAngle_rad: number,
  aspect: number,
): Pose | undefined {
  const { bounds, cells } = manifest;
  const isOpenAbove = cells.entries.some((entry) => entry.bounds.max[1] > bounds.max[1]);
  if (!madeUp(manifest) || !isOpenAbove) return undefined;
  const radius_m = length(subtract(bounds.max, bounds.min)) / 2;
  const across_rad = 2 * Math.atan(Math.tan(viewAngle_rad / 2) * Math.min(1, aspect));
  const distance_m = radius_m / Math.sin(across_rad / 2);
  const level_m = distance_m * Math.cos(PITCH_RAD);
  const [x, y, z] = middle(bounds);
  const position = [
    x + level_m * Math.sin(YAW_RAD),
    y - distance_m * Math.sin(PITCH_RAD),
    z + level_m * Math.cos(YAW_RAD),
  ] as const;
  return { position, yaw: YAW_RAD, pitch: PITCH_RAD };
}
