/** How is something written? What an error shows where a word or a sign is missing. As `crates/scene/src/procedural/parser/usage.rs`. */

export const STATEMENT = "a statement, such as `box(1, 2, 1)` or a rule with its arguments";
export const MATERIAL = "the name of a material, declared as in `material red { colour = #f00 }`";
/** What stands in braces. */
export const BODY = "the body in braces, as in `rule post() { box(0.1, 1, 0.1) }`";
export const CHOICES = "what to choose from in braces, as in `choose 1 { box(1, 2, 1) sphere(1) }`";
export const PROPERTIES = "the properties in braces, as in `material red { colour = #f00 }`";
/** What stands in brackets. */
export const FORMALS = "the parameters in brackets, as in `(length, sides = 6)` or `()`";
export const ASKS_FOR_PICTURES = "`(`, as in `part bush() { impostor() box(1, 1, 1) }`";
/** What ends a value in brackets. */
export const BRACKETS = "`)` behind the one value in the brackets; lists and points are written `[1, 2, 3]`";
/** What stands behind a name. */
export const VALUE = "`=` and a value, as in `size = 3`";
export const VALUE_OF_FUNCTION = "`=` and a value, as in `function twice(x) = 2 * x`";
export const SECOND_NAME = "`,` and a name for z, as in `x, z in 180 by 180`";

/** Statements and values that have words further on. */
export const FOR = "for i in 10 box(1, 1, 1)";
export const EDGES = "edges length in [[0, 0], [4, 0], [0, 3]] box(length, 1, 1)";
export const SCATTER = "scatter 60 as x, z in 180 by 180 box(1, 1, 1)";
export const HEIGHTS = "heights x, z in 50 by 50 steps 20 by 20 = 0";
export const RANGE = "parameter height = 8 from 3 to 20";
export const WITHIN = "part tree() within [-1, 0, -1] to [1, 3, 1] { … }";
export const IF = "if a < b then a else b";

/** Words that stand inside of a statement or declaration, with one that has them. */
export const LATER: ReadonlyMap<string, string> = new Map([
  ["as", SCATTER],
  ["by", SCATTER],
  ["from", RANGE],
  ["in", FOR],
  ["levels", "rule branch() levels 4 { … }"],
  ["steps", HEIGHTS],
  ["to", RANGE],
  ["within", WITHIN],
]);
