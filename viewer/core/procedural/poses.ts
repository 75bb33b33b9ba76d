/**
 * How do turtles move in several turns of a loop? Side by side, with the same numbers as one by one in `turtles.ts`: x, y and
 * z of an axis, or of where a turtle is, are columns one behind the other.
 */

import { directions } from "./arithmetic.ts";
import { num } from "./numbers.ts";

/** Moves along axes: x and y, and behind each other in words z, the origin and how far along each. */
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
  for (let i = 0; i < count; i += 1) {
    const u = num(numbers, alongX + i);
    const v = num(numbers, alongY + i);
    const w = num(numbers, alongZ + i);
    numbers[to + i] =
      num(numbers, x + i) * u + num(numbers, y + i) * v + num(numbers, z + i) * w + num(numbers, origin + i);
    const j = i + width;
    numbers[to + j] =
      num(numbers, x + j) * u + num(numbers, y + j) * v + num(numbers, z + j) * w + num(numbers, origin + j);
    const k = j + width;
    numbers[to + k] =
      num(numbers, x + k) * u + num(numbers, y + k) * v + num(numbers, z + k) * w + num(numbers, origin + k);
  }
}

/** Turns two axes, from one to the other; they come to lie one behind the other. */
export function swing(
  numbers: Float64Array,
  to: number,
  u: number,
  v: number,
  degrees: number,
  width: number,
  count: number,
): void {
  const { sines, cosines } = directions(numbers, degrees, count);
  const turned = to + 3 * width;
  for (let i = 0; i < count; i += 1) {
    const sin = num(sines, i);
    const cos = num(cosines, i);
    const j = i + width;
    const k = j + width;
    const fromX = num(numbers, u + i);
    const intoX = num(numbers, v + i);
    const fromY = num(numbers, u + j);
    const intoY = num(numbers, v + j);
    const fromZ = num(numbers, u + k);
    const intoZ = num(numbers, v + k);
    numbers[to + i] = fromX * cos + intoX * sin;
    numbers[to + j] = fromY * cos + intoY * sin;
    numbers[to + k] = fromZ * cos + intoZ * sin;
    numbers[turned + i] = intoX * cos - fromX * sin;
    numbers[turned + j] = intoY * cos - fromY * sin;
    numbers[turned + k] = intoZ * cos - fromZ * sin;
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
