/** What does an evaluation know while it runs? What it has made so far, what it has taken, and where values lie. */
import type { Affine } from "../affine.ts";
import type { DcgError } from "../error.ts";
import { type Part, PLAIN, type Surface } from "../grown.ts";
import { type Amounts, MAX_KEPT, reached } from "../limits.ts";
import { errorAt, type Program } from "../link.ts";
import type { At, Module } from "../syntax.ts";
import { sizesOf, type Value } from "../value.ts";

/** Where names are looked up, and which random numbers belong here. */
export interface Scope {
  readonly module: number;
  readonly instance: number;
  /** Where the values of the rule begin on the stack. */
  readonly base: number;
  readonly path: number;
  /** Calls inside each other. */
  readonly depth: number;
  /** Calls of this rule inside each other. */
  readonly level: number;
}

/** The same names with other random numbers. Written out, because it is done for each turn of a loop. */
export function withPath({ module, instance, base, depth, level }: Scope, path: number): Scope {
  return { module, instance, base, path, depth, level };
}

/** The parameter by which a part or a file moves: the share of a round of its movement that is over. */
export const PHASE = "phase";

/** What is handed down besides names. */
export interface Turtle {
  readonly frame: Affine;
  readonly material: number;
}

/** As many letters are kept like a number. */
const LETTERS = 8;

function utf8Length(text: string): number {
  return new TextEncoder().encode(text).byteLength;
}

export class State {
  readonly usage: Amounts = { levels: 0, nesting: 0, steps: 0, triangles: 0, parts: 0, placements: 0, materials: 0 };
  private nesting = 0;
  /** See {@link MAX_KEPT}. */
  private kept = 0;
  protected stack: Value[] = [];
  /** Values of files with their parameters; `undefined` until they are computed. */
  protected readonly instances: (Value | undefined)[][] = [];
  protected readonly parts: Part[] = [];
  protected readonly materials: Surface[] = [PLAIN];
  /** The part that is being made. */
  protected part = 0;
  /** Parts with a parameter {@link PHASE}. */
  protected readonly phased = new Set<number>();

  constructor(
    protected readonly program: Program,
    protected readonly seed: number,
    protected readonly detail: number,
    protected readonly limits: Readonly<Amounts>,
  ) {}

  protected module(index: number): Module {
    return this.program.modules[index] as Module;
  }

  protected error(module: number, at: At, problem: string): DcgError {
    return errorAt(this.module(module), at, problem);
  }

  /** Counts visits; `at` is where to say that there are too many. */
  protected count(scope: Scope, at: At, steps: number): void {
    this.usage.steps += steps;
    if (this.usage.steps > this.limits.steps) {
      throw this.error(scope.module, at, reached("steps", this.limits.steps));
    }
  }

  /** Counts what is kept until the end. */
  protected keep(module: number, at: At, numbers: number): void {
    this.kept += numbers;
    if (this.kept > MAX_KEPT) throw this.error(module, at, reached("numbers kept", MAX_KEPT));
  }

  /** The same of a name. */
  protected keepName(module: number, name: string): void {
    this.keep(module, 0, Math.floor(utf8Length(name) / LETTERS));
  }

  /** Counts what lists take to be compared; `at` is where they are given. */
  protected countLists(scope: Scope, at: At, values: readonly Value[]): void {
    this.count(scope, at, sizesOf(values) - values.length);
  }

  /** Goes one deeper; whoever calls it comes back with {@link ascend}, unless there was an error. */
  protected descend(scope: Scope, at: At): void {
    this.nesting += 1;
    if (this.nesting > this.usage.nesting) this.usage.nesting = this.nesting;
    if (this.nesting > this.limits.nesting) {
      throw this.error(scope.module, at, reached("nesting", this.limits.nesting));
    }
    this.count(scope, at, 1);
  }

  protected ascend(): void {
    this.nesting -= 1;
  }

  protected local(scope: Scope, slot: number): Value {
    return this.stack[scope.base + slot] as Value;
  }

  protected assign(scope: Scope, slot: number, value: Value): void {
    this.stack[scope.base + slot] = value;
  }

  /** Makes room for a frame of so many values behind what is there; where it begins. */
  protected open(slots: number): number {
    const base = this.stack.length;
    for (let i = 0; i < slots; i += 1) this.stack.push(0);
    return base;
  }

  protected close(base: number): void {
    this.stack.length = base;
  }
}
