/** What lies at a place of an array of numbers? */

/**
 * The number at a place. That places are whole 32-bit numbers is said, so that compilers of browsers need not watch the sums
 * that give them.
 */
export function num(numbers: Float64Array, at: number): number {
  return numbers[at | 0] as number;
}
