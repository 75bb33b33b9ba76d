/**
 * From where does one see all of a world at once? Of interest where its author names no place to begin and it is open above: from
 * there it looks like a model on a table.
 */
import { add, type Bounds, direction, dot, middle, scale, subtract, type Vec3 } from "../basics/geometry.ts";
import type { Manifest, Viewpoint } from "../documents/documents.ts";
import type { Pose } from "./address.ts";

/** From so high, and from the side on which the light falls. */
const [YAW_RAD, PITCH_RAD] = [Math.PI / 6, -Math.PI / 6];
const RIGHT_RAD = Math.PI / 2;
/** Some room is left around it. */
const FRAME = 1.1;

/** The viewpoint that a bake has made up, when the author names none. */
export function madeUp({ viewpoints }: Pick<Manifest, "viewpoints">): Viewpoint | undefined {
  return viewpoints.find(({ isMadeUp }) => isMadeUp);
}

/** Whether any cell reaches above what there is to see. */
export function reachesAbove({ cells }: Pick<Manifest, "cells">, frame: Bounds): boolean {
  return cells.entries.some((entry) => entry.bounds.max[1] > frame.max[1]);
}

/** A three-quarter view of what belongs into the picture; `undefined` where one begins in a better place, or would look at a roof. */
export function overview(
  manifest: Pick<Manifest, "cells" | "viewpoints">,
  frame: Bounds,
  viewAngle_rad: number,
  aspect: number,
): Pose | undefined {
  if (!madeUp(manifest) || !reachesAbove(manifest, frame)) return undefined;
  const tall = Math.tan(viewAngle_rad / 2);
  const [ahead, up, right] = [
    direction(YAW_RAD, PITCH_RAD),
    direction(YAW_RAD, PITCH_RAD + RIGHT_RAD),
    rightOf(YAW_RAD),
  ];
  const centre = middle(frame);
  // From each corner backwards until it stands on the edge of the picture; the furthest of these has all corners in it.
  const distances_m = cornersOf(frame).map((corner) => {
    const way = subtract(corner, centre);
    const aside_m = Math.max(Math.abs(dot(up, way)) / tall, Math.abs(dot(right, way)) / (tall * aspect));
    return aside_m - dot(ahead, way);
  });
  const distance_m = FRAME * Math.max(...distances_m);
  return { position: add(centre, scale(ahead, -distance_m)), yaw: YAW_RAD, pitch: PITCH_RAD };
}

function rightOf(yaw: number): Vec3 {
  return [Math.cos(yaw), 0, -Math.sin(yaw)];
}

function cornersOf({ min, max }: Bounds): Vec3[] {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [(i & 1 ? max : min)[0], (i & 2 ? max : min)[1], (i & 4 ? max : min)[2]]);
}
