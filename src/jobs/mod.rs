//! How does an uploaded scene get published? As a job: it waits, is baked by a child process, and ends.
//!
//! * [`upload`](Upload): bytes arrive on the disk, and become a job only when they are all there.
//! * `queue`: which job is next; one at a time for each scene.
//! * `child`: the bake, in a process of its own with limits of its own.
//!
//! Jobs stand in the catalogue, so they outlive the server. One server works them off for a data folder: it holds a
//! lock, and whoever takes the lock over begins with what was left unfinished. A bake goes on where it was, because
//! what it has found is kept beside the blobs.

mod child;
mod job;
mod queue;
mod settings;
mod upload;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use belvedere_scene::SceneName;
use futures_util::{Stream, StreamExt, stream};
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

pub use job::{Failure, Job, JobId, NoJob, Progress, State};
pub use settings::JobSettings;
pub use upload::Upload;

use crate::{db::Catalogue, keys::Grant};

/// Why a job is not made or found.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// There is none of this name.
    #[error("there is no job {0}")]
    NoJob(JobId),
    /// The upload is larger than uploads may be.
    #[error("an upload may have {most_bytes} bytes")]
    TooLarge {
        /// How large it may be.
        most_bytes: u64,
    },
    /// Nothing was uploaded.
    #[error("the upload is empty")]
    Empty,
    /// Too many jobs wait.
    #[error("{0}")]
    Full(String),
    /// The disk or the catalogue.
    #[error(transparent)]
    Internal(#[from] anyhow::Error),
}

/// The jobs of one data folder. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Jobs {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    catalogue: Catalogue,
    data: PathBuf,
    settings: JobSettings,
    /// Jobs that have not ended, as far as this server knows them.
    open: Mutex<BTreeMap<JobId, Arc<Open>>>,
    /// Rung when a job came, ended or was cancelled.
    changed: Notify,
    stopping: CancellationToken,
}

/// A job that has not ended.
#[derive(Debug)]
struct Open {
    now: watch::Sender<Job>,
    cancelled: CancellationToken,
}

impl Jobs {
    /// The jobs of this data folder. Nothing is baked before [`Jobs::work`].
    #[must_use]
    pub fn new(catalogue: Catalogue, data: &Path, settings: JobSettings, stopping: CancellationToken) -> Self {
        Self {
            inner: Arc::new(Inner {
                catalogue,
                data: data.to_owned(),
                settings,
                open: Mutex::default(),
                changed: Notify::new(),
                stopping,
            }),
        }
    }

    /// Works jobs off until the server stops; ends when every child has ended.
    pub async fn work(&self) {
        queue::work(self.clone()).await;
    }

    /// Begins an upload for a scene.
    ///
    /// # Errors
    /// When too many jobs wait already, or the disk does not take it.
    pub async fn upload(
        &self,
        scene: SceneName,
        title: Option<String>,
        grant: &Grant,
        announced_bytes: u64,
    ) -> Result<Upload, JobError> {
        let (theirs, all) = self.inner.catalogue.open_jobs(&grant.id).await?;
        let settings = &self.inner.settings;
        if theirs >= settings.open_of_a_key || all >= settings.open_of_all {
            return Err(self.full());
        }
        Upload::begin(self.clone(), scene, title, grant.id.clone(), announced_bytes).await
    }

    /// How a job is doing.
    ///
    /// # Errors
    /// When there is none of this name, or the catalogue does not answer.
    pub async fn get(&self, id: JobId) -> Result<Job, JobError> {
        if let Some(open) = self.open(id) {
            return Ok(open.now.borrow().clone());
        }
        let stored = self.inner.catalogue.job(&id.to_string()).await?;
        Ok(Job::read(&stored.ok_or(JobError::NoJob(id))?)?)
    }

    /// How a job is doing, now and whenever that changes, until it has ended. Who reads slowly misses what was between.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn follow(&self, id: JobId) -> Result<impl Stream<Item = Job> + Send + 'static, JobError> {
        let Some(open) = self.open(id) else {
            return Ok(stream::iter([self.get(id).await?]).left_stream());
        };
        let changes = stream::unfold(Some((open.now.subscribe(), true)), async |following| {
            let (mut now, first) = following?;
            if !first && now.changed().await.is_err() {
                return None;
            }
            let job = now.borrow_and_update().clone();
            let next = (!job.state.has_ended()).then_some((now, false));
            Some((job, next))
        });
        let until = self.inner.stopping.clone().cancelled_owned();
        Ok(changes.take_until(until).right_stream())
    }

    /// Ends a job that has not ended by itself, and waits for that. One that has ended stays as it is.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn cancel(&self, id: JobId) -> Result<Job, JobError> {
        let Some(open) = self.open(id) else {
            return self.get(id).await;
        };
        open.cancelled.cancel();
        self.inner.changed.notify_one();
        let mut now = open.now.subscribe();
        let ended = now.wait_for(|job| job.state.has_ended()).await;
        let ended = ended.map(|job| job.clone());
        ended.map_err(|_| JobError::Internal(anyhow::anyhow!("the server stops; the job goes on with the next one")))
    }

    fn open(&self, id: JobId) -> Option<Arc<Open>> {
        let open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.get(&id).cloned()
    }

    /// Knows a job from now on; says it to whoever works jobs off.
    fn admit(&self, job: Job) {
        let entry = Arc::new(Open {
            now: watch::Sender::new(job.clone()),
            cancelled: CancellationToken::new(),
        });
        let mut open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.entry(job.job).or_insert(entry);
        drop(open);
        self.inner.changed.notify_one();
    }

    fn full(&self) -> JobError {
        let settings = &self.inner.settings;
        JobError::Full(format!(
            "{} jobs of one key and {} of all may wait or run; send it again when some have ended",
            settings.open_of_a_key, settings.open_of_all
        ))
    }

    /// Where the bytes of a job lie.
    fn folder(&self, id: JobId) -> PathBuf {
        self.uploads().join(id.to_string())
    }

    fn uploads(&self) -> PathBuf {
        self.inner.data.join("uploads")
    }
}
