import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { Announcer } from "./announcer.ts";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function listen() {
  const line = { textContent: "" };
  return { line, announcer: new Announcer(line) };
}

it("waits until things are quiet, and then says the last on each topic", () => {
  const { line, announcer } = listen();
  announcer.say("cell", "Cell c1");
  announcer.say("door", "Enter: open the door");
  vi.advanceTimersByTime(500);
  announcer.say("cell", "Cell c2");
  vi.advanceTimersByTime(500);
  expect(line.textContent).toBe("");
  vi.advanceTimersByTime(500);
  expect(line.textContent).toBe("Cell c2. Enter: open the door");
});

it("repeats nothing, unless it was taken back in between", () => {
  const { line, announcer } = listen();
  const hear = (text: string) => {
    line.textContent = "";
    announcer.say("door", text);
    vi.runAllTimers();
    return line.textContent;
  };
  expect(hear("Enter: open the door")).toBe("Enter: open the door");
  expect(hear("Enter: open the door")).toBe("");
  expect(hear("")).toBe("");
  expect(hear("Enter: open the door")).toBe("Enter: open the door");
});

it("says nothing of a door that was passed by", () => {
  const { line, announcer } = listen();
  announcer.say("door", "Enter: open the door");
  vi.advanceTimersByTime(300);
  announcer.say("door", "");
  vi.runAllTimers();
  expect(line.textContent).toBe("");
});
