//! How far does a participant look?
//!
//! An area of interest is a sphere with two radii (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §5.2): what comes
//! nearer than the one enters, what goes further than the larger one leaves, and nothing flickers in between. What has
//! entered also stays for a while, so that fast things that graze the sphere do not flicker either.

use serde::{Deserialize, Serialize};

use crate::Ms;

/// An area of interest around a participant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aoi {
    /// What is nearer enters.
    pub enter_m: f64,
    /// What is further away leaves; larger than `enter_m`.
    pub leave_m: f64,
}

impl Aoi {
    /// Whether both radii are finite and positive and the second is larger.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.enter_m > 0.0 && self.enter_m < self.leave_m && self.leave_m.is_finite()
    }

    /// Whether something at this distance is inside. `since_ms` is when it entered, if it is inside so far.
    #[must_use]
    pub fn holds(&self, distance_m: f64, since_ms: Option<Ms>, now_ms: Ms, shortest_stay_ms: Ms) -> bool {
        match since_ms {
            None => distance_m <= self.enter_m,
            Some(since_ms) => distance_m <= self.leave_m || now_ms - since_ms < shortest_stay_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_the_radii_everything_stays_as_it_is() {
        let aoi = Aoi {
            enter_m: 10.0,
            leave_m: 12.0,
        };
        let inside = |distance_m, since_ms| aoi.holds(distance_m, since_ms, 5_000, 1_000);
        assert!(inside(10.0, None) && !inside(11.0, None));
        assert!(inside(11.0, Some(0)) && !inside(12.5, Some(0)));
        assert!(inside(99.0, Some(4_500)), "too young to leave");
    }
}
