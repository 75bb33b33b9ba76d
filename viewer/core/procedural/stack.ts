/** Where do the values of rules lie? In frames, one behind the other; numbers apart from lists. */
import type { List, Value } from "./value.ts";

/** In place of a number where a list lies, or nothing: no number of a model is like this. */
export const NO_NUMBER = Number.NaN;

export class Stack {
  numbers = new Float64Array(256);
  /** Lists, at the places of numbers that are {@link NO_NUMBER}. */
  readonly lists: (List | undefined)[] = [];
  /** Where the next frame begins. */
  top = 0;

  /** Makes room for a frame of so many values behind what is there; where it begins. */
  open(slots: number): number {
    const base = this.top;
    this.top += slots;
    while (this.lists.length < this.top) this.lists.push(undefined);
    if (this.top > this.numbers.length) {
      const wide = new Float64Array(2 * this.top);
      wide.set(this.numbers);
      this.numbers = wide;
    }
    for (let i = base; i < this.top; i += 1) this.numbers[i] = 0;
    return base;
  }

  close(base: number): void {
    this.top = base;
  }

  get(at: number): Value {
    const number = this.numbers[at] as number;
    return Number.isNaN(number) ? (this.lists[at] as List) : number;
  }

  set(at: number, value: Value): void {
    if (typeof value === "number") {
      this.numbers[at] = value;
    } else {
      this.numbers[at] = NO_NUMBER;
      this.lists[at] = value;
    }
  }

  /** Values from a place on. */
  slice(base: number, count: number): Value[] {
    return Array.from({ length: count }, (_, i) => this.get(base + i));
  }
}

/** Values of a file with its parameters; a number or a list once it is computed. */
export class Globals {
  readonly numbers: Float64Array;
  readonly lists: (List | undefined)[];

  constructor(count: number) {
    this.numbers = new Float64Array(count).fill(NO_NUMBER);
    this.lists = Array.from({ length: count }, () => undefined);
  }

  get(slot: number): Value | undefined {
    const number = this.numbers[slot] as number;
    return Number.isNaN(number) ? this.lists[slot] : number;
  }

  set(slot: number, value: Value): void {
    if (typeof value === "number") this.numbers[slot] = value;
    else this.lists[slot] = value;
  }
}
