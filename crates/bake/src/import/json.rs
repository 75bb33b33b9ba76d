//! Is it JSON? What is not is refused with what stands where reading ended, and with the way out.

use std::fmt;

use serde_json::{Value, error::Category};

/// Numbers that some exporters write, and JSON does not have.
const NO_NUMBERS: [&str; 3] = ["nan", "inf", "infinity"];
/// So much of a word is told.
const LONGEST_WORD: usize = 24;

/// Why a document is no JSON.
#[derive(Debug)]
pub struct NoJson {
    cause: serde_json::Error,
    /// What stands there: letters, digits and signs of a number.
    word: String,
}

/// The document that a text holds.
pub(super) fn parsed(text: &[u8]) -> Result<Value, NoJson> {
    serde_json::from_slice(text).map_err(|cause| NoJson {
        word: word_at(text, cause.line(), cause.column()),
        cause,
    })
}

/// The word at a line and a column, both from 1 on; the column may be that of the byte behind it.
fn word_at(text: &[u8], line: usize, column: usize) -> String {
    let line = text.split(|byte| *byte == b'\n').nth(line.saturating_sub(1));
    let line = line.unwrap_or_default();
    let is_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-.".contains(byte);
    let at = column.saturating_sub(1).min(line.len());
    let before = line[..at].iter().rev().take_while(|byte| is_of_word(byte)).count();
    let word = line[at - before..].iter().take_while(|byte| is_of_word(byte));
    word.take(LONGEST_WORD).map(|byte| char::from(*byte)).collect()
}

impl fmt::Display for NoJson {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cause.fmt(f)?;
        let bare = self.word.trim_start_matches(['-', '+']).to_ascii_lowercase();
        match self.cause.classify() {
            Category::Eof => f.write_str(": it ends too soon, as if cut off; copy or export it again"),
            _ if NO_NUMBERS.contains(&&*bare) => {
                let word = &self.word;
                write!(
                    f,
                    ": JSON has no number `{word}`; mend what is not finite in the source, and export it again"
                )
            }
            _ if self.word.is_empty() => f.write_str("; mend it there, or export it again"),
            _ => write!(f, ", at `{}`; mend it there, or export it again", self.word),
        }
    }
}

impl std::error::Error for NoJson {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.cause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_json_is_told_with_the_word_and_the_way_out() {
        let cases: [(&str, &str); 7] = [
            ("{\"a\": [0.0, NaN, 1]}", "JSON has no number `NaN`"),
            ("{\"a\": NaN}", "JSON has no number `NaN`"),
            (
                "{\n\"a\": [-Infinity]}",
                "line 2 column 8: JSON has no number `-Infinity`",
            ),
            ("{\"a\": [1, 2", "it ends too soon"),
            ("{\"a\": [1 2]}", "at `2`; mend it there"),
            ("{\"a\": [1,, 2]}", "; mend it there"),
            ("{'a': 1}", "; mend it there"),
        ];
        for (text, wanted) in cases {
            let told = parsed(text.as_bytes()).unwrap_err().to_string();
            assert!(told.contains(wanted), "{text}: {told}");
        }
        assert!(parsed(b"{\"a\": [1, 2]}").is_ok());
    }
}
