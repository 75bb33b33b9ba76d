//! Where is to blame that an operator ends a line, a block or the file, and no value follows? Line breaks mean nothing, so the parser
//! takes what stands next for the value, and is surprised by that.

use super::declaration::{DECLARATIONS, STATEMENTS};
use super::{OPERATORS, Place};
use crate::procedural::lexer::{Kind, Token, words};
use crate::procedural::problem::Problem;
use crate::procedural::solid::SolidKind;
use crate::procedural::syntax::At;

/// Signs and words behind which a value must stand.
const SIGNS: [&str; 10] = ["+", "-", "*", "/", "==", "!=", "<=", ">=", "<", ">"];
const WORDS: [&str; 3] = ["and", "or", "not"];

/// A mistake on a line that begins with no value where the line before ends with an operator is told behind that, and so is one where
/// something ends behind an operator; all others stay as they are.
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
    let place = words.partition_point(|word| word.at < at);
    let ends = words.get(place).is_some_and(|word| word.at == at && is_end(word.kind));
    let first = if ends {
        place
    } else {
        words.partition_point(|word| word.at < line_at)
    };
    let (operator, found) = (words.get(first.checked_sub(1)?)?, words.get(first)?);
    let sign = match operator.kind {
        Kind::Symbol(sign) if SIGNS.contains(&sign) => sign,
        Kind::Name(word) => *WORDS.iter().find(|known| **known == word)?,
        _ => return None,
    };
    let is_met = found.at == at;
    let begins_none = match found.kind {
        Kind::Name("if") => !is_value(&words[first..]),
        Kind::Name(word) => {
            let begins = STATEMENTS.contains(&word) || DECLARATIONS.contains(&word);
            let is_no_value = SolidKind::named(word).is_some() || OPERATORS.contains(&word) && word != "not";
            begins || is_met && (is_no_value || matches!(problem, Problem::OtherKind { .. }))
        }
        Kind::Symbol(_) | Kind::Text(_) | Kind::End => is_met,
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

/// Whether it ends what stands before it.
fn is_end(kind: Kind) -> bool {
    matches!(kind, Kind::End | Kind::Symbol("}" | ")" | "]" | ","))
}

/// Whether an `if` is that of a value: its `then` comes before any statement does.
fn is_value(words: &[Token]) -> bool {
    let begins = |word: &&str| {
        *word == "then" || STATEMENTS.contains(word) || DECLARATIONS.contains(word) || SolidKind::named(word).is_some()
    };
    let mut names = words.iter().skip(1).filter_map(|word| match word.kind {
        Kind::Name(name) => Some(name),
        _ => None,
    });
    names.find(|name| begins(name)) == Some("then")
}
