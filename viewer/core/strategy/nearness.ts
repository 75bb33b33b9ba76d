/**
 * How many steps from here is a model needed? Counted from cell to adjacent cell, breadth first, over what is known of
 * the cells around; what no known cell near by sees is infinitely far.
 */
import type { PlacedObject } from "../documents/placedobject.ts";
import type { KnownCells } from "./ahead.ts";
import type { StepsTo } from "./residency.ts";

/** Cells further than this are not asked. */
const FURTHEST_STEPS = 6;

/** What is known of cells, and of what can be seen from them. */
interface KnownWorld extends KnownCells {
  placed(object: number): PlacedObject | undefined;
}

/** Counts from a cell; looks around when it is asked for the first time, and anew when more is known of what is next door. */
export function stepsToModels(from: number, world: KnownWorld): StepsTo {
  let steps: Map<number, number> | undefined;
  let unknown: number[] = [];
  return (model) => {
    if (!steps || unknown.some((cell) => world.recordOf(cell))) {
      steps = lookAround(from, world);
      unknown = [from, ...(world.entryOf(from)?.adjacent ?? [])].filter((cell) => !world.recordOf(cell));
    }
    return steps.get(model) ?? Number.POSITIVE_INFINITY;
  };
}

function lookAround(from: number, world: KnownWorld): Map<number, number> {
  const found = new Map<number, number>();
  const met = new Set([from]);
  let ring = [from];
  for (let steps = 0; ring.length > 0 && steps <= FURTHEST_STEPS; steps += 1) {
    for (const cell of ring) {
      const record = world.recordOf(cell);
      for (const { object } of record ? [...record.lpvs, ...record.opvs] : []) {
        const model = world.placed(object)?.model.model;
        if (model !== undefined && !found.has(model)) found.set(model, steps);
      }
    }
    const next = ring.flatMap((cell) => world.entryOf(cell)?.adjacent ?? []);
    ring = [...new Set(next)].filter((cell) => !met.has(cell));
    for (const cell of ring) met.add(cell);
  }
  return found;
}
