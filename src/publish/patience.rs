//! How long does a bake wait for a catalogue or a store that does not answer, or for room on a disk? Longer than either is
//! usually away: what took hours to find is not given up for a restart of a database.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_bake::progress::Progress;

use crate::{place::Absent, progress::BakeProgress};

/// How long it waits, and between two times that it asks.
const PATIENCE: Duration = Duration::from_secs(600);
const PAUSE: Duration = Duration::from_secs(2);
/// A catalogue that has not answered one question for so long is away. A store has a limit of its own, on how long it stands
/// still: large blobs take their time over slow lines.
pub(super) const ANSWER: Duration = Duration::from_secs(60);

/// Waits, for everything that one bake does.
pub(super) struct Patience {
    progress: Arc<BakeProgress>,
    /// How many threads wait: the first one says so, and the last one that the bake goes on.
    waiting: Mutex<usize>,
    pause: Duration,
}

impl Patience {
    pub(super) fn new(progress: Arc<BakeProgress>) -> Self {
        Self {
            progress,
            waiting: Mutex::new(0),
            pause: PAUSE,
        }
    }

    /// Tries until it works, or fails for another reason than that something is absent, or nobody wants the bake any more.
    pub(super) async fn wait<T, F>(&self, trying: impl Fn() -> F) -> anyhow::Result<T>
    where
        F: Future<Output = anyhow::Result<T>>,
    {
        let mut since = None;
        let ended = loop {
            let cause = match trying().await {
                Ok(done) => break Ok(done),
                Err(cause) => cause,
            };
            let Some(absent) = Absent::of(&cause) else {
                break Err(cause);
            };
            if self.progress.cancelled() || since.is_some_and(|since: Instant| since.elapsed() >= PATIENCE) {
                break Err(cause);
            }
            if since.is_none() {
                since = Some(Instant::now());
                self.begin(absent, &cause);
            }
            tokio::time::sleep(self.pause).await;
        };
        if since.is_some() {
            self.end(ended.is_ok());
        }
        ended
    }

    fn begin(&self, absent: Absent, cause: &anyhow::Error) {
        // Held while it is said, so that what is said last is so.
        let mut waiting = self.waiting();
        *waiting += 1;
        if *waiting == 1 {
            let minutes = PATIENCE.as_secs() / 60;
            let why = format!("{absent}; the bake waits for it, for {minutes} minutes at most: {cause}");
            self.progress.waits(Some(absent), &why);
        }
    }

    fn end(&self, goes_on: bool) {
        let mut waiting = self.waiting();
        *waiting -= 1;
        if *waiting == 0 && goes_on {
            self.progress.waits(None, "the bake goes on");
        }
    }

    fn waiting(&self) -> MutexGuard<'_, usize> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the catalogue answers, if it does in time.
pub(super) async fn answered<T>(
    patience: Duration,
    asking: impl Future<Output = anyhow::Result<T>>,
) -> anyhow::Result<T> {
    tokio::time::timeout(patience, asking)
        .await
        .context("a question to the catalogue was not answered in time")?
}

#[cfg(test)]
mod tests {
    use std::{
        io,
        sync::atomic::{AtomicUsize, Ordering},
    };

    use super::*;
    use crate::{progress::Show, store::StoreError};

    fn patience() -> Patience {
        Patience {
            pause: Duration::ZERO,
            ..Patience::new(Arc::new(BakeProgress::new(Show::Lines)))
        }
    }

    fn failed(kind: io::ErrorKind) -> anyhow::Error {
        let source = object_store::Error::Generic {
            store: "test",
            source: io::Error::from(kind).into(),
        };
        let error = StoreError::Io {
            what: "write a blob".to_owned(),
            cause: Arc::new(source),
        };
        anyhow::Error::from(error).context("cannot publish")
    }

    #[tokio::test]
    async fn what_is_absent_is_waited_for() {
        for (kind, absent) in [
            (io::ErrorKind::StorageFull, Absent::Room),
            (io::ErrorKind::ConnectionRefused, Absent::Store),
        ] {
            assert_eq!(Absent::of(&failed(kind)), Some(absent));
            let tried = AtomicUsize::new(0);
            let trying = || {
                let done = tried.fetch_add(1, Ordering::Relaxed) == 3;
                std::future::ready(if done { Ok("done") } else { Err(failed(kind)) })
            };
            assert_eq!(patience().wait(trying).await.unwrap(), "done");
            assert_eq!(tried.into_inner(), 4);
        }
    }

    #[tokio::test]
    async fn a_catalogue_that_does_not_answer_is_away() {
        let never = std::future::pending::<anyhow::Result<()>>();
        let error = answered(Duration::ZERO, never).await.unwrap_err();
        assert_eq!(Absent::of(&error), Some(Absent::Catalogue));
    }

    #[tokio::test]
    async fn the_bake_goes_on_when_nobody_waits_any_more() {
        let patience = patience();
        let tried = AtomicUsize::new(0);
        let trying = || {
            let before = tried.fetch_add(1, Ordering::Relaxed);
            assert_eq!(*patience.waiting(), usize::from(before > 0));
            std::future::ready(
                (before == 2)
                    .then_some(())
                    .ok_or_else(|| failed(io::ErrorKind::StorageFull)),
            )
        };
        patience.wait(trying).await.unwrap();
        assert_eq!(*patience.waiting(), 0);
    }

    #[tokio::test]
    async fn what_is_wrong_is_told_at_once() {
        let trying = || std::future::ready(Err::<(), _>(failed(io::ErrorKind::PermissionDenied)));
        assert!(patience().wait(trying).await.is_err());
    }

    #[tokio::test]
    async fn nobody_waits_for_a_bake_that_was_cancelled() {
        let patience = patience();
        patience.progress.cancel();
        let trying = || std::future::ready(Err::<(), _>(failed(io::ErrorKind::StorageFull)));
        assert!(patience.wait(trying).await.is_err());
    }
}
