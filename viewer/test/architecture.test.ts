import { readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { describe, expect, it } from "vitest";

const ROOT = join(import.meta.dirname, "..");
const IMPORT = /(?:from\s|import\s*\(?|new URL\()\s*["']([^"'\n]+)["']/g;
const PACKAGE = /^[a-z@]/;
const LONGEST_FILE_LINES = 600;

const READERS = ["core/basics", "core/pace", "core/documents"] as const;

/**
 * Which other rooms each room may import: only such as stand before it, so that data flows one way. A room is a folder with
 * all that is in it, but for rooms in it. Tests may import more.
 */
const KNOWS: Record<string, readonly string[]> = {
  "core/smooth": [],
  "core/select": ["core/smooth"],
  "core/procedural": [],
  "core/basics": [],
  "core/pace": ["core/basics"],
  "core/documents": ["core/basics", "core/pace", "core/procedural"],
  "core/strategy": ["core/basics", "core/documents"],
  "core/shelf": ["core/pace"],
  "core/fetch": [...READERS, "core/strategy", "core/shelf"],
  "core/live": ["core/basics", "core/documents", "core/strategy", "core/fetch"],
  "core/atlas": [...READERS, "core/strategy", "core/fetch"],
  "core/movement": ["core/basics", "core/documents", "core/strategy", "core/atlas"],
  "core/models": [...READERS, "core/strategy", "core/fetch", "core/procedural", "core/smooth"],
  "core/explorer": [...READERS, "core/strategy", "core/fetch", "core/atlas", "core/movement", "core/models"],
  core: [
    ...READERS,
    "core/strategy",
    "core/shelf",
    "core/fetch",
    "core/atlas",
    "core/movement",
    "core/models",
    "core/explorer",
    "core/procedural",
    "core/smooth",
    "core/select",
  ],
  three: [...READERS, "core/strategy", "core/models", "core/live", "core/procedural"],
  ui: [
    ...READERS,
    "core/strategy",
    "core/shelf",
    "core/fetch",
    "core/atlas",
    "core/movement",
    "core/explorer",
    "core/live",
    "three",
  ],
  embed: ["core/basics", "core/fetch", "core/movement", "three", "ui"],
};
const ROOMS = Object.keys(KNOWS);

/** The files by which others enter a room, where these are not all. */
const DOORS: Record<string, readonly string[]> = { "core/procedural": ["index.ts", "value.ts"] };

/** What rooms use besides: packages, and what stands beside the viewer. */
const BESIDES: Record<string, RegExp> = { three: /^(three|three\/addons\/.+|\.\.\/content\/[a-z]+\.dcg\?raw)$/ };

interface Source {
  readonly path: string;
  readonly text: string;
}

/** The room in which a file is: the innermost. */
function roomOf(path: string): string | undefined {
  return ROOMS.filter((room) => path.startsWith(`${room}/`)).sort((a, b) => b.length - a.length)[0];
}

const SOURCES: readonly Source[] = ["core", "three", "ui", "embed"].flatMap((top) => {
  const names = readdirSync(join(ROOT, top), { recursive: true, encoding: "utf8" });
  const paths = names.filter((name) => name.endsWith(".ts")).map((name) => `${top}/${name.replaceAll("\\", "/")}`);
  return paths.map((path) => ({ path, text: readFileSync(join(ROOT, path), "utf8") }));
});

const sources = (room: string) => SOURCES.filter(({ path }) => roomOf(path) === room);
const production = (room: string) => sources(room).filter(({ path }) => !path.endsWith(".test.ts"));

/** What a file imports: paths in the viewer, or names of packages. */
function importsOf({ path, text }: Source): string[] {
  const named = [...text.matchAll(IMPORT)].map(([, target = ""]) => target);
  return named.map((target) => (PACKAGE.test(target) ? target : join(dirname(path), target).replaceAll("\\", "/")));
}

/** Whether a room may know what is imported. */
function mayKnow(room: string, target: string): boolean {
  const other = roomOf(target);
  if (other === undefined) return BESIDES[room]?.test(target) ?? false;
  if (other === room) return true;
  const doors = DOORS[other]?.map((door) => `${other}/${door}`) ?? [target];
  return KNOWS[room]?.includes(other) === true && doors.includes(target);
}

describe.each(ROOMS)("%s", (room) => {
  it("imports nothing that it should not know", () => {
    const files = production(room);
    expect(files.length).toBeGreaterThan(0);
    for (const file of files) {
      for (const target of importsOf(file)) expect(mayKnow(room, target), `${file.path} imports ${target}`).toBe(true);
    }
  });

  it("knows only what stands before it, and nothing that it does not use", () => {
    const before = ROOMS.slice(0, ROOMS.indexOf(room));
    expect(before).toEqual(expect.arrayContaining([...(KNOWS[room] ?? [])]));
    const used = new Set(production(room).flatMap((file) => importsOf(file).map(roomOf)));
    expect([...used]).toEqual(expect.arrayContaining([...(KNOWS[room] ?? [])]));
  });

  it("opens each file with the question that it answers", () => {
    for (const { path, text } of production(room)) expect(text, path).toMatch(/^\/\*\*[\s\S]{1,300}\?/);
  });

  it("keeps its files short", () => {
    for (const { path, text } of sources(room)) expect(text.split("\n").length, path).toBeLessThan(LONGEST_FILE_LINES);
  });
});

it("the core stands in rooms, beside what it shows to others", () => {
  expect(sources("core").map(({ path }) => path)).toEqual(["core/index.ts"]);
});

it.each(ROOMS.filter((room) => room.startsWith("core")))("%s touches neither page nor window", (room) => {
  for (const { path, text } of production(room)) {
    expect(text, path).not.toMatch(/\b(document|window|localStorage|navigator)\.[a-z]/);
  }
});

it("the strategy has neither clock nor wire", () => {
  for (const { path, text } of production("core/strategy")) {
    expect(text, path).not.toMatch(/\b(performance|Date|fetch|setTimeout|setInterval)[.(]|\bawait\b/);
  }
});
