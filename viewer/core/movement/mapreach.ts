/**
 * How much of a world does a map show? At first all that is built in a world of few cells, and the eye, else some cells around the eye; at
 * most the whole world, with air and ground far around, and at least a small cell. A map's reach goes from its middle to its edge.
 */
import { type Bounds, boundsOf, nearestInBounds, type Vec3 } from "../basics/geometry.ts";
import type { CellEntry, Manifest } from "../documents/documents.ts";

/** Between these a map can be zoomed. */
export interface ReachRange {
  readonly least_m: number;
  readonly most_m: number;
}

/** A line on a map, and how long it is in the world. */
export interface ScaleBar {
  readonly length_m: number;
  readonly length_px: number;
}

/** Some room is left around the world. */
const MARGIN = 0.05;
/** So many cells are shown at first. */
const CELLS_AROUND = 48;
/** A small cell, from its middle to its wall, and the least that is shown at first, for a person. */
const [SMALL_CELL_M, FIRST_M] = [2, 12];
/** Any world can be seen so much nearer than whole. */
const LEAST_ZOOM = 4;

/** What can be on a map of a world: its objects and cells, with some room around them. */
export function groundOf({ bounds, cells }: Pick<Manifest, "bounds" | "cells">): Bounds {
  return withMargin([bounds, ...cells.entries.map((entry) => entry.bounds)]);
}

/** Where cells and objects are: neither air far around a house, nor ground that reaches to the horizon around its rooms. */
export function builtOf({ cells }: Pick<Manifest, "cells">, objects: Bounds): Bounds {
  if (cells.entries.length === 0) return objects;
  const rooms = boundsOf(cells.entries.flatMap(({ bounds: { min, max } }) => [min, max]));
  const [min, max] = [nearestInBounds(objects, rooms.min), nearestInBounds(objects, rooms.max)];
  // Where they are apart both of them matter.
  return min[0] < max[0] && min[2] < max[2] ? { min, max } : boundsOf([rooms.min, rooms.max, objects.min, objects.max]);
}

/** What matters of some ground: what is built there, and the eye, as far as that is on it. */
export function builtAround(built: Bounds, eye: Vec3, ground: Bounds): Bounds {
  const there = nearestInBounds(ground, eye);
  return withMargin([built, { min: there, max: there }]);
}

function withMargin(all: readonly Bounds[]): Bounds {
  const low = (axis: 0 | 1 | 2) => Math.min(...all.map(({ min }) => min[axis]));
  const high = (axis: 0 | 1 | 2) => Math.max(...all.map(({ max }) => max[axis]));
  // Of a world that is a point a metre is shown.
  const margin_m = Math.max(high(0) - low(0), high(2) - low(2)) * MARGIN || 0.5;
  return {
    min: [low(0) - margin_m, low(1), low(2) - margin_m],
    max: [high(0) + margin_m, high(1), high(2) + margin_m],
  };
}

/** How far a map of some ground reaches, for one who has a share of a person's size. */
export function reachRange(ground: Bounds, size: number): ReachRange {
  const most_m = reachOf(ground);
  return { least_m: Math.min(most_m / LEAST_ZOOM, SMALL_CELL_M * size), most_m };
}

function reachOf({ min, max }: Bounds): number {
  return Math.max(max[0] - min[0], max[2] - min[2]) / 2;
}

/** Of a storey with few cells all that matters is shown first, else as far as the cells around the eye. */
export function firstReach(
  range: ReachRange,
  matters: Bounds,
  storey: readonly CellEntry[],
  eye: Vec3,
  size: number,
): number {
  const aside_m = ({ bounds: { min, max } }: CellEntry, axis: 0 | 2) =>
    Math.abs((min[axis] + max[axis]) / 2 - eye[axis]);
  const distances_m = storey.map((cell) => Math.max(aside_m(cell, 0), aside_m(cell, 2))).sort((a, b) => a - b);
  const around_m = Math.min(distances_m[CELLS_AROUND] ?? Infinity, reachOf(matters));
  return withinReach(range, Math.max(around_m, FIRST_M * size));
}

export function withinReach({ least_m, most_m }: ReachRange, reach_m: number): number {
  return Math.min(most_m, Math.max(least_m, reach_m));
}

/** The longest line of 1, 2 or 5 times a power of ten metres that is no longer than so many pixels. */
export function scaleBar(px_per_m: number, most_px: number): ScaleBar {
  const most_m = most_px / px_per_m;
  // Powers of ten below one are exact as quotients, not as products.
  const exponent = Math.floor(Math.log10(most_m));
  const power = (digit: number) => (exponent < 0 ? digit / 10 ** -exponent : digit * 10 ** exponent);
  const length_m = [5, 2].map(power).find((m) => m <= most_m) ?? power(1);
  return { length_m, length_px: length_m * px_per_m };
}
