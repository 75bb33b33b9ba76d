/**
 * How urgent is a download, and why? Lower goes first. Each purpose has a band, refined by what is added to it; one number
 * decides, and every want says in words where it has it from. The same bands as in `client/src/strategy/priority.rs`.
 */
import type { PlacedObject } from "../documents/placedobject.ts";
import type { Step } from "./ahead.ts";
import { type Grade, nameOf } from "./grade.ts";

export const PRIORITY = {
  document: 0,
  /** Something of everything visible. */
  coarsest: 1_000_000,
  /** What may be visible before it could come otherwise. */
  due: 1_500_000,
  finer: 2_000_000,
  /** What may be visible later. */
  prefetch: 3_000_000,
} as const;

/** Behind every refinement, which lie within 100,000 of the start of their band. */
const LAST_OF_BAND = 400_000;

/** What a download is for: the bands of its priority. */
export type Purpose = "document" | "coarsest" | "finer" | "prefetch";

/** What a priority is for. */
export function purposeOf(priority: number): Purpose {
  if (priority >= PRIORITY.prefetch) return "prefetch";
  if (priority >= PRIORITY.finer) return "finer";
  if (priority >= PRIORITY.due) return "prefetch";
  return priority >= PRIORITY.coarsest ? "coarsest" : "document";
}

/** Why something is wanted. */
export type Cause =
  /** It can be seen, and nothing of it is here. */
  | { readonly kind: "missing" }
  /** What is here of it is off by so many pixels. */
  | { readonly kind: "finer"; readonly error_px: number }
  /** What is here of it is drawn without some of its textures. */
  | { readonly kind: "plain" }
  /** Its pictures save drawing so many triangles. */
  | { readonly kind: "relief"; readonly triangles: number }
  /** What is here of it takes more memory than there is. */
  | { readonly kind: "coarser" }
  /** It can be seen from a cell that one may enter soon; `due` when there is just time enough to fetch it. */
  | {
      readonly kind: "ahead";
      readonly cell: number;
      readonly step: Step;
      readonly in_s: number;
      readonly due: boolean;
    };

/** A grade that should be fetched. */
export interface Want {
  /** The object that needs it most. */
  readonly object: PlacedObject;
  readonly grade: Grade;
  readonly cause: Cause;
  /** Lower is more urgent. */
  readonly priority: number;
}

/** The priority of the `rank`th want of its kind. */
export function priorityOf(cause: Cause, rank: number): number {
  switch (cause.kind) {
    case "coarser":
      return PRIORITY.coarsest;
    case "missing":
      return PRIORITY.coarsest + rank;
    case "ahead":
      return (cause.due ? PRIORITY.due : PRIORITY.prefetch) + rank;
    case "plain":
      return PRIORITY.finer;
    case "finer":
      return PRIORITY.finer + 100_000 / (1 + cause.error_px);
    case "relief":
      return PRIORITY.finer + LAST_OF_BAND - Math.min(cause.triangles, LAST_OF_BAND) / 2;
  }
}

/** Why it is fetched, in a few words. */
export function reasonFor({ object, grade, cause }: Want): string {
  return `${inWords(cause)}: m${object.model.model} ${nameOf(grade)}`;
}

/** Why a pack is fetched that brings so many of the models that are wanted. */
export function reasonForPack({ cause }: Want, models: number): string {
  return `${inWords(cause)}: a pack for ${models} ${models === 1 ? "model" : "models"}`;
}

function inWords(cause: Cause): string {
  switch (cause.kind) {
    case "missing":
      return "not here yet";
    case "coarser":
      return "memory is short";
    case "plain":
      return "without its textures";
    case "finer":
      return `${cause.error_px.toFixed(1)} px off`;
    case "relief":
      return `saves ${cause.triangles.toLocaleString("en")} triangles`;
    case "ahead":
      return `seen from c${cause.cell}, ${cause.in_s.toFixed(1)} s ahead`;
  }
}
