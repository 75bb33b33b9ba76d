/**
 * Where is somebody told to be who is far outside? A live session takes nobody who is further from a scene than it is large;
 * who looks at it from further away stands at that edge.
 */
import { type Bounds, diagonal_m, type Vec3 } from "../basics/geometry.ts";

/** This share of what is allowed is used, so that no rounding leads beyond it. */
const SAFE = 0.999;

export function standIn(bounds: Bounds, position: Vec3): Vec3 {
  const { min, max } = bounds;
  const reach_m = SAFE * diagonal_m(bounds);
  const kept = (axis: 0 | 1 | 2) => Math.min(max[axis] + reach_m, Math.max(min[axis] - reach_m, position[axis]));
  return [kept(0), kept(1), kept(2)];
}
