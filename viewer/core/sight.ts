/** What can be seen from a cell, as far as that is known? */
import type { PlacedObject } from "./objects.ts";

export interface Sight {
  /** The cell; `undefined` in a small world, where everything counts as visible, and while nothing is known. */
  readonly cell: number | undefined;
  /** What is known of it, the most important first; for some, what stands for them. */
  readonly objects: readonly PlacedObject[];
  /** How many objects can be seen, known or not. */
  readonly count: number;
}

export const NOTHING_IN_SIGHT: Sight = { cell: undefined, objects: [], count: 0 };

export function isSameSight(a: Sight, b: Sight): boolean {
  const isSame = a.cell === b.cell && a.count === b.count && a.objects.length === b.objects.length;
  return isSame && a.objects.every((object, i) => object === b.objects[i]);
}
