/**
 * How large is who goes through a world, and how fast? A person, where a person can stand upright. What is lower was made to another
 * scale: there the height of the navigable space says how large one is at most, and the world's diagonal that it takes some steps to
 * cross. Who flies crosses any world in the same time at most.
 */
import { diagonal_m as diagonalOf_m } from "../basics/geometry.ts";
import { EYE_HEIGHT_M } from "../basics/person.ts";
import type { Manifest } from "../documents/documents.ts";

/** All lengths and speeds of who walks, as shares of a person's. */
export interface Stature {
  /** 1 for a person; smaller where one has to be. */
  readonly size: number;
  readonly flight_mps: number;
}

/** So high must a space be for a person to stand upright: up to the eyes, and some room above them. */
const UPRIGHT_M = 2;
/** A world that is no larger than this is too small for a person. */
const SMALLEST_M = 10 * EYE_HEIGHT_M;
/** As fast as one may fly where a person is at home … */
const FLIGHT_MPS = 4.4;
/** … and fast enough to cross everything in this time; in less than one minute who hurries. */
const CROSSING_S = 120;

export const PERSON: Stature = { size: 1, flight_mps: FLIGHT_MPS };

/** Of who goes through a scene. */
export function statureIn({ bounds, cells }: Pick<Manifest, "bounds" | "cells">): Stature {
  const diagonal_m = diagonalOf_m(bounds);
  const tops = cells.entries.map((entry) => entry.bounds.max[1]);
  const floors = cells.entries.map((entry) => entry.bounds.min[1]);
  const height_m = cells.entries.length > 0 ? Math.max(...tops) - Math.min(...floors) : UPRIGHT_M;
  const isLow = height_m < UPRIGHT_M && diagonal_m > 0 && height_m > 0;
  const size = isLow ? Math.min(height_m / UPRIGHT_M, diagonal_m / SMALLEST_M) : 1;
  return { size, flight_mps: Math.max(FLIGHT_MPS * size, diagonal_m / CROSSING_S) };
}
