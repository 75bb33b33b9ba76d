/** What does the picture show, in words? For who cannot see it: the direction of the view, the largest things in it, and who is in sight. */
import {
  type Bounds,
  diagonal_m,
  direction,
  dot,
  length,
  middle,
  subtract,
  type Vec3,
} from "../core/basics/geometry.ts";
import { write } from "./dom.ts";
import { writeDoor, writePeople } from "./format.ts";
import type { Visit } from "./visit.ts";

/** Something that may be in the picture. */
export interface Thing {
  readonly name: string;
  readonly bounds: Bounds;
}

export interface View {
  readonly position: Vec3;
  readonly yaw: number;
}

const UPDATE_EVERY_MS = 1000;
const MOST_THINGS = 6;
/** What is further off the middle of the picture is left out, cosine. */
const ASIDE = 0.8;
/** Looking along −Z, and then turning left. */
const DIRECTIONS = ["north", "north-west", "west", "south-west", "south", "south-east", "east", "north-east"];

/** For example: “Facing west. Ahead: chest, lamp. 2 people in sight: Ada, Ben.” */
export function describe(view: View, things: Iterable<Thing>, people: readonly string[] = []): string {
  const names = [...new Set(largestAhead(view, things))].slice(0, MOST_THINGS);
  const facing = `Facing ${quarter(view.yaw)}.`;
  const ahead = names.length > 0 ? `Ahead: ${names.join(", ")}.` : "Nothing is known of what is ahead.";
  return [facing, ahead, ...(people.length > 0 ? [`${writePeople(people)}.`] : [])].join(" ");
}

function quarter(yaw: number): string {
  const step = Math.round((yaw / (2 * Math.PI)) * DIRECTIONS.length);
  return DIRECTIONS[((step % DIRECTIONS.length) + DIRECTIONS.length) % DIRECTIONS.length] ?? "";
}

/** Names of what stands ahead, by how large it looks. */
function largestAhead({ position, yaw }: View, things: Iterable<Thing>): string[] {
  const seen: { name: string; size: number }[] = [];
  for (const { name, bounds } of things) {
    const way = subtract(middle(bounds), position);
    const distance_m = Math.max(length(way), 1e-3);
    const straight = dot(direction(yaw), way) / distance_m;
    if (straight >= ASIDE && name) seen.push({ name, size: diagonal_m(bounds) / distance_m });
  }
  return seen.sort((a, b) => b.size - a.size).map(({ name }) => name);
}

/** Keeps a description of the canvas up to date; `people` names who is in sight, where one meets people. */
export function describeInto(line: HTMLElement, visit: Visit, people?: () => readonly string[]): void {
  let again_ms = 0;
  visit.onFrame((now_ms) => {
    if (now_ms < again_ms) return false;
    again_ms = now_ms + UPDATE_EVERY_MS;
    const things = visit.explorer.visible.map(({ entry }) => ({
      name: entry.door ? writeDoor(entry.sourceNode) : entry.sourceNode,
      bounds: entry.bounds,
    }));
    write(line, describe(visit.walker, things, people?.()));
    return false;
  });
}
