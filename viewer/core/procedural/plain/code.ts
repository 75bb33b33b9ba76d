/** What does a machine of numbers do? Words of a code, one after the other, from registers to registers. */
import type { Faces } from "../solid/flat.ts";
import type { Globals } from "../stack.ts";
import type { BuiltIn, Operator } from "../syntax.ts";

/** What a row of expressions is computed with at one go, and what that takes when nothing in it depends on values. */
export interface Code {
  readonly words: Int32Array;
  /** Results lie from register {@link RESULTS} on. */
  readonly results: number;
  /** Of rows of numbers: how many there are in each, and in all that are alike; 0 when they differ. */
  readonly lengths: readonly number[];
  readonly width: number;
  /** Its own, with its constants in their places. */
  readonly registers: Float64Array;
  /** Pairs of a slot and the register that its value is copied to. */
  readonly globals: Int32Array;
  readonly locals: Int32Array;
  /** Whose globals were copied last, with the level of detail; each evaluation has files of its own. */
  file: Globals | undefined;
  readonly cost: Readonly<Cost>;
  /** What its rows of constants say, when that was found to be faces. */
  faces: Faces | undefined;
}

/** What the visit of an expression takes. */
export interface Cost {
  steps: number;
  /** Nodes inside each other. */
  nesting: number;
  /** Calls inside each other. */
  levels: number;
}

export const MOST_REGISTERS = 256;
export const MOST_WORDS = 8192;

/** What to do, in two words: what they say with the register of the result above it, and those of what it is made of. */
export function wordsOf(says: number, to: number, a: number, b: number): [number, number] {
  return [says | (to << 8), a | (b << 16)];
}

/** Whether there is nothing to do but to end. */
export function isEmpty(words: Int32Array): boolean {
  return words.length === 2;
}

/** Registers that are always there. */
export const DETAIL = 0;
export const LEVEL = 1;
export const RESULTS = 2;

// What words say, and what they say it of when that is not the register of a result and two others. Some are followed by
// plain numbers.
export const END = 0;
export const MOVE = 1;
export const ADD = 2;
export const SUBTRACT = 3;
export const MULTIPLY = 4;
export const DIVIDE = 5;
export const EQUAL = 6;
export const UNEQUAL = 7;
export const LESS = 8;
export const AT_MOST = 9;
export const MINUS = 10;
export const NOT = 11;
/** Whether it is anything but 0. */
export const TRUTH = 12;
export const ABS = 13;
export const ATAN2 = 14;
export const CEIL = 15;
export const COS = 16;
export const FLOOR = 17;
export const MAX = 18;
export const MIN = 19;
export const MOD = 20;
/** Register, x, z. How many octaves follows. */
export const NOISE = 21;
export const POWER = 22;
export const ROUND = 23;
export const SIN = 24;
export const SQRT = 25;
/** Register. The number of sites follows, and they. */
export const RANDOM = 26;
/** Register, the ends. The number of sites follows, and they. */
export const RANDOM_BETWEEN = 27;
/** Register, the number, the least. The register of the most follows. */
export const CLAMP = 28;
/** Register, the ends. The register of the part follows. */
export const MIX = 29;
/** Register, x, z. The register of the octaves follows. */
export const FRACTAL = 30;
/** Register, where the list is. Its slot follows, how many numbers of items, and their registers. */
export const ITEM = 31;
/** Register, where the list is. Its slot follows. */
export const COUNT = 32;
/** The steps, nesting and levels of what comes behind it follow. */
export const COST = 33;
/** Where to go on follows. */
export const JUMP = 34;
/** Nothing, a register. Where to go on follows, if that is 0. */
export const JUMP_IF_NOT = 35;
/** Nothing, a register. */
export const CHECK = 36;
/** Nothing, a register, the least. The register of the most follows. */
export const WITHIN = 37;
/** Nothing, a register, how near to 0 it may be, either way. */
export const APART = 38;
/** Three registers, where an x axis and a y axis begin. A z axis, an origin, three numbers along these axes and bits follow. */
export const MOVED = 39;
/** Six registers, two axes. The angle by which they turn, from the first to the second, and bits follow. */
export const SWUNG = 40;
/** Three registers, an axis, how many times as long it gets. */
export const STRETCHED = 41;

/** Where a list is. */
export const AMONG_LOCALS = 0;
export const AMONG_GLOBALS = 1;

/** `>` and `>=` are the others with their sides exchanged. */
export const OPERATORS: Readonly<Record<Operator, number>> = {
  "+": ADD,
  "-": SUBTRACT,
  "*": MULTIPLY,
  "/": DIVIDE,
  "==": EQUAL,
  "!=": UNEQUAL,
  "<": LESS,
  "<=": AT_MOST,
  ">": LESS,
  ">=": AT_MOST,
};

/** Functions that need nothing but their arguments, at most two. */
export const FUNCTIONS: Readonly<Partial<Record<BuiltIn, number>>> = {
  abs: ABS,
  atan2: ATAN2,
  ceil: CEIL,
  cos: COS,
  floor: FLOOR,
  max: MAX,
  min: MIN,
  mod: MOD,
  power: POWER,
  round: ROUND,
  sin: SIN,
  sqrt: SQRT,
};
