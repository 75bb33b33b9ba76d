/**
 * How much of what one can see is here? Counted in bytes of published files, each once however many objects share them, also of
 * those that are still on their way.
 *
 * The first picture is measured by coarsest levels, whatever stands for them: a rung, pictures or what was grown counts as
 * the level that need not come any more. So the total is what the cell's record says, before anything else is known of the
 * objects, and stays the same. Of the sharp picture nothing is known before their entries are: until then its total is at
 * least what is known.
 */
import type { FileRef } from "../documents/documents.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { costAlone_bytes } from "./file.ts";
import type { Grade, Holding } from "./grade.ts";
import { coarsestLevel, filesOf, goalOf, isHereWellEnough } from "./grade.ts";
import { siblingsIn } from "./siblings.ts";
import { type Eye, errorThatDoes } from "./sight.ts";

export interface Progress {
  readonly loaded_bytes: number;
  /** Whether that is estimated, as something is here whose size is still unknown. */
  readonly isAbout: boolean;
  readonly total_bytes: number;
  /** Whether the total is a bound only. */
  readonly bound: "exact" | "least" | "most";
}

/** From 0 to 1; nothing is here while nobody knows what can be seen. */
export function shareOf(progress: Progress | undefined): number {
  if (!progress) return 0;
  const { loaded_bytes, total_bytes } = progress;
  return total_bytes === 0 ? 1 : Math.min(1, loaded_bytes / total_bytes);
}

/** What can be seen from a cell. */
export interface Scope {
  /** What is known of it; for some, what stands for them. */
  readonly objects: readonly PlacedObject[];
  /** How many objects it is. */
  readonly count: number;
  /** What the coarsest levels of all that can be seen with open doors take, where a record says so … */
  readonly told_bytes: number | undefined;
  /** … and whether closed doors hide some of that. */
  readonly isHiding: boolean;
}

/** What is known of a model. */
export type HoldingOf = (model: number) => Holding;

/** How much has come of one of a model's files that is on its way. */
export type CameOf = (model: number, file: FileRef) => number;

const NOTHING_CAME: CameOf = () => 0;

/** Towards the first picture: something of everything visible. */
export function firstProgress(scope: Scope, holdingOf: HoldingOf, cameOf: CameOf = NOTHING_CAME): Progress {
  const { objects, count, told_bytes, isHiding } = scope;
  const files = new Files();
  let [known, here] = [0, 0];
  for (const { model, objects: siblings } of siblingsIn(objects)) {
    const isHeld = holdingOf(model.model).held !== undefined;
    const coarsest = coarsestLevel(model);
    if (coarsest) {
      known += siblings.length;
      for (const file of [coarsest, ...coarsest.textures])
        files.add(file, isHeld ? file.bytes : cameOf(model.model, file));
    } else if (isHeld) here += siblings.length;
  }
  const unknown = count - known;
  const { loaded_bytes, total_bytes } = files;
  if (told_bytes === undefined || (isHiding && unknown === 0)) {
    return { loaded_bytes, isAbout: false, total_bytes, bound: unknown === 0 ? "exact" : "least" };
  }
  // What nobody knows of yet shares what is left of the total.
  const others_bytes = unknown === 0 ? 0 : ((told_bytes - total_bytes) * here) / unknown;
  return {
    loaded_bytes: loaded_bytes + Math.max(0, Math.round(others_bytes)),
    isAbout: here > 0,
    total_bytes: told_bytes,
    bound: isHiding ? "most" : "exact",
  };
}

/** Towards the sharp picture: of everything visible what will do from here. */
export function sharpProgress(
  scope: Scope,
  holdingOf: HoldingOf,
  eye: Eye,
  target_px: number,
  cameOf: CameOf = NOTHING_CAME,
): Progress {
  const wanted = new Map<number, { object: PlacedObject; grade: Grade; does: boolean }>();
  let known = 0;
  for (const object of scope.objects) {
    const { model } = object;
    if (coarsestLevel(model)) known += 1;
    const holding = holdingOf(model.model);
    const most_error = errorThatDoes(object, eye, target_px);
    // What it takes from the beginning, so that the total does not depend on what is here.
    const bare = { held: undefined, taken: 0, failed: holding.failed };
    const grade = goalOf(model, most_error, bare, costAlone_bytes);
    const other = wanted.get(model.model);
    if (grade && (!other || grade.geometricError < other.grade.geometricError)) {
      wanted.set(model.model, { object, grade, does: isHereWellEnough(model, holding, most_error) });
    }
  }
  const files = new Files();
  for (const { object, grade, does } of wanted.values()) {
    const { held } = holdingOf(object.model.model);
    const here = new Set(held ? filesOf(object.model, held).map(({ url }) => url) : []);
    for (const file of filesOf(object.model, grade))
      files.add(file, does || here.has(file.url) ? file.bytes : cameOf(object.model.model, file));
  }
  const { loaded_bytes, total_bytes } = files;
  return { loaded_bytes, isAbout: false, total_bytes, bound: known === scope.count ? "exact" : "least" };
}

/** Files, each once. */
class Files {
  private readonly files = new Map<string, { readonly bytes: number; readonly here_bytes: number }>();

  add({ url, bytes }: FileRef, here_bytes: number): void {
    this.files.set(url, { bytes, here_bytes: Math.max(here_bytes, this.files.get(url)?.here_bytes ?? 0) });
  }

  get loaded_bytes(): number {
    return [...this.files.values()].reduce((sum, { here_bytes }) => sum + here_bytes, 0);
  }

  get total_bytes(): number {
    return [...this.files.values()].reduce((sum, { bytes }) => sum + bytes, 0);
  }
}
