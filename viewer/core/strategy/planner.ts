/**
 * What is wanted of all that is known of a place: of what can be seen, and of what lies ahead? The same decisions as those of
 * `client/src/strategy/planner.rs`, by the rules in `docs/STRATEGY.md`; `core/models` and `core/fetch` make requests of them.
 */
import type { PlacedObject } from "../documents/placedobject.ts";
import { type Approach, HORIZON_S, isDue } from "./ahead.ts";
import type { Holding } from "./grade.ts";
import { costOf_bytes, firstWants, plan, type Stock, want } from "./plan.ts";
import type { Cause, Want } from "./priority.ts";
import type { Eye } from "./sight.ts";

/** A cell that may be entered, and something of what can be seen from there, the most important first. */
export interface Ahead extends Approach {
  readonly objects: readonly PlacedObject[];
}

/** What is known of a place. */
export interface View {
  readonly eye: Eye;
  /** What is known of what can be seen, the most important first … */
  readonly here: readonly PlacedObject[];
  /** … and whether that is all. */
  readonly isAllKnown: boolean;
  /** In the order in which to care for them. */
  readonly ahead: readonly Ahead[];
}

/** Everything to fetch, most urgent first: of what can be seen, and of what lies ahead. */
export function wanted(view: View, all: Stock, target_px: number, bytes_per_s: number): Want[] {
  const { eye, here, isAllKnown } = view;
  const stock = askedOnce(all);
  const wants = plan(here, stock, eye, target_px).filter(({ cause }) => isAllKnown || cause.kind === "missing");
  const named = new Set(wants.map(({ object }) => object.model.model));
  let before_bytes = 0;
  for (const { cell, step, in_s, objects } of view.ahead) {
    const firsts = firstWants(objects, stock, named);
    before_bytes += firsts.reduce((sum, { object, grade }) => sum + costOf_bytes(object, grade, stock), 0);
    const due = isDue(in_s, before_bytes, bytes_per_s);
    if (!due && in_s >= HORIZON_S) continue;
    const cause: Cause = { kind: "ahead", cell, step, in_s, due };
    for (const { object, grade } of firsts) {
      named.add(object.model.model);
      wants.push(want(object, grade, cause, wants.length));
    }
  }
  return wants.sort((a, b) => a.priority - b.priority);
}

/** The same, but that nothing is asked twice: many objects share a model, and many cells see the same. */
function askedOnce(stock: Stock): Stock {
  const known = new Map<number, Holding>();
  const of = (model: number) => {
    const holding = known.get(model) ?? stock.of(model);
    known.set(model, holding);
    return holding;
  };
  return { of, costOf: stock.costOf };
}
