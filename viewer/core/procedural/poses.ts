/**
 * How do turtles move in several turns of a loop? Side by side, with the same numbers as one by one in `turtles.ts`: x, y and
 * z of an axis, or of where a turtle is, are columns one behind the other. Those that are the same in all turns are there only
 * for the first: a bit for each of them says whether it differs.
 */

import { directions } from "./arithmetic.ts";
import { num } from "./numbers.ts";

/** All ones when a bit is set, to choose between a turn's own number and that of the first. */
function mask(bits: number, bit: number): number {
  return -((bits >> bit) & 1);
}

/** Moves along axes: x and y, and behind each other in words z, the origin, how far along each and what differs. */
export function move(
  numbers: Float64Array,
  to: number,
  x: number,
  y: number,
  words: Int32Array,
  first: number,
  width: number,
  count: number,
): void {
  const z = (words[first] as number) * width;
  const origin = (words[first + 1] as number) * width;
  const alongX = (words[first + 2] as number) * width;
  const alongY = (words[first + 3] as number) * width;
  const alongZ = (words[first + 4] as number) * width;
  const differing = words[first + 5] as number;
  const ofX = mask(differing, 0);
  const ofY = mask(differing, 1);
  const ofZ = mask(differing, 2);
  const ofOrigin = mask(differing, 3);
  for (let i = 0; i < count; i += 1) {
    const u = num(numbers, alongX + i);
    const v = num(numbers, alongY + i);
    const w = num(numbers, alongZ + i);
    let a = x + (i & ofX);
    let b = y + (i & ofY);
    let c = z + (i & ofZ);
    let d = origin + (i & ofOrigin);
    let e = to + i;
    numbers[e | 0] = num(numbers, a) * u + num(numbers, b) * v + num(numbers, c) * w + num(numbers, d);
    a += width;
    b += width;
    c += width;
    d += width;
    e += width;
    numbers[e | 0] = num(numbers, a) * u + num(numbers, b) * v + num(numbers, c) * w + num(numbers, d);
    a += width;
    b += width;
    c += width;
    d += width;
    e += width;
    numbers[e | 0] = num(numbers, a) * u + num(numbers, b) * v + num(numbers, c) * w + num(numbers, d);
  }
}

/** Turns two axes, from one to the other; they come to lie one behind the other. The angle lies behind in words. */
export function swing(
  numbers: Float64Array,
  to: number,
  u: number,
  v: number,
  words: Int32Array,
  first: number,
  width: number,
  count: number,
): void {
  const { sines, cosines } = directions(numbers, (words[first] as number) * width, count);
  const differing = words[first + 1] as number;
  const ofU = mask(differing, 0);
  const ofV = mask(differing, 1);
  const turned = to + 3 * width;
  for (let i = 0; i < count; i += 1) {
    const sin = num(sines, i);
    const cos = num(cosines, i);
    const a = u + (i & ofU);
    const b = v + (i & ofV);
    const fromX = num(numbers, a);
    const intoX = num(numbers, b);
    const fromY = num(numbers, a + width);
    const intoY = num(numbers, b + width);
    const fromZ = num(numbers, a + 2 * width);
    const intoZ = num(numbers, b + 2 * width);
    const c = to + i;
    const d = turned + i;
    numbers[c | 0] = fromX * cos + intoX * sin;
    numbers[(c + width) | 0] = fromY * cos + intoY * sin;
    numbers[(c + 2 * width) | 0] = fromZ * cos + intoZ * sin;
    numbers[d | 0] = intoX * cos - fromX * sin;
    numbers[(d + width) | 0] = intoY * cos - fromY * sin;
    numbers[(d + 2 * width) | 0] = intoZ * cos - fromZ * sin;
  }
}

/** Makes an axis as many times as long. */
export function stretch(
  numbers: Float64Array,
  to: number,
  axis: number,
  factors: number,
  width: number,
  count: number,
): void {
  for (let along = 0; along < 3 * width; along += width) {
    for (let i = 0; i < count; i += 1) {
      numbers[to + along + i] = num(numbers, axis + along + i) * num(numbers, factors + i);
    }
  }
}
