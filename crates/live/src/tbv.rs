//! Where is a hidden mover guaranteed to be, and for how long?
//!
//! Temporal bounding volumes (Sudarsky & Gotsman, *Output-Sensitive Rendering and Communication in Dynamic Virtual
//! Environments*, §2.2): a volume that surely holds a mover until it expires. While it is hidden, so is the mover, and
//! nobody needs to hear of it. Here it is a ball, from the largest speed that the mover's owner has promised, or from how it
//! moves and the largest acceleration; a mover with a known trajectory has boxes along its way instead
//! ([`crate::motion::Trajectory::swept`]).
//!
//! How large one is adapts, as in the paper: larger when it expired unseen or was left, smaller when it was exposed before.
//! Hence a mover in a far corner costs ever less, and one at a door is not put away in vain.

use serde::Serialize;

use crate::{
    Ms,
    cells::{Ball, distance_m},
};

/// A ball that holds a mover until it expires. Its times are those of whoever reads it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tbv {
    /// The middle of the ball.
    pub center: [f64; 3],
    /// Its radius, the mover's own size not included: where the mover's position is.
    pub radius_m: f64,
}

impl Tbv {
    /// Where a mover that was somewhere `elapsed_ms` ago can be by now.
    #[must_use]
    pub fn around(position: [f64; 3], max_speed_mps: f64, elapsed_ms: Ms) -> Self {
        Self {
            center: position,
            radius_m: max_speed_mps * elapsed_ms.max(0) as f64 * 1e-3,
        }
    }

    /// Where a mover that moved like this `elapsed_ms` ago can be by now when it changes its velocity only so fast, or has
    /// been meanwhile.
    #[must_use]
    pub fn ahead(position: [f64; 3], velocity: [f64; 3], max_acceleration_mps2: f64, elapsed_ms: Ms) -> Self {
        let elapsed_s = elapsed_ms.max(0) as f64 * 1e-3;
        // Half of the way straight on is the middle; what acceleration adds grows up to the end.
        let half_way: [f64; 3] = velocity.map(|mps| 0.5 * elapsed_s * mps);
        Self {
            center: std::array::from_fn(|axis| position[axis] + half_way[axis]),
            radius_m: distance_m(half_way, [0.0; 3]) + 0.5 * max_acceleration_mps2 * elapsed_s * elapsed_s,
        }
    }

    /// Everything that a mover of this size may touch.
    #[must_use]
    pub fn grown(&self, radius_m: f64) -> Ball {
        Ball {
            center: self.center,
            radius_m: self.radius_m + radius_m,
        }
    }

    /// Whether a mover at this position keeps the promise.
    #[must_use]
    pub fn holds(&self, position: [f64; 3]) -> bool {
        self.grown(0.0).holds(position)
    }
}

/// How large the next volume of a mover is: so large that the mover, as fast as it can, comes to its border in this time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Validity {
    ms: Ms,
    longest_ms: Ms,
}

impl Validity {
    /// A shorter volume is not worth its bookkeeping.
    pub const SHORTEST_MS: Ms = 250;
    const FIRST_MS: Ms = 2_000;

    /// Never above `longest_ms`.
    #[must_use]
    pub fn new(longest_ms: Ms) -> Self {
        let longest_ms = longest_ms.max(Self::SHORTEST_MS);
        Self {
            ms: Self::FIRST_MS.min(longest_ms),
            longest_ms,
        }
    }

    /// What the next volume should be.
    #[must_use]
    pub fn ms(&self) -> Ms {
        self.ms
    }

    /// The last volume expired unseen, or was left.
    pub fn lengthen(&mut self) {
        self.ms = (2 * self.ms).min(self.longest_ms);
    }

    /// A volume of this size was the largest that would do.
    pub fn fit(&mut self, ms: Ms) {
        self.ms = self.ms.min(ms).max(Self::SHORTEST_MS);
    }

    /// The last volume was exposed.
    pub fn shorten(&mut self) {
        self.ms = (self.ms / 2).max(Self::SHORTEST_MS);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn validity_adapts_between_its_limits() {
        let mut validity = Validity::new(10_000);
        for expected in [4_000, 8_000, 10_000, 10_000] {
            validity.lengthen();
            assert_eq!(validity.ms(), expected);
        }
        (0..20).for_each(|_| validity.shorten());
        assert_eq!(validity.ms(), Validity::SHORTEST_MS);
    }

    proptest! {
        #[test]
        fn a_volume_holds_whoever_keeps_to_the_acceleration(
            velocity in prop::array::uniform3(-20.0..20.0f64),
            pushes in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..30),
        ) {
            const STEP_S: f64 = 0.1;
            let most_mps2 = 3.0;
            let tbv = Tbv::ahead([5.0, 6.0, 7.0], velocity, most_mps2, 100 * pushes.len() as Ms);
            let (mut position, mut velocity) = ([5.0, 6.0, 7.0], velocity);
            for push in pushes {
                let length = distance_m(push, [0.0; 3]).max(1e-9);
                for axis in 0..3 {
                    let acceleration = most_mps2 * push[axis] / length;
                    position[axis] += STEP_S * (velocity[axis] + 0.5 * STEP_S * acceleration);
                    velocity[axis] += STEP_S * acceleration;
                }
                let away_m = distance_m(tbv.center, position);
                prop_assert!(away_m <= tbv.radius_m + 1e-9, "{away_m} of {}", tbv.radius_m);
            }
        }
    }

    #[test]
    fn a_volume_holds_whoever_keeps_to_the_speed() {
        let tbv = Tbv::around([1.0, 0.0, 0.0], 2.0, 3_000);
        assert!(tbv.holds([7.0, 0.0, 0.0]) && !tbv.holds([7.1, 0.0, 0.0]));
        assert_eq!(tbv.grown(0.5).radius_m, 6.5);
    }
}
