//! How does the outcome read? As a table for people, as JSON for programs.

use belvedere_scene::{Revision, SceneName, record::Guarantee};
use belvedere_verify::{
    check::{FINE_PX, Miss, Outcome, Settings, Tightness},
    verdict,
};
use serde::Serialize;

use super::load::Published;
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
    eyes: u64,
    size_px: usize,
    seed: u64,
    seconds: f64,
    /// Pixels that show an object, in all views.
    pixels: u64,
    /// Objects missing from a record, each pair of cell and object once.
    missed_objects: usize,
    missed_pixels: u64,
    false_negative_rate: f64,
    /// What only seemed to be missing: rounding decides.
    unconfirmed_objects: usize,
    unconfirmed_pixels: u64,
    tightness_mean: f64,
    /// All entries over all that were seen.
    tightness_of_entries: f64,
    loosest: Option<Tightness>,
    worst: Option<NamedMiss>,
    /// The largest misses.
    misses: Vec<NamedMiss>,
    rule: String,
    failures: Vec<String>,
    passed: bool,
}

#[derive(Debug, Clone, Serialize)]
struct NamedMiss {
    #[serde(flatten)]
    miss: Miss,
    source_node: String,
}

impl Report {
    pub(super) fn new(published: &Published, settings: &Settings, outcome: &Outcome, seconds: f64) -> Self {
        let named = |miss: &Miss| NamedMiss {
            miss: miss.clone(),
            source_node: published.nodes.get(miss.object.0 as usize).cloned().unwrap_or_default(),
        };
        let misses: Vec<_> = outcome.misses.iter().take(LISTED).map(named).collect();
        let failures = verdict::failures(outcome);
        Self {
            scene: published.pointer.scene.clone(),
            revision: published.pointer.revision,
            method: published.visibility.method.clone(),
            guarantee: published.visibility.guarantee,
            cells: published.cells.len(),
            eyes: outcome.eyes,
            size_px: settings.size_px,
            seed: settings.seed,
            seconds,
            pixels: outcome.pixels,
            missed_objects: outcome.misses.len(),
            missed_pixels: outcome.missed_pixels,
            false_negative_rate: outcome.false_negative_rate(),
            unconfirmed_objects: outcome.unconfirmed.len(),
            unconfirmed_pixels: outcome.unconfirmed_pixels,
            tightness_mean: outcome.tightness_mean(),
            tightness_of_entries: outcome.tightness_of_entries(),
            loosest: outcome.loosest(),
            worst: misses.first().cloned(),
            misses,
            rule: verdict::rule(),
            passed: failures.is_empty(),
            failures,
        }
    }

    /// For people; `drawn` says what the picture shows.
    pub(super) fn text(&self, drawn: Option<&str>) -> String {
        let guarantee = match self.guarantee {
            Guarantee::Conservative => "conservative",
            Guarantee::Sampled => "sampled",
        };
        let mut lines = vec![
            format!(
                "{}, revision {}: {} ({guarantee}), {} cells, {} eyes, {} × {} pixels on six faces, {:.1} s",
                self.scene, self.revision, self.method, self.cells, self.eyes, self.size_px, self.size_px, self.seconds,
            ),
            String::new(),
        ];
        let loosest = self.loosest.map_or_else(String::new, |l| {
            format!(
                ", least tight {}: {} listed, {} seen by {} eyes",
                l.cell, l.listed, l.seen, l.eyes
            )
        });
        let facts = [
            ("missed objects", format!("{}", self.missed_objects)),
            (
                "false-negative pixels",
                format!(
                    "{:.2e} ({} of {})",
                    self.false_negative_rate, self.missed_pixels, self.pixels
                ),
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
                    "at most {:.2} times what was seen, mean over cells; {:.2} over all entries{loosest}",
                    self.tightness_mean, self.tightness_of_entries,
                ),
            ),
        ];
        lines.extend(facts.map(|(name, value)| format!("  {name:<22} {value}")));
        if !self.misses.is_empty() {
            lines.push(String::new());
            lines.push(self.miss_table());
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

    fn miss_table(&self) -> String {
        let pixels = format!("pixels at {FINE_PX}²");
        let head = ["cell", "object", "node", &pixels, "eye", "place"];
        let rows: Vec<_> = self
            .misses
            .iter()
            .take(ROWS)
            .map(|NamedMiss { miss, source_node }| {
                vec![
                    miss.cell.to_string(),
                    miss.object.to_string(),
                    source_node.clone(),
                    miss.pixels.to_string(),
                    miss.eye.map(|x| format!("{x:.4}")).join(" "),
                    miss.place.to_string(),
                ]
            })
            .collect();
        let more = self.missed_objects - rows.len();
        let tail = if more > 0 {
            format!("\n… and {more} more")
        } else {
            String::new()
        };
        format!("{}{tail}", table(&head, &rows))
    }

    /// The sentence with which the command fails.
    pub(super) fn refusal(&self, failures: &[String]) -> String {
        let worst = self
            .worst
            .as_ref()
            .map_or_else(String::new, |NamedMiss { miss, source_node }| {
                format!(
                    "; the worst: {} (`{source_node}`) is seen from {} at {:?} and is not in its record",
                    miss.object, miss.cell, miss.eye,
                )
            });
        format!(
            "the visible sets of `{}` are not good enough: {}{worst}",
            self.scene,
            failures.join("; ")
        )
    }
}
