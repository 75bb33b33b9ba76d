//! Does an answer still come? Who waits gives it a time to begin in, and more with each byte that is here: what trickles is given up.

use std::{
    pin::pin,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::time::{Instant, timeout};

use super::{Carried, pulse::BEAT};

/// An answer that brings fewer bytes a second, beyond the time that it has to begin in, does not come.
const LEAST_BYTES_PER_S: f64 = 1000.0;

/// How far an answer has come.
#[derive(Debug)]
pub(super) struct Progress<'a> {
    asked: Instant,
    begun: OnceLock<Duration>,
    bytes: AtomicU64,
    /// What its line carries, of an answer that nobody looks at while it comes, and how much that was before.
    line: Option<(&'a Carried, u64)>,
}

impl<'a> Progress<'a> {
    pub(super) fn new() -> Self {
        Self {
            asked: Instant::now(),
            begun: OnceLock::new(),
            bytes: AtomicU64::new(0),
            line: None,
        }
    }

    /// Of an answer of which only what its line carries is known.
    pub(super) fn counted(carried: &'a Carried) -> Self {
        Self {
            line: Some((carried, carried.bytes())),
            ..Self::new()
        }
    }

    /// So many bytes are here.
    pub(super) fn note(&self, bytes: usize) {
        self.begun.get_or_init(|| self.asked.elapsed());
        self.bytes.store(bytes as u64, Ordering::Relaxed);
    }

    /// How many bytes are here.
    pub(super) fn bytes(&self) -> u64 {
        let carried = self
            .line
            .map_or(0, |(line, before)| line.bytes().saturating_sub(before));
        self.bytes.load(Ordering::Relaxed).max(carried)
    }

    /// After what time it began, or for how long it has not.
    pub(super) fn begins(&self) -> Duration {
        self.begun.get().copied().unwrap_or_else(|| self.asked.elapsed())
    }

    /// An answer, unless it does not begin within a time, or trickles; and how long it was waited for, in beats: who is woken
    /// late counts the beat and not the delay. One that may be seen only when all of its bytes are here has the time for so many of them as
    /// well.
    pub(super) async fn wait<T>(
        &self,
        grace: Duration,
        unseen: u64,
        answer: impl Future<Output = T>,
    ) -> (Option<T>, Duration) {
        let mut answer = pin!(answer);
        let mut waited = Duration::ZERO;
        loop {
            let bytes = self.bytes();
            let earned = Duration::from_secs_f64((bytes + unseen) as f64 / LEAST_BYTES_PER_S);
            while waited < grace + earned {
                let beat = BEAT.min(grace + earned - waited);
                let begun = Instant::now();
                if let Ok(answer) = timeout(beat, &mut answer).await {
                    return (Some(answer), waited + begun.elapsed().min(beat));
                }
                waited += beat;
            }
            if self.bytes() <= bytes {
                return (None, waited);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::time::sleep;

    use super::*;

    /// How an answer ends of which so many bytes are here after each second, and when.
    async fn answer(bytes_per_s: usize, seconds: usize) -> (bool, u64) {
        let progress = Progress::new();
        let comes = async {
            for second in 1..=seconds {
                sleep(Duration::from_secs(1)).await;
                progress.note(second * bytes_per_s);
            }
        };
        let (came, waited) = progress.wait(Duration::from_secs(5), 0, comes).await;
        assert_eq!(waited, progress.asked.elapsed());
        (came.is_some(), progress.asked.elapsed().as_secs())
    }

    #[tokio::test(start_paused = true)]
    async fn what_comes_slowly_is_waited_for_and_what_trickles_is_not() {
        assert_eq!(answer(1100, 100).await, (true, 100));
        assert_eq!(answer(100, 100).await, (false, 5));
        assert_eq!(answer(500, 100).await, (false, 9));
        assert_eq!(answer(0, 100).await, (false, 5));
    }

    #[tokio::test(start_paused = true)]
    async fn a_machine_that_had_no_time_to_listen_does_not_count_that_as_silence() {
        let progress = Progress::new();
        let comes = async {
            // Nobody is woken for a minute, then the answer takes as long as it may.
            tokio::task::yield_now().await;
            tokio::time::advance(Duration::from_mins(1)).await;
            sleep(Duration::from_secs(4)).await;
        };
        let (came, waited) = progress.wait(Duration::from_secs(5), 0, comes).await;
        assert!(came.is_some() && waited < Duration::from_secs(5), "{waited:?}");
    }
}
