//! How does a sender's clock stand beside ours? It may drift, stand still or be set, so only what came lately says that: of the poses
//! of the last seconds the one that was fastest on its way had the least delay.
//!
//! The server's rules follow a clock within as long (`belvedere_live`, `world/clock.rs`), by blocks of time; what counts there
//! counts here, and hardly more, so that no clock excuses for long what it did once.

use std::collections::VecDeque;

use belvedere_live::Ms;

/// A clock that goes back by more than this was set anew.
const SET_BACK_MS: Ms = 60_000;
/// What came so long ago says nothing of how clocks stand now …
const WINDOW_MS: Ms = 4_000;
/// … unless little has come since: a pose longer ago than this is looked at too, with what came so shortly before it …
const PAUSE_MS: Ms = 2_000;
/// … if it was no longer ago than this.
const LONGEST_PAUSE_MS: Ms = 32_000;
/// Clocks are read to the millisecond.
const CLOCK_MS: Ms = 2;

/// A sender's clock.
#[derive(Debug, Clone, Default)]
pub(super) struct Clock {
    last_ms: Option<Ms>,
    ahead: VecDeque<Ahead>,
}

/// How far our clock was ahead of the sender's by a pose that came.
#[derive(Debug, Clone, Copy)]
struct Ahead {
    came_ms: Ms,
    ms: Ms,
}

impl Clock {
    /// When something was true at the earliest, in our clock, that comes now.
    pub(super) fn earliest_ms(&mut self, t_ms: Option<Ms>, now_ms: Ms) -> Ms {
        let Some(t_ms) = t_ms else {
            return now_ms - CLOCK_MS;
        };
        if self.last_ms.is_some_and(|last_ms| t_ms < last_ms - SET_BACK_MS) {
            self.ahead.clear();
        }
        self.last_ms = Some(t_ms);
        let before = self.ahead.iter().rev().find(|ahead| ahead.came_ms <= now_ms - PAUSE_MS);
        let since_ms = before.map_or(now_ms, |ahead| ahead.came_ms.max(now_ms - LONGEST_PAUSE_MS) - PAUSE_MS);
        let since_ms = since_ms.min(now_ms - WINDOW_MS);
        while self.ahead.pop_front_if(|ahead| ahead.came_ms < since_ms).is_some() {}
        let ms = now_ms - t_ms;
        self.ahead.push_back(Ahead { came_ms: now_ms, ms });
        let least_ms = self.ahead.iter().fold(ms, |least, ahead| least.min(ahead.ms));
        t_ms + least_ms - CLOCK_MS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How old a pose may be at most that comes now, but for how clocks are read, by a clock that is so far behind ours.
    fn oldest_ms(clock: &mut Clock, now_ms: Ms, behind_ms: Ms) -> Ms {
        now_ms - clock.earliest_ms(Some(now_ms - behind_ms), now_ms) - CLOCK_MS
    }

    #[test]
    fn what_was_longer_on_its_way_than_others_is_as_much_older() {
        let mut clock = Clock::default();
        let delays = [0, 30, 10, 80].into_iter().zip(1..);
        let ages = delays.map(|(late_ms, i)| oldest_ms(&mut clock, 1_000 * i, 500 + late_ms));
        assert_eq!(ages.collect::<Vec<_>>(), [0, 30, 10, 80]);
        assert_eq!(clock.earliest_ms(None, 9_000), 9_000 - CLOCK_MS, "true when it comes");
    }

    #[test]
    fn a_clock_that_stood_still_excuses_nothing_after_four_seconds() {
        let mut clock = Clock::default();
        oldest_ms(&mut clock, 10_000, 1_000);
        let ages = (1..=60).map(|i| (100 * i, oldest_ms(&mut clock, 10_000 + 100 * i, 11_000)));
        let (excused, followed): (Vec<_>, Vec<_>) = ages.partition(|(_, age_ms)| *age_ms > 0);
        assert_eq!(excused.last(), Some(&(4_000, 10_000)));
        assert_eq!(followed.first(), Some(&(4_100, 0)));
    }

    #[test]
    fn a_clock_that_runs_slow_is_followed() {
        let mut clock = Clock::default();
        // A hundredth slower than ours.
        let ages = (0..300).map(|i| oldest_ms(&mut clock, 200 * i, 2 * i));
        assert_eq!(ages.max(), Some(40), "what it loses in four seconds");
    }

    #[test]
    fn of_who_speaks_seldom_the_pose_before_counts_and_none_before_that() {
        let mut clock = Clock::default();
        for (now_ms, behind_ms, age_ms) in [(1_000, 1_000, 0), (11_000, 9_000, 8_000), (21_000, 9_050, 50)] {
            assert_eq!(oldest_ms(&mut clock, now_ms, behind_ms), age_ms, "{now_ms}");
        }
        assert_eq!(
            oldest_ms(&mut clock, 81_000, 20_000),
            0,
            "nobody knows what became of it in a minute"
        );
    }

    #[test]
    fn a_clock_that_was_set_back_far_counts_at_once() {
        let mut clock = Clock::default();
        oldest_ms(&mut clock, 100_000, 0);
        assert_eq!(
            oldest_ms(&mut clock, 100_100, 59_000),
            59_000,
            "it may have been overtaken"
        );
        assert_eq!(oldest_ms(&mut clock, 100_200, 120_000), 0);
    }
}
