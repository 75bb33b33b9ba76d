/**
 * Which of these objects share a model? Found once for each list: thousands of objects are in sight that share some hundreds of models, and
 * most of what one asks of an object is the same for all that share its model.
 */
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";

/** Objects that share a model, in the order in which they were listed. */
export interface Siblings {
  readonly model: Model;
  readonly objects: readonly PlacedObject[];
  /** Where the first of them stands in the list. */
  readonly rank: number;
}

const known = new WeakMap<readonly PlacedObject[], readonly Siblings[]>();

/** All siblings in a list, which is not changed any more, in the order of the first of each. */
export function siblingsIn(objects: readonly PlacedObject[]): readonly Siblings[] {
  const found = known.get(objects) ?? gather(objects);
  known.set(objects, found);
  return found;
}

function gather(objects: readonly PlacedObject[]): readonly Siblings[] {
  const siblings = new Map<Model, { model: Model; objects: PlacedObject[]; rank: number }>();
  objects.forEach((object, rank) => {
    const others = siblings.get(object.model);
    if (others) others.objects.push(object);
    else siblings.set(object.model, { model: object.model, objects: [object], rank });
  });
  return [...siblings.values()];
}
