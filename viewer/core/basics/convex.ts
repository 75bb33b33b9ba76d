/**
 * Does a point lie in a convex cell, and does it surely lie in no other? A cell is a box, or where a box and some
 * half-spaces meet. The arithmetic is that of every other client, to the last bit: see docs/FORMAT.md.
 */
import {
  add,
  type Bounds,
  distanceToBounds,
  dot,
  type Plane,
  planesOfBounds,
  scale,
  subtract,
  type Vec3,
} from "./geometry.ts";

/** A point no further outside a half-space than this is inside: rounding must leave no gaps between cells. */
const TOUCH_M = 1e-6;
/** Published cells overlap by less than this, so a point that lies deeper than this in one lies in no other. */
const SURE_M = 2e-3;

/** Turns that projections onto slanted walls take at most to agree. */
const MOST_TURNS = 32;

/** What is known of the shape of a cell. */
export interface Convex {
  readonly bounds: Bounds;
  /** Half-spaces that together with the box are the cell; none when it is its box. */
  readonly planes: readonly Plane[];
}

/** The planes of a cell before its record has arrived. */
export function planesOfCell(cell: Convex): readonly Plane[] {
  return cell.planes.length > 0 ? cell.planes : planesOfBounds(cell.bounds);
}

const outside = (plane: Plane, point: Vec3): number => dot(plane.normal, point) - plane.offset;

/** Zero when a point lies in a cell, else the largest of its distances in metres to the cell's box and to its planes. */
export function distanceToCell(cell: Convex, point: Vec3): number {
  let distance_m = distanceToBounds(cell.bounds, point);
  for (const plane of cell.planes) {
    const outside_m = outside(plane, point);
    if (outside_m > TOUCH_M && outside_m > distance_m) distance_m = outside_m;
  }
  return distance_m;
}

/** Whether a point lies so deep in a cell that it lies in no other. */
export function holdsAlone(cell: Convex, point: Vec3): boolean {
  const { min, max } = cell.bounds;
  for (const axis of [0, 1, 2] as const) {
    if (!(min[axis] + SURE_M < point[axis] && point[axis] < max[axis] - SURE_M)) return false;
  }
  return cell.planes.every((plane) => outside(plane, point) < -SURE_M);
}

/** How far down a cell is below a point: zero from inside; infinite when it lies aside or above. */
export function dropTo({ bounds: { min, max }, planes }: Convex, [x, y, z]: Vec3): number {
  if (x < min[0] || x > max[0] || z < min[2] || z > max[2]) return Number.POSITIVE_INFINITY;
  let [low, high] = [min[1], max[1]];
  for (const { normal, offset } of planes) {
    const room = offset + TOUCH_M - normal[0] * x - normal[2] * z;
    if (normal[1] > 0) high = Math.min(high, room / normal[1]);
    else if (normal[1] < 0) low = Math.max(low, room / normal[1]);
    else if (room < 0) return Number.POSITIVE_INFINITY;
  }
  return low <= Math.min(high, y) ? Math.max(0, y - high) : Number.POSITIVE_INFINITY;
}

/**
 * The point of a cell that is nearest to a point, as far from its walls as `off_m` or else in their middle. Boxes at once;
 * slanted walls by projecting onto them in turns (Boyle & Dykstra, A method for finding projections onto the intersection
 * of convex sets in Hilbert spaces, 1986).
 */
export function nearestPoint({ bounds, planes }: Convex, point: Vec3, off_m: number): Vec3 {
  const clamp = (at: Vec3): Vec3 => [
    between(at[0], bounds.min[0], bounds.max[0], off_m),
    between(at[1], bounds.min[1], bounds.max[1], off_m),
    between(at[2], bounds.min[2], bounds.max[2], off_m),
  ];
  const onto = (plane: Plane) => (at: Vec3) =>
    subtract(at, scale(plane.normal, Math.max(0, outside(plane, at) + off_m)));
  const steps = [clamp, ...planes.map(onto)].map((project) => ({ project, owed: [0, 0, 0] as Vec3 }));
  let at = point;
  for (let turn = 0; turn < (planes.length > 0 ? MOST_TURNS : 1); turn += 1) {
    for (const step of steps) {
      const from = add(at, step.owed);
      at = step.project(from);
      step.owed = subtract(from, at);
    }
  }
  return at;
}

function between(value: number, min: number, max: number, off: number): number {
  const room = Math.min(off, (max - min) / 2);
  return Math.min(max - room, Math.max(min + room, value));
}
