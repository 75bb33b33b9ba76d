//! Is it the server that is slow, or the machine that waits for it? A wait is counted in short beats: who is woken late counts the beat
//! and not the delay, since a machine that had no time to look had none to hear an answer either. So patience is for the silence of a
//! server, and how late beats were tells how busy the machine is, as a watchdog against stalled event loops has it.

use std::{
    sync::{Mutex, MutexGuard},
    time::Duration,
};

use tokio::time::{Instant, sleep};

/// One beat.
pub(super) const BEAT: Duration = Duration::from_millis(100);

/// A machine is too busy when it came so late to all beats together …
const MUCH: Duration = Duration::from_secs(2);
/// … and this share of the time was such delay.
const MUCH_SHARE: f64 = 0.3;

/// Counts beats, and how late this machine came to them.
#[derive(Debug, Default)]
pub struct Pulse {
    lateness: Mutex<Lateness>,
}

/// How late a machine came to what it had to do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lateness {
    /// How long all beats were to take …
    pub waited: Duration,
    /// … by how much they took longer …
    pub late: Duration,
    /// … and one of them at most.
    pub most_late: Duration,
}

impl Lateness {
    /// The share of the time that was nothing but delay, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.late.as_secs_f64() / (self.waited + self.late).as_secs_f64().max(f64::MIN_POSITIVE)
    }

    /// Whether that is so much that a slow server cannot be told from a slow machine.
    #[must_use]
    pub fn is_much(&self) -> bool {
        self.late >= MUCH && self.share() >= MUCH_SHARE
    }
}

impl Pulse {
    /// What was noted so far.
    #[must_use]
    pub fn lateness(&self) -> Lateness {
        *self.noted()
    }

    /// Goes on noting for as long as this is waited for, once: whoever else waits at the same time is held up by the same stall.
    pub async fn beat(&self) {
        loop {
            let begun = Instant::now();
            sleep(BEAT).await;
            self.note(BEAT, begun.elapsed());
        }
    }

    /// A wait of some time took another.
    fn note(&self, beat: Duration, took: Duration) {
        let mut noted = self.noted();
        let late = took.saturating_sub(beat);
        noted.waited += beat;
        noted.late += late;
        noted.most_late = noted.most_late.max(late);
    }

    fn noted(&self) -> MutexGuard<'_, Lateness> {
        self.lateness.lock().expect("nothing panics while it holds this lock")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_stall_is_noted_once() {
        let pulse = Pulse::default();
        let stall = async {
            tokio::task::yield_now().await;
            tokio::time::advance(Duration::from_secs(3)).await;
            sleep(BEAT / 2).await;
        };
        tokio::select! {
            biased;
            () = pulse.beat() => {}
            () = stall => {}
        }
        let lateness = pulse.lateness();
        assert_eq!(lateness.waited, BEAT);
        let late = Duration::from_secs(3) - BEAT;
        assert!(lateness.late.abs_diff(late) <= Duration::from_millis(2), "{lateness:?}");
    }

    #[test]
    fn a_machine_is_too_busy_when_much_of_the_time_is_delay_and_not_for_a_moment() {
        let pulse = Pulse::default();
        assert!(!pulse.lateness().is_much());
        pulse.note(BEAT, BEAT + Duration::from_millis(900));
        assert!(!pulse.lateness().is_much(), "once is no habit: {:?}", pulse.lateness());
        (0..12).for_each(|_| pulse.note(BEAT, 2 * BEAT));
        let lateness = pulse.lateness();
        assert!(lateness.is_much(), "{lateness:?}");
        assert_eq!(lateness.most_late, Duration::from_millis(900));
        (0..60).for_each(|_| pulse.note(BEAT, BEAT));
        assert!(!pulse.lateness().is_much(), "{:?}", pulse.lateness());
    }
}
