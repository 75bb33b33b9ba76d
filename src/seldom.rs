//! Is it time to say or try the same again? What goes wrong for everybody who asks is found anew each time; the log need not say so, nor the
//! catalogue be asked, as often.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

/// So long after it was said the same is not said again.
const PAUSE: Duration = Duration::from_secs(60);

/// What was said, or done, in the last minute. It forgets what is older as soon as something is added.
#[derive(Debug)]
pub(crate) struct Seldom<K>(BTreeMap<K, Instant>);

impl<K> Default for Seldom<K> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<K: Ord> Seldom<K> {
    /// Whether it was in the last minute.
    pub(crate) fn was_lately(&self, key: &K, now: Instant) -> bool {
        self.0.get(key).is_some_and(|at| is_lately(*at, now))
    }

    /// Whether it is time; if so, it is from now on that it was.
    pub(crate) fn is_due(&mut self, key: K, now: Instant) -> bool {
        let is_due = !self.was_lately(&key, now);
        if is_due {
            self.forget_old(now);
            self.0.insert(key, now);
        }
        is_due
    }

    /// All of these are now; those that find no more room than for so many in all are passed over.
    pub(crate) fn add(&mut self, keys: impl IntoIterator<Item = K>, most: usize, now: Instant) {
        self.forget_old(now);
        let room = most.saturating_sub(self.0.len());
        self.0.extend(keys.into_iter().take(room).map(|key| (key, now)));
    }

    fn forget_old(&mut self, now: Instant) {
        self.0.retain(|_, at| is_lately(*at, now));
    }
}

fn is_lately(at: Instant, now: Instant) -> bool {
    now.duration_since(at) < PAUSE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_due_again_after_a_minute_and_something_else_at_once() {
        let (mut told, start) = (Seldom::default(), Instant::now());
        let after = |s| start + Duration::from_secs(s);
        assert!(told.is_due("rooms", start));
        assert!(!told.is_due("rooms", after(59)), "and that does not put it off");
        assert!(told.is_due("doors", after(59)));
        assert!(told.was_lately(&"rooms", after(59)) && !told.was_lately(&"rooms", after(60)));
        assert!(told.is_due("rooms", after(60)));
        assert!(!told.is_due("doors", after(118)));
    }

    #[test]
    fn what_finds_no_room_is_passed_over_until_something_is_old() {
        let (mut told, start) = (Seldom::default(), Instant::now());
        let minute = start + PAUSE;
        told.add(0..5, 3, start);
        assert!([0, 1, 2].iter().all(|key| told.was_lately(key, start)));
        assert!([3, 4].iter().all(|key| !told.was_lately(key, start)));
        told.add(5..7, 3, minute);
        assert!([5, 6].iter().all(|key| told.was_lately(key, minute)));
        assert_eq!(told.0.len(), 2, "what is old is forgotten");
    }
}
