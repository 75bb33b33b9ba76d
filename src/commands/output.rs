//! How do answers reach the person or the program that asked? Text and tables on standard output; a closed pipe is not
//! an error.

use std::{
    borrow::Cow,
    io::{ErrorKind, Write},
};

use anyhow::Context;
use belvedere_scene::CellId;

/// Prints a text and a line end. What would control a terminal is shown instead: names and titles come from whoever uploads.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    write_line(&printable(text))
}

fn write_line(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(cause) if cause.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to standard output"),
    }
}

/// Prints a document as JSON, indented.
pub(super) fn print_json(document: &impl serde::Serialize) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(document)?;
    // In JSON such characters stand in texts alone.
    write_line(&shown(&json, |c| c != '\n', |c| format!("\\u{:04x}", u32::from(c))))
}

/// Lays rows out in columns: the first to the left, the others to the right.
pub(super) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let rows: Vec<Vec<_>> = rows
        .iter()
        .map(|row| row.iter().map(|cell| in_a_line(cell)).collect())
        .collect();
    let width = |column: usize| {
        let cells = rows
            .iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count());
        cells.chain([head[column].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let padded: Vec<String> = cells
            .zip(&widths)
            .enumerate()
            .map(|(column, (cell, width))| {
                if column == 0 {
                    format!("{cell:<width$}")
                } else {
                    format!("{cell:>width$}")
                }
            })
            .collect();
        padded.join("  ").trim_end().to_owned()
    };
    let mut lines = vec![line(&mut head.iter().copied())];
    lines.extend(rows.iter().map(|row| line(&mut row.iter().map(AsRef::as_ref))));
    lines.join("\n")
}

/// A text for a terminal: what would control it, or turn its writing from right to left, is shown by its number. Lines end as they
/// do.
#[must_use]
pub fn printable(text: &str) -> Cow<'_, str> {
    shown(text, |c| c != '\n', escaped)
}

/// The same of what is in one line of a table.
fn in_a_line(text: &str) -> Cow<'_, str> {
    shown(text, |_| true, escaped)
}

fn escaped(c: char) -> String {
    c.escape_default().to_string()
}

/// A text with another one in the place of each character that controls a terminal, if that is one that counts.
fn shown(text: &str, counts: impl Fn(char) -> bool, instead: impl Fn(char) -> String) -> Cow<'_, str> {
    let turns = |c| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let controls = |c: char| (c.is_control() || turns(c)) && counts(c);
    if !text.contains(controls) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if controls(c) {
            shown += &instead(c);
        } else {
            shown.push(c);
        }
    }
    shown.into()
}

/// `1.2 MB`, in powers of a thousand.
pub(super) fn bytes(count: u64) -> String {
    let units = ["kB", "MB", "GB", "TB"];
    if count < 1000 {
        return format!("{count} B");
    }
    let mut value = count as f64 / 1000.0;
    let mut unit = 0;
    while value >= 999.95 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    format!("{value:.1} {}", units[unit])
}

/// `1 object`, `2 objects`.
pub(super) fn counted(count: usize, one: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {one}{ending}")
}

/// `86.2 %`; a dash for a share of nothing.
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() {
        format!("{:.1} %", 100.0 * share)
    } else {
        "–".to_owned()
    }
}

/// What to say of a cell that a scene of so many cells does not have.
pub(super) fn no_such_cell(cell: CellId, cells: u32) -> String {
    match cells {
        1 => format!("there is no cell {cell}; the scene has one, c0"),
        known => format!("there is no cell {cell}; the scene has c0 to c{}", known - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_well_at_every_magnitude() {
        let read: Vec<_> = [0, 999, 1000, 999_949, 999_950, 1_234_567, 5_000_000_000]
            .map(bytes)
            .into();
        assert_eq!(
            read,
            ["0 B", "999 B", "1.0 kB", "999.9 kB", "1.0 MB", "1.2 MB", "5.0 GB"]
        );
    }

    #[test]
    fn what_controls_a_terminal_is_told_and_not_done() {
        let name = "a\u{1b}]0;owned\u{7}\u{9b}2J\rb\u{202e}\u{2066}é\tz";
        let told = "a\\u{1b}]0;owned\\u{7}\\u{9b}2J\\rb\\u{202e}\\u{2066}é\\tz";
        assert_eq!(printable(name), told);
        assert_eq!(printable("two\nlines"), "two\nlines");
        let rows = [vec!["c\n1".to_owned(), name.to_owned()]];
        let lines = table(&["cell", "name"], &rows);
        assert_eq!(
            lines,
            format!("cell  {:>1$}\nc\\n1  {told}", "name", told.chars().count())
        );
    }

    #[test]
    fn json_stays_json() {
        let name = "a\u{1b}[2J\u{9b}\u{202e}";
        let json = serde_json::to_string_pretty(&[name]).unwrap();
        let told = shown(&json, |c| c != '\n', |c| format!("\\u{:04x}", u32::from(c)));
        assert!(!told.contains(['\u{9b}', '\u{202e}']));
        assert_eq!(serde_json::from_str::<[String; 1]>(&told).unwrap(), [name]);
    }

    #[test]
    fn one_is_no_several() {
        assert_eq!(
            [0, 1, 2].map(|count| counted(count, "part")),
            ["0 parts", "1 part", "2 parts"]
        );
    }

    #[test]
    fn a_share_of_nothing_is_no_number() {
        assert_eq!(percent(0.862), "86.2 %");
        assert_eq!([percent(f64::INFINITY), percent(f64::NAN)], ["–", "–"]);
    }

    #[test]
    fn a_table_aligns_its_columns() {
        let rows = [
            vec!["c1".to_owned(), "7".to_owned()],
            vec!["c100".to_owned(), "12345".to_owned()],
        ];
        assert_eq!(table(&["cell", "seen"], &rows), "cell   seen\nc1        7\nc100  12345");
    }
}
