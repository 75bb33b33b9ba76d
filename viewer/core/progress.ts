/**
 * How much of what one can see is here? Exact, because the documents say how large everything is: bytes of levels or rungs
 * and of their textures, each once however many objects share them.
 */
import type { Grade, Holding } from "./grades.ts";
import { filesOf, goalOf, isHereWellEnough } from "./grades.ts";
import type { PlacedObject } from "./objects.ts";
import { type Eye, errorThatDoes, firstGoal } from "./scheduler.ts";
import type { Sight } from "./sight.ts";
import { costAlone_bytes } from "./travel.ts";

export interface Progress {
  readonly loaded_bytes: number;
  readonly total_bytes: number;
}

/** What is known of a model. */
export type HoldingOf = (model: number) => Holding;

/** Towards the first picture: something of everything visible. */
export function firstProgress(visible: readonly PlacedObject[], holdingOf: HoldingOf): Progress {
  return progressTowards(visible, holdingOf, (object, asked) => ({
    grade: firstGoal(object, asked, costAlone_bytes),
    does: true,
  }));
}

/** Towards the sharp picture: of everything visible what will do from here. */
export function sharpProgress(
  visible: readonly PlacedObject[],
  holdingOf: HoldingOf,
  eye: Eye,
  target_px: number,
): Progress {
  return progressTowards(visible, holdingOf, (object, asked, holding) => {
    const most_error = errorThatDoes(object, eye, target_px);
    const grade = goalOf(object.model, most_error, asked, costAlone_bytes);
    return { grade, does: isHereWellEnough(object.model, holding, most_error) };
  });
}

/** Of what is visible, 0 to 1. */
export interface Shares {
  /** Of which anything is here. */
  readonly here: number;
  /** Of which enough is here, as far as the eye can tell. */
  readonly sharp: number;
}

export function shares({ objects, count }: Sight, holdingOf: HoldingOf, eye: Eye, target_px: number): Shares {
  let [here, sharp] = [0, 0];
  for (const object of objects) {
    const holding = holdingOf(object.model.model);
    if (!holding.held) continue;
    here += 1;
    if (isHereWellEnough(object.model, holding, errorThatDoes(object, eye, target_px))) sharp += 1;
  }
  return count === 0 ? { here: 1, sharp: 1 } : { here: here / count, sharp: sharp / count };
}

/** The grade that is wanted of an object, and whether what is held, if anything, does. */
type Wanted = (object: PlacedObject, asked: Holding, holding: Holding) => { grade: Grade | undefined; does: boolean };

function progressTowards(visible: readonly PlacedObject[], holdingOf: HoldingOf, wantedOf: Wanted): Progress {
  const wanted = new Map<number, { object: PlacedObject; grade: Grade; held: Grade | undefined; does: boolean }>();
  for (const object of visible) {
    const { model } = object.model;
    const holding = holdingOf(model);
    const { held, failed } = holding;
    // What it takes from the beginning, so that the total does not depend on what is here; but nothing else is fetched for
    // what has grown.
    const asked = { held: undefined, failed };
    const { grade, does } = held?.kind === "grown" ? { grade: held, does: true } : wantedOf(object, asked, holding);
    const other = wanted.get(model);
    if (grade && (!other || grade.geometricError < other.grade.geometricError)) {
      wanted.set(model, { object, grade, held, does: held !== undefined && does });
    }
  }
  const files = new Map<string, { bytes: number; loaded: boolean }>();
  for (const { object, grade, held, does } of wanted.values()) {
    const here = new Set(held ? filesOf(object.model, held).map(({ url }) => url) : []);
    for (const { url, bytes } of filesOf(object.model, grade)) {
      const loaded = does || here.has(url) || (files.get(url)?.loaded ?? false);
      files.set(url, { bytes, loaded });
    }
  }
  let [loaded_bytes, total_bytes] = [0, 0];
  for (const { bytes, loaded } of files.values()) {
    total_bytes += bytes;
    if (loaded) loaded_bytes += bytes;
  }
  return { loaded_bytes, total_bytes };
}
