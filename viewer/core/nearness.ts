/**
 * How many steps from here is a model needed? Counted from cell to adjacent cell, breadth first, over what is known of
 * the cells around; what no known cell near by sees is infinitely far.
 */
import type { CellEntry } from "./documents.ts";
import type { StepsTo } from "./residency.ts";

/** Cells further than this are not asked. */
const FURTHEST_STEPS = 6;

/** Looks around when it is asked for the first time. */
export function stepsToModels(
  from: CellEntry,
  entryOf: (cell: number) => CellEntry | undefined,
  modelsOf: (cell: number) => Iterable<number>,
): StepsTo {
  let steps: Map<number, number> | undefined;
  return (model) => {
    steps ??= lookAround(from, entryOf, modelsOf);
    return steps.get(model) ?? Number.POSITIVE_INFINITY;
  };
}

function lookAround(
  from: CellEntry,
  entryOf: (cell: number) => CellEntry | undefined,
  modelsOf: (cell: number) => Iterable<number>,
): Map<number, number> {
  const found = new Map<number, number>();
  const met = new Set([from.cell]);
  let ring = [from];
  for (let steps = 0; ring.length > 0 && steps <= FURTHEST_STEPS; steps += 1) {
    for (const { cell } of ring) for (const model of modelsOf(cell)) if (!found.has(model)) found.set(model, steps);
    const next = ring.flatMap(({ adjacent }) => adjacent).filter((cell) => !met.has(cell));
    for (const cell of next) met.add(cell);
    ring = [...new Set(next)].map(entryOf).filter((entry) => entry !== undefined);
  }
  return found;
}
