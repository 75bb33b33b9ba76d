/**
 * Which views of an impostor does an eye need? As `crates/scene/src/impostor/octahedral.rs`, which explains it: directions
 * lie on an octahedron that is unfolded into a square, views at the points of a grid on it. Directions lead from the model
 * to the eye, in the model's space, +Y up.
 */
import { cross, dot, scale, type Vec3 } from "../basics/geometry.ts";

const MAPPINGS = ["octahedral", "hemi-octahedral"] as const;
/** Seen from all sides, or from all but below. */
export type Mapping = (typeof MAPPINGS)[number];

export function isMapping(text: string): text is Mapping {
  return (MAPPINGS as readonly string[]).includes(text);
}

/** A view and how much it counts. */
export interface Weighted {
  readonly column: number;
  readonly row: number;
  /** 0 to 1; those of three add up to 1. */
  readonly weight: number;
}

/** The point of a direction in the square, each coordinate 0 to 1. */
export function pointOf(mapping: Mapping, direction: Vec3): [number, number] {
  const isHemi = mapping === "hemi-octahedral";
  const y = isHemi ? Math.max(direction[1], 0) : direction[1];
  const reach = Math.abs(direction[0]) + Math.abs(y) + Math.abs(direction[2]) || 1;
  const [x, z] = [direction[0] / reach, direction[2] / reach];
  if (isHemi) return [(x + z + 1) / 2, (x - z + 1) / 2];
  return y < 0 ? [(fold(x, z) + 1) / 2, (fold(z, x) + 1) / 2] : [(x + 1) / 2, (z + 1) / 2];
}

/** The direction of a point in the square, of length 1. */
export function directionOf(mapping: Mapping, u: number, v: number): Vec3 {
  const [a, b] = [2 * u - 1, 2 * v - 1];
  const [x, z] = mapping === "hemi-octahedral" ? [(a + b) / 2, (a - b) / 2] : [a, b];
  const y = 1 - Math.abs(x) - Math.abs(z);
  return unit(y < 0 ? [fold(x, z), y, fold(z, x)] : [x, y, z]);
}

/** The three views around a direction. */
export function viewsAround(mapping: Mapping, direction: Vec3, views: number): [Weighted, Weighted, Weighted] {
  const last = views - 1;
  const [u, v] = pointOf(mapping, direction).map((x) => x * last) as [number, number];
  const cell = (x: number) => Math.min(Math.max(Math.floor(x), 0), last - 1);
  const [column, row] = [cell(u), cell(v)];
  const isRight = (number: number) => 2 * number + 1 > last;
  const isMirrored = mapping === "octahedral" && isRight(column) !== isRight(row);
  const [near, far] = isMirrored ? [1, 0] : [0, 1];
  const x = isMirrored ? 1 - (u - column) : u - column;
  const y = v - row;
  const weighted = (dx: number, dy: number, weight: number) => ({ column: column + dx, row: row + dy, weight });
  return x + y <= 1
    ? [weighted(near, 0, 1 - x - y), weighted(far, 0, x), weighted(near, 1, y)]
    : [weighted(far, 1, x + y - 1), weighted(far, 0, 1 - y), weighted(near, 1, 1 - x)];
}

/** The axes of the picture that an eye in this direction sees: to the right and level, up, and towards the eye. */
export function axesOf(direction: Vec3): { right: Vec3; up: Vec3; towards: Vec3 } {
  const towards = unit(direction);
  const level = Math.hypot(towards[0], towards[2]);
  const right: Vec3 = level > 1e-6 ? [towards[2] / level, 0, -towards[0] / level] : [1, 0, 0];
  return { right, up: cross(towards, right), towards };
}

/** Over the edge of the lower half. */
function fold(a: number, b: number): number {
  const far = 1 - Math.abs(b);
  return a < 0 ? -far : far;
}

function unit(v: Vec3): Vec3 {
  const length = Math.sqrt(dot(v, v));
  return length > 0 ? scale(v, 1 / length) : [0, 1, 0];
}
