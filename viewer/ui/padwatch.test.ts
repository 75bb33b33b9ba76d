import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { Pad } from "./gamepad.ts";
import { PadWatch } from "./padwatch.ts";

const [LOWER, RIGHT_SHOULDER] = [0, 5];
/** Many frames of a fast machine, one of a slow one. */
const FRAME_MS = 1000;

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

/** A watch of pads that can be pressed, and what it heard. */
function watched(...pads: (Pad | null)[]) {
  const heard: string[] = [];
  const watch = new PadWatch(
    () => pads,
    (command) => heard.push(command),
  );
  const hold = (axes: number[], ...pressed: number[]) => {
    pads[0] = {
      id: "some pad",
      mapping: "standard",
      axes,
      buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i) })),
    };
  };
  /** Holds something for a while, and lets it go. */
  const press = (ms: number, axes: number[], ...pressed: number[]) => {
    hold(axes, ...pressed);
    vi.advanceTimersByTime(ms);
    hold([]);
    vi.advanceTimersByTime(FRAME_MS);
  };
  return { watch, heard, pads, hold, press };
}

it("a press between two frames commands and moves, once for each", () => {
  const { watch, heard, hold, press } = watched();
  hold([]);
  watch.take();
  press(50, [0, -1, 0.9], LOWER, RIGHT_SHOULDER);
  expect(heard).toEqual(["door"]);
  const { intent, yaw } = watch.take();
  expect(intent).toMatchObject({ forward: 1, up: 1 });
  expect(yaw).toBeLessThan(0);
  expect(watch.take()).toMatchObject({ intent: { forward: 0, up: 0 }, yaw: 0 });
  press(50, [], LOWER);
  press(50, [], LOWER);
  watch.take();
  expect(heard).toEqual(["door", "door", "door"]);
});

it("a button that is held commands once, and moves in every frame until it is let go", () => {
  const { watch, heard, hold } = watched();
  hold([], LOWER, RIGHT_SHOULDER);
  for (const _ of [1, 2, 3]) {
    expect(watch.take().intent.up).toBe(1);
    vi.advanceTimersByTime(FRAME_MS);
  }
  hold([]);
  expect(watch.take().intent.up).toBe(0);
  expect(heard).toEqual(["door"]);
});

it("nothing is looked at between frames while no pad is connected, nor after the end", () => {
  const { watch, pads, hold } = watched(null, null);
  watch.take();
  expect(vi.getTimerCount()).toBe(0);
  hold([]);
  watch.take();
  expect(vi.getTimerCount()).toBe(1);
  pads[0] = null;
  vi.advanceTimersByTime(FRAME_MS);
  expect(vi.getTimerCount()).toBe(0);
  hold([]);
  watch.look();
  watch.close();
  expect(vi.getTimerCount()).toBe(0);
});
