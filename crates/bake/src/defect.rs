//! What was wrong with the source, and what was done about it?

use std::{collections::BTreeMap, fmt};

use serde::Serialize;

/// Most places of one kind that are kept: who has mended so many asks again.
const MOST_NAMED: usize = 64;

/// Counts defects by kind and keeps the first place of each, or all places, up to [`MOST_NAMED`], where each must be seen to.
#[derive(Debug, Clone, Default)]
pub struct Defects(BTreeMap<&'static str, Noted>);

#[derive(Debug, Clone, Default)]
struct Noted {
    count: u64,
    /// The first, or all.
    places: Vec<String>,
    names_all: bool,
}

impl Noted {
    fn keep(&mut self, places: impl IntoIterator<Item = String>) {
        let left = MOST_NAMED.saturating_sub(self.places.len());
        self.places.extend(places.into_iter().take(left));
    }
}

/// One kind of defect, as reports show it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Defect {
    /// What was wrong and what was done, in a few words: `degenerate triangle: dropped`.
    pub kind: &'static str,
    /// How often.
    pub count: u64,
    /// The first place: `mesh "Wall" primitive 2, triangle 17`.
    pub first: String,
    /// Further places, of kinds of which all are named.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<String>,
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            kind,
            count,
            first,
            others,
        } = self;
        match &others[..] {
            [] => write!(f, "{count} × {kind} (first: {first})"),
            others => {
                write!(f, "{count} × {kind} ({first}, {}", others.join(", "))?;
                match count.saturating_sub(1 + others.len() as u64) {
                    0 => f.write_str(")"),
                    more => write!(f, " and {more} more)"),
                }
            }
        }
    }
}

impl Defects {
    /// Notes `count` defects of a kind; `place` names the first of them, in one line. Nothing happens when `count` is zero.
    pub fn note(&mut self, kind: &'static str, count: u64, place: impl FnOnce() -> String) {
        if count > 0 {
            let noted = self.0.entry(kind).or_default();
            if noted.count == 0 {
                noted.places.push(in_a_line(place()));
            }
            noted.count += count;
        }
    }

    /// Notes a defect of a kind at each of some places, all of which are named as far as they are not too many. A kind is noted either so or as [`note`](Self::note) does.
    pub fn name(&mut self, kind: &'static str, places: impl IntoIterator<Item = String>) {
        for place in places {
            self.tell(kind, in_a_line(place));
        }
    }

    /// The same of one place that is told as it is, in as many lines as that has.
    pub fn tell(&mut self, kind: &'static str, place: String) {
        let noted = self.0.entry(kind).or_default();
        noted.count += 1;
        noted.keep([place]);
        noted.names_all = true;
    }

    /// Adds what was noted elsewhere; the first place stays the first.
    pub fn absorb(&mut self, other: Self) {
        for (kind, noted) in other.0 {
            let known = self.0.entry(kind).or_default();
            if known.count == 0 || noted.names_all {
                known.keep(noted.places);
            }
            known.count += noted.count;
            known.names_all |= noted.names_all;
        }
    }

    /// All kinds, by name.
    pub fn iter(&self) -> impl Iterator<Item = Defect> {
        self.0.iter().map(|(kind, noted)| Defect {
            kind,
            count: noted.count,
            first: noted.places.first().cloned().unwrap_or_default(),
            others: noted.places.iter().skip(1).cloned().collect(),
        })
    }

    /// How many of one kind there are.
    #[must_use]
    pub fn count(&self, kind: &str) -> u64 {
        self.0.get(kind).map_or(0, |noted| noted.count)
    }
}

/// A place by the names that others gave, whatever is in these.
fn in_a_line(place: String) -> String {
    if !place.contains(char::is_control) {
        return place;
    }
    let told = |c: char| match c.is_control() {
        true => c.escape_default().to_string(),
        false => c.to_string(),
    };
    place.chars().map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_named_all_or_the_first_and_what_is_taken_over_is_added() {
        let mut defects = Defects::default();
        defects.note("dent", 2, || "a".to_owned());
        defects.name("leak", ["a", "b"].map(str::to_owned));
        let mut others = Defects::default();
        others.note("dent", 1, || "c".to_owned());
        others.name("leak", ["c".to_owned()]);
        others.note("never", 0, || "d".to_owned());
        defects.absorb(others);
        defects.note("mark", 1, || "two\nlines".to_owned());
        defects.tell("rule", "two\nlines".to_owned());
        let told: Vec<_> = defects.iter().map(|defect| defect.to_string()).collect();
        assert_eq!(
            told,
            [
                "3 × dent (first: a)",
                "3 × leak (a, b, c)",
                "1 × mark (first: two\\nlines)",
                "1 × rule (first: two\nlines)"
            ]
        );
        defects.name("leak", (0..100).map(|number| number.to_string()));
        let leaks = defects.iter().find(|defect| defect.kind == "leak").unwrap();
        assert_eq!((leaks.count, leaks.others.len() + 1), (103, MOST_NAMED));
        assert!(leaks.to_string().ends_with(", 60 and 39 more)"), "{leaks}");
    }
}
