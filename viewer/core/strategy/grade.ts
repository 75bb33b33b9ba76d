/**
 * In which ways can a model be drawn, and which of them costs least? A *grade* is a level of detail, or the mesh that a
 * smooth LOD gives up to a rung, or an impostor: pictures from all around, a coarse level with rich detail; or level 0 grown
 * here out of the rules that it has come from (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §8).
 *
 * The rule, in one place for first pictures and for refining: of the grades that are good enough for an error, the one for
 * which the fewest bytes have still to travel ({@link CostOf}: compressed, requests included). Rungs that are held are not
 * paid again, nor are pictures, materials and rules that are here. So smooth LODs are left alone where they would be worse:
 * where the coarsest levels of many models come in one compressed pack, where a coarse level names its pictures in a
 * smaller size, or where a model is too small to pay for its materials. Rules for which many wait cost each its share
 * (`sharing.ts`). Rules that are here would cost nothing for any
 * model, and fill the picture with triangles that nobody sees: so each triangle that grows counts as a byte.
 */
import type { FileRef } from "../documents/documents.ts";
import type { Impostor } from "../documents/impostordocument.ts";
import type { Level, Model, Rung, Smooth } from "../documents/modeldocument.ts";
import type { Rules } from "../documents/rulesdocument.ts";
import { type CostOf, compressed_bytes } from "./file.ts";

/** One way to draw a model. */
export interface Grade {
  readonly kind: "level" | "impostor" | "rung" | "grown";
  /** Of the level, 0 the finest; of the last rung that was taken in, 0 the coarsest; 0 of all else. */
  readonly number: number;
  readonly triangles: number;
  /** In model space, as those of levels. */
  readonly geometricError: number;
}

/** What is known of a model while one chooses for it. */
export interface Holding {
  /** What is drawn, if anything. */
  readonly held: Grade | undefined;
  /** How many rungs of its smooth LOD have come and need not come again. */
  readonly taken: number;
  /** Names of grades that could not be had: {@link nameOf}, or {@link ALL_RUNGS}. */
  readonly failed: ReadonlySet<string>;
  /** Whether its impostor is here, alone or beside what is held. */
  readonly hasImpostor?: boolean;
  /** Whether what is drawn lacks textures that may be had by now. */
  readonly isPlain?: boolean;
}

/** A smooth LOD that is damaged anywhere is not used at all. */
export const ALL_RUNGS = "rungs";
/** Rungs come together up to so many bytes, so that small models take one step and large ones show each. */
const STEP_BYTES = 16 * 1024;

/** What a triangle counts that is grown here. */
const GROWN_TRIANGLE_BYTES = 1;

const NO_FILES: readonly FileRef[] = [];

export function nameOf({ kind, number }: Pick<Grade, "kind" | "number">): string {
  return `${kind} ${number}`;
}

export function levelGrade({ level, triangles, geometricError }: Level): Grade {
  return { kind: "level", number: level, triangles, geometricError };
}

function rungGrade({ triangles, geometricError }: Rung, number: number): Grade {
  return { kind: "rung", number, triangles, geometricError };
}

/** Two triangles for each object. */
export function impostorGrade({ geometricError }: Impostor): Grade {
  return { kind: "impostor", number: 0, triangles: 2, geometricError };
}

function grownGrade({ triangles, geometricError }: Rules): Grade {
  return { kind: "grown", number: 0, triangles, geometricError };
}

/** The coarsest level: what a first picture is at least as good as. */
export function coarsestLevel(model: Model): Level | undefined {
  return model.levels.at(-1);
}

const known = new WeakMap<Model, readonly Grade[]>();

/** All ways to draw a model: what grows here, levels, finest first, then its impostor, then rungs, coarsest first. */
export function gradesOf(model: Model): readonly Grade[] {
  const grades = known.get(model) ?? [
    ...(model.rules ? [grownGrade(model.rules)] : []),
    ...model.levels.map(levelGrade),
    ...(model.impostor ? [impostorGrade(model.impostor)] : []),
    ...(model.smooth?.rungs ?? []).map(rungGrade),
  ];
  known.set(model, grades);
  return grades;
}

/** Whether nothing finer of its kind can be had. */
export function isFinest(model: Model, { kind, number }: Grade): boolean {
  if (kind === "impostor") return false;
  return number === (kind === "rung" ? (model.smooth?.rungs.length ?? 0) - 1 : 0);
}

/** Whether a grade will do where errors up to this, in model space, do; the finest of a kind always will. */
export function isGoodEnough(model: Model, grade: Grade, most_error: number): boolean {
  return grade.geometricError <= most_error || isFinest(model, grade);
}

/** Whether what is here of a model will do where errors up to this do. */
export function isHereWellEnough(model: Model, holding: Holding, most_error: number): boolean {
  const { held, hasImpostor = false } = holding;
  if (held && !isFailed(holding, held) && isGoodEnough(model, held, most_error)) return true;
  return hasImpostor && model.impostor !== undefined && model.impostor.geometricError <= most_error;
}

/** Whether a grade could not be had, or turned out to be damaged. */
export function isFailed({ failed }: Holding, grade: Grade): boolean {
  if (failed.size === 0) return false;
  return failed.has(nameOf(grade)) || (grade.kind === "rung" && failed.has(ALL_RUNGS));
}

/** Whether a model can be drawn by its smooth LOD and by nothing else, but for pictures of it. */
export function needsSmooth(model: Model, holding: Holding): boolean {
  const others = gradesOf(model).filter(({ kind }) => kind === "level" || kind === "grown");
  return others.every((grade) => isFailed(holding, grade));
}

/** The level that a grade is. */
export function levelOf(model: Model, { kind, number }: Grade): Level | undefined {
  return kind === "level" ? model.levels[number] : undefined;
}

/** The pictures that a mesh is drawn with; what grows has none. */
export function texturesOf(model: Model, grade: Grade): readonly FileRef[] {
  if (grade.kind === "rung") return model.smooth?.textures ?? NO_FILES;
  return levelOf(model, grade)?.textures ?? NO_FILES;
}

/** What has to be fetched to draw a model so after so many rungs. */
export function filesOf(model: Model, { kind, number }: Grade, taken = 0): readonly FileRef[] {
  if (kind === "level") {
    const level = model.levels[number];
    return level ? [level, ...level.textures] : NO_FILES;
  }
  if (kind === "impostor") return model.impostor ? [model.impostor.colour, model.impostor.shape] : NO_FILES;
  if (kind === "grown") return model.rules ? [model.rules.file, ...model.rules.imports.values()] : NO_FILES;
  if (!model.smooth) return NO_FILES;
  const { materials, textures } = model.smooth;
  return [...slicesOf(model.smooth, number, taken), materials, ...textures];
}

/** A part of a stream with a name of its own, or all of it. */
export interface Slice extends FileRef {
  readonly from: number;
}

/** The rungs that follow those that were taken, up to one; the whole stream, with one request, where that is all of it. */
export function slicesOf({ url, bytes, rungs }: Smooth, number: number, taken: number): Slice[] {
  if (taken === 0 && number === rungs.length - 1) return [{ url, bytes, from: 0 }];
  return rungs.slice(taken, number + 1).map(({ url, from, to }) => ({ url, bytes: to - from, from }));
}

/** Bytes that have still to travel until a model can be drawn so. */
export function cost_bytes(model: Model, grade: Grade, taken: number, costOf: CostOf): number {
  const pack = grade.kind === "level" ? model.levels[grade.number]?.pack : undefined;
  const [first, ...others] = filesOf(model, grade, taken);
  const cost = others.reduce((sum, file) => sum + costOf(file), 0);
  if (!first) return cost;
  if (grade.kind === "grown") return cost + costOf(first) + GROWN_TRIANGLE_BYTES * grade.triangles;
  // A pack is asked for once, for many.
  const packed_bytes = pack && (costOf(pack) === 0 ? 0 : compressed_bytes({ url: pack.url, bytes: first.bytes }));
  return cost + Math.min(packed_bytes ?? Number.POSITIVE_INFINITY, costOf(first));
}

/** What to draw a model with in the end where errors up to this do; `undefined` when nothing that would do can be had. */
export function goalOf(model: Model, most_error: number, holding: Holding, costOf: CostOf): Grade | undefined {
  let best: { grade: Grade; bytes: number } | undefined;
  for (const grade of gradesOf(model)) {
    if (isFailed(holding, grade) || !isGoodEnough(model, grade, most_error)) continue;
    const bytes = cost_bytes(model, grade, holding.taken, costOf);
    if (!best || bytes < best.bytes) best = { grade, bytes };
  }
  return best?.grade;
}

/** What to draw next on the way to a goal: a level at once, rungs in steps, none of them coarser than what is held. */
export function stepTowards(model: Model, goal: Grade, held: Grade | undefined): Grade {
  if (goal.kind !== "rung" || !model.smooth) return goal;
  const { rungs } = model.smooth;
  const first = held?.kind === "rung" ? held.number + 1 : 0;
  const from = rungs[first]?.from ?? 0;
  const most_error = held?.geometricError ?? Number.POSITIVE_INFINITY;
  const isTooCoarse = (number: number) => (rungs[number]?.geometricError ?? 0) >= most_error;
  const isSmall = (number: number) => (rungs[number]?.to ?? 0) - from <= STEP_BYTES;
  let number = first;
  while (number < goal.number && (isSmall(number + 1) || isTooCoarse(number))) number += 1;
  const rung = rungs[number];
  return rung ? rungGrade(rung, number) : goal;
}
