//! When was a pose true, in our clock? Its sender stamps it with a clock of its own, of which only differences count.
//!
//! The offset between the clocks is the smallest that was seen, since that pose travelled fastest; it may rise slowly,
//! because clocks drift. So jitter of the network does not look like motion, and no pose is of the future.

use crate::Ms;

/// Clocks drift by less than this.
const DRIFT: f64 = 5e-4;
/// A clock that goes back by more than this was set anew: no pose is so long on its way.
const SET_BACK_MS: Ms = 60_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct SenderClock {
    offset_ms: f64,
    read_at_ms: Ms,
    /// None while the sender goes by our clock.
    theirs_ms: Option<Ms>,
    ours_ms: Ms,
}

impl SenderClock {
    /// `t_ms` is the sender's time now; who has sent none so far goes by our clock.
    pub(super) fn new(t_ms: Option<Ms>, now_ms: Ms) -> Self {
        Self {
            offset_ms: (now_ms - t_ms.unwrap_or(now_ms)) as f64,
            read_at_ms: now_ms,
            theirs_ms: t_ms,
            ours_ms: now_ms,
        }
    }

    /// The last time that was read, in the sender's clock.
    pub(super) fn last_ms(&self) -> Ms {
        self.theirs_ms.unwrap_or(self.ours_ms)
    }

    /// Our time of theirs, which must not be before the last one.
    pub(super) fn read(&mut self, t_ms: Option<Ms>, now_ms: Ms) -> Option<Ms> {
        let t_ms = t_ms.or_else(|| self.theirs_ms.map(|_| self.theirs(now_ms)));
        let Some(theirs_ms) = t_ms else {
            self.ours_ms = self.ours_ms.max(now_ms);
            return Some(self.ours_ms);
        };
        self.offset_ms = match self.theirs_ms {
            Some(last_ms) if theirs_ms < last_ms - SET_BACK_MS => (now_ms - theirs_ms) as f64,
            Some(last_ms) if theirs_ms < last_ms => return None,
            Some(_) => {
                let drifted = self.offset_ms + DRIFT * (now_ms - self.read_at_ms) as f64;
                drifted.min((now_ms - theirs_ms) as f64)
            }
            None => (now_ms - theirs_ms) as f64,
        };
        self.read_at_ms = now_ms;
        self.theirs_ms = Some(theirs_ms);
        self.ours_ms = self.ours_ms.max((theirs_ms as f64 + self.offset_ms).floor() as Ms);
        Some(self.ours_ms)
    }

    /// Their time of ours.
    pub(super) fn theirs(&self, ours_ms: Ms) -> Ms {
        (ours_ms as f64 - self.offset_ms).round() as Ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_is_taken_out_and_time_never_runs_backwards() {
        let mut clock = SenderClock::new(Some(50), 1_000_000);
        assert_eq!(clock.read(Some(150), 1_000_180), Some(1_000_100), "eighty late");
        assert_eq!(
            clock.read(Some(250), 1_000_195),
            Some(1_000_195),
            "faster than any before"
        );
        assert_eq!(clock.read(Some(350), 1_000_400), Some(1_000_295));
        assert_eq!(clock.read(Some(349), 1_000_500), None);
        assert_eq!(clock.theirs(1_000_295), 350);
    }

    #[test]
    fn a_clock_that_was_far_ahead_locks_nobody_out() {
        let mut clock = SenderClock::new(Some(1_000), 1_000_000);
        assert_eq!(clock.read(Some(1 << 53), 1_000_100), Some(1_000_100));
        assert_eq!(clock.read(Some(1_200), 1_000_200), Some(1_000_200));
        assert_eq!(clock.read(Some(1_300), 1_000_310), Some(1_000_300));
        assert_eq!(clock.read(Some(1_299), 1_000_400), None);
    }

    #[test]
    fn a_clock_may_be_shown_late() {
        let mut clock = SenderClock::new(None, 1_000_000);
        assert_eq!(clock.read(None, 1_000_100), Some(1_000_100));
        assert_eq!(clock.theirs(1_000_100), 1_000_100, "so far it is ours");
        assert_eq!(clock.read(Some(5), 1_000_200), Some(1_000_200));
        assert_eq!(clock.read(Some(105), 1_000_300), Some(1_000_300));
        assert_eq!(clock.read(Some(104), 1_000_300), None);
    }
}
