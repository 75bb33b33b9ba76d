/**
 * What could not be had of models, or turned out to be damaged? Grades by their names, until they are tried again, and why others stand
 * in for them.
 */
import { reasonOf } from "../basics/reason.ts";
import { type Loss, mayRetry, type Retried } from "../fetch/losses.ts";
import { ALL_RUNGS, type Grade, nameOf } from "../strategy/grade.ts";

/** A grade that could not be had, by its name. */
interface FailedGrade extends Loss {
  readonly model: number;
  readonly name: string;
}

const NONE: ReadonlySet<string> = new Set();

export class FailedGrades {
  private readonly names = new Map<number, Set<string>>();
  private readonly losses = new Set<FailedGrade>();
  private readonly reasons = new Map<number, string>();

  /** Names of grades of a model: {@link nameOf}, or {@link ALL_RUNGS}. */
  of(model: number): ReadonlySet<string> {
    return this.names.get(model) ?? NONE;
  }

  /** Why a model is drawn otherwise than it could be. */
  reasonFor(model: number): string | undefined {
    return this.reasons.get(model);
  }

  /** All of these reasons. */
  get allReasons(): readonly string[] {
    return [...this.reasons.values()];
  }

  /** A grade cannot be had. */
  add(model: number, grade: Grade, error: unknown): void {
    const names = this.names.get(model) ?? new Set();
    this.names.set(model, names);
    // Any rung may be the damaged one.
    const name = grade.kind === "rung" ? ALL_RUNGS : nameOf(grade);
    names.add(name);
    this.losses.add({ model, name, error });
  }

  /** Levels stand in for it. */
  explain(model: number, error: unknown): void {
    this.reasons.set(model, reasonOf(error));
  }

  /** Forgets failures, so that they are tried again. */
  forgive(retried: Retried): void {
    for (const loss of this.losses) {
      if (!mayRetry(loss, retried)) continue;
      this.losses.delete(loss);
      this.names.get(loss.model)?.delete(loss.name);
      this.reasons.delete(loss.model);
    }
  }
}
