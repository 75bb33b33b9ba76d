//! When will a bake be done?
//!
//! Most of it is looking from cells for their visible sets, and how long that takes nobody knows before. But some thousand
//! rays have been cast from cells before that, at a glance, among the same things. A look may cast the more rays the fewer cells
//! there are, and ends where they find nothing new: so it takes longer than a step of a glance by the root of how many it may
//! cast ([`STEPS_OF_A_LOOK`]). As looks are finished they count for themselves, the more the less the guess.

use std::collections::BTreeMap;

use belvedere_bake::{progress::Stage, visibility::rays_of_a_look};

/// A look from a cell takes as long as so many steps of a glance, of which each cell takes five, for each unit of the root of the rays
/// that it may cast. In two floor plans of 312 and 947 cells, a house of boxes with 280 and a lawn with four bushes and 31 it was
/// 0.28, 0.19, 0.15 and 0.19.
const STEPS_OF_A_LOOK: f64 = 0.2;
/// So many cells are left to look from for each such step, as long as nobody has counted them.
const CELLS_FOR_A_STEP: f64 = 0.1;
/// Steps of a glance are unlike: the first fifth casts rays, the next three try what neighbours have seen, and the last proves. So
/// much of its time has gone after each of these.
const AFTER_RAYS: f64 = 0.25;
const AFTER_TRIES: f64 = 0.5;
/// Levels of detail and first sets take this share of what looking takes, each, …
const BESIDE_LOOKS: f64 = 0.05;
/// … and writing this.
const WRITING: f64 = 0.1;
/// A guess counts as much as what this share of a stage has shown.
const GUESS_COUNTS: f64 = 0.03;

/// What is known of the stages of a bake.
#[derive(Debug, Default)]
pub(super) struct Forecast {
    /// Stages that have ended, with all their parts.
    ended: BTreeMap<Stage, Ended>,
    /// Steps of stages to come, as far as they are known.
    expected: BTreeMap<Stage, u64>,
}

/// What a stage took.
#[derive(Debug, Default)]
struct Ended {
    seconds: f64,
    stepping_s: f64,
    steps: u64,
}

/// How far a stage is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    pub(super) stage: Stage,
    pub(super) seconds: f64,
    /// Seconds until its last step was made: what is done after that, without steps, tells nothing of how long steps take.
    pub(super) stepping_s: f64,
    pub(super) done: u64,
    pub(super) of: u64,
}

impl Forecast {
    /// A stage to come has so many steps.
    pub(super) fn expect(&mut self, stage: Stage, steps: u64) {
        self.expected.insert(stage, steps);
    }

    /// A stage, or a part of it, has ended.
    pub(super) fn end(&mut self, now: Now) {
        let ended = self.ended.entry(now.stage).or_default();
        ended.seconds += now.seconds;
        ended.stepping_s += now.stepping_s;
        ended.steps += now.of;
    }

    /// Seconds that everything from now on takes; `None` while nobody can tell.
    pub(super) fn rest_s(&self, now: Now) -> Option<f64> {
        let looks_s = self.looks_s(now);
        let guess_s = |stage: Stage| match stage {
            Stage::Visibility => looks_s,
            Stage::Publish => looks_s.map(|looks_s| WRITING * looks_s),
            _ => looks_s.map(|looks_s| BESIDE_LOOKS * looks_s),
        };
        let to_come = [
            Stage::Lod,
            Stage::Preview,
            Stage::Smooth,
            Stage::Visibility,
            Stage::Publish,
        ];
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
            ..
        } = now
            && !self.ended.contains_key(&Stage::Glance)
        {
            return (done > 0).then(|| seconds * of as f64 / done as f64);
        }
        let ended = self.ended.get(&Stage::Glance);
        let (ended_s, ended) = ended.map_or((0.0, 0), |ended| (ended.stepping_s, ended.steps));
        let glancing = (now.stage == Stage::Glance).then_some(now);
        let glancing_s = match glancing {
            Some(now) => (now.done > 0).then(|| now.stepping_s / gone_of_a_glance(now))?,
            None => 0.0,
        };
        let steps = ended + glancing.map_or(0, |now| now.of);
        let step_s = (steps > 0).then(|| (ended_s + glancing_s) / steps as f64)?;
        let cells = self.expected.get(&Stage::Visibility).copied();
        let cells = cells.unwrap_or((CELLS_FOR_A_STEP * steps as f64) as u64);
        let look_s = STEPS_OF_A_LOOK * f64::from(rays_of_a_look(cells as usize)).sqrt() * step_s;
        Some(cells as f64 * look_s)
    }

    /// Seconds that have gone until now.
    pub(super) fn gone_s(&self, now: Now) -> f64 {
        now.seconds + self.ended.values().map(|ended| ended.seconds).sum::<f64>()
    }
}

/// How much of a glance's time has gone.
fn gone_of_a_glance(now: Now) -> f64 {
    let share = now.done as f64 / now.of.max(1) as f64;
    let within = |from: f64, to: f64| ((share - from) / (to - from)).clamp(0.0, 1.0);
    AFTER_RAYS * within(0.0, 0.2)
        + (AFTER_TRIES - AFTER_RAYS) * within(0.2, 0.8)
        + (1.0 - AFTER_TRIES) * within(0.8, 1.0)
}

/// Seconds that a stage still takes: as its steps did so far, and at first as it was guessed.
fn rest_of(now: Now, guess_s: Option<f64>) -> f64 {
    let share = now.done.min(now.of) as f64 / now.of.max(1) as f64;
    let shown_s = (share > 0.0).then(|| now.seconds / share);
    let guess_s = guess_s.filter(|guess_s| *guess_s > 0.0);
    // Between the two as times are compared, by their ratio: steps that are slow to begin are no sign of hours.
    let all_s = match (shown_s, guess_s) {
        (Some(shown_s), Some(guess_s)) => {
            let shows = share / (share + GUESS_COUNTS);
            shown_s.powf(shows) * guess_s.powf(1.0 - shows)
        }
        (shown_s, guess_s) => shown_s.or(guess_s).unwrap_or(0.0),
    };
    (1.0 - share) * all_s.max(now.seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn now(stage: Stage, seconds: f64, done: u64, of: u64) -> Now {
        Now {
            stage,
            seconds,
            stepping_s: seconds,
            done,
            of,
        }
    }

    /// How long stages of bakes took on a busy machine, in seconds, and how many steps they had: of a part of a floor plan, …
    const WING: [(Stage, f64, u64); 6] = [
        (Stage::Glance, 17.5, 3120),
        (Stage::Lod, 11.4, 98_968),
        (Stage::Preview, 6.6, 312),
        (Stage::Smooth, 12.5, 83_996),
        (Stage::Visibility, 179.7, 312),
        (Stage::Publish, 7.0, 936),
    ];
    /// … of a house of boxes, …
    const BOXES: [(Stage, f64, u64); 6] = [
        (Stage::Glance, 8.9, 1400),
        (Stage::Lod, 0.1, 13),
        (Stage::Preview, 8.4, 280),
        (Stage::Smooth, 0.0, 0),
        (Stage::Visibility, 94.0, 280),
        (Stage::Publish, 7.7, 840),
    ];
    /// … of a lawn with bushes that have pictures, of which many cells were joined, …
    const BUSHES: [(Stage, f64, u64); 7] = [
        (Stage::Glance, 15.6, 1300),
        (Stage::Lod, 6.7, 268_812),
        (Stage::Preview, 3.9, 130),
        (Stage::Smooth, 5.6, 268_812),
        (Stage::Impostors, 24.5, 80_640_000),
        (Stage::Visibility, 72.5, 31),
        (Stage::Publish, 15.3, 93),
    ];
    /// … and of all of the floor plan.
    const MUSEUM: [(Stage, f64, u64); 6] = [
        (Stage::Glance, 81.4, 9470),
        (Stage::Lod, 22.2, 211_929),
        (Stage::Preview, 41.9, 947),
        (Stage::Smooth, 19.4, 159_970),
        (Stage::Visibility, 395.0, 947),
        (Stage::Publish, 12.0, 2841),
    ];

    /// Steps that a stage has done when this share of its time has gone: as glances were, the first fifth took a fifth of it, the
    /// next three another, and the last the rest.
    fn done(stage: Stage, gone: f64, of: u64) -> u64 {
        let share = match stage {
            Stage::Glance if gone < 0.2 => gone,
            Stage::Glance if gone < 0.4 => 0.2 + 3.0 * (gone - 0.2),
            Stage::Glance => 0.8 + (gone - 0.4) / 3.0,
            _ => gone,
        };
        (share * of as f64) as u64
    }

    /// From a tenth of the whole on, what is left is known within a factor of two.
    #[test]
    fn unlike_bakes_are_foretold() {
        for stages in [&WING[..], &BOXES, &BUSHES, &MUSEUM] {
            let cells = stages.iter().find(|(stage, ..)| *stage == Stage::Visibility).unwrap().2;
            let mut forecast = Forecast::default();
            let all_s: f64 = stages.iter().map(|(_, seconds, _)| seconds).sum();
            let mut left_s = all_s;
            for &(stage, seconds, of) in stages {
                for part in 0..10 {
                    let gone = f64::from(part) / 10.0;
                    let rest_s = forecast.rest_s(now(stage, gone * seconds, done(stage, gone, of), of));
                    let real_s = left_s - gone * seconds;
                    if real_s < 0.9 * all_s && stage < Stage::Publish {
                        let ratio = rest_s.expect("a glance has told") / real_s;
                        assert!((0.5..2.0).contains(&ratio), "{stage} {part}: {ratio}");
                    }
                }
                left_s -= seconds;
                forecast.end(now(stage, seconds, of, of));
                if stage == Stage::Glance {
                    forecast.expect(Stage::Visibility, cells);
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
        // 90 s of looks, and a tenth of all 120 s for writing.
        assert!((100.0..105.0).contains(&rest_s), "{rest_s}");
    }

    #[test]
    fn what_comes_after_the_last_step_makes_no_look_longer() {
        let forecast = Forecast::default();
        let rest_s = |seconds: f64| {
            let stepping_s = 10.0;
            let now = Now {
                stepping_s,
                ..now(Stage::Glance, seconds, 1000, 1000)
            };
            forecast.rest_s(now).unwrap()
        };
        assert_eq!(rest_s(10.0), rest_s(40.0));
    }

    #[test]
    fn a_stage_that_is_slow_to_begin_is_not_foretold_to_take_hours() {
        let mut forecast = Forecast::default();
        for &(stage, seconds, of) in &WING[..5] {
            forecast.end(now(stage, seconds, of, of));
            forecast.expect(Stage::Visibility, 312);
        }
        let guess_s = forecast.rest_s(now(Stage::Publish, 0.0, 0, 936)).unwrap();
        for (seconds, done) in [(5.0, 0), (20.0, 0), (20.0, 3)] {
            let rest_s = forecast.rest_s(now(Stage::Publish, seconds, done, 936)).unwrap();
            assert!(rest_s <= 2.0 * guess_s.max(seconds), "{rest_s} s after {seconds} s");
        }
    }
}
