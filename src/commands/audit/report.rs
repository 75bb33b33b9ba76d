//! What did an audit find? As a table for people, or as JSON.

use belvedere_live::Ms;
use belvedere_scene::CellId;
use serde::Serialize;

use super::{judge::Finding, poses::Untrue, telling::Astray};
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
    /// Times that a session was told of a door.
    pub(super) doors: u64,
    /// Pairs of a participant and a mover that it was not told of that were looked at.
    pub(super) untold: u64,
    /// Pairs of these that were in view but for a crowd, in which the rules leave some out.
    pub(super) culled: u64,
    /// Pairs of these that were in view while the session waited for its stream to take what it was told before.
    pub(super) waiting: u64,
    /// Promises that owners were told by `hush`.
    pub(super) hushed: u64,
    /// Those of them that their owners broke: the mover turned up outside, further than it comes while that is said.
    pub(super) broken: u64,
    /// Cells from which rays looked around, once for each set of closed doors.
    pub(super) cells: usize,
    /// Pairs of cells between which sight lines were aimed.
    pub(super) pairs: usize,
    /// Pairs between which sight lines were hunted.
    pub(super) hunted: usize,
    /// Ticks in a revision that is not kept any more: only replayed.
    pub(super) ticks_not_looked_at: u64,
    pub(super) leaks: Findings<Finding>,
    /// Told of what neither a sight line nor a proof decides.
    pub(super) undecided: Findings<Finding>,
    pub(super) misses: Findings<Finding>,
    /// Told to sessions, or of movers, that were not there.
    pub(super) astray: Findings<Astray>,
    /// Told otherwise than it is, or not told that it is otherwise by now.
    pub(super) untrue: Findings<Untrue>,
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
            "of doors",
            "not told",
            "culled",
            "waiting",
            "hushed",
            "broken",
            "leaks",
            "undecided",
            "misses",
            "astray",
            "untrue",
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
        let told: u64 = self.scenes.iter().map(|scene| scene.told + scene.doors).sum();
        let ticks: u64 = self.scenes.iter().map(|scene| scene.ticks).sum();
        let unjudged = match self.ticks_not_looked_at() {
            0 => String::new(),
            all if all == ticks => "nothing was judged, for no revision of the recording is kept any more: ".to_owned(),
            some => format!("{some} of {ticks} ticks were not judged, for their revision is not kept any more: "),
        };
        format!(
            "{unjudged}{}, {} of {told} tellings undecided, {}, {} astray, {} untrue, {} otherwise",
            counted(self.sum(|scene| scene.leaks.count), "leak", "leaks"),
            self.sum(|scene| scene.undecided.count),
            counted(self.sum(|scene| scene.misses.count), "miss", "misses"),
            counted(self.sum(|scene| scene.astray.count), "telling", "tellings"),
            self.sum(|scene| scene.untrue.count),
            counted(
                self.sum(|scene| scene.differences.count),
                "entry that comes out",
                "entries that come out"
            ),
        )
    }

    fn ticks_not_looked_at(&self) -> u64 {
        self.scenes.iter().map(|scene| scene.ticks_not_looked_at).sum()
    }

    /// What is wrong, if anything is; to leave something open may be wrong too.
    pub(super) fn verdict(&self, undecided_too: bool) -> Option<String> {
        let seen = self.sum(|scene| scene.leaks.count + scene.misses.count);
        let told = self.sum(|scene| scene.astray.count + scene.untrue.count);
        let wrong = seen + told + self.sum(|scene| scene.differences.count);
        let open = self.sum(|scene| scene.undecided.count) > 0 || self.ticks_not_looked_at() > 0;
        (wrong > 0 || undecided_too && open).then(|| self.summary())
    }
}

impl SceneReport {
    fn row(&self) -> Vec<String> {
        let counts = [
            self.sessions.to_string(),
            self.told.to_string(),
            self.doors.to_string(),
            self.untold.to_string(),
            self.culled.to_string(),
            self.waiting.to_string(),
            self.hushed.to_string(),
            self.broken.to_string(),
            self.leaks.count.to_string(),
            self.undecided.count.to_string(),
            self.misses.count.to_string(),
            self.astray.count.to_string(),
            self.untrue.count.to_string(),
            self.differences.count.to_string(),
        ];
        let lasted = format!("{:.1} s", self.lasted_ms as f64 * 1e-3);
        [self.scene.clone(), lasted].into_iter().chain(counts).collect()
    }

    fn details(&self, text: &mut String) {
        if self.ticks_not_looked_at > 0 {
            *text += &format!(
                "\n{}: {} of {} ticks are of a revision that is not kept any more, and were only replayed",
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
                *text += &format!("\n{kind} at {}: {}", found.at_ms, sentence(found));
            }
        }
        for told in &self.astray.first {
            let of = told
                .object
                .as_deref()
                .map_or(String::new(), |object| format!(" of {object}"));
            *text += &format!(
                "\nastray at {}: `{}` to {}{of}: {}",
                told.at_ms, told.event, told.session, told.why
            );
        }
        for told in &self.untrue.first {
            let by = told
                .event
                .map_or_else(String::new, |event| format!(" was told by {event}:"));
            let off = told
                .off_m
                .map_or_else(String::new, |off_m| format!(", {off_m:.3} m off"));
            *text += &format!(
                "\nuntrue at {}: {} of {}{by} {}{off}",
                told.at_ms, told.session, told.object, told.why
            );
        }
        for found in &self.differences.first {
            *text += &format!("\nentry {} at {}: {}", found.entry, found.at_ms, found.why);
        }
    }
}

/// `1 leak`, `2 leaks`.
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// `s0 at (4, 1.5, 6) in c0 was told of o100000001 at (28, 1.5, 4) in c3 by object-pos`.
fn sentence(found: &Finding) -> String {
    let told = found.event.map_or("was not told", |_| "was told");
    let by = found.event.map_or(String::new(), |event| format!(" by {event}"));
    let why = found.why.map_or(String::new(), |why| format!(": {why}"));
    format!(
        "{} at {} in {} {told} of {} at {} in {}{by}{why}",
        found.session,
        place(found.eye),
        list(&found.eye_cells),
        found.object,
        place(found.position),
        list(&found.cells),
    )
}

fn place([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

/// `c0, c2`.
fn list(cells: &[CellId]) -> String {
    if cells.is_empty() {
        return "no cell".to_owned();
    }
    let names: Vec<_> = cells.iter().map(CellId::to_string).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use belvedere_live::event::SessionId;
    use belvedere_scene::ObjectId;

    use super::*;

    #[test]
    fn findings_are_told_in_the_words_of_the_interface() {
        let found = Finding {
            at_ms: 7,
            session: SessionId(0),
            object: ObjectId(100_000_001),
            event: Some("object-pos"),
            eye: [4.0, 1.5, 6.0],
            position: [28.6, 1.5, 4.0],
            eye_cells: vec![CellId(0)],
            cells: vec![CellId(3), CellId(5)],
            why: None,
        };
        let mut scene = SceneReport::default();
        scene.leaks.add(found.clone());
        scene.misses.add(Finding {
            event: None,
            cells: vec![],
            why: Some("its owner sleeps"),
            ..found
        });
        let report = Report {
            whole_bytes: 1,
            scenes: vec![scene],
        };
        let text = report.text();
        let lines: Vec<_> = text.lines().rev().collect();
        assert_eq!(
            lines[..3],
            [
                "1 leak, 0 of 0 tellings undecided, 1 miss, 0 tellings astray, 0 untrue, 0 entries that come out otherwise",
                "miss at 7: s0 at (4, 1.5, 6) in c0 was not told of o100000001 at (28.6, 1.5, 4) in no cell: its owner sleeps",
                "leak at 7: s0 at (4, 1.5, 6) in c0 was told of o100000001 at (28.6, 1.5, 4) in c3, c5 by object-pos",
            ]
        );
    }
}
