/**
 * Where do the values of rules lie? In frames, one behind the other; numbers apart from lists. It is counted what lists take that
 * are needed at once, as `crates/scene/src/procedural/evaluator/held.rs` does.
 */
import { type List, sizeOf, type Value } from "./value.ts";

/** In place of a number where a list lies, or nothing: no number of a model is like this. */
export const NO_NUMBER = Number.NaN;

export class Stack {
  numbers = new Float64Array(256);
  /** Lists, at the places of numbers that are {@link NO_NUMBER}. One whose place a number has taken stays until the frame ends. */
  readonly lists: (List | undefined)[] = [];
  /** Places of lists, in the order in which they got one. */
  private readonly listed: number[] = [];
  /** Numbers of lists that are needed now: of those here, and of those that wait for what is computed beside them. */
  held = 0;
  /** The same before each frame that is open. */
  private readonly heldBefore: number[] = [];
  /** Where the next frame begins. */
  top = 0;

  /** Makes room for a frame of so many values behind what is there; where it begins. */
  open(slots: number): number {
    const base = this.top;
    this.heldBefore.push(this.held);
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

  /** Ends the frame that was opened last, with all that it held. */
  close(base: number): void {
    const { lists, listed } = this;
    this.top = base;
    this.held = this.heldBefore.pop() ?? 0;
    for (let at = listed.length - 1; at >= 0 && (listed[at] as number) >= base; at -= 1) {
      lists[listed.pop() as number] = undefined;
    }
  }

  get(at: number): Value {
    const number = this.numbers[at] as number;
    return Number.isNaN(number) ? (this.lists[at] as List) : number;
  }

  set(at: number, value: Value): void {
    if (typeof value === "number") {
      this.numbers[at] = value;
    } else {
      const before = this.lists[at];
      if (before) this.held -= sizeOf(before);
      else this.listed.push(at);
      this.held += sizeOf(value);
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
