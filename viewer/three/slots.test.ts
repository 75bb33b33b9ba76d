import { expect, it } from "vitest";
import { Rows, Slots } from "./slots.ts";

const objectsIn = (slots: Slots) => Array.from({ length: slots.count }, (_, slot) => slots.objectIn(slot));

it("objects take slots in turn, and keep them", () => {
  const slots = new Slots();
  expect([7, 3, 7, 9].map((object) => slots.take(object))).toEqual([0, 1, 0, 2]);
  expect(objectsIn(slots)).toEqual([7, 3, 9]);
  expect(slots.objectIn(3)).toBeUndefined();
});

it("the last one takes the slot of one that leaves, so that there are no gaps", () => {
  const slots = new Slots();
  for (const object of [1, 2, 3, 4]) slots.take(object);
  expect([slots.free(2), objectsIn(slots)]).toEqual([1, [1, 4, 3]]);
  expect([slots.free(3), objectsIn(slots)]).toEqual([2, [1, 4]]);
  expect([slots.free(2), objectsIn(slots)]).toEqual([undefined, [1, 4]]);
  expect([slots.take(4), slots.take(5)]).toEqual([1, 2]);
  for (const object of [1, 4, 5]) slots.free(object);
  expect([slots.count, slots.take(6)]).toEqual([0, 0]);
});

it("rows keep what is written while they grow, and grow seldom", () => {
  const rows = new Rows(2);
  const arrays = new Set<Float64Array>();
  for (let slot = 0; slot < 1000; slot += 1) {
    rows.reserve(slot + 1);
    rows.array.set([slot, -slot], 2 * slot);
    arrays.add(rows.array);
  }
  expect(arrays.size).toBeLessThanOrEqual(10);
  rows.move(999, 4);
  expect([...rows.array.subarray(6, 12)]).toEqual([3, -3, 999, -999, 5, -5]);
});
