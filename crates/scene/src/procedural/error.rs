//! What is wrong with a procedural model, and where?

use std::fmt;

use super::columns::columns_before;
use super::problem::Problem;

/// Longest part of a line, or of a word, that an error repeats, characters.
pub(super) const MOST_SHOWN: usize = 120;

/// Most callers that an error names.
const MOST_CALLERS: usize = 3;

/// A call that led to what is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caller {
    /// The file, as it was imported.
    pub file: String,
    /// Line in its text.
    pub line: usize,
    /// Character in the line.
    pub column: usize,
}

/// Why a procedural model was refused. Line and column count from 1, columns in characters; both are 0 where no place of the
/// text is wrong but what it was given.
#[derive(Debug, Clone, PartialEq)]
pub struct DcgError {
    /// The file, as it was imported.
    pub file: String,
    /// Line in its text.
    pub line: usize,
    /// Character in the line.
    pub column: usize,
    /// The line, without the spaces around it; of a long one what is around the place.
    pub text: String,
    /// How many characters of it stand before the place, where it is not the whole line.
    pub mark: Option<usize>,
    /// What is wrong there.
    pub problem: Problem,
    /// The calls that led there, the innermost first, and not all of many.
    pub callers: Vec<Caller>,
    /// What the file was given that may be why, in a sentence.
    pub given: Option<String>,
}

impl fmt::Display for DcgError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            file,
            line,
            column,
            text,
            mark,
            problem,
            callers,
            given,
        } = self;
        let told = match line {
            0 => problem.to_string(),
            _ => format!("{file}, line {line}, column {column}: {problem}"),
        };
        f.write_str(&printable(&told))?;
        if !text.is_empty() {
            write!(f, "\n    {}", printable(text))?;
        }
        if let Some(mark) = mark {
            write!(f, "\n    {}^", columns_before(text, *mark))?;
        }
        callers.iter().try_for_each(|Caller { file, line, column }| {
            let file = printable(file);
            write!(f, "\n    called from line {line}, column {column} of {file}")
        })?;
        given.iter().try_for_each(|given| write!(f, "\n    {given}"))
    }
}

/// What a terminal would take for an order, to write from right to left too, becomes a replacement character.
fn printable(text: &str) -> String {
    text.replace(|c| is_order(c) && !matches!(c, '\n' | '\t'), "\u{fffd}")
}

/// Whether a character is none but an order to who shows the text: a control character, a break of the line, or one of the marks
/// that turn the way of writing.
#[must_use]
pub fn is_order(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

impl std::error::Error for DcgError {}

/// Where a byte of a text lies for who reads it. Line and column count from 1, columns in characters.
pub(super) struct Place<'t> {
    pub(super) line: usize,
    pub(super) column: usize,
    /// The whole line.
    text: &'t str,
}

impl<'t> Place<'t> {
    pub(super) fn of(source: &'t str, at: u32) -> Self {
        // A mark of the byte order may stand before a text and is no part of it.
        let text = source.strip_prefix(MARK).unwrap_or(source);
        let at = at.saturating_sub((source.len() - text.len()) as u32);
        let before = &text[..text.floor_char_boundary(at as usize)];
        let start = before.rfind(LINE_ENDS).map_or(0, |end| end + 1);
        Self {
            line: line_of(text, at),
            column: before[start..].chars().count() + 1,
            text: text[start..].split(LINE_ENDS).next().unwrap_or_default(),
        }
    }
}

/// What is shown of a line: all of a short one; of a long one what is around the character at `column`, and how much of that
/// stands before it.
fn excerpt(line: &str, column: usize) -> (String, Option<usize>) {
    let blank = line.chars().take_while(|c| BLANKS.contains(c)).count();
    let letters: Vec<char> = line.trim_matches(BLANKS).chars().collect();
    if letters.len() <= MOST_SHOWN {
        return (letters.into_iter().collect(), None);
    }
    let place = (column - 1).saturating_sub(blank).min(letters.len());
    let start = place.saturating_sub(MOST_SHOWN / 2).min(letters.len() - MOST_SHOWN);
    let end = start + MOST_SHOWN;
    let [before, after] = [start > 0, end < letters.len()].map(|is_cut| if is_cut { "…" } else { "" });
    let shown: String = letters[start..end].iter().collect();
    let mark = before.chars().count() + place - start;
    (format!("{before}{shown}{after}"), Some(mark))
}

impl DcgError {
    /// An error at a byte of a text.
    #[must_use]
    pub(super) fn at(file: &str, source: &str, at: u32, problem: Problem) -> Box<Self> {
        let Place { line, column, text } = Place::of(source, at);
        let (text, mark) = excerpt(text, column);
        Box::new(Self {
            file: file.to_owned(),
            line,
            column,
            text,
            mark,
            problem,
            callers: Vec::new(),
            given: None,
        })
    }

    /// Why a bake refuses what grew from a byte of a text.
    #[must_use]
    pub fn of_grown(file: &str, source: &str, at: u32, what: String) -> Box<Self> {
        Self::at(file, source, at, Problem::OfGrown(what))
    }

    /// Notes a call in which it happened, unless that is the place which was named last, as where a recursion has no end.
    pub(super) fn add_caller(&mut self, file: &str, source: &str, at: u32) {
        let Place { line, column, .. } = Place::of(source, at);
        let last = self.callers.last();
        let last = last.map_or((self.file.as_str(), self.line, self.column), |last| {
            (last.file.as_str(), last.line, last.column)
        });
        if self.callers.len() < MOST_CALLERS && last != (file, line, column) {
            let file = file.to_owned();
            self.callers.push(Caller { file, line, column });
        }
    }

    /// The same where its files lie in a folder that is named too.
    #[must_use]
    pub fn below(mut self: Box<Self>, folder: &str) -> Box<Self> {
        if !folder.is_empty() {
            let callers = self.callers.iter_mut().map(|caller| &mut caller.file);
            for file in callers.chain([&mut self.file]) {
                *file = format!("{folder}/{file}");
            }
        }
        self
    }

    /// An error in what a file was given, which says itself which file that is.
    pub(super) fn of_whole(file: &str, problem: Problem) -> Box<Self> {
        Box::new(Self {
            file: file.to_owned(),
            line: 0,
            column: 0,
            text: String::new(),
            mark: None,
            problem,
            callers: Vec::new(),
            given: None,
        })
    }

    /// The text of a file.
    ///
    /// # Errors
    /// At the first byte that is no part of UTF-8.
    pub fn text_of(file: &str, bytes: Vec<u8>) -> Result<String, Box<Self>> {
        String::from_utf8(bytes).map_err(|cause| {
            let sound = cause.utf8_error().valid_up_to();
            let (before, after) = cause.as_bytes().split_at(sound);
            let byte = after.first().copied().unwrap_or_default();
            let source = String::from_utf8_lossy(before);
            Self::at(file, &source, source.len() as u32, Problem::NotText(byte))
        })
    }
}

/// Marks of the byte order, which mean nothing in UTF-8.
const MARK: char = '\u{feff}';
const BLANKS: [char; 2] = [' ', '\t'];

const LINE_ENDS: [char; 2] = ['\n', '\r'];

/// The line in which a byte lies, counted from 1. Lines end as on any machine, old ones too.
pub(super) fn line_of(text: &str, at: u32) -> usize {
    let before = &text[..text.floor_char_boundary(at as usize)];
    1 + before.matches(LINE_ENDS).count() - before.matches("\r\n").count()
}
