/**
 * What should be fetched next? A pure function of what is visible, what is held and where the eye is.
 *
 * Rule 1: the coarsest level of every visible object comes before any finer level of anything; objects come in the order
 * of their visible solid angle, as the cell's record lists them. Rule 2: then models are refined by screen error, the
 * worst first, until their error covers at most `target_px` pixels. Objects that share a model share one download, and
 * the object that needs it most decides.
 *
 * Screen error (thesis on walkthroughs, §6.3): an error of `e` metres at distance `d` covers `e · h / (2 d tan(α/2))`
 * of `h` pixels under the vertical view angle `α`.
 */
import { distanceToBounds, type Vec3 } from "./geometry.ts";
import { geometricError_m, type PlacedObject } from "./objects.ts";
import { PRIORITY } from "./priority.ts";
import type { Held } from "./residency.ts";

export interface Eye {
  readonly position: Vec3;
  /** Vertical view angle in radians. */
  readonly viewAngle_rad: number;
  /** Height of the picture in device pixels. */
  readonly height_px: number;
}

/** A level that should be fetched. */
export interface Want {
  readonly object: PlacedObject;
  readonly level: number;
  /** Lower is more urgent. */
  readonly priority: number;
  /** How far off the held level is; `undefined` when nothing is held. */
  readonly error_px: number | undefined;
}

/** What the plan needs to know of a model. */
export interface ModelState {
  /** The level that is held, if any. */
  readonly heldLevel: number | undefined;
  /** Levels that could not be fetched or decoded. */
  readonly failed: ReadonlySet<number>;
}

/** How many pixels an error covers at an object's distance. */
export function screenError_px(error_m: number, distance_m: number, eye: Eye): number {
  if (error_m === 0) return 0;
  return (error_m * eye.height_px) / (2 * Math.max(distance_m, 0.05) * Math.tan(eye.viewAngle_rad / 2));
}

/** The coarsest level whose error covers at most `target_px` pixels; the finest when none does. */
export function desiredLevel(object: PlacedObject, eye: Eye, target_px: number): number {
  const distance_m = distanceToBounds(object.entry.bounds, eye.position);
  for (let i = object.model.levels.length - 1; i > 0; i -= 1) {
    const level = object.model.levels[i];
    if (level && screenError_px(geometricError_m(object, level), distance_m, eye) <= target_px) return i;
  }
  return 0;
}

/** Everything to fetch, most urgent first. While a coarsest level is missing, nothing finer is in the plan. */
export function plan(
  visible: readonly PlacedObject[],
  stateOf: (model: number) => ModelState,
  eye: Eye,
  target_px: number,
): Want[] {
  const first = new Map<number, Want>();
  const finer = new Map<number, Want>();
  visible.forEach((object, rank) => {
    const id = object.model.model;
    const { heldLevel, failed } = stateOf(id);
    if (heldLevel === undefined) {
      const level = coarsestUsable(object, failed);
      if (level !== undefined && !first.has(id)) {
        first.set(id, { object, level, priority: PRIORITY.coarsest + rank, error_px: undefined });
      }
      return;
    }
    const level = desiredLevel(object, eye, target_px);
    if (level >= heldLevel || failed.has(level)) return;
    const held = object.model.levels[heldLevel];
    const distance_m = distanceToBounds(object.entry.bounds, eye.position);
    const error_px = held ? screenError_px(geometricError_m(object, held), distance_m, eye) : 0;
    const want = { object, level, priority: PRIORITY.finer + 100_000 / (1 + error_px), error_px };
    const other = finer.get(id);
    if (!other) finer.set(id, want);
    else if (level <= other.level) {
      finer.set(id, { ...want, priority: Math.min(want.priority, other.priority) });
    }
  });
  const wants = first.size > 0 ? [...first.values()] : [...finer.values()];
  return wants.sort((a, b) => a.priority - b.priority);
}

/** The coarsest level that has not failed. */
export function coarsestUsable(object: PlacedObject, failed: ReadonlySet<number>): number | undefined {
  for (let level = object.model.levels.length - 1; level >= 0; level -= 1) if (!failed.has(level)) return level;
  return undefined;
}

/** What to draw more coarsely when memory is short: the coarsest level of the visible model that takes most. */
export function shrink(
  visible: readonly PlacedObject[],
  heldOf: (model: number) => Held | undefined,
): Want | undefined {
  let largest: { object: PlacedObject; bytes: number } | undefined;
  for (const object of visible) {
    const held = heldOf(object.model.model);
    if (!held || held.level >= object.model.levels.length - 1) continue;
    if (held.bytes > (largest?.bytes ?? 0)) largest = { object, bytes: held.bytes };
  }
  if (!largest) return undefined;
  const { object } = largest;
  return { object, level: object.model.levels.length - 1, priority: PRIORITY.coarsest, error_px: undefined };
}
