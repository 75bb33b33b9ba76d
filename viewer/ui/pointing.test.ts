import { expect, it } from "vitest";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import { Pointing } from "./pointing.ts";

const [MIDDLE, LEFT] = [{}, {}] as PlacedObject[];

function set(open: boolean, live = true) {
  const [shown, used]: (PlacedObject | undefined)[][] = [[], []];
  const pointing = new Pointing({
    pick: (x, y) => (x === 400 && y === 300 ? MIDDLE : x < 400 ? LEFT : undefined),
    canvas: { clientWidth: 800, clientHeight: 600 },
    inspector: { open, show: (object) => shown?.push(object) },
    isLive: () => live,
    use: (object) => used?.push(object),
  });
  return { pointing, shown, used };
}

it("a key shows what is in the middle of the view while the inspector is open, and uses nothing", () => {
  const open = set(true);
  expect(open.pointing.inspect()).toBe(true);
  expect([open.shown, open.used]).toEqual([[MIDDLE], []]);
  const closed = set(false);
  expect(closed.pointing.inspect()).toBe(false);
  expect([closed.shown, closed.used]).toEqual([[], []]);
});

it("a tap shows an object or nothing while the inspector is open, and else uses it where it is live", () => {
  const open = set(true);
  open.pointing.tap(10, 10);
  open.pointing.tap(500, 10);
  expect([open.shown, open.used]).toEqual([[LEFT, undefined], []]);
  const closed = set(false);
  closed.pointing.tap(10, 10);
  closed.pointing.tap(500, 10);
  expect([closed.shown, closed.used]).toEqual([[], [LEFT]]);
  const frozen = set(false, false);
  frozen.pointing.tap(10, 10);
  expect([frozen.shown, frozen.used]).toEqual([[], []]);
});
