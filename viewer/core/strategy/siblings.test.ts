import { expect, it } from "vitest";
import type { Model } from "../documents/modeldocument.ts";
import type { PlacedObject } from "../documents/placedobject.ts";
import { siblingsIn } from "./siblings.ts";

const model = (number: number): Model => ({ model: number, levels: [] });
const place = (object: number, shape: Model): PlacedObject => ({
  entry: {
    object,
    sourceNode: "",
    bounds: { min: [0, 0, 0], max: [0, 0, 0] },
    worldFromObject: [],
    scale: 1,
    model: shape.model,
  },
  model: shape,
});

it("finds objects that share a model, in the order of the list, and once for a list", () => {
  const [tree, house] = [model(1), model(2)];
  const objects = [place(7, tree), place(3, house), place(5, tree)];
  const found = siblingsIn(objects);
  expect(
    found.map(({ model: { model }, objects, rank }) => [model, objects.map(({ entry }) => entry.object), rank]),
  ).toEqual([
    [1, [7, 5], 0],
    [2, [3], 1],
  ]);
  expect(siblingsIn(objects)).toBe(found);
});

it("keeps what stands in apart from what it stands for, though both have the number of one model", () => {
  const objects = [place(1, model(4)), place(2, model(4))];
  expect(siblingsIn(objects).map(({ objects }) => objects.length)).toEqual([1, 1]);
});
