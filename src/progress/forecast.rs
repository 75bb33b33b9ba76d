//! When will a bake be done?
//!
//! Nearly all of it is looking from cells for their visible sets, and how long that takes nobody knows before. But some thousand
//! rays have been cast from cells before that, at a glance, among the same things: a look takes about so many times as long as a
//! glance ([`STEPS_IN_A_LOOK`]). As looks are finished they count for themselves, the more the less the guess.

use std::collections::BTreeMap;

use belvedere_bake::progress::Stage;

/// A look from a cell takes so many times as long as a step of a glance, of which each cell takes five. In a floor plan, a level of a
/// game and a city of 400 houses it was 145, 295 and 95 times.
const STEPS_IN_A_LOOK: f64 = 165.0;
/// So many cells are left to look from for each such step, as long as nobody has counted them.
const CELLS_FOR_A_STEP: f64 = 0.12;
/// Levels of detail and writing take this share of what looking takes, each.
const BESIDE_LOOKS: f64 = 0.04;
/// A guess counts as much as if this share of a stage had shown it.
const GUESS_COUNTS: f64 = 0.03;

/// What is known of the stages of a bake.
#[derive(Debug, Default)]
pub(super) struct Forecast {
    /// Seconds and steps of stages that have ended.
    ended: BTreeMap<Stage, (f64, u64)>,
    /// Steps of stages to come, as far as they are known.
    expected: BTreeMap<Stage, u64>,
}

/// How far a stage is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    pub(super) stage: Stage,
    pub(super) seconds: f64,
    pub(super) done: u64,
    pub(super) of: u64,
}

impl Forecast {
    /// A stage to come has so many steps.
    pub(super) fn expect(&mut self, stage: Stage, steps: u64) {
        self.expected.insert(stage, steps);
    }

    /// A stage, or a part of it, has ended.
    pub(super) fn end(&mut self, Now { stage, seconds, of, .. }: Now) {
        let (all_s, steps) = self.ended.entry(stage).or_default();
        *all_s += seconds;
        *steps += of;
    }

    /// Seconds that everything from now on takes; `None` while nobody can tell.
    pub(super) fn rest_s(&self, now: Now) -> Option<f64> {
        let looks_s = self.looks_s(now);
        let guess_s = |stage: Stage| match stage {
            Stage::Visibility => looks_s,
            _ => looks_s.map(|looks_s| BESIDE_LOOKS * looks_s),
        };
        let to_come = [Stage::Lod, Stage::Smooth, Stage::Visibility, Stage::Publish];
        let later = to_come.into_iter().filter(|stage| *stage > now.stage);
        let later_s = later.map(guess_s).sum::<Option<f64>>()?;
        let guess_s = to_come.contains(&now.stage).then(|| guess_s(now.stage)).flatten();
        Some(rest_of(now, guess_s) + later_s)
    }

    /// Seconds that looking from all cells takes, at a guess.
    fn looks_s(&self, now: Now) -> Option<f64> {
        if let Now {
            stage: Stage::Visibility,
            seconds,
            done,
            of,
        } = now
            && !self.ended.contains_key(&Stage::Glance)
        {
            return (done > 0).then(|| seconds * of as f64 / done as f64);
        }
        let (ended_s, ended) = self.ended.get(&Stage::Glance).copied().unwrap_or_default();
        let glancing = (now.stage == Stage::Glance).then_some(now);
        let steps = ended + glancing.map_or(0, |now| now.done);
        let seconds = ended_s + glancing.map_or(0.0, |now| now.seconds);
        let step_s = (steps > 0).then(|| seconds / steps as f64)?;
        let all_steps = ended + glancing.map_or(0, |now| now.of);
        let cells = self.expected.get(&Stage::Visibility).map(|cells| *cells as f64);
        Some(cells.unwrap_or(CELLS_FOR_A_STEP * all_steps as f64) * STEPS_IN_A_LOOK * step_s)
    }
}

/// Seconds that a stage still takes: as its steps did so far, and at first as it was guessed.
fn rest_of(now: Now, guess_s: Option<f64>) -> f64 {
    let share = now.done.min(now.of) as f64 / now.of.max(1) as f64;
    let (counts, guess_s) = guess_s.map_or((0.0, 0.0), |guess_s| (GUESS_COUNTS, guess_s));
    let known = share + counts;
    if known > 0.0 {
        (1.0 - share) * (now.seconds + counts * guess_s) / known
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn now(stage: Stage, seconds: f64, done: u64, of: u64) -> Now {
        Now {
            stage,
            seconds,
            done,
            of,
        }
    }

    /// How long stages of three bakes took on one core, in seconds, and how many steps they had: of a floor plan, …
    const PLAN: [(Stage, f64, u64); 5] = [
        (Stage::Glance, 24.3, 10_060),
        (Stage::Lod, 10.3, 150_000),
        (Stage::Smooth, 6.4, 154_574),
        (Stage::Visibility, 354.0, 1006),
        (Stage::Publish, 10.0, 1006),
    ];
    /// … a city of 400 houses, …
    const CITY: [(Stage, f64, u64); 5] = [
        (Stage::Glance, 20.7, 6015),
        (Stage::Lod, 0.4, 6082),
        (Stage::Smooth, 0.0, 0),
        (Stage::Visibility, 103.1, 317),
        (Stage::Publish, 6.2, 317),
    ];
    /// … and a level of a game.
    const LEVEL: [(Stage, f64, u64); 5] = [
        (Stage::Glance, 2.7, 2340),
        (Stage::Lod, 2.0, 57_872),
        (Stage::Smooth, 0.1, 2702),
        (Stage::Visibility, 76.0, 222),
        (Stage::Publish, 3.0, 222),
    ];

    /// Once the cells are known, what is left is known within a factor of two.
    #[test]
    fn three_unlike_bakes_are_foretold() {
        for stages in [PLAN, CITY, LEVEL] {
            let mut forecast = Forecast::default();
            let mut left_s: f64 = stages.iter().map(|(_, seconds, _)| seconds).sum();
            for (stage, seconds, of) in stages {
                for part in 0..10 {
                    let gone = f64::from(part) / 10.0;
                    let rest_s = forecast.rest_s(now(stage, gone * seconds, (gone * of as f64) as u64, of));
                    let real_s = left_s - gone * seconds;
                    if stage > Stage::Glance && stage < Stage::Publish {
                        let ratio = rest_s.expect("a glance has told") / real_s;
                        assert!((0.5..2.0).contains(&ratio), "{stage} {part}: {ratio}");
                    }
                }
                left_s -= seconds;
                forecast.end(now(stage, seconds, of, of));
                if stage == Stage::Glance {
                    forecast.expect(Stage::Visibility, stages[3].2);
                }
            }
        }
    }

    #[test]
    fn nobody_knows_before_the_first_glance() {
        let forecast = Forecast::default();
        assert_eq!(forecast.rest_s(now(Stage::Cells, 5.0, 3, 4)), None);
        assert_eq!(forecast.rest_s(now(Stage::Glance, 0.0, 0, 1280)), None);
        assert!(forecast.rest_s(now(Stage::Glance, 1.0, 10, 1280)).is_some());
    }

    #[test]
    fn cells_that_their_author_drew_are_foretold_by_the_first_looks() {
        let mut forecast = Forecast::default();
        forecast.expect(Stage::Visibility, 20);
        assert_eq!(forecast.rest_s(now(Stage::Lod, 5.0, 3, 4)), None);
        let rest_s = forecast.rest_s(now(Stage::Visibility, 30.0, 5, 20)).unwrap();
        assert!((90.0..100.0).contains(&rest_s), "{rest_s}");
    }
}
