import { expect, it } from "vitest";
import { EYE, placedAhead } from "../../test/placed.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { costAlone_bytes } from "./file.ts";
import { plan, type Stock } from "./plan.ts";

const NOTHING: Stock = {
  of: () => ({ held: undefined, taken: 0, failed: new Set<string>() }),
  costOf: costAlone_bytes,
};
const RULES = { url: "/o/rules.dcg", bytes: 4000 };

/** An object whose model has one level, and grows from the same rules as all others. */
function grown(id: number): PlacedObject {
  const { entry, model } = placedAhead(id, id, 10, [0]);
  const rules = { file: RULES, imports: new Map(), part: "post", parameters: {}, seed: 0 };
  return { entry, model: { ...model, rules: { ...rules, triangles: 12, geometricError: 0 } } };
}

it("models grow where their levels take more than the rules that all of them share", () => {
  const kinds = (count: number) => {
    const objects = Array.from({ length: count }, (_, id) => grown(id));
    return new Set(plan(objects, NOTHING, EYE, 1).map(({ grade }) => grade.kind));
  };
  // A level is 870 bytes with its request, the rules 1,560: a half of them is less, all of them are more.
  expect([kinds(1), kinds(2)]).toEqual([new Set(["level"]), new Set(["grown"])]);
});
