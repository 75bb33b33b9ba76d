//! When is tried again what failed for a reason that passes? After a pause that grows from time to time, so that nobody hammers a
//! server that is down, and that differs from client to client, so that they do not all come back at once (`viewer/core/fetch/recovery.ts`).

use std::{collections::HashSet, time::Duration};

use belvedere_scene::CellId;
use tokio::time::{Instant, sleep_until};

use crate::{Error, source::about, strategy::file::Key};

/// Before the first new try, on average.
const FIRST_PAUSE: Duration = Duration::from_secs(5);
/// No pause is longer on average. When nothing was lost for so long after a try, the next pause is the first again.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// What could not be had, and may come later.
#[derive(Debug, Default)]
pub(super) struct Losses {
    /// Files that are drawn with.
    pub(super) files: HashSet<Key>,
    /// Cells of which something could not be read.
    pub(super) cells: HashSet<CellId>,
    /// Whether nobody knows in which cell the eye is.
    pub(super) is_astray: bool,
}

/// The losses since the last try, and when the next one is.
#[derive(Debug, Default)]
pub(super) struct Recovery {
    losses: Losses,
    due: Option<Instant>,
    tried: Option<Instant>,
    tries: u32,
}

impl Recovery {
    /// Takes note of a loss, unless it is final.
    pub(super) fn note(&mut self, cause: &Error, loss: impl FnOnce(&mut Losses)) {
        if cause.passes() {
            self.expect(loss);
        }
    }

    /// Takes note of what may come later.
    pub(super) fn expect(&mut self, loss: impl FnOnce(&mut Losses)) {
        loss(&mut self.losses);
        if self.due.is_some() {
            return;
        }
        if self.tried.is_some_and(|tried| tried.elapsed() >= LONGEST_PAUSE) {
            self.tries = 0;
        }
        let pause = FIRST_PAUSE.saturating_mul(1 << self.tries.min(8)).min(LONGEST_PAUSE);
        self.tries += 1;
        self.due = Some(Instant::now() + about(pause, self.tries));
    }

    /// Somebody knows again in which cell the eye is.
    pub(super) fn found(&mut self) {
        let was_astray = std::mem::take(&mut self.losses.is_astray);
        if was_astray && self.losses.files.is_empty() && self.losses.cells.is_empty() {
            self.due = None;
            self.tries = self.tries.saturating_sub(1);
        }
    }

    /// Whether something of a cell may come later.
    pub(super) fn awaits(&self, cell: CellId) -> bool {
        self.losses.cells.contains(&cell)
    }

    /// Whether something will be tried again.
    pub(super) fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    /// Waits until that is due; for ever where nothing is.
    pub(super) async fn due(&self) {
        match self.due {
            Some(due) => sleep_until(due).await,
            None => std::future::pending().await,
        }
    }

    /// What is to be tried now.
    pub(super) fn take(&mut self) -> Losses {
        self.due = None;
        self.tried = Some(Instant::now());
        std::mem::take(&mut self.losses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::silence;

    #[tokio::test(start_paused = true)]
    async fn pauses_grow_while_things_are_lost_and_begin_anew_after_a_good_time() {
        let away = silence("/o/x");
        let mut recovery = Recovery::default();
        let mut pause = async || {
            recovery.note(&away, |losses| losses.is_astray = true);
            let lost = Instant::now();
            recovery.due().await;
            assert!(recovery.take().is_astray && !recovery.is_waiting());
            lost.elapsed().as_secs_f64()
        };
        for mean_s in [5.0, 10.0, 20.0, 40.0, 60.0, 60.0] {
            let pause_s = pause().await;
            assert!(
                (0.5 * mean_s..=1.5 * mean_s + 0.001).contains(&pause_s),
                "{pause_s} s instead of {mean_s}"
            );
        }
        tokio::time::advance(LONGEST_PAUSE).await;
        assert!(pause().await <= 7.501);
    }

    #[tokio::test(start_paused = true)]
    async fn what_is_gone_for_good_is_not_waited_for() {
        let mut recovery = Recovery::default();
        recovery.note(&Error::Missing("/o/x".to_owned()), |_| {
            panic!("it is no loss that passes")
        });
        assert!(!recovery.is_waiting());
    }
}
