//! How many requests are under way at once, of all who share a source? So many that a server is kept busy, and no more: what thousands
//! of visitors ask for at the same moment would only wait in the machine that asks, and be taken for the silence of a server. Who waits
//! for a turn has not asked yet.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::{Instant, sleep},
};

use super::Carried;

/// A turn ends after this time where nobody was answered meanwhile: a server that is silent must not hold up who may hear of that as well.
const SILENCE: Duration = Duration::from_secs(2);

/// Turns of all who share a source; as many as are wanted unless they are bounded.
#[derive(Debug, Default)]
pub(super) struct Turns {
    turns: Option<Arc<Semaphore>>,
    answers: AtomicU64,
}

/// One of them.
pub(super) type Turn = Option<OwnedSemaphorePermit>;

impl Turns {
    pub(super) fn at_most(requests: usize) -> Self {
        Self {
            turns: Some(Arc::new(Semaphore::new(requests))),
            answers: AtomicU64::new(0),
        }
    }

    /// Waits for one, for as long as is noted.
    pub(super) async fn take(&self, count: Option<&Carried>) -> Turn {
        let turns = self.turns.clone()?;
        let asked = Instant::now();
        let turn = turns.acquire_owned().await.ok();
        if let Some(count) = count {
            count.waits(asked.elapsed());
        }
        turn
    }

    /// Waits for an answer, or until that is given up, and for how long; keeps the turn for no longer than that takes.
    pub(super) async fn during<T>(
        &self,
        turn: Turn,
        answer: impl Future<Output = (Option<T>, Duration)>,
    ) -> (Option<T>, Duration) {
        let silence = async {
            let mut before = self.answers.load(Ordering::Relaxed);
            loop {
                sleep(SILENCE).await;
                let now = self.answers.load(Ordering::Relaxed);
                if std::mem::replace(&mut before, now) == now {
                    break;
                }
            }
        };
        let mut answer = std::pin::pin!(answer);
        let came = match turn {
            None => answer.await,
            Some(turn) => tokio::select! {
                biased;
                came = &mut answer => came,
                () = silence => {
                    drop(turn);
                    answer.await
                }
            },
        };
        // Who gives up has heard nothing.
        self.answers.fetch_add(u64::from(came.0.is_some()), Ordering::Relaxed);
        came
    }
}
