/**
 * Which objects are drawn by pictures? Those whose impostor is here and good enough from where the eye is, each by itself:
 * of a model that many objects share, near ones are drawn by its mesh and far ones by its pictures. One that is nearly near
 * enough stays as it is drawn, so that none flickers.
 */
import type { PlacedObject } from "../documents/placedobject.ts";
import { type Holding, impostorGrade } from "./grade.ts";
import { siblingsIn } from "./siblings.ts";
import { type Eye, errorOf_px } from "./sight.ts";

/** Pictures stay until their error is so many times what will do. */
const STAYS = 1.25;

/** The objects that are drawn by pictures now, when `before` were. */
export function farObjects(
  visible: readonly PlacedObject[],
  holdingOf: (model: number) => Holding,
  eye: Eye,
  target_px: number,
  before: ReadonlySet<number>,
): Set<number> {
  const far = new Set<number>();
  for (const { model, objects } of siblingsIn(visible)) {
    if (!model.impostor) continue;
    const { held, hasImpostor } = holdingOf(model.model);
    if (!hasImpostor) continue;
    const isAlone = held === undefined || held.kind === "impostor";
    const grade = impostorGrade(model.impostor);
    for (const object of objects) {
      const { object: id } = object.entry;
      const most_px = target_px * (before.has(id) ? STAYS : 1);
      if (isAlone || errorOf_px(object, grade, eye) <= most_px) far.add(id);
    }
  }
  return far;
}

/** Whether both hold the same objects. */
export function areSame(a: ReadonlySet<number>, b: ReadonlySet<number>): boolean {
  return a.size === b.size && [...a].every((object) => b.has(object));
}
