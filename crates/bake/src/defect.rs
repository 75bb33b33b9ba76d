//! What was wrong with the source, and what was done about it?

use std::{collections::BTreeMap, fmt};

use serde::Serialize;

/// Counts defects by kind and keeps the first place of each.
#[derive(Debug, Clone, Default)]
pub struct Defects(BTreeMap<&'static str, (u64, String)>);

/// One kind of defect, as reports show it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Defect {
    /// What was wrong and what was done, in a few words: `degenerate triangle: dropped`.
    pub kind: &'static str,
    /// How often.
    pub count: u64,
    /// The first place: `mesh "Wall" primitive 2, triangle 17`.
    pub first: String,
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, count, first } = self;
        write!(f, "{count} × {kind} (first: {first})")
    }
}

impl Defects {
    /// Notes `count` defects of a kind; `place` names the first of them. Nothing happens when `count` is zero.
    pub fn note(&mut self, kind: &'static str, count: u64, place: impl FnOnce() -> String) {
        if count > 0 {
            self.0.entry(kind).or_insert_with(|| (0, place())).0 += count;
        }
    }

    /// Adds what was noted elsewhere; the first place stays the first.
    pub fn absorb(&mut self, other: Self) {
        for (kind, (count, first)) in other.0 {
            self.note(kind, count, || first);
        }
    }

    /// All kinds, by name.
    pub fn iter(&self) -> impl Iterator<Item = Defect> {
        self.0.iter().map(|(kind, (count, first))| Defect {
            kind,
            count: *count,
            first: first.clone(),
        })
    }

    /// How many of one kind there are.
    #[must_use]
    pub fn count(&self, kind: &str) -> u64 {
        self.0.get(kind).map_or(0, |(count, _)| *count)
    }
}
