import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Controls } from "./controls.ts";

beforeEach(() => {
  vi.stubGlobal("addEventListener", () => {});
  vi.stubGlobal("window", new EventTarget());
  vi.stubGlobal("navigator", {});
});
afterEach(() => vi.unstubAllGlobals());

/** Controls of a canvas of 200 × 100 px, where fingers move the page until `isIn`; and what came of fingers. */
function touched() {
  const page = { isIn: false };
  const canvas = Object.assign(new EventTarget(), {
    focus: vi.fn(() => {
      page.isIn = true;
    }),
    setPointerCapture: vi.fn(),
    getRootNode: () => ({ pointerLockElement: null }),
    getBoundingClientRect: () => ({ left: 0, top: 0, width: 200, height: 100 }),
  });
  const events = { keys: new EventTarget(), turn: vi.fn(), command: () => false, tap: vi.fn() };
  const stick = { hidden: true, style: {} };
  const controls = new Controls(canvas as unknown as HTMLCanvasElement, stick as unknown as HTMLElement, {
    ...events,
    takesTouch: () => page.isIn,
  });
  const finger = (type: string, clientX: number, clientY: number) =>
    canvas.dispatchEvent(
      Object.assign(new Event(type), { pointerType: "touch", pointerId: 1, button: 0, clientX, clientY }),
    );
  return { controls, canvas, page, ...events, finger };
}

test("fingers move the page until one taps, and the walker from then on", () => {
  const { controls, canvas, page, turn, tap, finger } = touched();
  for (const x of [150, 50]) {
    finger("pointerdown", x, 50);
    finger("pointermove", x + 20, 20);
    finger("pointercancel", x + 20, 20);
  }
  expect([page.isIn, turn.mock.calls, controls.intent().forward]).toEqual([false, [], 0]);
  expect(canvas.setPointerCapture, "the browser scrolls").not.toHaveBeenCalled();
  finger("pointerdown", 150, 50);
  finger("pointerup", 150, 50);
  expect([page.isIn, tap.mock.calls]).toEqual([true, [[150, 50]]]);
  finger("pointerdown", 50, 50);
  finger("pointermove", 50, 2);
  expect(controls.intent().forward).toBe(1);
  finger("pointerup", 50, 2);
  finger("pointerdown", 150, 50);
  finger("pointermove", 170, 50);
  expect(turn).toHaveBeenCalledOnce();
});
