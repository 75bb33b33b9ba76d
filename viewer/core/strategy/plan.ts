/**
 * What should be fetched next of what is visible? A pure function of that, of what is held and of where the eye is; the same as
 * `client/src/strategy/plan.rs`. The rules stand in `docs/STRATEGY.md`, and `tests/golden/strategy` holds both to the same decisions;
 * what a triangle counts that grows in a first picture is each one's own affair.
 */
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import type { CostOf } from "./file.ts";
import {
  coarsestLevel,
  cost_bytes,
  type Grade,
  goalOf,
  gradesOf,
  type Holding,
  impostorGrade,
  isFailed,
  isGoodEnough,
  isHereWellEnough,
  levelGrade,
  stepTowards,
} from "./grade.ts";
import { type Cause, priorityOf, type Want } from "./priority.ts";
import { shared } from "./sharing.ts";
import { type Siblings, siblingsIn } from "./siblings.ts";
import { type Eye, errorOf_px, errorThatDoes } from "./sight.ts";

/** A triangle that need not be drawn in any picture is worth fetching so many bytes. */
const BYTES_PER_TRIANGLE = 16;
/** A target is doubled at most so often to keep to a budget of triangles. */
const MOST_DOUBLINGS = 16;

/** What is known while one plans. */
export interface Stock {
  of(model: number): Holding;
  readonly costOf: CostOf;
}

/** Everything to fetch of what is visible, most urgent first. While an object has nothing at all, nothing finer is in the plan. */
export function plan(visible: readonly PlacedObject[], stock: Stock, eye: Eye, target_px: number): Want[] {
  const first = firstWants(visible, stock);
  if (first.length > 0) return first;
  const finer = new Map<number, Want>();
  for (const siblings of siblingsIn(visible)) {
    const holding = stock.of(siblings.model.model);
    // What gets finer brings textures of its own.
    const wish = refinementOf(siblings, holding, stock.costOf, eye, target_px) ?? repainting(siblings, holding);
    if (wish) finer.set(siblings.model.model, wish);
  }
  const wants = [...finer.values(), ...reliefs(visible, stock, eye, target_px, finer)];
  return wants.sort((a, b) => a.priority - b.priority || a.object.model.model - b.object.model.model);
}

const NONE: ReadonlySet<number> = new Set();

/** Something of every model of which nothing is held, each once, but for those that were named already. */
export function firstWants(visible: readonly PlacedObject[], stock: Stock, named: ReadonlySet<number> = NONE): Want[] {
  const missing = siblingsIn(visible).filter(
    ({ model }) => !named.has(model.model) && stock.of(model.model).held === undefined,
  );
  if (missing.length === 0) return [];
  const waiting = new Map(missing.map(({ model }) => [model.model, model]));
  const costOf = shared([...waiting.values()], stock.costOf);
  const wants: Want[] = [];
  for (const { model, objects, rank } of missing) {
    const [object] = objects;
    if (!object || !waiting.has(model.model)) continue;
    const goal = firstGoal(object, stock.of(model.model), costOf);
    if (!goal) continue;
    waiting.delete(model.model);
    wants.push(want(object, stepTowards(model, goal, undefined), { kind: "missing" }, rank));
  }
  return wants;
}

/** Whether the first picture is there: something of everything visible, but for what cannot be had. */
export function hasFirstPicture(visible: readonly PlacedObject[], stock: Stock): boolean {
  return siblingsIn(visible).every(({ model, objects: [object] }) => {
    const holding = stock.of(model.model);
    return !object || holding.held || !firstGoal(object, holding, stock.costOf);
  });
}

/**
 * What a first picture of an object is made of: what costs least of all that is at least as good as its coarsest level;
 * where that cannot be had, whatever can.
 */
export function firstGoal({ model }: PlacedObject, holding: Holding, costOf: CostOf): Grade | undefined {
  const coarsest = coarsestLevel(model)?.geometricError ?? Number.POSITIVE_INFINITY;
  return goalOf(model, coarsest, holding, costOf) ?? goalOf(model, Number.POSITIVE_INFINITY, holding, costOf);
}

/** The next step of a model of which something is held: that of the object which needs it most, as urgent as any of them. */
function refinementOf(
  { model, objects }: Siblings,
  holding: Holding,
  costOf: CostOf,
  eye: Eye,
  target_px: number,
): Want | undefined {
  // Most of what is here is as fine as it gets, however near it is.
  if (!holding.held || isHereWellEnough(model, holding, 0)) return undefined;
  const goals = goalsOf(model, holding, costOf);
  let finest: Want | undefined;
  for (const object of objects) {
    const wish = refinement(object, holding, goals, eye, target_px);
    if (!wish) continue;
    const priority = Math.min(wish.priority, finest?.priority ?? wish.priority);
    finest = { ...(finest && wish.grade.geometricError > finest.grade.geometricError ? finest : wish), priority };
  }
  return finest;
}

/** What is held once more, where it is drawn without textures that may be had by now. */
function repainting({ objects: [object] }: Siblings, holding: Holding): Want | undefined {
  const { held, isPlain } = holding;
  return object && held && isPlain && !isFailed(holding, held) ? want(object, held, { kind: "plain" }, 0) : undefined;
}

/** The next step of an object of which something is held, unless that will do. */
function refinement(
  object: PlacedObject,
  holding: Holding,
  goals: (most_error: number) => Grade | undefined,
  eye: Eye,
  target_px: number,
): Want | undefined {
  const { model } = object;
  const { held } = holding;
  const most_error = errorThatDoes(object, eye, target_px);
  if (!held || isHereWellEnough(model, holding, most_error)) return undefined;
  const unsound = isFailed(holding, held);
  const goal = goals(most_error);
  if (!goal || (!unsound && goal.geometricError >= held.geometricError)) return undefined;
  const error_px = unsound ? Number.MAX_VALUE : errorOf_px(object, held, eye);
  return want(object, stepTowards(model, goal, unsound ? undefined : held), { kind: "finer", error_px }, 0);
}

/** What {@link goalOf} answers for one model, found once for all errors up to which the same grades will do. */
function goalsOf(model: Model, holding: Holding, costOf: CostOf): (most_error: number) => Grade | undefined {
  const found = new Map<number, Grade | undefined>();
  return (most_error) => {
    let sufficing = 0;
    for (const { geometricError } of gradesOf(model)) if (geometricError <= most_error) sufficing += 1;
    if (!found.has(sufficing)) found.set(sufficing, goalOf(model, most_error, holding, costOf));
    return found.get(sufficing);
  };
}

/**
 * Impostors that save so much drawing that they are worth fetching beside a mesh that is held: those of models that many
 * far objects share with a near one.
 */
function reliefs(
  visible: readonly PlacedObject[],
  stock: Stock,
  eye: Eye,
  target_px: number,
  busy: ReadonlyMap<number, Want>,
): Want[] {
  const saved = new Map<number, { object: PlacedObject; grade: Grade; triangles: number }>();
  for (const { model, objects } of siblingsIn(visible)) {
    if (!model.impostor || busy.has(model.model)) continue;
    const holding = stock.of(model.model);
    const grade = impostorGrade(model.impostor);
    if (!holding.held || holding.hasImpostor || isFailed(holding, grade)) continue;
    const saves = Math.max(0, holding.held.triangles - grade.triangles);
    for (const object of objects) {
      if (errorOf_px(object, grade, eye) > target_px) continue;
      const before = saved.get(model.model)?.triangles ?? 0;
      saved.set(model.model, { object, grade, triangles: before + saves });
    }
  }
  const worth = [...saved.values()].filter(
    ({ object, grade, triangles }) => triangles >= costOf_bytes(object, grade, stock) / BYTES_PER_TRIANGLE,
  );
  return worth.map(({ object, grade, triangles }) => want(object, grade, { kind: "relief", triangles }, 0));
}

/** What of a model came first, and what that takes alone. */
export interface Base {
  readonly grade: Grade;
  readonly bytes: number;
}

/** What to draw more coarsely when memory is short: the coarsest level of the visible model whose base takes most. */
export function shrink(
  visible: readonly PlacedObject[],
  baseOf: (model: number) => Base | undefined,
): Want | undefined {
  let largest: { object: PlacedObject; grade: Grade; bytes: number } | undefined;
  for (const object of visible) {
    const base = baseOf(object.model.model);
    const coarsest = coarsestLevel(object.model);
    if (!base || !coarsest || base.grade.kind === "impostor") continue;
    if (base.grade.kind === "level" && base.grade.number >= coarsest.level) continue;
    if (base.bytes > (largest?.bytes ?? 0)) largest = { object, grade: levelGrade(coarsest), bytes: base.bytes };
  }
  return largest && want(largest.object, largest.grade, { kind: "coarser" }, 0);
}

/**
 * The error on the screen with which everything visible takes at most so many triangles: `target_px`, or twice that, four
 * times … as much. The largest error is smallest when all have the same.
 */
export function targetWithin(
  visible: readonly PlacedObject[],
  eye: Eye,
  target_px: number,
  most_triangles: number,
): number {
  if (finestTriangles(visible) <= most_triangles) return target_px;
  let px = target_px;
  for (let doubled = 0; doubled < MOST_DOUBLINGS && trianglesAt(visible, eye, px) > most_triangles; doubled += 1)
    px *= 2;
  return px;
}

const finest = new WeakMap<readonly PlacedObject[], number>();

/** Triangles of all that is visible as fine as it can be had, counted once for each list. */
function finestTriangles(visible: readonly PlacedObject[]): number {
  const most = ({ model }: PlacedObject) => Math.max(0, ...gradesOf(model).map(({ triangles }) => triangles));
  const sum = finest.get(visible) ?? visible.reduce((total, object) => total + most(object), 0);
  finest.set(visible, sum);
  return sum;
}

/** Triangles of all that is visible where errors of so many pixels do. */
function trianglesAt(visible: readonly PlacedObject[], eye: Eye, px: number): number {
  let sum = 0;
  for (const object of visible) {
    const most_error = errorThatDoes(object, eye, px);
    let fewest = Number.POSITIVE_INFINITY;
    for (const grade of gradesOf(object.model)) {
      if (grade.triangles < fewest && isGoodEnough(object.model, grade, most_error)) fewest = grade.triangles;
    }
    if (fewest < Number.POSITIVE_INFINITY) sum += fewest;
  }
  return sum;
}

/** What has still to travel for a grade of an object. */
export function costOf_bytes({ model }: PlacedObject, grade: Grade, stock: Stock): number {
  return cost_bytes(model, grade, stock.of(model.model).taken, stock.costOf);
}

/** A want, and how urgent it is: the `rank`th of its kind. */
export function want(object: PlacedObject, grade: Grade, cause: Cause, rank: number): Want {
  return { object, grade, cause, priority: priorityOf(cause, rank) };
}
