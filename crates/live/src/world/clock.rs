//! When was a pose true, in our clock? Its sender stamps it with a clock of its own, of which only differences count.
//!
//! A pose came with the least delay where our clock is ahead of the sender's by the least, so the offset between the clocks is
//! the least of the last few seconds: the clock filter of NTP (RFC 5905, section 10), one way only. So jitter of the network does
//! not look like motion, no pose is of the future, and a clock that was put forward counts at once. One that stood still, runs
//! slow or was put back a little is found out as soon as all that came before has left the window. One that goes on from an
//! earlier time is told from poses that were overtaken by how it goes: as long for its sender as for us.

use crate::Ms;

/// The window is the block of time in which the last pose came, and the one before in which any did.
const BLOCK_MS: Ms = 2_000;
/// What came in a block longer ago says nothing of how the clocks stand now.
const MOST_BLOCKS: Ms = 15;
/// A clock that goes back by more than this was set anew: no pose is so long on its way.
const SET_BACK_MS: Ms = 60_000;
/// A clock that goes on for so long from an earlier time was set anew.
const GOES_ON_MS: Ms = 500;
/// One that has gone further meanwhile, or less far, was set once more, or poses were held up.
const MOST_OFF_MS: Ms = 1_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct SenderClock {
    ahead: Least,
    /// None while the sender goes by our clock.
    theirs_ms: Option<Ms>,
    ours_ms: Ms,
    /// Poses of an earlier time that have come since the last one that counted.
    back: Option<Back>,
}

/// By how much our clock is ahead: the least in the window.
#[derive(Debug, Clone, Copy)]
struct Least {
    block: Ms,
    ms: Ms,
    /// Of the block before.
    before_ms: Option<Ms>,
}

impl Least {
    fn of(ahead_ms: Ms, now_ms: Ms) -> Self {
        Self {
            block: now_ms.div_euclid(BLOCK_MS),
            ms: ahead_ms,
            before_ms: None,
        }
    }

    fn take(&mut self, ahead_ms: Ms, now_ms: Ms) {
        let new = Self::of(ahead_ms, now_ms);
        *self = match new.block - self.block {
            0 => Self {
                ms: self.ms.min(ahead_ms),
                ..*self
            },
            1..=MOST_BLOCKS => Self {
                before_ms: Some(self.ms),
                ..new
            },
            _ => new,
        };
    }

    fn ms(&self) -> Ms {
        self.before_ms.map_or(self.ms, |before_ms| before_ms.min(self.ms))
    }
}

/// Times before the last one that counted.
#[derive(Debug, Clone, Copy)]
struct Back {
    /// In their clock and in ours.
    first_ms: (Ms, Ms),
    /// The latest of them.
    last_ms: Ms,
}

impl Back {
    /// How far it has gone by its own time, and by how much that differs from ours.
    fn gone_ms(&self, now_ms: Ms) -> (Ms, Ms) {
        let theirs_ms = self.last_ms - self.first_ms.0;
        (theirs_ms, (theirs_ms - (now_ms - self.first_ms.1)).abs())
    }

    /// Whether this is a clock, and not what comes all at once because it was held up.
    fn goes_on(&self, now_ms: Ms) -> bool {
        let (gone_ms, off_ms) = self.gone_ms(now_ms);
        gone_ms >= GOES_ON_MS && 2 * off_ms <= gone_ms
    }
}

impl SenderClock {
    /// `t_ms` is the sender's time now; who has sent none so far goes by our clock.
    pub(super) fn new(t_ms: Option<Ms>, now_ms: Ms) -> Self {
        Self {
            ahead: Least::of(now_ms - t_ms.unwrap_or(now_ms), now_ms),
            theirs_ms: t_ms,
            ours_ms: now_ms,
            back: None,
        }
    }

    /// The last time that was read, in the sender's clock.
    pub(super) fn last_ms(&self) -> Ms {
        self.theirs_ms.unwrap_or(self.ours_ms)
    }

    /// Our time of theirs; none when it is before the last one. What comes without a time is true now.
    pub(super) fn read(&mut self, t_ms: Option<Ms>, now_ms: Ms) -> Option<Ms> {
        let Some(theirs_ms) = t_ms else {
            self.ours_ms = self.ours_ms.max(now_ms);
            return Some(self.ours_ms);
        };
        let ahead_ms = now_ms - theirs_ms;
        let goes_on = self.theirs_ms.is_some_and(|last_ms| theirs_ms >= last_ms);
        let goes_back = |last_ms| (last_ms - SET_BACK_MS..last_ms).contains(&theirs_ms);
        if self.theirs_ms.is_some_and(goes_back) && !self.goes_on_from(theirs_ms, now_ms) {
            return None;
        }
        if goes_on {
            self.ahead.take(ahead_ms, now_ms);
        } else {
            self.ahead = Least::of(ahead_ms, now_ms);
        }
        self.back = None;
        self.theirs_ms = Some(theirs_ms);
        self.ours_ms = self.ours_ms.max(theirs_ms + self.ahead.ms());
        Some(self.ours_ms)
    }

    /// Whether a clock that goes back has gone on from there since.
    fn goes_on_from(&mut self, theirs_ms: Ms, now_ms: Ms) -> bool {
        let begun = self.back.filter(|back| back.first_ms.0 <= theirs_ms);
        let fresh = Back {
            first_ms: (theirs_ms, now_ms),
            last_ms: theirs_ms,
        };
        let on = begun.map(|back| Back {
            last_ms: back.last_ms.max(theirs_ms),
            ..back
        });
        let back = on.filter(|back| back.gone_ms(now_ms).1 <= MOST_OFF_MS).unwrap_or(fresh);
        self.back = Some(back);
        back.goes_on(now_ms)
    }

    /// Their time of ours.
    pub(super) fn theirs(&self, ours_ms: Ms) -> Ms {
        ours_ms - self.ahead.ms()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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
    fn a_clock_may_be_shown_late_and_now_and_then() {
        let mut clock = SenderClock::new(None, 1_000_000);
        assert_eq!(clock.read(None, 1_000_100), Some(1_000_100));
        assert_eq!(clock.theirs(1_000_100), 1_000_100, "so far it is ours");
        assert_eq!(clock.read(Some(5), 1_000_200), Some(1_000_200));
        assert_eq!(clock.read(Some(105), 1_000_300), Some(1_000_300));
        assert_eq!(clock.read(Some(104), 1_000_300), None);
        assert_eq!(clock.read(None, 1_000_350), Some(1_000_350));
        assert_eq!(clock.theirs(1_000_350), 155, "it is theirs from the first time on");
        assert_eq!(clock.read(Some(110), 1_000_360), Some(1_000_350));
    }

    #[test]
    fn a_clock_that_stood_still_is_found_out_and_one_late_pose_is_not_taken_for_that() {
        let mut clock = SenderClock::new(Some(0), 1_000_000);
        let mut pose = |t_ms, now_ms| now_ms - clock.read(Some(t_ms), now_ms).unwrap();
        assert_eq!(pose(100, 1_000_900), 800, "late");
        assert_eq!(pose(1_000, 1_001_000), 0);
        // Ten seconds pass in a moment.
        let ages: Vec<_> = (11..70).map(|i| pose(100 * i, 1_010_000 + 100 * i)).collect();
        assert_eq!((ages[0], ages.last()), (10_000, Some(&0)));
        assert!(ages.iter().filter(|age| **age > 0).count() <= 20, "{ages:?}");
    }

    #[test]
    fn a_clock_that_goes_on_from_an_earlier_time_counts_and_poses_that_were_overtaken_do_not() {
        let mut clock = SenderClock::new(Some(20_000), 1_000_000);
        let overtaken = (0..20).filter_map(|i| clock.read(Some(12_000 + 100 * i), 1_000_100 + i));
        assert_eq!(overtaken.count(), 0);
        assert_eq!(clock.read(Some(20_200), 1_000_200), Some(1_000_200));
        let set_back: Vec<_> = (0..10)
            .map(|i| clock.read(Some(12_300 + 100 * i), 1_000_300 + 100 * i))
            .collect();
        assert_eq!(set_back.iter().filter(|read| read.is_none()).count(), 5);
        assert_eq!(set_back[5..].iter().flatten().max(), Some(&1_001_200));
    }

    proptest! {
        /// A sender speaks each `pause_ms`; its clock is set now and then, and each pose is up to `most_ms` on its way.
        #[test]
        fn whatever_becomes_of_a_clock_nothing_is_told_late_for_long_nor_of_the_future(
            pause_ms in 20..400i64,
            most_ms in 0..500i64,
            sent in prop::collection::vec((0.0..1.0f64, prop_oneof![30 => Just(0), 1 => -100_000..100_000i64]), 2..400),
        ) {
            let (mut theirs_ms, mut set_ms, mut poses) = (0, 0, Vec::new());
            for (i, (delay, set_by_ms)) in (0..).zip(sent) {
                let true_ms = 1_000_000 + pause_ms * i;
                theirs_ms += pause_ms + set_by_ms;
                set_ms = if set_by_ms == 0 { set_ms } else { true_ms };
                poses.push((true_ms + (delay * most_ms as f64) as Ms, theirs_ms, set_ms));
            }
            poses.sort_by_key(|(now_ms, ..)| *now_ms);
            let mut clock: Option<SenderClock> = None;
            let (mut told_ms, mut heard_ms) = (0, 0);
            for (now_ms, theirs_ms, set_ms) in poses {
                let read = match &mut clock {
                    Some(clock) => clock.read(Some(theirs_ms), now_ms),
                    None => {
                        clock = Some(SenderClock::new(Some(theirs_ms), now_ms));
                        Some(now_ms)
                    }
                };
                if let Some(read_ms) = read {
                    prop_assert!((told_ms..=now_ms).contains(&read_ms), "{read_ms} at {now_ms}");
                    // Until it is taken for set anew, and then for a window.
                    let found_ms = set_ms + 2 * BLOCK_MS + GOES_ON_MS + MOST_OFF_MS + 3 * most_ms + 2 * pause_ms;
                    let late_ms = now_ms - read_ms;
                    prop_assert!(late_ms <= most_ms || now_ms < found_ms, "{late_ms} late at {now_ms}, set at {set_ms}");
                    (told_ms, heard_ms) = (read_ms, now_ms);
                }
                let silent_ms = now_ms - heard_ms.max(set_ms);
                prop_assert!(silent_ms <= GOES_ON_MS + MOST_OFF_MS + 4 * most_ms + 2 * pause_ms, "{silent_ms} refused");
            }
        }
    }
}
