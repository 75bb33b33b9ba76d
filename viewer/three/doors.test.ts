import { Vector3 } from "three";
import { expect, it } from "vitest";
import { DoorSwing } from "./doors.ts";

const LEAF = { min: [2, 0, 5], max: [3, 2, 5.1] } as const;

it("a closed leaf stays where it was published, an open one keeps its hinge and leaves the doorway", () => {
  const door = new DoorSwing(LEAF, 0);
  const free = () => new Vector3(3, 1, 5.05).applyMatrix4(door.matrix());
  const hinge = () => new Vector3(2, 1, 5.05).applyMatrix4(door.matrix());
  expect(free().distanceTo(new Vector3(3, 1, 5.05))).toBeCloseTo(0, 9);
  door.turn(true, "swinging");
  expect(door.step(0.2)).toBe(true);
  const ajar = free().x;
  for (let i = 0; i < 10; i += 1) door.step(0.2);
  expect(door.step(0.2)).toBe(false);
  expect(hinge().distanceTo(new Vector3(2, 1, 5.05))).toBeCloseTo(0, 9);
  expect(free().x).toBeLessThan(ajar);
  expect(free().x).toBeLessThan(2.2);
  expect(door.leaf().max[0]).toBeLessThan(2.3);
  door.turn(false, "at once");
  expect(free().x).toBeCloseTo(3, 9);
  expect(door.leaf()).toEqual(LEAF);
  expect([door.step(0.1), door.step(0.1)]).toEqual([true, false]);
});
