/**
 * Which door can one use from here? The one that one looks at, else the nearest beside one, unless a wall or another door is
 * between.
 */
import {
  type Bounds,
  direction,
  distanceToBounds,
  dot,
  middle,
  nearestInBounds,
  rayToBounds,
  subtract,
  type Vec3,
} from "../basics/geometry.ts";

/** A door with the boxes around its doorway and around its leaf where that is now. */
export interface DoorPlace {
  readonly door: number;
  readonly doorway: Bounds;
  readonly leaf: Bounds;
}

/** Where one looks from; angles as the walker has them. */
export interface Gaze {
  readonly position: Vec3;
  readonly yaw: number;
  readonly pitch: number;
}

/** A door is looked at from no further than this … */
const REACH_M = 3;
/** … and used without a look from here, unless it is behind one. */
const BESIDE_M = 1.2;
/** Cosine of the angle from straight ahead beyond which things are behind one. */
const BEHIND = -0.2;

/**
 * The door to use; `leadsTo` says whether one gets straight to a door's opening at a point. `size` is that of who reaches for it, as a
 * share of a person's.
 */
export function doorInReach(
  doors: Iterable<DoorPlace>,
  gaze: Gaze,
  leadsTo: (point: Vec3, door: number) => boolean,
  size = 1,
): number | undefined {
  let best: { readonly door: number; readonly rank_m: number } | undefined;
  for (const place of doors) {
    const rank_m = rank(place, gaze, size);
    if (rank_m === undefined || (best && best.rank_m <= rank_m)) continue;
    if (leadsTo(nearestInBounds(place.doorway, gaze.position), place.door)) best = { door: place.door, rank_m };
  }
  return best?.door;
}

/** How far it is to a door that is looked at; further than any of these when it is only near. */
function rank({ doorway, leaf }: DoorPlace, { position, yaw, pitch }: Gaze, size: number): number | undefined {
  const ahead = direction(yaw, pitch);
  const seen_m = Math.min(...[doorway, leaf].map((box) => rayToBounds(box, position, ahead)));
  if (seen_m <= REACH_M * size) return seen_m;
  const near_m = distanceToBounds(doorway, position);
  if (near_m > BESIDE_M * size) return undefined;
  const way = subtract(middle(doorway), position);
  const facing = dot(direction(yaw), way) / Math.max(Math.hypot(way[0], way[2]), 1e-9);
  return facing < BEHIND ? undefined : REACH_M * size + near_m;
}
