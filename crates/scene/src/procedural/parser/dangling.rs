//! Where is to blame that an operator ends a line, a block or the file, or a word of the language follows, and no value does? Line
//! breaks mean nothing, and values may be called by most words, so the parser takes what stands next for the value, and is surprised
//! by that or by what comes behind.

use super::declaration::{DECLARATIONS, STATEMENTS};
use super::usage::LATER;
use super::{OPERATORS, Place};
use crate::procedural::lexer::{Kind, Token, words};
use crate::procedural::problem::Problem;
use crate::procedural::solid::SolidKind;
use crate::procedural::syntax::At;

/// Signs and words behind which a value must stand.
const SIGNS: [&str; 10] = ["+", "-", "*", "/", "==", "!=", "<=", ">=", "<", ">"];
const WORDS: [&str; 3] = ["and", "or", "not"];

/// A mistake on a line that begins with no value where the line before ends with an operator is told behind that, and so is one where
/// something ends behind an operator or something else begins; all others stay as they are.
pub(in crate::procedural) fn at_its_operator(text: &str, (at, problem): (At, Problem)) -> (At, Problem) {
    let moved = is_of_no_value(&problem).then(|| moved(text, at, &problem)).flatten();
    moved.unwrap_or((at, problem))
}

/// Whether it may be said of a word that was taken for a value, or of what stands behind one.
fn is_of_no_value(problem: &Problem) -> bool {
    matches!(
        problem,
        Problem::Expected { .. }
            | Problem::WithoutLet(_)
            | Problem::NoStatement { .. }
            | Problem::Later { .. }
            | Problem::OtherKind { .. }
            | Problem::Unknown {
                kind: "value" | "function",
                ..
            }
    )
}

fn moved(text: &str, at: At, problem: &Problem) -> Option<(At, Problem)> {
    let words = words(text).ok()?;
    let line_at = text[..at as usize].rfind(['\n', '\r']).map_or(0, |end| end + 1) as At;
    let line = words.partition_point(|word| word.at < line_at);
    let place = words.partition_point(|word| word.at < at);
    let is_met = |index: usize| words.get(index).is_some_and(|word| word.at == at);
    let is_behind = |index: usize| index > 0 && sign_of(words[index - 1].kind).is_some();
    let ends = is_met(place) && is_end(words[place].kind) && is_behind(place);
    let begun = (line..=place)
        .rev()
        .find(|index| is_behind(*index) && begins_other(&words, *index, place));
    let first = if ends { place } else { begun.unwrap_or(line) };
    let (operator, found) = (words.get(first.checked_sub(1)?)?, words.get(first)?);
    let sign = sign_of(operator.kind)?;
    let begins_none = match found.kind {
        Kind::Name("if") => !is_value(&words[first..]),
        Kind::Name(word) => {
            let is_no_value = SolidKind::named(word).is_some() || OPERATORS.contains(&word) && word != "not";
            begun == Some(first)
                || begins(word)
                || is_met(first) && (is_no_value || matches!(problem, Problem::OtherKind { .. }))
        }
        Kind::Symbol(_) | Kind::Text(_) | Kind::End => is_met(first),
        Kind::Number(_) | Kind::Colour(_) => false,
    };
    let behind = operator.at + sign.len() as u32;
    let Place { line, .. } = Place::of(text, found.at);
    let expected = format!("a value behind `{sign}`");
    let found = match found.kind {
        Kind::End => found.kind.to_string(),
        kind if line == Place::of(text, behind).line => kind.to_string(),
        kind => format!("{kind} on line {line}"),
    };
    begins_none.then_some((behind, Problem::Expected { expected, found }))
}

fn sign_of(kind: Kind) -> Option<&'static str> {
    let known = |known: &[&'static str], found: &str| known.iter().find(|sign| **sign == found).copied();
    match kind {
        Kind::Symbol(sign) => known(&SIGNS, sign),
        Kind::Name(word) => known(&WORDS, word),
        _ => None,
    }
}

/// Whether no value begins so, and what stands before it ends there.
fn is_end(kind: Kind) -> bool {
    match kind {
        Kind::End => true,
        // A number that begins with it has an advice of its own.
        Kind::Symbol(sign) => sign != ".",
        // So have `if` and `not`.
        Kind::Name(word) => matches!(word, "then" | "else" | "and" | "or"),
        _ => false,
    }
}

/// Whether a word begins a statement or a declaration.
fn begins(word: &str) -> bool {
    STATEMENTS.contains(&word) || DECLARATIONS.contains(&word)
}

/// Whether, on the line of a mistake, something else begins at a word behind an operator, where that was taken for a value; a word
/// that stands further on in something is none if the mistake is not met with it, or right behind. Values may be called like any.
fn begins_other(words: &[Token], index: usize, mistake: usize) -> bool {
    let Some(Kind::Name(word)) = words.get(index).map(|word| word.kind) else {
        return false;
    };
    let is_later = LATER.iter().any(|(later, _)| *later == word) && mistake - index <= 1;
    (begins(word) && word != "if" || is_later) && !is_named(words, word)
}

/// Whether a text names a value so.
fn is_named(words: &[Token], name: &str) -> bool {
    let mut around = words.windows(3).filter(|words| words[1].kind == Kind::Name(name));
    around.any(|words| {
        let is_listed =
            matches!(words[0].kind, Kind::Symbol("(" | ",")) && matches!(words[2].kind, Kind::Symbol(")" | ","));
        is_listed
            || matches!(words[0].kind, Kind::Name("let" | "parameter" | "for" | "edges" | "as"))
            || words[2].kind == Kind::Symbol("=")
    })
}

/// Whether an `if` is that of a value: its `then` comes before any statement does.
fn is_value(words: &[Token]) -> bool {
    let begins = |word: &&str| *word == "then" || begins(word) || SolidKind::named(word).is_some();
    let mut names = words.iter().skip(1).filter_map(|word| match word.kind {
        Kind::Name(name) => Some(name),
        _ => None,
    });
    names.find(|name| begins(name)) == Some("then")
}
