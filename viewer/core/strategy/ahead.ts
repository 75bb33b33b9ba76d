/**
 * Which cells may be entered soon, and when at the earliest? In three steps (Marvie & Bouatouch, A VRML97-X3D extension for
 * massive scenery management in virtual worlds, 2004, §6.1): where one heads, the other cells next door, and those beyond
 * where one heads. The same as `client/src/strategy/ahead.rs`.
 *
 * One heads for the cell behind the nearest opening that lies ahead in the direction of travel, which need not be hit
 * exactly. Who turns round on the spot may be in any other cell next door as soon as the way to its opening takes; so every
 * cell has a time, and what there is no hurry for can wait.
 */
import {
  type Bounds,
  boundsOf,
  distanceToBounds,
  dot,
  length,
  middle,
  subtract,
  type Vec3,
} from "../basics/geometry.ts";
import type { CellRecord } from "../documents/cellrecord.ts";
import type { CellEntry } from "../documents/documents.ts";

/** Who stands may start to walk at this speed. */
const WALKING_MPS = 1.4;
/** An opening further away than this is not what one heads for. */
const RANGE_M = 30;
/** Who would have to turn for a cell is there later by so much. */
const TURN_S = 1;

/** What lies ahead is due so many seconds before it could be needed … */
const MARGIN_S = 3;
/** … and this many times as long as fetching it takes. */
const CAUTION = 2;
/** What cannot be needed sooner than this waits although the line rests. */
export const HORIZON_S = 30;
/** About what the documents of a cell take. */
const DOCUMENTS_BYTES = 64 * 1024;

/** Where one heads (1), next door (2), or beyond where one heads (3). */
export type Step = 1 | 2 | 3;

/** A cell that may be entered. */
export interface Approach {
  readonly cell: number;
  readonly step: Step;
  /** One may be there after so long. */
  readonly in_s: number;
}

/** What is known of cells. */
export interface KnownCells {
  entryOf(cell: number): CellEntry | undefined;
  recordOf(cell: number): CellRecord | undefined;
}

/** The way to the nearest opening that leads to a cell. */
interface Way {
  readonly cell: number;
  readonly away_m: number;
  /** Where the opening is. */
  readonly at: Vec3;
  readonly isAhead: boolean;
}

/** The cells that may be entered, in the order in which to care for them, each once. */
export function approaches(here: number, cells: KnownCells, position: Vec3, velocity_mps: Vec3): Approach[] {
  const entry = cells.entryOf(here);
  if (!entry) return [];
  const speed_mps = length(velocity_mps);
  const pace_mps = speed_mps > 0 ? speed_mps : WALKING_MPS;
  const ways = entry.adjacent
    .map((cell) => wayTo(cell, here, cells, position, velocity_mps))
    .sort((a, b) => a.away_m - b.away_m || a.cell - b.cell);
  const heading = ways.find(({ isAhead, away_m }) => isAhead && away_m <= RANGE_M);
  const found: Approach[] = heading ? [{ cell: heading.cell, step: 1, in_s: heading.away_m / pace_mps }] : [];
  for (const { cell, away_m, isAhead } of ways) {
    if (cell === heading?.cell) continue;
    found.push({ cell, step: 2, in_s: away_m / pace_mps + (speed_mps > 0 && !isAhead ? TURN_S : 0) });
  }
  const named = new Set([here, ...found.map(({ cell }) => cell)]);
  for (const cell of heading ? (cells.entryOf(heading.cell)?.adjacent ?? []) : []) {
    if (!heading || named.has(cell)) continue;
    named.add(cell);
    const beyond = wayTo(cell, heading.cell, cells, heading.at, velocity_mps);
    found.push({ cell, step: 3, in_s: (heading.away_m + beyond.away_m) / pace_mps });
  }
  return found;
}

/** Whether there is just time enough to fetch so many bytes before one could be there. */
export function isDue(in_s: number, bytes: number, bytes_per_s: number): boolean {
  return in_s <= MARGIN_S + (CAUTION * bytes) / bytes_per_s;
}

/** How soon to learn what can be seen from a cell: before any of that could be due, or as soon as that is. */
export function whenToKnow(in_s: number, bytes_per_s: number): "due" | "later" | "not yet" {
  if (isDue(in_s, DOCUMENTS_BYTES, bytes_per_s)) return "due";
  return in_s <= HORIZON_S ? "later" : "not yet";
}

function wayTo(cell: number, from: number, cells: KnownCells, position: Vec3, velocity_mps: Vec3): Way {
  let nearest: { bounds: Bounds; away_m: number } | undefined;
  for (const portal of cells.recordOf(from)?.portals ?? []) {
    if (portal.to !== cell || portal.polygon.length === 0) continue;
    const bounds = boundsOf(portal.polygon);
    const away_m = distanceToBounds(bounds, position);
    if (!nearest || away_m < nearest.away_m) nearest = { bounds, away_m };
  }
  const bounds = nearest?.bounds ?? cells.entryOf(cell)?.bounds;
  if (!bounds) return { cell, away_m: Number.POSITIVE_INFINITY, at: position, isAhead: false };
  const at = middle(bounds);
  const isAhead = dot(velocity_mps, subtract(at, position)) > 0;
  return { cell, away_m: nearest?.away_m ?? distanceToBounds(bounds, position), at, isAhead };
}
