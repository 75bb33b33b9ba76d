//! Is what came out good enough?
//!
//! A set that is called conservative may miss nothing at all. A sampled one may miss at most one pixel in ten thousand,
//! and no object that covers more than four pixels of a cube face of 1024² pixels. Eyes that saw nothing prove nothing.

use crate::check::{FINE_PX, Outcome};

/// The largest share of pixels that may show missing objects of sampled sets.
pub const RATE: f64 = 1e-4;
/// The most pixels, on faces of [`FINE_PX`], that a missing object of a sampled set may cover.
pub const PIXELS: u64 = 4;

/// Says what breaks the rule; nothing when all is well.
#[must_use]
pub fn failures(outcome: &Outcome) -> Vec<String> {
    let mut failures = Vec::new();
    if outcome.eyes > 0 && outcome.pixels == 0 {
        failures.push(
            "no eye saw a pixel of anything, which proves nothing: larger pictures (`--size`) show what is small or far away"
                .to_owned(),
        );
    }
    let promised = outcome.misses.iter().filter(|miss| miss.conservative).count();
    if promised > 0 {
        failures.push(format!(
            "{promised} objects are missing from sets that promise to miss nothing"
        ));
    }
    let large = outcome.misses.iter().filter(|miss| miss.pixels > PIXELS).count();
    if large > 0 {
        failures.push(format!(
            "{large} missing objects cover more than {PIXELS} pixels of a cube face of {FINE_PX} × {FINE_PX}"
        ));
    }
    let rate = outcome.false_negative_rate();
    if rate > RATE {
        failures.push(format!(
            "{rate:.1e} of the pixels show missing objects, more than {RATE:.0e}"
        ));
    }
    failures
}

/// The rule in words.
#[must_use]
pub fn rule() -> String {
    format!(
        "conservative sets miss nothing; sampled sets miss at most {RATE:.0e} of the pixels and no object over {PIXELS} \
         pixels at {FINE_PX} × {FINE_PX}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{check::Miss, eyes::Place};
    use belvedere_scene::{CellId, ObjectId};

    fn outcome(pixels: u64, conservative: bool, missed_pixels: u64) -> Outcome {
        Outcome {
            eyes: 1,
            pixels: 1_000_000,
            missed_pixels,
            misses: vec![Miss {
                cell: CellId(0),
                closed: vec![],
                eye: [0.0; 3],
                place: Place::Inside,
                direction: [1.0, 0.0, 0.0],
                object: ObjectId(0),
                pixels,
                conservative,
            }],
            ..Outcome::default()
        }
    }

    #[test]
    fn sampled_sets_may_miss_a_little_and_conservative_ones_nothing() {
        assert!(failures(&outcome(4, false, 100)).is_empty());
        assert_eq!(failures(&outcome(5, false, 100)).len(), 1);
        assert_eq!(failures(&outcome(4, false, 101)).len(), 1);
        assert_eq!(failures(&outcome(1, true, 1)).len(), 1);
    }

    #[test]
    fn eyes_that_saw_nothing_prove_nothing_and_where_nobody_looked_there_is_nothing_to_prove() {
        let blind = Outcome {
            eyes: 3,
            ..Outcome::default()
        };
        assert!(failures(&blind)[0].contains("--size"), "{:?}", failures(&blind));
        assert_eq!(failures(&Outcome::default()), [""; 0]);
    }
}
