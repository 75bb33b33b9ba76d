/** What does an evaluation know while it runs? What it has made so far, what it has taken, and where values lie. */
import type { Bounds, Reach } from "../bounds.ts";
import { DcgError } from "../error.ts";
import { type Part, PLAIN, type Surface } from "../grown.ts";
import { type Amounts, MAX_HELD, reached, type Usage } from "../limits.ts";
import { errorAt, type Program } from "../link.ts";
import type { Scope } from "../plain/machine.ts";
import { type Globals, Stack } from "../stack.ts";
import type { At, Module } from "../syntax.ts";
import { Turtles } from "../turtles.ts";
import { sizesOf, type Value } from "../value.ts";

/** The same names with other random numbers. Written out, because it is done for each loop. */
export function withPath({ module, instance, base, depth, level }: Scope, path: number): Scope {
  return { module, instance, base, path, depth, level };
}

/** The parameter by which a part or a file moves: the share of a round of its movement that is over. */
export const PHASE = "phase";

/** What is handed down besides names: a place among the {@link Turtles}. */
export type Turtle = number;

/** As many letters are kept like a number. */
const LETTERS = 8;

function utf8Length(text: string): number {
  return new TextEncoder().encode(text).byteLength;
}

/** The box around a glTF file that rules place, by the path that they give; nothing where it is not known. */
export type Boxes = (path: string) => Bounds | undefined;

export class State {
  readonly usage: Usage = {
    levels: 0,
    nesting: 0,
    steps: 0,
    triangles: 0,
    parts: 0,
    placements: 0,
    materials: 0,
    kept: 0,
    files: 0,
  };
  protected nesting = 0;
  protected readonly stack = new Stack();
  protected readonly turtles = new Turtles();
  /** Values of files with their parameters. */
  protected readonly instances: Globals[] = [];
  protected readonly parts: Part[] = [];
  /** What they reach so far, with all that they place. */
  protected readonly reaches: Reach[] = [];
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
    /** Boxes around glTF files that are placed. */
    protected readonly boxes: Boxes,
  ) {}

  protected module(index: number): Module {
    return this.program.modules[index] as Module;
  }

  protected globals(scope: Scope): Globals {
    return this.instances[scope.instance] as Globals;
  }

  protected growing(part: number): Part {
    return this.parts[part] as Part;
  }

  protected reach(part: number): Reach {
    return this.reaches[part] as Reach;
  }

  protected error(module: number, at: At, problem: string): DcgError {
    return errorAt(this.module(module), at, problem);
  }

  /** Of numbers that are too large, too small, too few or in no order. */
  protected amount(module: number, at: At, what: string, wanted: string): DcgError {
    return errorAt(this.module(module), at, `${what} must be ${wanted}`);
  }

  /** Of a value that is of another kind than it must be. */
  protected unfit(module: number, at: At, what: string, wanted: string): DcgError {
    return errorAt(this.module(module), at, `${what} must be ${wanted}`, "of value");
  }

  /** Runs what a call leads to: an error in it names that call too. */
  protected traced<T>(module: number, at: At, run: () => T): T {
    try {
      return run();
    } catch (error) {
      throw this.addCaller(module, at, error);
    }
  }

  protected addCaller(module: number, at: At, error: unknown): unknown {
    const { file, text } = this.module(module);
    if (error instanceof DcgError) error.addCaller(file, text, at);
    return error;
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
    const { limits, usage } = this;
    usage.kept += numbers;
    if (usage.kept > limits.kept) throw this.error(module, at, reached("numbers kept", limits.kept));
  }

  /** The same of a name. */
  protected keepName(module: number, at: At, name: string): void {
    this.keep(module, at, Math.floor(utf8Length(name) / LETTERS));
  }

  /** Counts what lists hold until it is released, or the call ends; `at` is where that is written. */
  protected hold(module: number, at: At, numbers: number): void {
    this.stack.held += numbers;
    if (this.stack.held > MAX_HELD) throw this.error(module, at, reached("numbers in lists at once", MAX_HELD));
  }

  protected release(numbers: number): void {
    this.stack.held -= numbers;
  }

  /** Puts a value into a place on the stack. */
  protected put(module: number, at: At, place: number, value: Value): void {
    this.stack.set(place, value);
    if (typeof value !== "number") this.hold(module, at, 0);
  }

  /** Counts what lists take to be compared; `at` is where they are given. */
  protected countLists(scope: Scope, at: At, values: readonly Value[]): void {
    this.count(scope, at, sizesOf(values) - values.length);
  }

  /** Goes one deeper; whether that is allowed. Whoever calls it comes back with {@link ascend}. */
  protected enters(): boolean {
    const { usage, limits } = this;
    this.nesting += 1;
    if (this.nesting > usage.nesting) usage.nesting = this.nesting;
    if (this.nesting > limits.nesting) return false;
    usage.steps += 1;
    return usage.steps <= limits.steps;
  }

  /** Why {@link enters} said no. */
  protected refused(scope: Scope, at: At): Error {
    const { nesting, steps } = this.limits;
    const problem = this.nesting > nesting ? reached("levels of nesting", nesting) : reached("steps", steps);
    return this.error(scope.module, at, problem);
  }

  protected ascend(): void {
    this.nesting -= 1;
  }

  protected assign(scope: Scope, slot: number, value: number): void {
    this.stack.set(scope.base + slot, value);
  }
}
