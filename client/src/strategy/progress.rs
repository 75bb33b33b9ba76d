//! How much of what one can see is here? Exact, because the documents say how large everything is: bytes of published files,
//! each once however many objects share them (`viewer/core/strategy/progress.ts`).
//!
//! The first picture is measured by coarsest levels, whatever stands for them: a rung counts as the level that need not come
//! any more. So the total is what the cell's record says (`visible_coarsest_bytes`), and stays the same; but what stands in for
//! an object whose levels nobody knows counts with its rules.

use std::{collections::HashMap, fmt};

use super::{
    file::Key,
    grade::{Grade, State, Stock, goal},
    plan::{Held, is_sharp},
    sight::{Eye, Seen},
};

/// What takes less is told in kB.
const SMALL: u64 = 1_000_000;

/// So much of so much.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// What is here.
    pub loaded_bytes: u64,
    /// All of it.
    pub total_bytes: u64,
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (unit, name) = if self.total_bytes < SMALL {
            (1e3, "kB")
        } else {
            (1e6, "MB")
        };
        let [loaded, total] = [self.loaded_bytes, self.total_bytes].map(|bytes| bytes as f64 / unit);
        write!(f, "{loaded:.1} of {total:.1} {name} of what you can see")
    }
}

/// As if nothing were here yet, so that a total does not depend on what is.
struct Bare<'a, H>(&'a H);

impl<H: Stock> Stock for Bare<'_, H> {
    fn state(&self, file: Key) -> State {
        match self.0.state(file) {
            State::Lost => State::Lost,
            _ => State::Away,
        }
    }
}

/// Towards the first picture: something of everything visible.
#[must_use]
pub fn first_progress(visible: &[Seen], held: &impl Held) -> Progress {
    progress(visible, held, |seen| {
        (Grade::coarsest(&seen.geometry), held.held(seen.model).is_some())
    })
}

/// Towards the sharp picture: of everything visible what will do from here.
#[must_use]
pub fn sharp_progress(visible: &[Seen], held: &impl Held, eye: &Eye, target_px: f64) -> Progress {
    progress(visible, held, |seen| {
        let wanted = goal(&seen.geometry, seen.error_of_px(target_px, eye), &Bare(held));
        let does = held
            .held(seen.model)
            .is_some_and(|now| is_sharp(seen, now, eye, target_px));
        (wanted, does)
    })
}

fn progress(visible: &[Seen], held: &impl Held, wanted: impl Fn(&Seen) -> (Option<Grade>, bool)) -> Progress {
    let mut finest: HashMap<_, (&Seen, Grade, bool)> = HashMap::new();
    for seen in visible {
        let (Some(grade), does) = wanted(seen) else { continue };
        let known = finest.entry(seen.model).or_insert((seen, grade, does));
        if grade.error < known.1.error {
            *known = (seen, grade, does);
        }
    }
    let mut files: HashMap<Key, (u64, bool)> = HashMap::new();
    for (seen, grade, does) in finest.into_values() {
        for part in grade.parts(&seen.geometry, &Bare(held)) {
            let lost = part.spare && held.state(part.key()) == State::Lost;
            let here = does || lost || part.holder(held).is_some();
            let file = files.entry(part.key()).or_insert((part.bytes, false));
            file.1 |= here;
        }
    }
    let sum = |here: bool| files.values().filter(|file| !here || file.1).map(|file| file.0).sum();
    Progress {
        loaded_bytes: sum(true),
        total_bytes: sum(false),
    }
}
