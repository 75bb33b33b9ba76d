/**
 * Where do the numbers of several turns of a loop lie? Side by side: a column holds one number for each turn. As `straight` in
 * `crates/scene/src/procedural/evaluator`.
 */
import { step } from "../random.ts";
import type { Scope } from "./machine.ts";

/** So many turns have room in a column: enough that little is done more often, few enough that all stays near at hand. */
export const WIDTH = 24;

/** Where names are looked up in all turns. */
export interface Frame {
  /** As in each turn, but for its path. */
  readonly scope: Scope;
  /** Where the paths of the turns begin. */
  readonly path: number;
  /** Where the column of each slot begins; nothing for values that are the same in each turn. */
  readonly columns: (number | undefined)[];
  /** Whether other values lie on the stack. */
  readonly hasStack: boolean;
}

export class Columns {
  /** How many turns there are. */
  count = 0;
  numbers = new Float64Array(64 * WIDTH);
  paths = new Int32Array(8 * WIDTH);
  private used = 0;
  private usedPaths = 0;

  /** Forgets what is there, for so many turns to come. */
  begin(count: number): void {
    this.count = count;
    this.used = 0;
    this.usedPaths = 0;
  }

  /** Makes room for so many columns, one behind the other; where they begin. */
  open(columns: number): number {
    const first = this.used;
    this.used += columns * WIDTH;
    if (this.used > this.numbers.length) {
      const wide = new Float64Array(2 * this.used);
      wide.set(this.numbers);
      this.numbers = wide;
    }
    return first;
  }

  /** Puts one number into a column. */
  fill(at: number, number: number): void {
    for (let i = at; i < at + this.count; i += 1) this.numbers[i] = number;
  }

  /** Whether all numbers of so many columns lie so near to zero. */
  areWithin(first: number, columns: number, most: number): boolean {
    const { numbers, count } = this;
    for (let at = first; at < first + columns * WIDTH; at += WIDTH) {
      for (let i = at; i < at + count; i += 1) if (!(Math.abs(numbers[i] as number) <= most)) return false;
    }
    return true;
  }

  /** Whether none lies nearer. */
  areApart(first: number, columns: number, least: number): boolean {
    const { numbers, count } = this;
    for (let at = first; at < first + columns * WIDTH; at += WIDTH) {
      for (let i = at; i < at + count; i += 1) if (!(Math.abs(numbers[i] as number) >= least)) return false;
    }
    return true;
  }

  /** As many columns from elsewhere, copied. */
  copied(of: Float64Array, from: number, columns: number): number {
    const at = this.open(columns);
    const { numbers } = this;
    for (let column = 0; column < columns * WIDTH; column += WIDTH) {
      for (let i = column; i < column + this.count; i += 1) numbers[at + i] = of[from + i] as number;
    }
    return at;
  }

  /** The paths of turns from `first` on. */
  pathsOfTurns(path: number, first: number): number {
    const at = this.openPaths();
    for (let i = 0; i < this.count; i += 1) this.paths[at + i] = step(path, first + i);
    return at;
  }

  /** The paths behind one word more. */
  pathsBehind(from: number, site: number): number {
    const at = this.openPaths();
    for (let i = 0; i < this.count; i += 1) this.paths[at + i] = step(this.paths[from + i] as number, site);
    return at;
  }

  /** The same path for all turns. */
  filledPaths(path: number): number {
    const at = this.openPaths();
    this.paths.fill(path, at, at + this.count);
    return at;
  }

  private openPaths(): number {
    const first = this.usedPaths;
    this.usedPaths += WIDTH;
    if (this.usedPaths > this.paths.length) {
      const wide = new Int32Array(2 * this.usedPaths);
      wide.set(this.paths);
      this.paths = wide;
    }
    return first;
  }
}

/** Copies so many numbers from one place to another. */
export function copy(of: Float64Array, from: number, to: Float64Array, at: number, count: number): void {
  for (let i = 0; i < count; i += 1) to[at + i] = of[from + i] as number;
}
