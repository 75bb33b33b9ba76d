//! What does a walk among objects with levels send?

use belvedere_live::aoi::Aoi;

use crate::papers::schmalstieg::FRAMES;

/// Radius of the area of interest; what leaves goes further.
const AOI: Aoi = Aoi {
    enter_m: 100.0,
    leave_m: 105.0,
};
/// Metres in a frame, and the largest turn.
const STEP_M: f64 = 2.0;
const TURN_RAD: f64 = 0.06;
/// Objects in an area of interest, on average.
pub(super) const OBJECTS_IN_AREA: f64 = 60.0;
/// Walks of each row.
pub(super) const WALKS: u64 = 20;
/// What a kind of object costs: its levels' bytes, finest first.
#[derive(Debug, Clone, Default)]
pub(super) struct Ladder {
    /// Each fetched by itself, or …
    pub(super) bytes: Vec<f64>,
    /// … each the beginning of the finer ones.
    pub(super) nested: bool,
}

impl Ladder {
    pub(super) fn complete(&self) -> f64 {
        if self.nested {
            self.bytes[0]
        } else {
            self.bytes.iter().sum()
        }
    }

    /// What it takes to have a level when a coarser one is there, or none.
    fn cost(&self, level: usize, held: Option<usize>) -> f64 {
        let held = held.filter(|_| self.nested).map_or(0.0, |held| self.bytes[held]);
        self.bytes[level] - held
    }

    /// The level of a distance: equal zones.
    fn wanted(&self, distance_m: f64) -> usize {
        let zone = distance_m / AOI.enter_m * self.bytes.len() as f64;
        (zone as usize).min(self.bytes.len() - 1)
    }

    /// Sizes ∝ 1/x, the finest 1.
    pub(super) fn of_thesis(levels: usize) -> Self {
        Self {
            bytes: (1..=levels).map(|x| 1.0 / x as f64).collect(),
            nested: false,
        }
    }
}

/// Splitmix64, as numbers from 0 to 1.
fn unit(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Bytes of each frame, with levels and complete; the visitor's first area is frame 0.
pub(super) fn walk(kinds: &[Ladder], seed: u64) -> Vec<[f64; 2]> {
    let mut random = seed;
    // No way leads out of this square.
    let half_m = FRAMES as f64 * STEP_M + AOI.leave_m;
    let density = OBJECTS_IN_AREA / (std::f64::consts::PI * AOI.enter_m * AOI.enter_m);
    let count = (4.0 * half_m * half_m * density) as usize;
    let objects: Vec<[f64; 2]> = (0..count)
        .map(|_| [0; 2].map(|_| half_m * (2.0 * unit(&mut random) - 1.0)))
        .collect();
    let mut held: Vec<Option<usize>> = vec![None; count];
    let ([mut x, mut z], mut heading) = ([0.0, 0.0], std::f64::consts::TAU * unit(&mut random));
    let mut frames = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        let mut sent = [0.0; 2];
        for (i, (object, held)) in objects.iter().zip(&mut held).enumerate() {
            let distance_m = (object[0] - x).hypot(object[1] - z);
            // What is outside was never inside since: no stay is too short here.
            if !AOI.holds(distance_m, held.map(|_| 0), 1, 0) {
                *held = None;
                continue;
            }
            let kind = &kinds[i % kinds.len()];
            let wanted = kind.wanted(distance_m);
            if held.is_none() {
                sent[1] += kind.complete();
            }
            if held.is_none_or(|held| wanted < held) {
                sent[0] += kind.cost(wanted, *held);
                *held = Some(wanted);
            }
        }
        frames.push(sent);
        heading += TURN_RAD * (2.0 * unit(&mut random) - 1.0);
        x += STEP_M * heading.cos();
        z += STEP_M * heading.sin();
    }
    frames
}

/// Sent with levels and complete, over all walks.
pub(super) fn sums(kinds: &[Ladder]) -> Vec<[f64; 2]> {
    let sum = |frames: Vec<[f64; 2]>| frames.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    (0..WALKS).map(|seed| sum(walk(kinds, seed))).collect()
}

pub(super) fn total(sums: &[[f64; 2]], i: usize) -> f64 {
    sums.iter().map(|sums| sums[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_among_the_theses_objects_cost_what_the_theory_says_but_at_their_ends() {
        let kinds = [Ladder::of_thesis(6)];
        let sent: Vec<_> = (0..4).flat_map(|seed| walk(&kinds, seed)).collect();
        let share = total(&sent, 0) / total(&sent, 1);
        let theory = 1.0 / (1.0 + 0.5 + 1.0 / 3.0 + 0.25 + 0.2 + 1.0 / 6.0);
        // Objects amid which a walk begins, or ends, were not passed wholly: they cost less.
        assert!(share < theory && share > 0.85 * theory, "{share} {theory}");
    }

    #[test]
    fn a_nested_ladder_costs_only_what_is_new() {
        let ladder = Ladder {
            bytes: vec![100.0, 40.0, 10.0],
            nested: true,
        };
        assert_eq!(
            (ladder.complete(), ladder.cost(0, Some(1)), ladder.cost(1, None)),
            (100.0, 60.0, 40.0)
        );
        let apart = Ladder {
            nested: false,
            ..ladder
        };
        assert_eq!((apart.complete(), apart.cost(0, Some(1))), (150.0, 100.0));
        assert_eq!([0.0, 34.0, 99.0, 104.0].map(|d| apart.wanted(d)), [0, 1, 2, 2]);
    }
}
