import { expect, it } from "vitest";
import type { Surveyed } from "../atlas/survey.ts";
import { stepsToModels } from "./nearness.ts";

/** A row of cells; cell i sees object i of model 10 i, and the last also what the first sees. */
function row(cells: number, unknown: readonly number[] = []) {
  const exists = (cell: number) => cell >= 0 && cell < cells;
  return {
    entryOf: (cell: number) => (exists(cell) ? { cell, adjacent: [cell - 1, cell + 1].filter(exists) } : undefined),
    recordOf: (cell: number) => {
      if (unknown.includes(cell)) return undefined;
      return { lpvs: [{ object: cell }], opvs: cell === cells - 1 ? [{ object: 0 }] : [] };
    },
    placed: (object: number) => ({ model: { model: 10 * object } }),
  } as unknown as Surveyed;
}

it("counts cells on the shortest way, and does not know what it has no record of", () => {
  const steps = stepsToModels(2, row(5, [1]));
  expect([20, 30, 40, 0, 10].map(steps)).toEqual([0, 1, 2, 2, Number.POSITIVE_INFINITY]);
});

it("does not look further than it pays", () => {
  const steps = stepsToModels(0, row(20));
  expect([60, 70].map(steps)).toEqual([6, Number.POSITIVE_INFINITY]);
});

it("counts anew when more is known of what is next door", () => {
  const unknown = [1, 3, 4];
  const steps = stepsToModels(2, row(5, unknown));
  expect([10, 30].map(steps)).toEqual([Number.POSITIVE_INFINITY, Number.POSITIVE_INFINITY]);
  unknown.splice(0, 1);
  expect([10, 30].map(steps)).toEqual([1, Number.POSITIVE_INFINITY]);
});
