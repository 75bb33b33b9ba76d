import { expect, it } from "vitest";
import { holdsPointer } from "./pointerlock.ts";

/** A canvas in a tree of which it is asked what holds the pointer. */
function canvasIn(root: { pointerLockElement?: unknown }): Element {
  return { getRootNode: () => root } as unknown as Element;
}

it("the canvas holds the pointer when its own tree says so, be it a document or a shadow tree", () => {
  const root: { pointerLockElement?: unknown } = {};
  const canvas = canvasIn(root);
  expect(holdsPointer(canvas)).toBe(false);
  root.pointerLockElement = canvas;
  expect(holdsPointer(canvas)).toBe(true);
  root.pointerLockElement = canvasIn({});
  expect(holdsPointer(canvas)).toBe(false);
});
