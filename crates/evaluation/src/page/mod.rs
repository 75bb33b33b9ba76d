//! How does a result become a page? Sections of comparisons, charts and goals, as Markdown.
//!
//! A row of a comparison always has the paper's number, ours, and the reason why they differ; a goal says what was wanted, what
//! was found and whether that is enough. Both are made from results only.

pub mod chart;
pub mod mesh;

use std::fmt::Write;

/// What one experiment has to say.
#[derive(Debug, Default)]
pub struct Section {
    /// How it was measured, a paragraph each.
    pub how: Vec<String>,
    /// Paper's numbers beside ours.
    pub comparisons: Vec<Comparison>,
    /// What the paper does not have.
    pub tables: Vec<Table>,
    /// Pictures.
    pub plots: Vec<Plot>,
    /// Why numbers differ; rows name them by their place, from 0.
    pub reasons: Vec<String>,
    /// What was wanted.
    pub goals: Vec<Goal>,
}

/// Paper's numbers beside ours.
#[derive(Debug)]
pub struct Comparison {
    /// Where the paper's numbers stand.
    pub source: &'static str,
    /// What the rows are.
    pub of: &'static str,
    /// The heads of our columns.
    pub ours: Vec<String>,
    /// The rows.
    pub rows: Vec<Row>,
}

/// A row of a comparison.
#[derive(Debug)]
pub struct Row {
    /// What is compared.
    pub what: String,
    /// The paper's number.
    pub paper: String,
    /// Ours, one for each column.
    pub ours: Vec<String>,
    /// Why they differ: places in [`Section::reasons`], not none.
    pub why: Vec<usize>,
}

/// A table without a paper's numbers.
#[derive(Debug)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Heads of columns.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<String>>,
}

/// A picture.
#[derive(Debug)]
pub struct Plot {
    /// Its file, without a folder.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// Its bytes.
    pub svg: String,
}

/// Something that was wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Goal {
    /// Of what.
    pub what: String,
    /// What was wanted.
    pub wanted: String,
    /// What was found.
    pub found: String,
    /// Whether that is enough.
    pub met: bool,
}

impl Goal {
    /// A number that shall not be larger.
    #[must_use]
    pub fn at_most(what: impl Into<String>, most: f64, found: f64, shown: impl Fn(f64) -> String) -> Self {
        Self {
            what: what.into(),
            wanted: format!("≤ {}", shown(most)),
            found: shown(found),
            met: found <= most,
        }
    }

    /// A number that shall not be smaller.
    #[must_use]
    pub fn at_least(what: impl Into<String>, least: f64, found: f64, shown: impl Fn(f64) -> String) -> Self {
        Self {
            what: what.into(),
            wanted: format!("≥ {}", shown(least)),
            found: shown(found),
            met: found >= least,
        }
    }

    fn verdict(&self) -> &'static str {
        if self.met { "met" } else { "**missed**" }
    }
}

impl Section {
    /// Its Markdown, without a heading. Pictures stand in `folder`.
    #[must_use]
    pub fn to_markdown(&self, folder: &str) -> String {
        let mut text = String::new();
        for paragraph in &self.how {
            push(&mut text, paragraph);
        }
        for comparison in &self.comparisons {
            push(&mut text, &format!("Paper: {}.", comparison.source));
            push(&mut text, &comparison.to_markdown());
        }
        for table in &self.tables {
            push(&mut text, &format!("{}:", table.caption));
            push(&mut text, &rows(&table.head, &table.rows));
        }
        for plot in &self.plots {
            push(&mut text, &format!("![{}]({folder}/{})", plot.caption, plot.file));
        }
        if !self.reasons.is_empty() {
            let line = |(i, reason): (usize, &String)| format!("{}. {reason}", i + 1);
            let list: Vec<_> = self.reasons.iter().enumerate().map(line).collect();
            push(&mut text, "Why the numbers differ:");
            push(&mut text, &list.join("\n"));
        }
        if !self.goals.is_empty() {
            push(&mut text, &goals(&self.goals));
        }
        text
    }

    /// What a row would leave unsaid: one without a reason, with a reason that is not there, or with too few numbers.
    #[must_use]
    pub fn unexplained(&self) -> Vec<&str> {
        let wrong = |comparison: &&Comparison, row: &&Row| {
            row.why.is_empty()
                || row.why.iter().any(|why| *why >= self.reasons.len())
                || row.ours.len() != comparison.ours.len()
                || row.paper.is_empty()
        };
        let all = self
            .comparisons
            .iter()
            .flat_map(|comparison| comparison.rows.iter().map(move |row| (comparison, row)));
        all.filter(|(comparison, row)| wrong(comparison, row))
            .map(|(_, row)| row.what.as_str())
            .collect()
    }
}

impl Comparison {
    fn to_markdown(&self) -> String {
        let mut head = vec![self.of.to_owned(), "paper".to_owned()];
        head.extend(self.ours.iter().cloned());
        head.push("why".to_owned());
        let line = |row: &Row| {
            let mut cells = vec![row.what.clone(), row.paper.clone()];
            cells.extend(row.ours.iter().cloned());
            let why: Vec<_> = row.why.iter().map(|why| (why + 1).to_string()).collect();
            cells.push(why.join(", "));
            cells
        };
        rows(&head, &self.rows.iter().map(line).collect::<Vec<_>>())
    }
}

/// A table of goals.
#[must_use]
pub fn goals(goals: &[Goal]) -> String {
    let line = |goal: &Goal| {
        vec![
            goal.what.clone(),
            goal.wanted.clone(),
            goal.found.clone(),
            goal.verdict().to_owned(),
        ]
    };
    let head = ["goal", "wanted", "found", ""].map(str::to_owned);
    rows(&head, &goals.iter().map(line).collect::<Vec<_>>())
}

/// A paragraph.
pub fn push(text: &mut String, paragraph: &str) {
    // A string takes whatever it is given.
    _ = write!(text, "{paragraph}\n\n");
}

fn rows(head: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
    let rule = format!("|{}", "---|".repeat(head.len()));
    let mut lines = vec![line(head), rule];
    lines.extend(rows.iter().map(|cells| line(cells)));
    lines.join("\n")
}

/// `86.2 %`
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// `86.21 %`, for what comes close to all.
#[must_use]
pub fn fine_percent(share: f64) -> String {
    // Never rounded up to what it is not.
    format!("{:.2} %", (1e4 * share + 1e-6).floor() / 100.0)
}

/// `12,345`
#[must_use]
pub fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section() -> Section {
        Section {
            how: vec!["Measured so.".to_owned()],
            comparisons: vec![Comparison {
                source: "A paper, table 1",
                of: "levels",
                ours: vec!["ours".to_owned()],
                rows: vec![Row {
                    what: "6".to_owned(),
                    paper: percent(0.396),
                    ours: vec![percent(0.3871)],
                    why: vec![0],
                }],
            }],
            plots: vec![Plot {
                file: "load.svg".to_owned(),
                caption: "Load".to_owned(),
                svg: String::new(),
            }],
            reasons: vec!["Other walks.".to_owned()],
            goals: vec![Goal::at_most("load", 0.396, 0.5, percent)],
            ..Section::default()
        }
    }

    #[test]
    fn numbers_become_a_page() {
        let text = section().to_markdown("evaluation");
        assert!(text.contains("| levels | paper | ours | why |\n|---|---|---|---|\n| 6 | 39.6 % | 38.7 % | 1 |"));
        assert!(text.contains("Paper: A paper, table 1."));
        assert!(text.contains("![Load](evaluation/load.svg)"));
        assert!(text.contains("1. Other walks."));
        assert!(text.contains("| load | ≤ 39.6 % | 50.0 % | **missed** |"));
    }

    #[test]
    fn a_row_without_a_reason_is_found() {
        let mut section = section();
        assert!(section.unexplained().is_empty());
        section.comparisons[0].rows[0].why = vec![1];
        assert_eq!(section.unexplained(), ["6"]);
        section.comparisons[0].rows[0].why = vec![];
        assert_eq!(section.unexplained(), ["6"]);
        section.comparisons[0].rows[0].why = vec![0];
        section.comparisons[0].rows[0].ours.clear();
        assert_eq!(section.unexplained(), ["6"]);
    }

    #[test]
    fn a_goal_is_met_at_its_edge_and_missed_beyond_it() {
        assert!(Goal::at_most("", 0.5, 0.5, percent).met && !Goal::at_most("", 0.5, 0.51, percent).met);
        assert!(Goal::at_least("", 0.5, 0.5, percent).met && !Goal::at_least("", 0.5, 0.49, percent).met);
        assert!(!Goal::at_least("", 0.5, f64::NAN, percent).met);
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!([0, 999, 1000, 1_234_567].map(count), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(fine_percent(0.999_99), "99.99 %");
        assert_eq!([1.0, 0.786].map(fine_percent), ["100.00 %", "78.60 %"]);
    }
}
