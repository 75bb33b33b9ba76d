/** How much may a model take, and how much of that has it taken? As `crates/scene/src/procedural/limits.rs`. */

export const MAX_TEXT_BYTES = 2 ** 20;
/** Most bytes of all files of one model: what is read of them takes some hundred times as much memory. */
export const MAX_ALL_TEXT_BYTES = 2 ** 22;
export const MAX_MODULES = 256;
/** Most letters of a name. */
export const MAX_NAME = 255;
export const MAX_NESTING = 96;
/** Most transforms, loops and conditions around one another in a text: they need no brackets. */
export const MAX_AROUND = 256;
/** Most operators in a row. */
export const MAX_CHAIN = 64;
/** Most words of code that are made of one file, so that they take no more memory than its text may. */
export const MAX_CODE = 2 ** 21;
export const MAX_LIST = 2 ** 16;
/** Most numbers of lists that are needed at once: by the calls that are open, and by what is being computed. */
export const MAX_HELD = 2 ** 21;
/** Most lists inside each other in a value. */
export const MAX_LIST_DEPTH = 64;
export const MAX_CORNERS = 256;
export const MAX_SIDES = 256;
export const MAX_STEPS = 4096;
/** The finest level of detail. */
export const FINEST = 4;

/** What was or may be taken, by name. */
export interface Amounts {
  /** Calls inside each other. */
  levels: number;
  /** Calls, blocks and expressions inside each other. */
  nesting: number;
  /** Nodes visited. */
  steps: number;
  /** Triangles, each part counted once. */
  triangles: number;
  parts: number;
  /** Parts, glTF files and viewpoints placed, counting again whatever they contain. */
  placements: number;
  materials: number;
  /** Numbers that are kept: what parts, materials and files were given, and 8 letters of a name or path for each number. */
  kept: number;
}

/** What was taken. */
export interface Usage extends Amounts {
  /** Files, the first included; at most {@link MAX_MODULES}. */
  files: number;
}

export const LIMITS: Readonly<Amounts> = {
  levels: 64,
  nesting: 640,
  steps: 1_000_000_000,
  triangles: 16_000_000,
  parts: 65_536,
  placements: 1_000_000,
  materials: 4_096,
  kept: 2 ** 22,
};

const WAYS_OUT: Readonly<Record<string, string>> = {
  "brackets and blocks inside each other": "give a part of it a name, with `let`, `rule` or `function`",
  "transforms, loops and conditions around one another":
    "put what is inside into a `rule` or `function`, or `choose` by a number",
  "operators in a row": "compute a part of it before, with `let`",
  "letters in a name": "choose a shorter one",
  "letters in a path": "choose a shorter one",
  "numbers in lists at once": "name long lists outside of rules, with `let`, and hand fewer of them down through calls",
  "numbers kept": "give parts, materials and files fewer different lists, and use shorter names",
  levels: "stop the recursion earlier, with `if` or `levels`",
  "levels of calls, those of functions too":
    "stop the recursion earlier, with `if`, or let each call halve what is left",
  "levels of nesting": "stop the recursion earlier, with `if` or `levels`",
  steps: "repeat less, or grow it with less detail",
  triangles: "use fewer sides or steps, or a `part` for what is repeated",
  placements: "place fewer, or split the world into several files",
  parts: "give parts parameters that take fewer different values, and call less by names of its own",
  "bytes of text in all files": "leave out what is not used, or make several models of it",
  materials: "let their parameters, and those of the files that have them, take fewer different values",
};

/** What is said when a limit is reached. */
export function reached(what: string, limit: number): string {
  return `more than ${limit} ${what}; ${WAYS_OUT[what] ?? "make it smaller"}`;
}
