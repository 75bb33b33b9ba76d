//! How does the outcome read? As a table for people, as JSON for programs.

use belvedere_scene::{CellId, ObjectId, Revision, SceneName, record::Guarantee};
use belvedere_verify::{
    check::{FINE_PX, Miss, Outcome, Settings, Tightness},
    verdict,
};
use serde::Serialize;

use super::{Found, load::Published};
use crate::commands::output::table;

/// At most so many misses are listed one by one.
const LISTED: usize = 100;
/// … and so many in the table.
const ROWS: usize = 12;

#[derive(Debug, Serialize)]
pub(super) struct Report {
    scene: SceneName,
    revision: Revision,
    method: String,
    guarantee: Guarantee,
    cells: usize,
    size_px: usize,
    seed: u64,
    seconds: f64,
    #[serde(flatten)]
    open: Findings,
    /// The same with doors closed, when some record names one.
    closed: Option<ClosedReport>,
    rule: String,
    failures: Vec<String>,
    passed: bool,
}

/// What eyes found.
#[derive(Debug, Serialize)]
struct Findings {
    eyes: u64,
    /// Pixels that show an object, in all views.
    pixels: u64,
    /// Objects missing from a record, each pair of cell and object once.
    missed_objects: usize,
    missed_pixels: u64,
    false_negative_rate: f64,
    /// What only seemed to be missing: rounding decides.
    unconfirmed_objects: usize,
    unconfirmed_pixels: u64,
    /// Null when nothing was seen.
    tightness_mean: Option<f64>,
    /// All entries over all that were seen.
    tightness_of_entries: Option<f64>,
    /// Cells from which no eye saw a pixel of anything.
    blind_cells: Vec<CellId>,
    loosest: Option<Tightness>,
    worst: Option<NamedMiss>,
    /// The largest misses.
    misses: Vec<NamedMiss>,
}

#[derive(Debug, Serialize)]
struct ClosedReport {
    /// Doors that some record names.
    doors: usize,
    /// Pairs of a cell and the doors that were closed there.
    situations: usize,
    #[serde(flatten)]
    findings: Findings,
    /// What is seen only through gaps that count as closed.
    gap_objects: u64,
    gap_pixels: u64,
}

#[derive(Debug, Clone, Serialize)]
struct NamedMiss {
    #[serde(flatten)]
    miss: Miss,
    source_node: String,
    /// The names of the doors that are closed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    closed_nodes: Vec<String>,
}

/// How doors that are closed are told of.
pub(super) fn with_closed(doors: &[ObjectId]) -> String {
    let doors: Vec<_> = doors.iter().map(ToString::to_string).collect();
    match &doors[..] {
        [] => String::new(),
        doors => format!(" with {} closed", doors.join(" and ")),
    }
}

impl Findings {
    fn new(published: &Published, outcome: &Outcome) -> Self {
        let node = |object: &ObjectId| published.nodes.get(object.0 as usize).cloned().unwrap_or_default();
        let named = |miss: &Miss| NamedMiss {
            miss: miss.clone(),
            source_node: node(&miss.object),
            closed_nodes: miss.closed.iter().map(node).collect(),
        };
        let misses: Vec<_> = outcome.misses.iter().take(LISTED).map(named).collect();
        Self {
            eyes: outcome.eyes,
            pixels: outcome.pixels,
            missed_objects: outcome.misses.len(),
            missed_pixels: outcome.missed_pixels,
            false_negative_rate: outcome.false_negative_rate(),
            unconfirmed_objects: outcome.unconfirmed.len(),
            unconfirmed_pixels: outcome.unconfirmed_pixels,
            tightness_mean: outcome.tightness_mean(),
            tightness_of_entries: outcome.tightness_of_entries(),
            blind_cells: outcome.blind.clone(),
            loosest: outcome.loosest(),
            worst: misses.first().cloned(),
            misses,
        }
    }

    fn rows(&self) -> Vec<(&'static str, String)> {
        let ratio = |ratio: Option<f64>| ratio.map_or_else(|| "–".to_owned(), |ratio| format!("{ratio:.2}"));
        let rate = match self.pixels {
            0 => "–".to_owned(),
            _ => format!("{:.2e}", self.false_negative_rate),
        };
        let loosest = self.loosest.as_ref().map_or_else(String::new, |l| {
            format!(
                ", least tight {}{}: {} listed, {} seen by {} eyes",
                l.cell,
                with_closed(&l.closed),
                l.listed,
                l.seen,
                l.eyes
            )
        });
        let mut rows = vec![
            ("missed objects", format!("{}", self.missed_objects)),
            (
                "false-negative pixels",
                format!("{rate} ({} of {})", self.missed_pixels, self.pixels),
            ),
            (
                "unconfirmed",
                format!(
                    "{} objects, {} pixels in all",
                    self.unconfirmed_objects, self.unconfirmed_pixels
                ),
            ),
            (
                "tightness",
                format!(
                    "at most {} times what was seen, mean over cells; {} over all entries{loosest}",
                    ratio(self.tightness_mean),
                    ratio(self.tightness_of_entries),
                ),
            ),
        ];
        if !self.blind_cells.is_empty() {
            let named: Vec<_> = self.blind_cells.iter().take(ROWS).map(ToString::to_string).collect();
            let more = self.blind_cells.len() - named.len();
            let more = if more > 0 {
                format!(" … and {more} more")
            } else {
                String::new()
            };
            let told = format!(
                "no eye saw a pixel of anything from {}{more}: a larger `--size` may",
                named.join(" ")
            );
            rows.push(("saw nothing", told));
        }
        rows
    }

    fn miss_table(&self) -> Option<String> {
        let pixels = format!("pixels at {FINE_PX}²");
        let closed = self.misses.iter().any(|named| !named.miss.closed.is_empty());
        let mut head = vec!["cell", "object", "node", &pixels, "eye", "place"];
        head.extend(closed.then_some("closed"));
        let rows: Vec<_> = self
            .misses
            .iter()
            .take(ROWS)
            .map(|named| {
                let NamedMiss { miss, source_node, .. } = named;
                let mut row = vec![
                    miss.cell.to_string(),
                    miss.object.to_string(),
                    source_node.clone(),
                    miss.pixels.to_string(),
                    miss.eye.map(|x| format!("{x:.4}")).join(" "),
                    miss.place.to_string(),
                ];
                row.extend(closed.then(|| named.doors().join(", ")));
                row
            })
            .collect();
        let more = self.missed_objects - rows.len();
        let tail = if more > 0 {
            format!("\n… and {more} more")
        } else {
            String::new()
        };
        (!rows.is_empty()).then(|| format!("{}{tail}", table(&head, &rows)))
    }
}

impl NamedMiss {
    /// The doors that are closed, each with its name.
    fn doors(&self) -> Vec<String> {
        let doors = self.miss.closed.iter().zip(&self.closed_nodes);
        doors.map(|(door, node)| format!("{door} `{node}`")).collect()
    }

    fn told(&self) -> String {
        let Miss { object, cell, eye, .. } = &self.miss;
        let closed = match &self.doors()[..] {
            [] => String::new(),
            doors => format!(" with {} closed", doors.join(" and ")),
        };
        format!(
            "; the worst: {object} (`{}`) is seen from {cell} at {eye:?}{closed} and is not in its record",
            self.source_node
        )
    }
}

impl Report {
    pub(super) fn new(published: &Published, settings: &Settings, found: &Found, seconds: f64) -> Self {
        let mut failures = verdict::failures(&found.open);
        let with_doors = verdict::failures(&found.closed).into_iter();
        failures.extend(with_doors.map(|failure| format!("with doors closed, {failure}")));
        let closed = (found.situations > 0).then(|| ClosedReport {
            doors: found.doors,
            situations: found.situations,
            findings: Findings::new(published, &found.closed),
            gap_objects: found.closed.gap_objects,
            gap_pixels: found.closed.gap_pixels,
        });
        Self {
            scene: published.pointer.scene.clone(),
            revision: published.pointer.revision,
            method: published.visibility.method.clone(),
            guarantee: published.visibility.guarantee,
            cells: published.cells.len(),
            size_px: settings.size_px,
            seed: settings.seed,
            seconds,
            open: Findings::new(published, &found.open),
            closed,
            rule: verdict::rule(),
            passed: failures.is_empty(),
            failures,
        }
    }

    pub(super) fn passed(&self) -> bool {
        self.passed
    }

    /// For people; `drawn` says what the picture shows.
    pub(super) fn text(&self, drawn: Option<&str>) -> String {
        let guarantee = match self.guarantee {
            Guarantee::Conservative => "conservative",
            Guarantee::Sampled => "sampled",
        };
        let fact = |(name, value): (&str, String)| format!("  {name:<22} {value}");
        let mut lines = vec![
            format!(
                "{}, revision {}: {} ({guarantee}), {} cells, {} eyes, {} × {} pixels on six faces, {:.1} s",
                self.scene,
                self.revision,
                self.method,
                self.cells,
                self.open.eyes,
                self.size_px,
                self.size_px,
                self.seconds,
            ),
            String::new(),
        ];
        lines.extend(self.open.rows().into_iter().map(fact));
        if let Some(misses) = self.open.miss_table() {
            lines.extend([String::new(), misses]);
        }
        if let Some(closed) = &self.closed {
            let findings = &closed.findings;
            let head = format!(
                "  with doors closed: {} doors in {} pairs of a cell and what is closed, {} eyes",
                closed.doors, closed.situations, findings.eyes
            );
            lines.extend([String::new(), head]);
            lines.extend(findings.rows().into_iter().map(fact));
            let gaps = format!(
                "{} objects, {} pixels through gaps around doors that count as closed",
                closed.gap_objects, closed.gap_pixels
            );
            lines.push(fact(("not held against it", gaps)));
            if let Some(misses) = findings.miss_table() {
                lines.extend([String::new(), misses]);
            }
        }
        lines.push(String::new());
        lines.extend(drawn.map(|drawn| format!("  picture: {drawn}")));
        lines.push(if self.passed {
            format!("  passed: {}", self.rule)
        } else {
            format!("  failed: {} (the rule: {})", self.failures.join("; "), self.rule)
        });
        lines.join("\n")
    }

    /// The sentence with which the command fails.
    pub(super) fn refusal(&self) -> String {
        let closed = self.closed.as_ref().and_then(|closed| closed.findings.worst.as_ref());
        let worst = self
            .open
            .worst
            .iter()
            .chain(closed)
            .max_by_key(|worst| worst.miss.pixels);
        format!(
            "the visible sets of `{}` are not good enough: {}{}",
            self.scene,
            self.failures.join("; "),
            worst.map_or_else(String::new, NamedMiss::told)
        )
    }
}
