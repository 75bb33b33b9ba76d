import { describe, expect, it } from "vitest";
import { type Bounds, nearestInBounds, planesOfBounds, rayToBounds, type Vec3 } from "../basics/geometry.ts";
import { doorInReach } from "./reach.ts";
import { type NavigationSpace, Walker } from "./walker.ts";

const WEST = Math.PI / 2;
const EAST = -WEST;
/** In a wall along z at x = 5, closed, or open and swung into the room. */
const doorway: Bounds = { min: [5, 0, 2], max: [5.1, 2, 3] };
const swung: Bounds = { min: [4, 0, 2], max: [5, 2, 2.1] };
const closed = { door: 7, doorway, leaf: doorway };
const freely = () => true;
const from = (position: Vec3, yaw: number, pitch = 0) => ({ position, yaw, pitch });

describe("the door in reach", () => {
  it("is the one that is looked at, up to three metres away", () => {
    expect(doorInReach([closed], from([2.5, 1.6, 2.5], EAST), freely)).toBe(7);
    expect(doorInReach([closed], from([1.5, 1.6, 2.5], EAST), freely)).toBeUndefined();
    expect(doorInReach([closed], from([2.5, 1.6, 2.5], EAST + 0.6), freely)).toBeUndefined();
    expect(doorInReach([closed], from([2.5, 1.6, 2.5], EAST, 1), freely)).toBeUndefined();
  });

  it("may be looked at where its leaf is now", () => {
    const looking = from([3.5, 1.6, 1], EAST - 1);
    expect(doorInReach([closed], looking, freely)).toBeUndefined();
    expect(doorInReach([{ ...closed, leaf: swung }], looking, freely)).toBe(7);
  });

  it("is near enough without a look, but not behind one's back", () => {
    expect(doorInReach([closed], from([4.2, 1.6, 2.5], 0), freely)).toBe(7);
    expect(doorInReach([closed], from([4.2, 1.6, 2.5], WEST), freely)).toBeUndefined();
  });

  it("is rather looked at than near, and rather near than far", () => {
    const beside = { door: 8, doorway: { min: [4, 0, 3.3], max: [5, 2, 3.4] }, leaf: doorway } as const;
    const looked = { ...beside, leaf: beside.doorway };
    expect(doorInReach([looked, closed], from([4.4, 1.6, 2.6], EAST), freely)).toBe(7);
    const further = { door: 9, doorway: { min: [5.5, 0, 2], max: [5.6, 2, 3] }, leaf: doorway } as const;
    expect(doorInReach([{ ...further, leaf: further.doorway }, closed], from([3.5, 1.6, 2.5], EAST), freely)).toBe(7);
  });

  it("is none that something is in front of", () => {
    expect(doorInReach([closed], from([4, 1.6, 2.5], EAST), (_, door) => door !== 7)).toBeUndefined();
  });
});

it("one gets straight to the doors of one's own cell, not through a wall to those of the next", () => {
  const [room, next]: Bounds[] = [
    { min: [0, 0, 0], max: [5, 3, 5] },
    { min: [5, 0, 0], max: [9, 3, 5] },
  ];
  const square = (x: number): Vec3[] => [
    [x, 0, 2],
    [x, 2, 2],
    [x, 2, 3],
    [x, 0, 3],
  ];
  const cells = [
    { planes: room, adjacent: [1], portals: [{ to: 1, polygon: square(5), door: 7 }] },
    {
      planes: next,
      adjacent: [0],
      portals: [
        { to: 0, polygon: square(5), door: 7 },
        { to: 2, polygon: square(9), door: 8 },
      ],
    },
  ];
  let shut = true;
  const space: NavigationSpace = {
    isShut: () => shut,
    isLost: () => false,
    cell: (id) => {
      const cell = cells[id];
      return cell?.planes && { cell: id, ...cell, planes: planesOfBounds(cell.planes) };
    },
  };
  const walker = new Walker(space);
  walker.place([4, 1.6, 2.5], 0);
  expect([walker.leadsTo([5, 1.6, 2.5], 7), walker.leadsTo([9, 1.6, 2.5], 8)]).toEqual([true, false]);
  shut = false;
  expect(walker.leadsTo([9, 1.6, 2.5], 8)).toBe(true);
  walker.place([4, 1.6, 0.5], 0);
  expect(walker.leadsTo([9, 1.6, 0.5], 8)).toBe(false);
  walker.mode = "fly";
  expect(walker.leadsTo([9, 1.6, 0.5], 8)).toBe(true);
});

it("rays meet boxes ahead of them, and boxes have a nearest point", () => {
  expect(rayToBounds(doorway, [3, 1, 2.5], [1, 0, 0])).toBeCloseTo(2, 9);
  expect(rayToBounds(doorway, [3, 1, 2.5], [-1, 0, 0])).toBe(Number.POSITIVE_INFINITY);
  expect(rayToBounds(doorway, [3, 1, 3.5], [1, 0, 0])).toBe(Number.POSITIVE_INFINITY);
  expect(rayToBounds(doorway, [5.05, 1, 2.5], [0, 1, 0])).toBe(0);
  expect(nearestInBounds(doorway, [0, 9, 2.5])).toEqual([5, 2, 2.5]);
});
