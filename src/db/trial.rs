//! Can the catalogue be written? One that can be read only, on a full disk or with a lock that somebody does not let go of,
//! looks well to whoever reads. So whoever asks for health writes the least that there is, a few seconds apart at most.

use std::{sync::Arc, time::Duration};

use anyhow::Context;
use tokio::{sync::watch, time::Instant};

use super::{Catalogue, PATIENCE};

/// Between two trials.
const PAUSE: Duration = Duration::from_secs(5);
/// Whoever asks waits no longer for a trial, and hears of the one before.
const HEARING: Duration = Duration::from_secs(2);

/// The trials of a catalogue, which all of its clones share.
#[derive(Debug, Clone, Default)]
pub(super) struct Trials(Arc<watch::Sender<Trial>>);

/// The last one, and whether another is under way.
#[derive(Debug, Default)]
struct Trial {
    running: bool,
    ended: Option<Instant>,
    refused: Option<Arc<anyhow::Error>>,
}

impl Trial {
    /// Whether it is time for another one, which begins then.
    fn begin(&mut self) -> bool {
        let due = !self.running && self.ended.is_none_or(|ended| ended.elapsed() >= PAUSE);
        self.running |= due;
        due
    }

    fn end(&mut self, outcome: anyhow::Result<()>) {
        *self = Self {
            running: false,
            ended: Some(Instant::now()),
            refused: outcome.err().map(Arc::new),
        };
    }
}

impl Catalogue {
    /// Whether something could be written when that was last tried, which is not long ago.
    ///
    /// # Errors
    /// What was said then.
    pub async fn writable(&self) -> anyhow::Result<()> {
        self.try_writing();
        let mut heard = self.trials.0.subscribe();
        // A trial that takes long is nothing to wait for.
        _ = tokio::time::timeout(HEARING, heard.wait_for(|trial| !trial.running)).await;
        match &heard.borrow().refused {
            Some(error) => Err(anyhow::anyhow!("cannot be written: {error:#}")),
            None => Ok(()),
        }
    }

    /// Tries it, if it is time to, beside whoever asks; says how it went the last time.
    pub fn try_writing(&self) -> bool {
        let trials = &self.trials.0;
        if trials.send_if_modified(Trial::begin) {
            let (catalogue, trials) = (self.clone(), trials.clone());
            tokio::spawn(async move {
                // In a task of its own, so that a panic ends the trial, too.
                let mut trying = tokio::spawn(async move { catalogue.write_least().await });
                let ended = tokio::time::timeout(PATIENCE, &mut trying).await;
                trying.abort();
                let outcome = ended
                    .context("nothing can be written in time")
                    .and_then(|ended| ended.context("the trial broke off").flatten());
                trials.send_modify(|trial| trial.end(outcome));
            });
        }
        trials.borrow().refused.is_none()
    }

    /// Writes a row twice, so that it is as it was, and yet on the disk anew: what is equal SQLite would not write.
    async fn write_least(&self) -> anyhow::Result<()> {
        let mut tx = self.transaction().await?;
        for sql in [
            "UPDATE mover_ids SET next = next + 1",
            "UPDATE mover_ids SET next = next - 1",
        ] {
            sqlx::query(sql).execute(&mut *tx).await?;
        }
        tx.commit().await?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use sqlx::Executor;

    use super::*;

    #[tokio::test]
    async fn a_catalogue_that_can_only_be_read_says_so_and_heals() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let first = catalogue.draw_mover_ids(1).await.unwrap();
        catalogue.writable().await.unwrap();
        assert_eq!(catalogue.draw_mover_ids(1).await.unwrap().0, first.0 + 1);
        let forbid = "CREATE TRIGGER full BEFORE UPDATE ON mover_ids BEGIN SELECT RAISE(ABORT, 'no room'); END";
        catalogue.pool.execute(forbid).await.unwrap();
        catalogue.writable().await.expect("what was tried just now holds");
        let later = || catalogue.trials.0.send_modify(|trial| trial.ended = None);
        later();
        let error = catalogue.writable().await.unwrap_err();
        assert!(error.to_string().contains("no room"), "{error:#}");
        catalogue.pool.execute("DROP TRIGGER full").await.unwrap();
        later();
        catalogue.writable().await.unwrap();
    }

    #[tokio::test]
    async fn what_is_tried_reaches_the_disk() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let log = data.path().join(format!("{}-wal", crate::db::FILE_NAME));
        let bytes = || std::fs::metadata(&log).unwrap().len();
        let before = bytes();
        catalogue.writable().await.unwrap();
        assert!(bytes() > before);
    }
}
