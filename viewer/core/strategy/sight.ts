/**
 * How many pixels does an error cover? (Thesis on walkthroughs, §6.3:) `e` metres at distance `d` are
 * `e · h / (2 d tan(α/2))` of `h` pixels under the vertical view angle `α`.
 */
import { distanceToBounds, type Vec3 } from "../basics/geometry.ts";
import { geometricError_m, type PlacedObject } from "../documents/placedobject.ts";
import type { Grade } from "./grade.ts";

export interface Eye {
  readonly position: Vec3;
  /** Vertical view angle in radians. */
  readonly viewAngle_rad: number;
  /** Height of the picture in device pixels. */
  readonly height_px: number;
}

/** How many pixels an error covers at an object's distance. */
export function screenError_px(error_m: number, distance_m: number, eye: Eye): number {
  if (error_m === 0) return 0;
  return (error_m * eye.height_px) / (2 * Math.max(distance_m, 0.05) * Math.tan(eye.viewAngle_rad / 2));
}

/** How many pixels the error of a grade of an object covers. */
export function errorOf_px(object: PlacedObject, grade: Grade, eye: Eye): number {
  return screenError_px(geometricError_m(object, grade), distanceToBounds(object.entry.bounds, eye.position), eye);
}

/** The error, in the space of an object's model, that covers `target_px` pixels. */
export function errorThatDoes(object: PlacedObject, eye: Eye, target_px: number): number {
  const px_per_unit = screenError_px(object.entry.scale, distanceToBounds(object.entry.bounds, eye.position), eye);
  return target_px / px_per_unit;
}
