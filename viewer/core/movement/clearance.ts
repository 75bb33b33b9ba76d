/** How far is it to the nearest thing that can be seen? Who draws needs to know: what is nearer need not be told apart. */
import { type Bounds, distanceToBounds, type Vec3 } from "../basics/geometry.ts";

/** Infinite where nothing can be seen; whatever is nearer than `least_m` may be said to be as near as any of it. */
export function clearance_m(
  objects: readonly { readonly entry: { readonly bounds: Bounds } }[],
  point: Vec3,
  least_m: number,
): number {
  let nearest_m = Number.POSITIVE_INFINITY;
  for (const { entry } of objects) {
    nearest_m = Math.min(nearest_m, distanceToBounds(entry.bounds, point));
    if (nearest_m <= least_m) break;
  }
  return nearest_m;
}
