/**
 * What do several turns of a loop do? What is known of it beforehand: solids, and words that compute their numbers for several
 * turns side by side. What is the same in all turns is computed once.
 */
import type { Faces } from "../solid/flat.ts";
import type { SolidKind } from "../solid/kinds.ts";
import type { Globals } from "../stack.ts";
import type { At, Row } from "../syntax.ts";
import type * as code from "./code.ts";

/** Words, and registers of one number that is then put into all of their column. */
export interface Prelude {
  readonly words: Int32Array;
  readonly spread: Int32Array;
}

/** Where a turtle is: registers at which three axes and an origin begin, three each. */
export interface Pose {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly origin: number;
  /** Which of the paints; −1 for that of the turtle outside. */
  readonly paint: number;
}

/** A solid with the registers of its numbers, or those of its points when it has faces. */
export interface Planned {
  readonly at: At;
  readonly solid: SolidKind;
  /** Where its faces are said. */
  readonly list: Row | undefined;
  readonly pose: Pose;
  readonly numbers: Int32Array;
  readonly faces: Faces | undefined;
}

/** A call that is visited, turn by turn, when the numbers of all turns are computed: the last thing that a turn does. */
export interface Tail {
  readonly call: number;
  readonly pose: Pose;
  /** Registers of its arguments. */
  readonly given: Int32Array;
  /** How many nodes it lies in. */
  readonly nesting: number;
}

/** What turns do. */
export interface Plan {
  readonly once: Prelude;
  readonly forAll: Prelude;
  readonly words: Int32Array;
  /** A column for each register. */
  readonly columns: Float64Array;
  /** Pairs of a slot, or of a rule whose level is asked for, and a register. */
  readonly globals: Int32Array;
  readonly locals: Int32Array;
  readonly levels: Int32Array;
  /** Registers of what a turn is given, and of what all turns are. */
  readonly turn: number;
  readonly all: number;
  /** The first of those of the turtle. */
  readonly frame: number;
  readonly solids: readonly Planned[];
  readonly tail: Tail | undefined;
  /** Calls of materials. */
  readonly paints: readonly number[];
  /** What is computed, if that is not solids. */
  readonly result: number;
  /** What a turn takes, but for octaves. */
  readonly cost: Readonly<code.Cost>;
  /** Whose globals were put in last, whether what is computed of them is sound, and which materials its paints are. */
  file: Globals | undefined;
  isSound: boolean;
  materials: number[] | undefined;
}
