/** Where does a part lie? Boxes around solids and around what is placed, as in Rust. */

import type { Affine, Vector } from "./affine.ts";
import { num } from "./numbers.ts";

export interface Bounds {
  readonly min: Vector;
  readonly max: Vector;
}

/** By how much geometry may go beyond what a part declares: rounding to single precision, relative and in metres. */
const SLACK = 1e-6;

/** The numbers of a frame, and their bits. */
const terms = new Float64Array(12);
const bits = new Int32Array(terms.buffer);
/** Where the sign is in the bits of a number. */
const HIGH = new Uint8Array(Uint16Array.of(1).buffer)[0] === 1 ? 1 : 0;

/** −1 below 0, and for −0; else 0. */
function signOf(term: number): number {
  return (bits[2 * term + HIGH] as number) >> 31;
}

const single = new Float32Array(1);
const singleBits = new Int32Array(single.buffer);
const LEAST_BELOW_ZERO = 0x8000_0001 | 0;

/** The most in single precision that is not above a number. */
function singleBelow(along: number): number {
  const rounded = Math.fround(along);
  if (!(rounded > along)) return rounded;
  single[0] = rounded;
  singleBits[0] = rounded === 0 ? LEAST_BELOW_ZERO : (singleBits[0] as number) - Math.sign(rounded);
  return single[0];
}

/** A box that grows around what it holds; at first it holds nothing. */
export class Reach {
  /** Least x, y and z, then the most. */
  readonly ends = Float64Array.of(Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity);

  /** The box, to be kept. */
  get bounds(): Bounds {
    const { ends } = this;
    return { min: [num(ends, 0), num(ends, 1), num(ends, 2)], max: [num(ends, 3), num(ends, 4), num(ends, 5)] };
  }

  /** Grows to the smallest box around it whose corners are in single precision, as what it holds is rounded when it is written. */
  toSingle(): void {
    const { ends } = this;
    for (let axis = 0; axis < 3; axis += 1) {
      ends[axis] = singleBelow(num(ends, axis));
      ends[axis + 3] = -singleBelow(-num(ends, axis + 3));
    }
  }

  /** Holds a box around the y axis and nothing else. */
  upright(x: number, low: number, high: number, z: number): void {
    this.box(-x, low, -z, x, high, z);
  }

  /** Holds a box and nothing else. */
  box(lowX: number, lowY: number, lowZ: number, highX: number, highY: number, highZ: number): void {
    const { ends } = this;
    ends[0] = lowX;
    ends[1] = lowY;
    ends[2] = lowZ;
    ends[3] = highX;
    ends[4] = highY;
    ends[5] = highZ;
  }

  /** Holds points and nothing else: so many, of so many numbers each. With two of them they are x and z. */
  points(points: Float64Array, count: number, width: 2 | 3): void {
    this.clear();
    this.spanAll(0, points, 0, count, width);
    if (width === 3) this.spanAll(1, points, 1, count, width);
    this.spanAll(2, points, width - 1, count, width);
  }

  /** So much along an axis as every `width`th number from the first on. */
  private spanAll(axis: number, numbers: Float64Array, first: number, count: number, width: number): void {
    let low = Infinity;
    let high = -Infinity;
    for (let at = first; at < width * count; at += width) {
      const along = num(numbers, at);
      if (along < low) low = along;
      if (along > high) high = along;
    }
    this.span(axis, low, high);
  }

  private clear(): void {
    this.upright(-Infinity, Infinity, -Infinity, -Infinity);
  }

  point(x: number, y: number, z: number): void {
    this.span(0, x, x);
    this.span(1, y, y);
    this.span(2, z, z);
  }

  /** So much along an axis. */
  span(axis: number, low: number, high: number): void {
    const { ends } = this;
    if (low < num(ends, axis)) ends[axis] = low;
    if (high > num(ends, axis + 3)) ends[axis + 3] = high;
  }

  /**
   * The eight corners of a box in a frame, whose twelve numbers begin at a place. Each coordinate is a sum of one term for
   * each axis, and rounding keeps order: so the least and the most of each term give those of all corners, to the bit.
   */
  placed({ ends }: Reach, frame: Float64Array, at: number): void {
    if (num(ends, 0) > num(ends, 3)) return;
    for (let i = 0; i < 12; i += 1) terms[i] = num(frame, at + i);
    this.along(0, ends);
    this.along(1, ends);
    this.along(2, ends);
  }

  private along(axis: number, ends: Float64Array): void {
    const x = num(terms, axis);
    const y = num(terms, axis + 3);
    const z = num(terms, axis + 6);
    const origin = num(terms, axis + 9);
    // Where the term is least; it is most at the other end. Asked of the sign alone, which no processor has to guess.
    const leastX = signOf(axis) & 3;
    const leastY = 1 + (signOf(axis + 3) & 3);
    const leastZ = 2 + (signOf(axis + 6) & 3);
    const low = x * num(ends, leastX) + y * num(ends, leastY) + z * num(ends, leastZ) + origin;
    const high = x * num(ends, 3 - leastX) + y * num(ends, 5 - leastY) + z * num(ends, 7 - leastZ) + origin;
    this.span(axis, low, high);
  }

  /** Another box in a frame. */
  placedIn(bounds: Reach, { x, y, z, origin }: Affine): void {
    this.placed(bounds, Float64Array.of(...x, ...y, ...z, ...origin), 0);
  }

  /** Points, three numbers each. */
  positions(positions: Float32Array): void {
    for (let i = 0; i < positions.length; i += 3) {
      this.point(positions[i] as number, positions[i + 1] as number, positions[i + 2] as number);
    }
  }
}

const TOWARDS = ["-x", "-y", "-z", "+x", "+y", "+z"] as const;

/** Where most of `inner` is outside of `outer`, and how far it reaches out there, in whole millimetres. */
export function beyond(inner: Bounds, outer: Bounds): { towards: string; byM: number } | undefined {
  const diagonal = Math.hypot(...outer.max.map((v, i) => v - (outer.min[i] as number)));
  const slack = SLACK * (1 + diagonal);
  let most = slack;
  let found: string | undefined;
  TOWARDS.forEach((towards, side) => {
    const axis = (side % 3) as 0 | 1 | 2;
    const by = side < 3 ? outer.min[axis] - inner.min[axis] : inner.max[axis] - outer.max[axis];
    if (by <= most) return;
    most = by;
    found = towards;
  });
  return found === undefined ? undefined : { towards: found, byM: Math.ceil(1000 * most) / 1000 };
}
