import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";

const ROOT = join(import.meta.dirname, "..");
const IMPORT = /(?:from\s|import\s*\(?)\s*["']([^"'\n]+)["']/g;
const LONGEST_FILE_LINES = 600;

/** Which other rooms and packages each room may import. Tests may import more. */
const ALLOWED: Record<string, RegExp> = {
  core: /^\.\/((smooth|procedural)\/)?[a-z]+\.ts$/,
  "core/live": /^(\.\/[a-z]+\.ts|\.\.\/[a-z]+\.ts)$/,
  "core/select": /^(\.\/[a-z]+\.ts|\.\.\/smooth\/[a-z]+\.ts)$/,
  "core/smooth": /^\.\/[a-z]+\.ts$/,
  three:
    /^(\.\/[a-z]+\.ts|\.\.\/core\/((live\/)?[a-z]+|procedural\/index)\.ts|\.\.\/\.\.\/content\/[a-z]+\.dcg\?raw|three|three\/addons\/.+)$/,
  "ui/inspector": /^(\.\/[a-z]+\.ts|\.\.\/[a-z]+\.ts|\.\.\/\.\.\/(core|core\/live|three)\/[a-z]+\.ts)$/,
  embed: /^(\.\/[a-z]+\.ts|\.\.\/(core|three|ui)\/[a-z]+\.ts)$/,
  ui: /^(\.\/(inspector\/)?[a-z]+\.ts|\.\.\/(core|core\/live|three)\/[a-z]+\.ts)$/,
};

function sources(room: string): { path: string; text: string }[] {
  const names = readdirSync(join(ROOT, room)).filter((name) => name.endsWith(".ts"));
  return names.map((name) => ({ path: `${room}/${name}`, text: readFileSync(join(ROOT, room, name), "utf8") }));
}

const production = (room: string) => sources(room).filter(({ path }) => !path.endsWith(".test.ts"));

describe.each(Object.entries(ALLOWED))("%s", (room, allowed) => {
  it("imports nothing that it should not know", () => {
    const files = production(room);
    expect(files.length).toBeGreaterThan(0);
    for (const { path, text } of files) {
      for (const [, target = ""] of text.matchAll(IMPORT)) expect(target, `imported by ${path}`).toMatch(allowed);
    }
  });

  it("opens each file with the question that it answers", () => {
    for (const { path, text } of production(room)) expect(text, path).toMatch(/^\/\*\*[\s\S]{1,300}\?/);
  });

  it("keeps its files short", () => {
    for (const { path, text } of sources(room)) expect(text.split("\n").length, path).toBeLessThan(LONGEST_FILE_LINES);
  });
});

it.each(["core", "core/live", "core/select", "core/smooth"])("%s touches neither page nor window", (room) => {
  for (const { path, text } of production(room)) {
    expect(text, path).not.toMatch(/\b(document|window|localStorage|navigator)\.[a-z]/);
  }
});
