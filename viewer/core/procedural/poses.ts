/**
 * How do turtles move in several turns of a loop? Side by side, with the same numbers as one by one in `turtles.ts`: x, y and
 * z of an axis, or of where a turtle is, are columns one behind the other.
 */
import { directions } from "./arithmetic.ts";

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
  for (let axis = 0; axis < 3 * width; axis += width) {
    for (let i = 0; i < count; i += 1) {
      numbers[to + axis + i] =
        num(numbers, x + axis + i) * num(numbers, alongX + i) +
        num(numbers, y + axis + i) * num(numbers, alongY + i) +
        num(numbers, z + axis + i) * num(numbers, alongZ + i) +
        num(numbers, origin + axis + i);
    }
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
  for (let axis = 0; axis < 3 * width; axis += width) {
    for (let i = 0; i < count; i += 1) {
      const sin = num(sines, i);
      const cos = num(cosines, i);
      const from = num(numbers, u + axis + i);
      const into = num(numbers, v + axis + i);
      numbers[to + axis + i] = from * cos + into * sin;
      numbers[turned + axis + i] = into * cos - from * sin;
    }
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

function num(numbers: Float64Array, at: number): number {
  return numbers[at] as number;
}
