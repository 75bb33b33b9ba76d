import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { COMMANDS, commandOf, isForControl, MOTIONS } from "./keys.ts";

/** How the help writes keys whose names are not their letters. */
const WRITTEN: Record<string, string> = {
  ArrowUp: "↑",
  ArrowDown: "↓",
  ArrowLeft: "←",
  ArrowRight: "→",
  PageUp: "Page Up",
  PageDown: "Page Down",
  NumpadEnter: "Enter",
  Escape: "Esc",
};

describe("the help of the page", () => {
  const page = readFileSync(join(import.meta.dirname, "../index.html"), "utf8");
  const from = page.indexOf('id="help"');
  const help = page.slice(from, page.indexOf("</section>", from));
  const listed = new Set([...help.matchAll(/<kbd>([^<]+)<\/kbd>/g)].map(([, name]) => name));

  it.each([...Object.keys(MOTIONS), ...Object.keys(COMMANDS)])("lists %s", (code) => {
    expect(listed).toContain(WRITTEN[code] ?? code.replace(/^Key/, ""));
  });

  it("lists what is no key of its own", () => {
    for (const name of ["?", "Shift"]) expect(listed).toContain(name);
  });
});

it("no key both moves and commands", () => {
  expect(Object.keys(MOTIONS).filter((code) => code in COMMANDS)).toEqual([]);
});

it("a question mark asks for help wherever it is printed, and a key without meaning for nothing", () => {
  expect(commandOf({ code: "Minus", key: "?" })).toBe("help");
  expect(commandOf({ code: "Enter", key: "Enter" })).toBe("door");
  expect(commandOf({ code: "Space", key: " " })).toBe("inspect");
  expect(commandOf({ code: "KeyZ", key: "z" })).toBeUndefined();
});

/** An element that stands in what these selectors, and no others, name. */
const within = (...names: string[]) => ({
  closest: (selector: string) =>
    selector.split(", ").some((part) => names.includes(part)) ? ({} as HTMLElement) : null,
});

it("controls keep the keys that they understand, and leave the others to the walker", () => {
  const [button, list, panel, canvas] = [within("button"), within("select"), within("[data-scrolls]"), within()];
  expect([isForControl(button, "Enter"), isForControl(button, "Space")]).toEqual([true, true]);
  expect([isForControl(button, "KeyW"), isForControl(button, "ArrowUp")]).toEqual([false, false]);
  expect([isForControl(list, "KeyW"), isForControl(list, "Enter"), isForControl(list, "Escape")]).toEqual([
    true,
    true,
    false,
  ]);
  expect([isForControl(panel, "PageDown"), isForControl(panel, "KeyW")]).toEqual([true, false]);
  expect([isForControl(canvas, "Enter"), isForControl(canvas, "ArrowUp")]).toEqual([false, false]);
});
