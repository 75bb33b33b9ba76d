//! How long is waited for what may not come? Ever less, the more was waited for in vain. A visitor has so many seconds for what never
//! comes: each wait takes a share of what is left of them, and each answer gives some back, as retry budgets do (Finagle, gRPC), but in
//! time, which is what a failure costs. So one file is given all the time that it may need, and a tree of which a third is broken is
//! walked through nearly as fast as one that is whole. Who is short of patience still waits for an answer as long as answers were found
//! to take, by their smoothed time and its deviation (Jacobson, *Congestion Avoidance and Control*, 1988; RFC 6298). Who hears nothing at
//! all asks now and then (a circuit breaker: Nygard, *Release It!*, 2007).

use std::{
    sync::{Mutex, MutexGuard},
    time::Duration,
};

use tokio::time::Instant;

/// To be waited in vain at first, and at most.
const MOST: Duration = Duration::from_secs(16);
/// What an answer that came gives back.
const EARNED: Duration = Duration::from_millis(30);
/// One wait takes no more than this part of what is left.
const SHARE: u32 = 4;
/// No answer is waited for less …
const LEAST_GRACE: Duration = Duration::from_millis(200);
/// … or more.
const MOST_GRACE: Duration = Duration::from_secs(30);
/// After each answer that was waited for in vain, the next is waited for longer by this, until one comes: the line may have become slower.
const SLOWER: f64 = 1.5;
/// Who has waited so long since the last answer began, and heard nothing, asks no more …
const MOST_SILENCE: Duration = Duration::from_secs(30);
/// … but once in this time.
const ASKS_AGAIN: Duration = Duration::from_secs(2);

/// What is left of a visitor's patience.
#[derive(Debug, Default)]
pub(super) struct Patience {
    state: Mutex<State>,
}

#[derive(Debug, Clone, Copy, Default)]
struct State {
    /// What was waited in vain.
    spent: Duration,
    /// How long it takes until an answer begins: smoothed, and its mean deviation.
    begins: Option<(Duration, Duration)>,
    /// Answers in a row that did not begin in time, how long they were waited for, and when the last was given up.
    silent: i32,
    silence: Duration,
    silent_at: Option<Instant>,
}

impl State {
    fn left(&self, spent: Duration) -> Duration {
        MOST.saturating_sub(self.spent + spent)
    }

    /// Somebody answers.
    fn hears(&mut self) {
        (self.silent, self.silence) = (0, Duration::ZERO);
    }

    fn hopes(&self) -> bool {
        let is_due = self.silent_at.is_none_or(|at| at.elapsed() >= ASKS_AGAIN);
        self.silence < MOST_SILENCE || is_due
    }
}

impl Patience {
    /// How long to wait until an answer begins, after so much was spent on its request.
    pub(super) fn grace(&self, spent: Duration) -> Duration {
        self.usual().max(self.state().left(spent) / SHARE)
    }

    /// How long that takes at most where an answer comes. As long as none ever came, nobody knows what is long.
    pub(super) fn usual(&self) -> Duration {
        let state = self.state();
        let Some((smoothed, deviation)) = state.begins else {
            return MOST_GRACE;
        };
        let usual = (smoothed + 4 * deviation).max(LEAST_GRACE);
        usual.mul_f64(SLOWER.powi(state.silent.min(20))).min(MOST_GRACE)
    }

    /// Whether so long may be waited before a request is tried again, after so much was spent on it.
    pub(super) fn bears(&self, wait: Duration, spent: Duration) -> bool {
        wait <= self.state().left(spent) / SHARE
    }

    /// An answer that came began after a time.
    pub(super) fn came(&self, begins: Duration) {
        let mut state = self.state();
        state.hears();
        state.spent = state.spent.saturating_sub(EARNED);
        let (smoothed, deviation) = match state.begins {
            Some((smoothed, deviation)) => (
                (7 * smoothed + begins) / 8,
                (3 * deviation + smoothed.abs_diff(begins)) / 4,
            ),
            None => (begins, begins / 2),
        };
        state.begins = Some((smoothed, deviation));
    }

    /// An answer was given up that had not begun after a time.
    pub(super) fn hears_nothing(&self, waited: Duration) {
        let mut state = self.state();
        state.silent += 1;
        state.silence += waited;
        state.silent_at = Some(Instant::now());
    }

    /// Somebody answered, though not with what was asked for.
    pub(super) fn hears(&self) {
        self.state().hears();
    }

    /// Whether it makes sense to ask now. Who hears nothing for long may ask once in a while.
    pub(super) fn hopes(&self) -> bool {
        self.state().hopes()
    }

    /// The same for who asks now: of several that may ask once in a while, one does.
    pub(super) fn takes_turn(&self) -> bool {
        let mut state = self.state();
        let hopes = state.hopes();
        if hopes && state.silence >= MOST_SILENCE {
            state.silent_at = Some(Instant::now());
        }
        hopes
    }

    /// So much was spent on a request, and nothing came of it.
    pub(super) fn spend(&self, spent: Duration) {
        let mut state = self.state();
        state.spent = (state.spent + spent).min(MOST);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("nothing panics while it holds this lock")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn waits_get_shorter_down_to_what_answers_take_and_answers_give_patience_back() {
        let patience = Patience::default();
        assert_eq!(patience.grace(Duration::ZERO), MOST_GRACE, "nobody knows what is long");
        (0..50).for_each(|_| patience.came(ms(2)));
        assert_eq!(patience.grace(Duration::ZERO), MOST / SHARE);
        assert_eq!(patience.grace(MOST), LEAST_GRACE);
        let mut waited = Duration::ZERO;
        for _ in 0..100 {
            let grace = patience.grace(Duration::ZERO);
            patience.spend(grace);
            waited += grace;
        }
        assert!(waited < MOST + 100 * LEAST_GRACE, "{waited:?}");
        assert!(!patience.bears(ms(1), Duration::ZERO));
        (0..10).for_each(|_| patience.came(ms(2)));
        assert!(patience.bears(10 * EARNED / SHARE, Duration::ZERO) && !patience.bears(ms(76), Duration::ZERO));
    }

    #[test]
    fn a_slow_line_is_waited_for_as_long_as_it_takes() {
        let patience = Patience::default();
        (0..50).for_each(|_| patience.came(ms(3000)));
        patience.spend(MOST);
        let usual = patience.grace(Duration::ZERO);
        assert!(usual > ms(2999), "{usual:?}");
        // It may have become slower since: then nothing comes until one waits longer.
        patience.hears_nothing(usual);
        assert_eq!(patience.grace(Duration::ZERO), usual.mul_f64(SLOWER));
        (0..20).for_each(|_| patience.hears_nothing(usual));
        assert_eq!(patience.grace(Duration::ZERO), MOST_GRACE);
        patience.came(ms(3000));
        assert!(patience.grace(Duration::ZERO) < 2 * usual);
    }

    #[tokio::test(start_paused = true)]
    async fn who_hears_nothing_for_long_asks_once_in_a_while_until_somebody_answers() {
        let patience = Patience::default();
        patience.came(ms(2));
        patience.hears_nothing(MOST_SILENCE - ms(1));
        assert!(patience.hopes());
        patience.hears_nothing(ms(1));
        assert!(!patience.hopes());
        tokio::time::advance(ASKS_AGAIN).await;
        assert!(patience.hopes() && patience.takes_turn());
        assert!(!patience.hopes() && !patience.takes_turn(), "one of several asks");
        tokio::time::advance(ASKS_AGAIN).await;
        patience.hears_nothing(ms(200));
        assert!(!patience.hopes());
        patience.hears();
        assert!(patience.hopes());
    }
}
