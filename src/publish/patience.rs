//! How long does a bake wait for a catalogue or a store that does not answer, or for room on a disk? Longer than either is
//! usually away: what took hours to find is not given up for a restart of a database.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use belvedere_bake::progress::Progress;

use crate::{place::Absent, progress::BakeProgress};

/// How long it waits, and between two times that it asks.
const PATIENCE: Duration = Duration::from_secs(600);
const PAUSE: Duration = Duration::from_secs(2);

/// Waits, for everything that one bake does.
pub(super) struct Patience {
    progress: Arc<BakeProgress>,
    /// Many threads wait for one store; one says so.
    told: AtomicBool,
    pause: Duration,
}

impl Patience {
    pub(super) fn new(progress: Arc<BakeProgress>) -> Self {
        Self {
            progress,
            told: AtomicBool::new(false),
            pause: PAUSE,
        }
    }

    /// Tries until it works, or fails for another reason than that something is absent, or nobody wants the bake any more.
    pub(super) async fn wait<T, F>(&self, trying: impl Fn() -> F) -> anyhow::Result<T>
    where
        F: Future<Output = anyhow::Result<T>>,
    {
        let begun = Instant::now();
        loop {
            let cause = match trying().await {
                Ok(done) => {
                    if self.told.swap(false, Ordering::Relaxed) {
                        self.progress.waits("the bake goes on");
                    }
                    return Ok(done);
                }
                Err(cause) => cause,
            };
            let Some(absent) = Absent::of(&cause) else {
                return Err(cause);
            };
            if self.progress.cancelled() || begun.elapsed() >= PATIENCE {
                return Err(cause);
            }
            if !self.told.swap(true, Ordering::Relaxed) {
                let minutes = PATIENCE.as_secs() / 60;
                self.progress.waits(&format!(
                    "{absent}; the bake waits for it, for {minutes} minutes at most: {cause}"
                ));
            }
            tokio::time::sleep(self.pause).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{io, sync::atomic::AtomicUsize};

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
            source: Arc::new(source),
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
