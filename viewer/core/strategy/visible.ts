/** What can be seen from a cell, as far as that is known, and how much of it is in the picture? */
import type { PlacedObject } from "../documents/placedobject.ts";
import { isHereWellEnough } from "./grade.ts";
import type { HoldingOf } from "./progress.ts";
import { siblingsIn } from "./siblings.ts";
import { type Eye, errorThatDoes } from "./sight.ts";

export interface Sight {
  /** The cell; `undefined` in a small world, where everything counts as visible, and while nothing is known. */
  readonly cell: number | undefined;
  /** What is known of it, the most important first; for some, what stands for them. */
  readonly objects: readonly PlacedObject[];
  /** How many objects can be seen, known or not. */
  readonly count: number;
  /** Of how many of them nothing can be had of the index; none unless said. */
  readonly lost?: number;
}

export const NOTHING_IN_SIGHT: Sight = { cell: undefined, objects: [], count: 0 };

/** Whether all is known that can be. */
export function isAllKnown({ objects, count, lost = 0 }: Sight): boolean {
  return objects.length + lost === count;
}

export function isSameSight(a: Sight, b: Sight): boolean {
  const isSame = a.cell === b.cell && a.count === b.count && a.lost === b.lost && a.objects.length === b.objects.length;
  return isSame && a.objects.every((object, i) => object === b.objects[i]);
}

/** Of what is visible, 0 to 1. */
export interface Shares {
  /** Of which anything is here. */
  readonly here: number;
  /** Of which enough is here, as far as the eye can tell. */
  readonly sharp: number;
}

/** Nothing where nothing is visible: there are no shares of that. */
export function shares(
  { objects, count }: Pick<Sight, "objects" | "count">,
  holdingOf: HoldingOf,
  eye: Eye,
  target_px: number,
): Shares | undefined {
  if (count === 0) return undefined;
  let [here, sharp] = [0, 0];
  for (const { model, objects: siblings } of siblingsIn(objects)) {
    const holding = holdingOf(model.model);
    if (!holding.held) continue;
    here += siblings.length;
    const isFinest = isHereWellEnough(model, holding, 0);
    const does = (object: PlacedObject) => isHereWellEnough(model, holding, errorThatDoes(object, eye, target_px));
    sharp += isFinest ? siblings.length : siblings.filter(does).length;
  }
  return { here: here / count, sharp: sharp / count };
}
