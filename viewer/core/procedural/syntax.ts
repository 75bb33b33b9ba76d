/**
 * What does a file of rules say? Its nodes: a directed graph, cyclic where rules call each other. As
 * `crates/scene/src/procedural/syntax.rs`: variables are slots already, calls are joined to what they call by `link.ts`.
 */
import type { Code } from "./plain/code.ts";
import type { Plan } from "./plain/plan.ts";
import type { SolidKind } from "./solid/kinds.ts";

/** Index in the text of a module. */
export type At = number;

export interface Module {
  readonly file: string;
  readonly text: string;
  readonly imports: Import[];
  readonly parameters: Parameter[];
  /** `let` outside of rules: value `i` of these lies behind the parameters. */
  readonly globals: Global[];
  readonly rules: Rule[];
  readonly functions: FunctionRule[];
  readonly materials: MaterialRule[];
  readonly body: Statement[];
  /** Values that the body has besides the globals. */
  bodySlots: number;
  readonly calls: Call[];
  /** Uses of globals. */
  readonly uses: Use[];
  /** How many more words of code may be made of it. */
  room: number;
}

/** An expression, and where it begins: an argument with its name, if it has one. */
export interface Written {
  readonly at: At;
  readonly of: Expr;
}

/** Expressions that are computed together. */
export interface Row {
  readonly of: readonly Expr[];
  /** Where each begins. */
  readonly places: readonly At[];
  /** What is wanted of them: numbers, any values, or for the only one rows of numbers. */
  readonly as: "numbers" | "values" | "rows";
  /** What computes them at one go; `null` when that cannot be, `undefined` as long as nobody asked. */
  code: Code | null | undefined;
}

export function rowOf(as: Row["as"], all: readonly Written[]): Row {
  return { of: all.map(({ of }) => of), places: all.map(({ at }) => at), as, code: undefined };
}

export interface Import {
  readonly alias: string;
  readonly at: At;
  readonly path: string;
  /** Index of the module, once linked. */
  module: number;
}

export interface Global {
  readonly name: string;
  readonly at: At;
  readonly value: Row;
}

/** What a file can be given from outside. */
export interface Parameter {
  readonly formal: Formal;
  readonly range?: readonly [Written, Written];
  /** Its name with its range, as they are written. */
  readonly shown: string;
}

/** What a rule, function or material can be given. */
export interface Formal {
  readonly name: string;
  readonly at: At;
  readonly initial?: Row;
}

interface Declared {
  readonly name: string;
  readonly formals: Formal[];
  readonly slots: number;
}

export interface Rule extends Declared {
  readonly at: At;
  /** Its geometry depends on its parameters alone and is shared. */
  readonly isPart: boolean;
  readonly levels: Row | undefined;
  /** Two opposite corners of a box that holds it. */
  readonly within: readonly [Written, Written] | undefined;
  readonly body: Statement;
  /** In place of the body when `levels` are used up. */
  readonly afterwards: Statement | undefined;
}

export interface FunctionRule extends Declared {
  readonly value: Written;
}

export interface MaterialRule extends Declared {
  readonly properties: readonly (readonly [Property, Written])[];
}

export const PROPERTIES = [
  "colour",
  "roughness",
  "metallic",
  "emissive",
  "opacity",
  "double_sided",
  "recolour",
] as const;
export type Property = (typeof PROPERTIES)[number];

export type Wanted = "rule" | "function" | "material";

/** A call of a rule, a part, a file, a function or a material. */
export interface Call {
  readonly at: At;
  /** The alias before the dot. */
  readonly alias: string | undefined;
  readonly name: string;
  readonly args: readonly Argument[];
  /** Which word the call adds to the path. */
  readonly site: number;
  readonly wanted: Wanted;
  /** Whether it names another file and no brackets follow, as where one reads a value: there is none to be read. */
  readonly isValue: boolean;
  /** Module that it leads to, once linked. */
  module: number;
  /** Index of the rule, function or material there; −1 for the file as a whole. */
  index: number;
  /** The arguments in the order of what they give, once linked. */
  given: Argument[];
  /** Places of the formals that they give, rising. */
  slots: number[];
  /** Their values; known once linked, as all of these. */
  row: Row;
}

const NONE: readonly number[] = [];

/** Places of the formals that a call does not give. */
export function notGiven({ slots }: Call, formals: readonly Formal[]): readonly number[] {
  // Most calls give all, and are followed very often.
  if (slots.length === formals.length) return NONE;
  const left: number[] = [];
  let given = 0;
  for (let place = 0; place < formals.length; place += 1) {
    if (slots[given] === place) given += 1;
    else left.push(place);
  }
  return left;
}

export interface Argument extends Written {
  readonly name: string | undefined;
}

export interface Use {
  readonly name: string;
  readonly at: At;
  slot: number;
}

export const TRANSFORMS = ["move", "turn", "tilt", "roll", "scale"] as const;
export type Transform = (typeof TRANSFORMS)[number];

export type Statement =
  | { readonly kind: "group"; readonly of: readonly Statement[] }
  | { readonly kind: "let"; readonly at: At; readonly slot: number; readonly value: Row }
  | {
      readonly kind: "if";
      readonly at: At;
      readonly condition: Row;
      readonly yes: Statement;
      readonly no: Statement | undefined;
    }
  | { readonly kind: "choose"; readonly at: At; readonly number: Row; readonly of: readonly Statement[] }
  | {
      readonly kind: "place";
      readonly at: At;
      readonly transform: Transform;
      readonly by: Row;
      readonly body: Statement;
    }
  | { readonly kind: "paint"; readonly call: number; readonly body: Statement }
  | { readonly kind: "called"; readonly at: At; readonly name: string; readonly body: Statement }
  | { readonly kind: "call"; readonly call: number }
  | {
      readonly kind: "solid";
      readonly at: At;
      readonly solid: SolidKind;
      /** Its lists, then its numbers. */
      readonly lists: readonly Row[];
      readonly numbers: Row;
    }
  | { readonly kind: "viewpoint"; readonly at: At; readonly name: string }
  | { readonly kind: "impostor"; readonly at: At; readonly numbers: Row }
  | { readonly kind: "model"; readonly at: At; readonly path: string }
  | {
      readonly kind: "for";
      readonly at: At;
      readonly site: number;
      readonly slots: readonly number[];
      readonly over: Row;
      readonly body: Statement;
      /** What does several turns at one go; as {@link Row.code}. */
      plan: Plan | null | undefined;
    }
  | {
      readonly kind: "scatter";
      readonly at: At;
      readonly site: number;
      readonly slots: readonly [number, number];
      /** How many, a width and a depth. */
      readonly over: Row;
      readonly body: Statement;
    }
  | {
      readonly kind: "edges";
      readonly at: At;
      readonly site: number;
      readonly slots: readonly number[];
      readonly polygon: Row;
      readonly body: Statement;
    }
  | {
      readonly kind: "heights";
      readonly at: At;
      readonly slots: readonly [number, number];
      /** Width, depth and steps along them. */
      readonly over: Row;
      readonly height: Row;
      plan: Plan | null | undefined;
    };

export type Operator = "+" | "-" | "*" | "/" | "==" | "!=" | "<" | "<=" | ">" | ">=";

export type Expr =
  | { readonly kind: "number"; readonly value: number }
  | { readonly kind: "colour"; readonly channels: readonly [number, number, number] }
  | { readonly kind: "local"; readonly slot: number }
  /** Index into the module's uses. */
  | { readonly kind: "global"; readonly use: number }
  | { readonly kind: "detail" }
  | { readonly kind: "level" }
  | { readonly kind: "minus"; readonly of: Expr }
  | { readonly kind: "not"; readonly of: Expr }
  | { readonly kind: "binary"; readonly at: At; readonly operator: Operator; readonly left: Expr; readonly right: Expr }
  | { readonly kind: "and"; readonly left: Expr; readonly right: Expr }
  | { readonly kind: "or"; readonly left: Expr; readonly right: Expr }
  | { readonly kind: "if"; readonly condition: Expr; readonly yes: Expr; readonly no: Expr }
  | { readonly kind: "list"; readonly at: At; readonly items: readonly Expr[] }
  | { readonly kind: "item"; readonly at: At; readonly of: Expr; readonly index: Expr }
  | {
      readonly kind: "builtin";
      readonly at: At;
      readonly name: BuiltIn;
      readonly site: number;
      readonly args: readonly Written[];
    }
  | { readonly kind: "call"; readonly call: number };

/** Functions of the language: the names by which documentation calls what they take. */
export const BUILT_INS = {
  abs: ["x"],
  atan2: ["y", "x"],
  ceil: ["x"],
  clamp: ["x", "least", "most"],
  cos: ["degrees"],
  count: ["list"],
  floor: ["x"],
  fractal: ["x", "z", "octaves"],
  max: ["a", "b"],
  min: ["a", "b"],
  mix: ["a", "b", "part"],
  mod: ["a", "b"],
  noise: ["x", "z"],
  power: ["x", "whole"],
  random: ["a", "b"],
  round: ["x"],
  sin: ["degrees"],
  sqrt: ["x"],
} as const;
export type BuiltIn = keyof typeof BUILT_INS;

export function isBuiltIn(name: string): name is BuiltIn {
  return Object.hasOwn(BUILT_INS, name);
}
