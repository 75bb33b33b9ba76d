/**
 * Where do the numbers of several turns of a loop lie? Side by side: a column holds one number for each turn. As `straight` in
 * `crates/scene/src/procedural/evaluator`.
 */

/** So many turns have room in a column: enough that little is done more often, few enough that all stays near at hand. */
export const WIDTH = 24;

/** Copies so many numbers from one place to another. */
export function copy(of: Float64Array, from: number, to: Float64Array, at: number, count: number): void {
  for (let i = 0; i < count; i += 1) to[at + i] = of[from + i] as number;
}

/** Puts a number at so many places. */
export function fill(to: Float64Array, at: number, number: number, count: number): void {
  for (let i = at; i < at + count; i += 1) to[i] = number;
}
