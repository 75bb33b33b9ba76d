//! How is something written? What an error shows where a word or a sign is missing.

pub(super) const STATEMENT: &str = "a statement, such as `box(1, 2, 1)` or a rule with its arguments";
pub(super) const MATERIAL: &str = "the name of a material, declared as in `material red { colour = #f00 }`";
/// What stands in braces.
pub(super) const BODY: &str = "the body in braces, as in `rule post() { box(0.1, 1, 0.1) }`";
pub(super) const CHOICES: &str = "what to choose from in braces, as in `choose 1 { box(1, 2, 1) sphere(1) }`";
pub(super) const PROPERTIES: &str = "the properties in braces, as in `material red { colour = #f00 }`";
/// What stands in brackets.
pub(super) const FORMALS: &str = "the parameters in brackets, as in `(length, sides = 6)` or `()`";
pub(super) const ASKS_FOR_PICTURES: &str = "`(`, as in `part bush() { impostor() box(1, 1, 1) }`";
/// What ends a value in brackets.
pub(super) const BRACKETS: &str = "`)` behind the one value in the brackets; lists and points are written `[1, 2, 3]`";
/// What stands behind a name.
pub(super) const VALUE: &str = "`=` and a value, as in `size = 3`";
pub(super) const VALUE_OF_FUNCTION: &str = "`=` and a value, as in `function twice(x) = 2 * x`";
pub(super) const SECOND_NAME: &str = "`,` and a name for z, as in `x, z in 180 by 180`";

/// Statements and values that have words further on.
pub(super) const FOR: &str = "for i in 10 box(1, 1, 1)";
pub(super) const EDGES: &str = "edges length in [[0, 0], [4, 0], [0, 3]] box(length, 1, 1)";
pub(super) const SCATTER: &str = "scatter 60 as x, z in 180 by 180 box(1, 1, 1)";
pub(super) const HEIGHTS: &str = "heights x, z in 50 by 50 steps 20 by 20 = 0";
pub(super) const RANGE: &str = "parameter height = 8 from 3 to 20";
pub(super) const WITHIN: &str = "part tree() within [-1, 0, -1] to [1, 3, 1] { … }";
pub(super) const IF: &str = "if a < b then a else b";

/// Words that stand inside of a statement or declaration, with one that has them.
pub(super) const LATER: [(&str, &str); 8] = [
    ("as", SCATTER),
    ("by", SCATTER),
    ("from", RANGE),
    ("in", FOR),
    ("levels", "rule branch() levels 4 { … }"),
    ("steps", HEIGHTS),
    ("to", RANGE),
    ("within", WITHIN),
];
