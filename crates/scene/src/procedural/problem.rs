//! What can be wrong at a place of a text, and what would put it right?

use super::signs::in_place_of;
use super::wording::{
    absent, character, counted, cut, meant, odd_in, of_points, quoted, shown, suggested, with_article,
};

/// What is wrong at one place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A character that means nothing.
    #[error("{shown} means nothing here; {way_out}", shown = character(*.0), way_out = in_place_of(*.0))]
    Character(char),
    /// A comment as other languages have it.
    #[error("comments begin with `//` and end with their line")]
    Comment,
    /// A byte that is no part of a text.
    #[error("the byte 0x{0:02x} is no part of a text; save the file as UTF-8")]
    NotText(u8),
    /// A text that does not end on its line.
    #[error("this text has no end; close it with `\"` on the same line")]
    OpenText,
    /// A number that is none.
    #[error("`{word}` is not a number; write `0.5`, `12` or `1e-3`", word = cut(.0))]
    Number(String),
    /// A colour that is none.
    #[error("`#{word}` is not a colour; write `#rgb` or `#rrggbb` with hexadecimal digits; comments begin with `//`",
        word = cut(.0))]
    Colour(String),
    /// Something else was expected.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A sign for giving names where values are compared.
    #[error("`=` gives a value a name; compare with `==`")]
    Equals,
    /// Two signs in the order of other languages, and what is meant by them.
    #[error("`{0}` means nothing here; write `{1}`")]
    Comparison(&'static str, &'static str),
    /// A comparison of a comparison.
    #[error("a comparison cannot follow another; join them with `and`, as in `a < b and b < c`")]
    Compared,
    /// What is opened and never closed.
    #[error("this `{0}` has no `{1}`")]
    Unclosed(&'static str, &'static str),
    /// What closes something that is not open.
    #[error("this `{0}` has no `{1}` before it; remove it, or write what is missing")]
    Unopened(&'static str, &'static str),
    /// A declaration in braces.
    #[error(
        "declarations stand outside of braces, and the `{{` of line {line}, column {column} is not closed before this one; close it with `}}`"
    )]
    DeclarationInside {
        /// The line of the brace.
        line: usize,
        /// Its character in the line.
        column: usize,
    },
    /// A declaration where what stands before wants a statement.
    #[error("`{0}` begins a declaration, and a statement is wanted here; write one, such as `box(1, 2, 1)`, before it")]
    DeclarationBehind(String),
    /// A range, as other languages have it, where a loop says how often.
    #[error(
        "`for` takes how often or a list, and no range: write `for i in 5`, which counts from 0 to 4, or `for i in [1, 2, 3]`"
    )]
    RangeOfLoop,
    /// A word that stands inside of what it belongs to.
    #[error("no statement begins with `{word}`; it belongs into one or into a declaration, as in `{usage}`")]
    Later {
        /// The word.
        word: String,
        /// What it may stand in.
        usage: &'static str,
    },
    /// A word with which no statement begins.
    #[error("no statement begins with `{word}`; {way_out}", way_out = match (absent("statement", .word), .suggestion) {
        (Some(instead), _) => instead.to_owned(),
        (None, Some(name)) => format!("did you mean `{name}`?"),
        (None, None) => format!("a rule is called with brackets, as in `{word}()`"),
    })]
    NoStatement {
        /// The word.
        word: String,
        /// A known word like it.
        suggestion: Option<String>,
    },
    /// A word of `if` where a statement begins.
    #[error("`else` follows the statement of an `if`; there is none before this")]
    Else,
    /// The same.
    #[error("`then` stands in values; the statement of an `if` follows its condition at once")]
    Then,
    /// A value where one of several statements is chosen.
    #[error(
        "`choose` does one of its statements, and a `let` alone does nothing; put it before the `choose`, or in braces with \
         the statement that it is for"
    )]
    LetInChoose,
    /// A value of which a `let` is all that stands behind an `if`, a loop or a transform.
    #[error(
        "`{0}` is not a value here: behind `if`, a loop or a transform, a `let` alone does nothing; put braces around it and \
         what uses it"
    )]
    LoneLet(String),
    /// A value that is made of itself.
    #[error(
        "`{0}` has no value yet where it is named; make it of other values, or give it another name than what it is made of"
    )]
    OfItself(String),
    /// The name of a function where a value is wanted.
    #[error("`{name}` is a function: write `{name}({formals})`")]
    FunctionAsValue {
        /// The function.
        name: String,
        /// What it takes.
        formals: String,
    },
    /// What changes a statement at the end of the file or of braces.
    #[error(
        "`{0}` is for the statement behind it, and there is none; write one, such as `box(1, 2, 1)`, or braces with several"
    )]
    NothingBehind(String),
    /// A value of another file.
    #[error(
        "values of other files cannot be read, as `{name}` of \"{file}\"; declare a function there, as in \
         `function {getter}() = {name}`, and write `{call}`"
    )]
    ValueOfFile {
        /// The file.
        file: String,
        /// The value.
        name: String,
        /// What a function there could be called that gives it.
        getter: String,
        /// How that would be called here.
        call: String,
    },
    /// A value without `let`.
    #[error("a value is named with `let`: write `let {0} = …`; it never changes")]
    WithoutLet(String),
    /// A name that is known for something else.
    #[error("`{name}` is a {is}, and a {wanted} is wanted here")]
    OtherKind {
        /// The name.
        name: String,
        /// What it is.
        is: &'static str,
        /// What it should be.
        wanted: &'static str,
    },
    /// A name that is not known.
    #[error("{name} is not {kind} here{suggestion}", name = quoted(.name), kind = with_article(.kind), suggestion = suggested(.suggestion, .kind, .name))]
    Unknown {
        /// What was looked for.
        kind: &'static str,
        /// The name.
        name: String,
        /// A known name like it.
        suggestion: Option<String>,
    },
    /// A name that the file does not declare of which it is asked.
    #[error("`{name}` is not {kind} of \"{file}\"; {way_out}", kind = with_article(.kind),
        way_out = meant(.suggestion, "declares", .known))]
    UnknownOfFile {
        /// What was looked for.
        kind: &'static str,
        /// The name.
        name: String,
        /// The file.
        file: String,
        /// A known name like it.
        suggestion: Option<String>,
        /// What it declares.
        known: Vec<String>,
    },
    /// An argument that what is called does not take.
    #[error("`{name}`{odd} is not a parameter of `{callee}`; {way_out}", name = cut(.name), odd = odd_in(.name), way_out = meant(.suggestion, "takes", .known))]
    UnknownArgument {
        /// The name.
        name: String,
        /// What is called.
        callee: String,
        /// A known name like it.
        suggestion: Option<String>,
        /// What it takes.
        known: Vec<String>,
    },
    /// A property that materials do not have.
    #[error("`{name}` is not a property of a material; {way_out}", way_out = meant(.suggestion, "takes", .known))]
    UnknownProperty {
        /// The name.
        name: String,
        /// A known name like it.
        suggestion: Option<String>,
        /// What there are.
        known: Vec<String>,
    },
    /// A name given twice.
    #[error("`{name}` was already given on line {first_line}; rename one of the two")]
    Twice {
        /// The name.
        name: String,
        /// Where it was given first.
        first_line: usize,
    },
    /// A name that the language uses itself.
    #[error("`{0}` is a word of the language; choose another name")]
    Reserved(String),
    /// A parameter or value of the file that would never be read.
    #[error("`{0}` is a value that the language gives itself, and this one would never be read; choose another name")]
    OwnValue(String),
    /// An argument too many.
    #[error("`{callee}` takes {most}; remove this one", most = counted(*.most))]
    TooManyArguments {
        /// What is called.
        callee: String,
        /// How many there may be.
        most: usize,
    },
    /// Too few arguments of what is written like `usage`.
    #[error("`{callee}` needs more arguments; write {usage}")]
    TooFewArguments {
        /// What is called.
        callee: String,
        /// How it is called.
        usage: String,
    },
    /// A name of an argument where they have none.
    #[error("arguments of `{callee}` have no names; write {usage}")]
    NamedArgument {
        /// What is called.
        callee: String,
        /// How it is called.
        usage: String,
    },
    /// An argument that is missing.
    #[error("`{callee}` needs `{name}`; give it, or a default where `{callee}` is defined")]
    MissingArgument {
        /// What is called.
        callee: String,
        /// What it needs.
        name: String,
    },
    /// A number that a solid needs.
    #[error("`{callee}` needs `{name}`; write {usage}")]
    MissingNumber {
        /// The solid.
        callee: String,
        /// What it needs.
        name: String,
        /// How it is called.
        usage: String,
    },
    /// An argument given twice.
    #[error("`{0}` is given twice; remove one of the two")]
    ArgumentTwice(String),
    /// A placed argument after a named one.
    #[error("an argument without a name cannot follow one with a name; name this one too")]
    UnnamedAfterNamed,
    /// `levels` on a part.
    #[error("a part cannot have `levels`; write a rule with `levels` and call it in the part")]
    LevelsOfPart,
    /// `then` where nothing ends.
    #[error("`then` says what a rule draws when its `levels` are used up; give it `levels`")]
    ThenWithoutLevels,
    /// `within` on a rule.
    #[error("only a part can say `within`; write `part` in place of `rule`, or leave it out")]
    WithinOfRule,
    /// A file that imports itself.
    #[error("\"{file}\" imports itself, directly or through others; move what both need to a third file", file = cut(.0))]
    ImportCycle(String),
    /// A name in which nothing is seen.
    #[error("this name is empty; say what it is, as people call it, as in `{0} \"The old well\"`")]
    EmptyName(&'static str),
    /// An order to who shows the text, in a name, which is read aloud, or in a path.
    #[error("{shown} is not seen, and has no place in a name or path; leave it out", shown = character(*.0))]
    Unseen(char),
    /// A file without a name.
    #[error("no file is named here; write its path from the folder of the first file, as in `\"tree.dcg\"`")]
    NoFile,
    /// A glTF file that cannot be placed.
    #[error("\"{path}\" cannot be placed: {reason}", path = cut(.path))]
    Model {
        /// The file.
        path: String,
        /// Why not.
        reason: String,
    },
    /// A file that cannot be imported.
    #[error("\"{path}\" cannot be imported: {reason}", path = cut(.path))]
    Import {
        /// The file.
        path: String,
        /// Why not.
        reason: String,
    },
    /// Why a bake refuses what grew from there, in its words.
    #[error("{0}")]
    OfGrown(String),
    /// A division by zero.
    #[error("division by zero; test the divisor with `if` before")]
    DivisionByZero,
    /// A number that left the reals, or grew beyond them.
    #[error("{0} is not a finite number here; keep its operands within range")]
    NotFinite(&'static str),
    /// A list in place of a number.
    #[error("{0} must be a number, and this is a list")]
    NotANumber(&'static str),
    /// A list for a parameter that has a range.
    #[error("`{0}` has a range and must be a number, and this is a list")]
    ListInRange(String),
    /// A number in place of a list.
    #[error("{0} must be a list, and this is a number")]
    NotAList(&'static str),
    /// A list of another kind, or what is none.
    #[error("{what} must be {wanted}")]
    Shape {
        /// What is wrong.
        what: &'static str,
        /// What it should be.
        wanted: &'static str,
    },
    /// Numbers that are too large, too small, too few or in no order.
    #[error("{what} must be {wanted}")]
    Amount {
        /// What is wrong.
        what: &'static str,
        /// What it should be.
        wanted: &'static str,
    },
    /// An index outside of a list.
    #[error("there is no item {index}: the list has {count}, counted from 0", index = shown(*.index))]
    NoItem {
        /// The index.
        index: f64,
        /// How many items there are.
        count: usize,
    },
    /// A face with a corner that is no point.
    #[error("face {face} has a corner {corner}, and there {points}; faces and points are counted from 0",
        corner = shown(*.corner), points = of_points(*.points))]
    NoPoint {
        /// The face.
        face: usize,
        /// What is no number of a point.
        corner: f64,
        /// How many there are.
        points: usize,
    },
    /// A value outside of its range.
    #[error("{what} is {value}; it must be from {min} to {max}", value = shown(*.value), min = shown(*.min), max = shown(*.max))]
    OutOfRange {
        /// Which.
        what: String,
        /// What it is.
        value: f64,
        /// The least it may be.
        min: f64,
        /// The most it may be.
        max: f64,
    },
    /// A limit was reached.
    #[error("more than {limit} {what}; {way_out}")]
    Limit {
        /// What is counted.
        what: &'static str,
        /// How many there may be.
        limit: u64,
        /// How to need less.
        way_out: &'static str,
    },
    /// A value asked for before it is there.
    #[error("`{name}` is not computed yet; {way_out}")]
    NotComputed {
        /// The value.
        name: String,
        /// How it is computed before.
        way_out: &'static str,
    },
    /// A part that contains itself.
    #[error("part `{0}` contains itself with the same parameters; count them down and stop with `if`")]
    PartInItself(String),
    /// A polygon that cannot be filled.
    #[error("this polygon crosses itself or has no area; list its corners in order around it")]
    Polygon,
    /// A polygon that is not flat.
    #[error(
        "this polygon is not flat: its corners lie up to {percent} % of its size off a plane, where 1 % is allowed; move them, \
         or give `mesh` the faces that it is folded into", percent = shown(*.percent)
    )]
    NotFlat {
        /// Of the longest side of a box around it, rounded up.
        percent: f64,
    },
    /// Frames of what does not move.
    #[error(
        "`frames` needs a parameter `phase` of this part or file, by which it moves; give it one, such as `phase = 0`"
    )]
    NoPhase,
    /// Geometry outside of what was declared.
    #[error("part `{part}` reaches {by} m beyond what it declares with `within`, towards {towards}; widen that", by = shown(*.by_m))]
    BeyondDeclared {
        /// Its name.
        part: String,
        /// Where most of it is outside.
        towards: &'static str,
        /// How far it reaches out there.
        by_m: f64,
    },
}

impl Problem {
    /// Whether a value is not what it must be: perhaps a number in place of a list, or a list in place of a number. One that is out
    /// of the range of a parameter, which that names itself, is not meant.
    pub(super) fn is_of_value(&self) -> bool {
        matches!(self, Self::NotANumber(_) | Self::NotAList(_) | Self::Shape { .. })
    }
}
