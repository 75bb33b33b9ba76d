import { beforeEach, expect, test, vi } from "vitest";
import { Frames } from "./frames.ts";

let next: FrameRequestCallback | undefined;
let now_ms = 0;

beforeEach(() => {
  next = undefined;
  vi.stubGlobal("requestAnimationFrame", (frame: FrameRequestCallback) => {
    expect(next, "one frame at a time").toBeUndefined();
    next = frame;
  });
});

/** Lets so much time pass, with a frame every 100 ms as long as somebody asks for one. */
function pass(time_ms: number): void {
  for (const end_ms = now_ms + time_ms; now_ms < end_ms; ) {
    now_ms += 100;
    const frame = next;
    next = undefined;
    frame?.(now_ms);
  }
}

test("frames that nobody sees end once nothing happens, and go on when something does or somebody sees them", () => {
  const drawn = vi.fn(() => false);
  const frames = new Frames(drawn);
  frames.wake();
  frames.wake();
  pass(5000);
  expect(drawn, "while somebody sees them").toHaveBeenCalledTimes(50);
  drawn.mockReturnValue(true);
  pass(100);
  frames.watch(false);
  pass(4900);
  expect(drawn, "while something happens").toHaveBeenCalledTimes(100);
  drawn.mockReturnValue(false);
  pass(2000);
  expect(next).toBeUndefined();
  const rested = drawn.mock.calls.length;
  pass(5000);
  expect(drawn).toHaveBeenCalledTimes(rested);
  frames.wake();
  pass(300);
  expect(drawn, "when something happens").toHaveBeenCalledTimes(rested + 3);
  pass(2000);
  expect(next).toBeUndefined();
  frames.watch(true);
  expect(next, "when somebody sees them").toBeDefined();
});

test("a frame that fails is not the last, and after the end there is none", () => {
  const frames = new Frames(() => {
    throw new Error("no picture");
  });
  frames.wake();
  expect(() => pass(100)).toThrow("no picture");
  expect(next).toBeDefined();
  frames.close();
  pass(100);
  expect(next).toBeUndefined();
});
