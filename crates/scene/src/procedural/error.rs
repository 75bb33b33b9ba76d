//! What is wrong with a procedural model, where, and what would put it right?

use std::fmt;

/// Longest part of a line that an error repeats, characters.
const MOST_SHOWN: usize = 120;

/// Why a procedural model was refused. Line and column count from 1, columns in characters.
#[derive(Debug, Clone, PartialEq)]
pub struct DcgError {
    /// The file, as it was imported.
    pub file: String,
    /// Line in its text.
    pub line: usize,
    /// Character in the line.
    pub column: usize,
    /// The line, without the spaces around it.
    pub text: String,
    /// What is wrong there.
    pub problem: Problem,
}

impl fmt::Display for DcgError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            file,
            line,
            column,
            text,
            problem,
        } = self;
        let told = format!("{file}, line {line}, column {column}: {problem}");
        f.write_str(&printable(&told))?;
        if text.is_empty() {
            Ok(())
        } else {
            write!(f, "\n    {}", printable(text))
        }
    }
}

/// What a terminal would take for an order becomes a replacement character.
fn printable(text: &str) -> String {
    let is_order = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    text.replace(is_order, "\u{fffd}")
}

impl std::error::Error for DcgError {}

impl DcgError {
    /// An error at a byte of a text.
    #[must_use]
    pub(super) fn at(file: &str, source: &str, at: u32, problem: Problem) -> Box<Self> {
        let before = &source[..source.floor_char_boundary(at as usize)];
        let start = before.rfind(LINE_ENDS).map_or(0, |end| end + 1);
        let line = source[start..].split(LINE_ENDS).next().unwrap_or_default();
        Box::new(Self {
            file: file.to_owned(),
            line: line_of(source, at),
            column: before[start..].chars().count() + 1,
            text: line.trim().chars().take(MOST_SHOWN).collect(),
            problem,
        })
    }
}

const LINE_ENDS: [char; 2] = ['\n', '\r'];

/// The line in which a byte lies, counted from 1. Lines end as on any machine, old ones too.
pub(super) fn line_of(text: &str, at: u32) -> usize {
    let before = &text[..text.floor_char_boundary(at as usize)];
    1 + before.matches(LINE_ENDS).count() - before.matches("\r\n").count()
}

/// What is wrong at one place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// A character that means nothing.
    #[error("`{0}` means nothing here; comments begin with `//`, colours with `#`")]
    Character(char),
    /// A text that does not end on its line.
    #[error("this text has no end; close it with `\"` on the same line")]
    OpenText,
    /// A number that is none.
    #[error("`{0}` is not a number; write `0.5`, `12` or `1e-3`")]
    Number(String),
    /// A colour that is none.
    #[error("`#{0}` is not a colour; write `#rgb` or `#rrggbb` with hexadecimal digits")]
    Colour(String),
    /// Something else was expected.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A name that is not known.
    #[error("{name} is not a {kind} here{suggestion}", name = quoted(.name), suggestion = suggested(.suggestion))]
    Unknown {
        /// What was looked for.
        kind: &'static str,
        /// The name.
        name: String,
        /// A known name like it.
        suggestion: Option<String>,
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
    /// An argument too many.
    #[error("`{callee}` takes {most} arguments; remove this one")]
    TooManyArguments {
        /// What is called.
        callee: String,
        /// How many there may be.
        most: usize,
    },
    /// An argument that is missing.
    #[error("`{callee}` needs `{name}`; give it, or a default where `{callee}` is defined")]
    MissingArgument {
        /// What is called.
        callee: String,
        /// What it needs.
        name: String,
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
    /// `within` on a rule.
    #[error("only a part can say `within`; write `part` in place of `rule`, or leave it out")]
    WithinOfRule,
    /// A file that imports itself.
    #[error("\"{0}\" imports itself, directly or through others; move what both need to a third file")]
    ImportCycle(String),
    /// A glTF file that cannot be placed.
    #[error("\"{path}\" cannot be placed: {reason}")]
    Model {
        /// The file.
        path: String,
        /// Why not.
        reason: String,
    },
    /// A file that cannot be imported.
    #[error("\"{path}\" cannot be imported: {reason}")]
    Import {
        /// The file.
        path: String,
        /// Why not.
        reason: String,
    },
    /// A division by zero.
    #[error("division by zero; test the divisor with `if` before")]
    DivisionByZero,
    /// A number that left the reals, or grew beyond them.
    #[error("{0} is not a finite number here; keep its operands within range")]
    NotFinite(&'static str),
    /// A list in place of a number.
    #[error("{0} must be a number, and this is a list")]
    NotANumber(&'static str),
    /// A number in place of a list.
    #[error("{0} must be a list, and this is a number")]
    NotAList(&'static str),
    /// A list of another length or kind.
    #[error("{what} must be {wanted}")]
    Shape {
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
    #[error("`{0}` is not computed yet; move its `let` up")]
    NotComputed(String),
    /// A part that contains itself.
    #[error("part `{0}` contains itself with the same parameters; count them down and stop with `if`")]
    PartInItself(String),
    /// A polygon that cannot be filled.
    #[error("this polygon crosses itself or has no area; list its corners in order around it")]
    Polygon,
    /// Frames of what does not move.
    #[error(
        "`frames` needs a parameter `phase` of this part or file, by which it moves; give it one, such as `phase = 0`"
    )]
    NoPhase,
    /// Geometry outside of what was declared.
    #[error("part `{0}` reaches beyond what it declares with `within`; widen that")]
    BeyondDeclared(String),
}

/// A number with few digits, as JavaScript writes it but for the `+` of large exponents.
fn shown(number: f64) -> String {
    let size = number.abs();
    if size >= 1e21 || (size > 0.0 && size < 1e-6) {
        format!("{number:e}")
    } else {
        number.to_string()
    }
}

fn quoted(name: &str) -> String {
    format!("`{name}`")
}

fn suggested(suggestion: &Option<String>) -> String {
    suggestion
        .as_ref()
        .map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// The known name that is most like this one, when one is like it: at most a third of its letters differ.
pub(super) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let most = name.chars().count().div_ceil(3);
    let distances = known.into_iter().map(|known| (distance(name, known), known));
    distances
        .filter(|(distance, _)| *distance <= most)
        .min()
        .map(|(_, known)| known.to_owned())
}

/// Letters to insert, delete, replace or swap with the next (optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().collect();
    let b: Vec<char> = b.chars().collect();
    let mut rows = vec![(0..=b.len()).collect::<Vec<_>>()];
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let differs = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (rows[i - 1][j] + 1)
                .min(row[j - 1] + 1)
                .min(rows[i - 1][j - 1] + differs);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(rows[i - 2][j - 2] + 1);
            }
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}
