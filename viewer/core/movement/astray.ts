/** Does a link lead into the world? Somebody may have typed it, or the world has changed since: then one sees nothing, or the inside of a wall. */
import { type Convex, distanceToCell } from "../basics/convex.ts";
import { type Bounds, diagonal_m, distanceToBounds } from "../basics/geometry.ts";
import type { Pose } from "./address.ts";

/** Out of the world, where nobody can stand, as inside of a wall, or to what is no place. */
export type Astray = "outside" | "walled" | "unreadable";

/** Who flies further away than so many diagonals of the world sees hardly anything of it. */
const FAR_DIAGONALS = 4;
/** What a place may be beside a cell, to a person: links are rounded. */
const BESIDE_M = 0.02;

/** Whether a pose is so far from the world that no cell need be asked. */
export function isFar(bounds: Bounds, { position }: Pose): boolean {
  return distanceToBounds(bounds, position) > FAR_DIAGONALS * diagonal_m(bounds);
}

/** What is wrong with a pose in a world where the nearest cell is known; `size` is that of who walks there. Who flies may be anywhere near. */
export function astray(bounds: Bounds, nearest: Convex, pose: Pose, size: number): Astray | undefined {
  if (isFar(bounds, pose)) return "outside";
  if (pose.mode === "fly" || distanceToCell(nearest, pose.position) <= BESIDE_M * size) return undefined;
  return distanceToBounds(bounds, pose.position) > 0 ? "outside" : "walled";
}
