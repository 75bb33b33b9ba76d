/**
 * Which cell will the walker enter next? The one behind the nearest opening that lies ahead in the direction of travel, as
 * the ray through the last two viewpoints does it (Marvie & Bouatouch, A VRML97-X3D extension for massive scenery
 * management in virtual worlds, 2004, §6.1), but an opening need not be hit exactly.
 */
import type { Portal } from "./cellrecord.ts";
import { centre, distanceToPolygon, dot, length, subtract, type Vec3 } from "./geometry.ts";

/** An opening further away than this names no cell. */
const RANGE_M = 6;
/** Who moves more slowly stands. */
const SLOWEST_MPS = 0.2;

export function cellAhead(portals: readonly Portal[], position: Vec3, velocity: Vec3): number | undefined {
  if (length(velocity) < SLOWEST_MPS) return undefined;
  let best: { cell: number; distance_m: number } | undefined;
  for (const portal of portals) {
    const distance_m = distanceToPolygon(portal.polygon, position);
    const heading = dot(velocity, subtract(centre(portal.polygon), position)) > 0;
    if (heading && distance_m < Math.min(best?.distance_m ?? Number.POSITIVE_INFINITY, RANGE_M)) {
      best = { cell: portal.to, distance_m };
    }
  }
  return best?.cell;
}
