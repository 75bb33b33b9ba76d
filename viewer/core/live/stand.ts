/**
 * Where is somebody told to be who is far outside? A live session takes nobody who is further from a scene than it is large;
 * who looks at it from further away stands at that edge.
 */
import { type Bounds, length, subtract, type Vec3 } from "../geometry.ts";

/** This share of what is allowed is used, so that no rounding leads beyond it. */
const SAFE = 0.999;

export function standIn({ min, max }: Bounds, position: Vec3): Vec3 {
  const reach_m = SAFE * length(subtract(max, min));
  const kept = (axis: 0 | 1 | 2) => Math.min(max[axis] + reach_m, Math.max(min[axis] - reach_m, position[axis]));
  return [kept(0), kept(1), kept(2)];
}
