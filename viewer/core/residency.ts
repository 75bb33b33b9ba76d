/**
 * What is held, what has been promised a place, and what goes when memory is short? For each model at most one level of
 * detail, or one rung, at a time.
 *
 * Guarantees: nothing is promised that would exceed the limit together with what is held and promised already; what
 * a visible object needs goes only when another grade of its model has taken its place. Models that nothing visible
 * needs are kept while memory allows; those go first that are needed furthest away, counted in steps from cell to
 * adjacent cell, and of these the longest unused (Marvie & Bouatouch, A VRML97-X3D extension for massive scenery
 * management in virtual worlds, 2004, §6.2).
 */
import type { Grade } from "./grades.ts";

export interface Held {
  readonly grade: Grade;
  /** Memory of geometry and textures, and of what refines a smooth LOD further. */
  readonly bytes: number;
}

interface Resident extends Held {
  lastNeeded: number;
}

/** How many steps from here a model is needed; infinite where nobody knows. */
export type StepsTo = (model: number) => number;

/** On which terms memory is promised. */
export interface Terms {
  /** So much must stay free beside it. */
  readonly spare_bytes: number;
  /** What is needed within so many steps does not go for it. */
  readonly within_steps: number;
}

/** Not even the coarsest levels of what can be seen from a place fit into the memory. */
export class MemoryShortError extends Error {
  override readonly name = "MemoryShortError";

  constructor(readonly limit_bytes: number) {
    super(`what can be seen from here does not fit into ${Math.round(limit_bytes / 1e6)} MB of memory`);
  }
}

const LETTERS = { level: "", impostor: "i", rung: "r", grown: "g" };

const NOWHERE_NEAR: StepsTo = () => Number.POSITIVE_INFINITY;

export class ResidencySet {
  private readonly residents = new Map<number, Resident>();
  private readonly promises = new Map<number, number>();
  private needed: ReadonlySet<number> = new Set();
  private stepsTo = NOWHERE_NEAR;
  private uses = 0;
  private total = 0;
  private promised = 0;

  constructor(readonly limit_bytes: number) {}

  /** Memory of what is held. */
  get bytes(): number {
    return this.total;
  }

  /** Memory that is kept free for what is on its way. */
  get promised_bytes(): number {
    return this.promised;
  }

  get size(): number {
    return this.residents.size;
  }

  held(model: number): Held | undefined {
    return this.residents.get(model);
  }

  /** Names the models that are visible now, and says how near the others are needed. */
  need(models: ReadonlySet<number>, stepsTo: StepsTo = NOWHERE_NEAR): void {
    this.needed = models;
    this.stepsTo = stepsTo;
    this.uses += 1;
    for (const model of models) {
      const resident = this.residents.get(model);
      if (resident) resident.lastNeeded = this.uses;
    }
  }

  /**
   * Promises memory to what will be fetched, when there is room or can be made; answers what has gone for it, or
   * `undefined` when there is no room.
   */
  promise(model: number, bytes: number, { spare_bytes, within_steps }: Terms): number[] | undefined {
    const short = this.total + this.promised + bytes + spare_bytes - this.limit_bytes;
    const going: number[] = [];
    let freed = 0;
    for (const [idle, { bytes: idle_bytes }] of short > 0 ? this.inOrderOfLeaving() : []) {
      if (freed >= short || this.stepsTo(idle) <= within_steps) break;
      if (idle === model) continue;
      going.push(idle);
      freed += idle_bytes;
    }
    if (freed < short) return undefined;
    for (const idle of going) this.drop(idle);
    this.withdraw(model);
    this.promises.set(model, bytes);
    this.promised += bytes;
    return going;
  }

  /** Takes a promise back. */
  withdraw(model: number): void {
    this.promised -= this.promises.get(model) ?? 0;
    this.promises.delete(model);
  }

  /** Takes a grade in instead of what was held of its model; the promise is kept thereby. */
  hold(model: number, held: Held): void {
    this.withdraw(model);
    this.total += held.bytes - (this.residents.get(model)?.bytes ?? 0);
    this.residents.set(model, { ...held, lastNeeded: this.uses });
  }

  /** Drops idle models until the limit is kept, when what came was larger than what was promised; answers which ones. */
  evict(): number[] {
    const going: number[] = [];
    for (const [model] of this.total + this.promised > this.limit_bytes ? this.inOrderOfLeaving() : []) {
      if (this.total + this.promised <= this.limit_bytes) break;
      this.drop(model);
      going.push(model);
    }
    return going;
  }

  /** Idle models in the order in which they would go. */
  inOrderOfLeaving(): (readonly [number, Held])[] {
    const idle = [...this.residents].filter(([model]) => !this.needed.has(model) && !this.promises.has(model));
    const steps = new Map(idle.map(([model]) => [model, this.stepsTo(model)]));
    const further = (a: number, b: number) => {
      const [stepsA = 0, stepsB = 0] = [steps.get(a), steps.get(b)];
      return stepsA === stepsB ? 0 : stepsB - stepsA;
    };
    return idle.sort(([a, { lastNeeded }], [b, other]) => further(a, b) || lastNeeded - other.lastNeeded);
  }

  /** How many models are held at each level, and at each rung, as `r0`, `r1` …, as an impostor alone, as `i0`, and grown here, as `g0`. */
  grades(): Record<string, number> {
    const counts: Record<string, number> = {};
    for (const { grade } of this.residents.values()) {
      const name = `${LETTERS[grade.kind]}${grade.number}`;
      counts[name] = (counts[name] ?? 0) + 1;
    }
    return counts;
  }

  private drop(model: number): void {
    this.total -= this.residents.get(model)?.bytes ?? 0;
    this.residents.delete(model);
  }
}
