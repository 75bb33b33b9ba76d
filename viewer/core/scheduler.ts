/**
 * What should be fetched next? A pure function of what is visible, what is held and where the eye is.
 *
 * Rule 1: something of every visible object, at least as good as its coarsest level, comes before anything finer of
 * anything; objects come in the order of their visible solid angle, as the cell's record lists them. Rule 2: then models
 * are refined by screen error, the worst first, until their error covers at most `target_px` pixels. Objects that share a
 * model share one download, and the object that needs it most decides. Whether levels, rungs or pictures are fetched for
 * that, `grades` says. Rule 3: last come pictures of models of which many far objects are drawn by a mesh.
 *
 * Screen error (thesis on walkthroughs, §6.3): an error of `e` metres at distance `d` covers `e · h / (2 d tan(α/2))`
 * of `h` pixels under the vertical view angle `α`.
 */
import { distanceToBounds, type Vec3 } from "./geometry.ts";
import {
  coarsestLevel,
  cost_bytes,
  type Grade,
  goalOf,
  type Holding,
  impostorGrade,
  isFailed,
  isHereWellEnough,
  levelGrade,
  nameOf,
  stepTowards,
} from "./grades.ts";
import { geometricError_m, type PlacedObject } from "./objects.ts";
import { PRIORITY, purposeOf } from "./priority.ts";
import type { Held } from "./residency.ts";
import type { CostOf } from "./travel.ts";

/** A triangle that need not be drawn in any picture is worth fetching so many bytes. */
const BYTES_PER_TRIANGLE = 16;
/** Behind every refinement, which lie within 100,000 of the start of their band. */
const LAST_OF_BAND = 400_000;

export interface Eye {
  readonly position: Vec3;
  /** Vertical view angle in radians. */
  readonly viewAngle_rad: number;
  /** Height of the picture in device pixels. */
  readonly height_px: number;
}

/** A grade that should be fetched. */
export interface Want {
  readonly object: PlacedObject;
  readonly grade: Grade;
  /** Lower is more urgent. */
  readonly priority: number;
  /** How far off the held grade is; `undefined` when nothing is held. */
  readonly error_px: number | undefined;
}

/** What is known while one plans. */
export interface Stock {
  of(model: number): Holding;
  readonly costOf: CostOf;
}

/** How many pixels an error covers at an object's distance. */
export function screenError_px(error_m: number, distance_m: number, eye: Eye): number {
  if (error_m === 0) return 0;
  return (error_m * eye.height_px) / (2 * Math.max(distance_m, 0.05) * Math.tan(eye.viewAngle_rad / 2));
}

/** How many pixels the error of a grade of an object covers. */
export function errorOf_px(object: PlacedObject, grade: Grade, eye: Eye): number {
  return screenError_px(geometricError_m(object, grade), distanceToBounds(object.entry.bounds, eye.position), eye);
}

/** The error, in the space of an object's model, that covers `target_px` pixels. */
export function errorThatDoes(object: PlacedObject, eye: Eye, target_px: number): number {
  const px_per_unit = screenError_px(object.entry.scale, distanceToBounds(object.entry.bounds, eye.position), eye);
  return target_px / px_per_unit;
}

/** Everything to fetch, most urgent first. While an object has nothing at all, nothing finer is in the plan. */
export function plan(visible: readonly PlacedObject[], stock: Stock, eye: Eye, target_px: number): Want[] {
  const first = new Map<number, Want>();
  const finer = new Map<number, Want>();
  visible.forEach((object, rank) => {
    const { model } = object;
    const holding = stock.of(model.model);
    if (holding.held === undefined) {
      const goal = first.has(model.model) ? undefined : firstGoal(object, holding, stock.costOf);
      if (!goal) return;
      const grade = stepTowards(model, goal, undefined);
      first.set(model.model, { object, grade, priority: PRIORITY.coarsest + rank, error_px: undefined });
      return;
    }
    const want = refinement(object, holding.held, holding, stock.costOf, eye, target_px);
    const other = finer.get(model.model);
    if (!want) return;
    if (!other) finer.set(model.model, want);
    else if (want.grade.geometricError <= other.grade.geometricError) {
      finer.set(model.model, { ...want, priority: Math.min(want.priority, other.priority) });
    }
  });
  const wants =
    first.size > 0 ? [...first.values()] : [...finer.values(), ...reliefs(visible, stock, eye, target_px, finer)];
  return wants.sort((a, b) => a.priority - b.priority);
}

/**
 * Impostors that save so much drawing that they are worth fetching beside a mesh that is held: those of models that many
 * far objects share with a near one. They come last.
 */
function reliefs(
  visible: readonly PlacedObject[],
  stock: Stock,
  eye: Eye,
  target_px: number,
  busy: ReadonlyMap<number, Want>,
): Want[] {
  const saved = new Map<number, { object: PlacedObject; grade: Grade; triangles: number }>();
  for (const object of visible) {
    const { model } = object;
    if (!model.impostor || busy.has(model.model)) continue;
    const holding = stock.of(model.model);
    const grade = impostorGrade(model.impostor);
    if (!holding.held || holding.hasImpostor || isFailed(holding, grade)) continue;
    if (errorOf_px(object, grade, eye) > target_px) continue;
    const before = saved.get(model.model)?.triangles ?? 0;
    const triangles = before + Math.max(0, holding.held.triangles - grade.triangles);
    saved.set(model.model, { object, grade, triangles });
  }
  const wants: Want[] = [];
  for (const { object, grade, triangles } of saved.values()) {
    if (triangles < cost_bytes(object.model, grade, undefined, stock.costOf) / BYTES_PER_TRIANGLE) continue;
    const priority = PRIORITY.finer + LAST_OF_BAND - Math.min(triangles, LAST_OF_BAND) / 2;
    wants.push({ object, grade, priority, error_px: undefined });
  }
  return wants;
}

/** What a first picture of an object is made of: what costs least of all that is at least as good as its coarsest level. */
export function firstGoal({ model }: PlacedObject, holding: Holding, costOf: CostOf): Grade | undefined {
  return goalOf(model, coarsestLevel(model)?.geometricError ?? Number.POSITIVE_INFINITY, holding, costOf);
}

/** The next step of an object of which something is held, unless that will do. */
function refinement(
  object: PlacedObject,
  held: Grade,
  holding: Holding,
  costOf: CostOf,
  eye: Eye,
  target_px: number,
): Want | undefined {
  const { model } = object;
  const most_error = errorThatDoes(object, eye, target_px);
  if (isHereWellEnough(model, holding, most_error)) return undefined;
  const unsound = isFailed(holding, held);
  const goal = goalOf(model, most_error, holding, costOf);
  if (!goal) return undefined;
  const error_px = unsound ? Number.MAX_VALUE : errorOf_px(object, held, eye);
  const priority = PRIORITY.finer + 100_000 / (1 + error_px);
  return { object, grade: stepTowards(model, goal, unsound ? undefined : held), priority, error_px };
}

/** What to draw more coarsely when memory is short: the coarsest level of the visible model that takes most. */
export function shrink(
  visible: readonly PlacedObject[],
  heldOf: (model: number) => Held | undefined,
): Want | undefined {
  let largest: { object: PlacedObject; grade: Grade; bytes: number } | undefined;
  for (const object of visible) {
    const held = heldOf(object.model.model);
    const coarsest = coarsestLevel(object.model);
    if (!held || !coarsest || held.grade.kind === "impostor") continue;
    if (held.grade.kind === "level" && held.grade.number >= coarsest.level) continue;
    if (held.bytes > (largest?.bytes ?? 0)) largest = { object, grade: levelGrade(coarsest), bytes: held.bytes };
  }
  if (!largest) return undefined;
  const { object, grade } = largest;
  return { object, grade, priority: PRIORITY.coarsest, error_px: undefined };
}

/** Why it is fetched, in a few words. */
export function reasonFor({ object, grade, priority, error_px }: Want): string {
  const what = `m${object.model.model} ${nameOf(grade)}`;
  if (purposeOf(priority) === "prefetch") return `seen ahead: ${what}`;
  return error_px === undefined ? `not here yet: ${what}` : `${error_px.toFixed(1)} px off: ${what}`;
}
