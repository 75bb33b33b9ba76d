//! What did an audit find? As a table for people, or as JSON.

use belvedere_live::Ms;
use serde::Serialize;

use super::judge::Finding;
use crate::commands::output::{bytes, table};

/// So many findings of a kind are told in full.
pub(super) const TOLD: usize = 20;

/// What was found in a recording.
#[derive(Debug, Default, Serialize)]
pub(super) struct Report {
    /// How much of the file is whole.
    pub(super) whole_bytes: u64,
    pub(super) scenes: Vec<SceneReport>,
}

/// What was found of a scene.
#[derive(Debug, Default, Serialize)]
pub(super) struct SceneReport {
    pub(super) scene: String,
    pub(super) entries: u64,
    pub(super) ticks: u64,
    /// From the first entry to the last.
    pub(super) lasted_ms: Ms,
    pub(super) sessions: u64,
    /// Times that a session was told of a mover.
    pub(super) told: u64,
    /// Pairs of a participant and a mover that it was not told of that were looked at.
    pub(super) untold: u64,
    /// Cells from which rays looked around, once for each set of closed doors.
    pub(super) cells: usize,
    /// Pairs of cells between which sight lines were aimed.
    pub(super) pairs: usize,
    /// Pairs between which sight lines were hunted.
    pub(super) hunted: usize,
    /// Ticks in a revision that is not the current one: only replayed.
    pub(super) ticks_not_looked_at: u64,
    pub(super) leaks: Findings<Finding>,
    /// Told of what neither a sight line nor a proof decides.
    pub(super) undecided: Findings<Finding>,
    pub(super) misses: Findings<Finding>,
    /// Entries whose outputs are others than the rules give.
    pub(super) differences: Findings<Difference>,
}

/// Findings of a kind: how many, and the first of them.
#[derive(Debug, Serialize)]
pub(super) struct Findings<T> {
    pub(super) count: usize,
    pub(super) first: Vec<T>,
}

/// An entry that does not come out as it was written.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Difference {
    pub(super) entry: u64,
    pub(super) at_ms: Ms,
    pub(super) why: String,
}

impl<T> Default for Findings<T> {
    fn default() -> Self {
        Self {
            count: 0,
            first: Vec::new(),
        }
    }
}

impl<T> Findings<T> {
    pub(super) fn add(&mut self, finding: T) {
        self.count += 1;
        if self.first.len() < TOLD {
            self.first.push(finding);
        }
    }
}

impl Report {
    pub(super) fn text(&self) -> String {
        let rows: Vec<_> = self.scenes.iter().map(SceneReport::row).collect();
        let head = [
            "scene",
            "lasted",
            "sessions",
            "told",
            "not told",
            "leaks",
            "undecided",
            "misses",
            "differences",
        ];
        let mut text = format!("{} of recording\n{}", bytes(self.whole_bytes), table(&head, &rows));
        for scene in &self.scenes {
            scene.details(&mut text);
        }
        text + "\n" + &self.summary()
    }

    fn sum(&self, count: fn(&SceneReport) -> usize) -> usize {
        self.scenes.iter().map(count).sum()
    }

    /// How much is wrong or may be.
    fn summary(&self) -> String {
        let told: u64 = self.scenes.iter().map(|scene| scene.told).sum();
        format!(
            "{} leaks, {} of {told} tellings undecided, {} misses, {} entries that come out otherwise",
            self.sum(|scene| scene.leaks.count),
            self.sum(|scene| scene.undecided.count),
            self.sum(|scene| scene.misses.count),
            self.sum(|scene| scene.differences.count),
        )
    }

    /// What is wrong, if anything is; to leave something open may be wrong too.
    pub(super) fn verdict(&self, undecided_too: bool) -> Option<String> {
        let wrong = self.sum(|scene| scene.leaks.count + scene.misses.count + scene.differences.count);
        let open = self.sum(|scene| scene.undecided.count);
        (wrong > 0 || undecided_too && open > 0).then(|| self.summary())
    }
}

impl SceneReport {
    fn row(&self) -> Vec<String> {
        let counts = [
            self.sessions.to_string(),
            self.told.to_string(),
            self.untold.to_string(),
            self.leaks.count.to_string(),
            self.undecided.count.to_string(),
            self.misses.count.to_string(),
            self.differences.count.to_string(),
        ];
        let lasted = format!("{:.1} s", self.lasted_ms as f64 * 1e-3);
        [self.scene.clone(), lasted].into_iter().chain(counts).collect()
    }

    fn details(&self, text: &mut String) {
        if self.ticks_not_looked_at > 0 {
            *text += &format!(
                "\n{}: {} of {} ticks are of another revision than the current one, and were only replayed",
                self.scene, self.ticks_not_looked_at, self.ticks
            );
        }
        let kinds = [
            ("leak", &self.leaks),
            ("undecided", &self.undecided),
            ("miss", &self.misses),
        ];
        for (kind, findings) in kinds {
            for found in &findings.first {
                *text += &format!(
                    "\n{kind} at {}: {} at {:?} in {:?}, {} at {:?} in {:?}",
                    found.at_ms, found.session, found.eye, found.eye_cells, found.object, found.position, found.cells
                );
            }
        }
        for found in &self.differences.first {
            *text += &format!("\nentry {} at {}: {}", found.entry, found.at_ms, found.why);
        }
    }
}
