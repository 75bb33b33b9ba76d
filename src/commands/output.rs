//! How do answers reach the person or the program that asked? Text and tables on standard output; a closed pipe is not
//! an error.

use std::io::{ErrorKind, Write};

use anyhow::Context;
use belvedere_scene::CellId;

/// Prints a text and a line end.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(cause) if cause.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to standard output"),
    }
}

/// Prints a document as JSON, indented.
pub(super) fn print_json(document: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&serde_json::to_string_pretty(document)?)
}

/// Lays rows out in columns: the first to the left, the others to the right.
pub(super) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
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
    lines.extend(rows.iter().map(|row| line(&mut row.iter().map(String::as_str))));
    lines.join("\n")
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
