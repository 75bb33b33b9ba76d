/**
 * Which numbers can registers hold, whatever is given to a plan? What need not be looked at is not. This is interval
 * arithmetic: rounding keeps order, so the ends of what is computed with bound what is computed.
 */
import * as code from "./code.ts";

type Extent = readonly [low: number, high: number];

export class Extents {
  private readonly known = new Map<number, Extent>();
  private readonly made = new Map<number, readonly [word: number, of: readonly number[]]>();

  /** A register lies within these ends, or it is noticed. */
  set(register: number, low: number, high: number): void {
    this.known.set(register, [low, high]);
  }

  /** What a word makes of other registers. */
  compute(register: number, word: number, of: readonly number[]): void {
    this.made.set(register, [word, of]);
  }

  areWithin(register: number, min: number, max: number): boolean {
    const extent = this.of(register);
    return extent !== undefined && min <= extent[0] && extent[1] <= max;
  }

  private of(register: number): Extent | undefined {
    const known = this.known.get(register);
    if (known) return known;
    const [word, of] = this.made.get(register) ?? [];
    const sides = of?.map((side) => this.known.get(side));
    const extent = word === undefined || !sides ? undefined : computed(word, sides);
    return extent && Math.max(Math.abs(extent[0]), Math.abs(extent[1])) < Infinity ? extent : undefined;
  }
}

function computed(word: number, [a, b, c]: readonly (Extent | undefined)[]): Extent | undefined {
  if (word === code.RANDOM) return [0, 1];
  if (word === code.CLAMP && b && c) return [Math.min(b[0], c[0]), Math.max(b[1], c[1])];
  if (!a) return undefined;
  if (word === code.MINUS) return [-a[1], -a[0]];
  if (!b) return undefined;
  switch (word) {
    case code.ADD:
      return [a[0] + b[0], a[1] + b[1]];
    case code.SUBTRACT:
      return [a[0] - b[1], a[1] - b[0]];
    case code.MULTIPLY: {
      const ends = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
      return [Math.min(...ends), Math.max(...ends)];
    }
    case code.RANDOM_BETWEEN: {
      const [low, high] = [b[0] - a[1], b[1] - a[0]];
      return [a[0] + Math.min(low, 0), a[1] + Math.max(high, 0)];
    }
    default:
      return undefined;
  }
}
