//! How often, and how much, is a session told?
//!
//! A mover is told of again when what the session extrapolates has gone wrong by more than what shows at that distance,
//! and not more often than that distance deserves. What is due competes for the session's bytes: priority accumulates
//! while something waits, so that nothing starves.

use crate::Ms;

/// A supply that refills at a constant rate up to a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bucket {
    filled: f64,
    limit: f64,
    per_s: f64,
    at_ms: Ms,
}

impl Bucket {
    /// A full bucket.
    #[must_use]
    pub fn full(limit: f64, per_s: f64, now_ms: Ms) -> Self {
        Self {
            filled: limit,
            limit,
            per_s,
            at_ms: now_ms,
        }
    }

    fn refill(&mut self, now_ms: Ms) {
        let elapsed_s = (now_ms - self.at_ms).max(0) as f64 * 1e-3;
        self.filled = (self.filled + elapsed_s * self.per_s).min(self.limit);
        self.at_ms = self.at_ms.max(now_ms);
    }

    /// Takes some, if there is as much.
    pub fn take(&mut self, amount: f64, now_ms: Ms) -> bool {
        self.refill(now_ms);
        let enough = self.filled >= amount;
        if enough {
            self.filled -= amount;
        }
        enough
    }

    /// How long until there is as much.
    #[must_use]
    pub fn wait_ms(&self, amount: f64) -> Ms {
        ((amount - self.filled).max(0.0) / self.per_s * 1e3).ceil() as Ms
    }
}

/// The error in metres that does not show at a distance: half a centimetre, or a six-hundredth of the distance, which is
/// about two pixels of [`belvedere_scene::object::SCREEN_HEIGHT_PX`] lines.
#[must_use]
pub fn tolerance_m(distance_m: f64) -> f64 {
    (distance_m / 600.0).max(0.005)
}

/// The turn in radians that does not show.
pub const TOLERANCE_RAD: f64 = 0.05;

/// The shortest time between two updates of a mover: a tick nearby, and twice as long each time that the distance doubles
/// from 10 m on, up to sixteen ticks.
#[must_use]
pub fn period_ms(distance_m: f64, tick_ms: Ms) -> Ms {
    const DOUBLES_AT_M: [f64; 4] = [20.0, 40.0, 80.0, 160.0];
    let doublings = DOUBLES_AT_M.iter().filter(|at_m| distance_m >= **at_m).count();
    tick_ms << doublings
}

/// Of what is partly hidden one sees as little as of all of it from further away.
#[must_use]
pub fn as_far_m(distance_m: f64, visibility: f64) -> f64 {
    distance_m / visibility.clamp(1e-4, 1.0).sqrt()
}

/// What one tick adds to the priority of a mover that is due: about the share of the view that it fills.
#[must_use]
pub fn priority(distance_m: f64, radius_m: f64) -> f64 {
    let ratio = radius_m / distance_m.max(radius_m).max(0.1);
    (ratio * ratio).max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bucket_gives_no_more_than_its_rate() {
        let mut bucket = Bucket::full(10.0, 5.0, 0);
        let taken = (0..=10_000).filter(|now_ms| bucket.take(1.0, *now_ms)).count();
        assert_eq!(taken, 60, "ten at once and five a second");
        let mut bucket = Bucket::full(1.0, 5.0, 0);
        assert!(bucket.take(1.0, 0) && !bucket.take(1.0, 0));
        assert_eq!(bucket.wait_ms(1.0), 200);
    }

    #[test]
    fn periods_double_with_the_distance() {
        let periods = [1.0, 10.0, 19.0, 20.0, 45.0, 100.0, 1e9].map(|distance_m| period_ms(distance_m, 100));
        assert_eq!(periods, [100, 100, 100, 200, 400, 800, 1600]);
    }
}
