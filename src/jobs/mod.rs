//! How does an uploaded scene get published? As a job: it waits, is baked by a child process, and ends.
//!
//! * [`upload`](Upload): bytes arrive on the disk, and become a job only when they are all there.
//! * `queue`: which job is next; one at a time for each scene.
//! * `child`: the bake, in a process of its own with limits of its own.
//!
//! Jobs stand in the catalogue, so they outlive the server. One server works them off for a data folder: it holds a
//! lock, and whoever takes the lock over begins with what was left unfinished. Any other server of the folder takes
//! uploads and reads in the catalogue what became of them. A bake goes on where it was, because what it has found is
//! kept beside the blobs.

mod child;
mod job;
mod queue;
mod settings;
mod upload;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use belvedere_scene::SceneName;
use futures_util::{Stream, StreamExt, stream};
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

pub use job::{Failure, Job, JobId, NoJob, Progress, State};
pub use settings::JobSettings;
pub use upload::{Format, Source, Upload};

use crate::{db::Catalogue, keys::Grant};

/// How often to look in the catalogue what another server has done.
const LOOK_INTERVAL: Duration = Duration::from_secs(1);

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
    /// Only the server that bakes it can end it.
    #[error("job {0} is being baked by another server; cancel it there")]
    Elsewhere(JobId),
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
    /// Whether this server works jobs off.
    working: AtomicBool,
    /// Jobs that have not ended, on the server that works them off.
    open: Mutex<BTreeMap<JobId, Arc<Open>>>,
    ended: Mutex<JobCounts>,
    /// Uploads that go on, by the key that was shown.
    uploading: Mutex<BTreeMap<String, u32>>,
    /// Rung when a job came, ended or was cancelled.
    changed: Notify,
    stopping: CancellationToken,
}

/// How many jobs this server works on, and how those ended that it has worked on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct JobCounts {
    /// Waiting.
    pub queued: usize,
    /// Being baked.
    pub running: usize,
    /// Published.
    pub done: u64,
    /// Ended with an error.
    pub failed: u64,
    /// Ended by somebody.
    pub cancelled: u64,
}

/// A job that has not ended.
#[derive(Debug)]
struct Open {
    now: watch::Sender<Job>,
    cancelled: CancellationToken,
}

/// An upload that goes on; it counts as an open job until it is dropped.
#[derive(Debug)]
struct GoingOn {
    jobs: Jobs,
    key_id: String,
}

impl Drop for GoingOn {
    fn drop(&mut self) {
        let uploading = &self.jobs.inner.uploading;
        let mut uploading = uploading.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = uploading.get_mut(&self.key_id) {
            *count -= 1;
            if *count == 0 {
                uploading.remove(&self.key_id);
            }
        }
    }
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
                working: AtomicBool::new(false),
                open: Mutex::default(),
                ended: Mutex::default(),
                uploading: Mutex::default(),
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
        source: Source,
        grant: &Grant,
        announced_bytes: u64,
    ) -> Result<Upload, JobError> {
        let (theirs, all) = self.inner.catalogue.open_jobs(&grant.id).await?;
        let going_on = self.go_on(&grant.id, theirs, all).ok_or_else(|| self.full())?;
        Upload::begin(self.clone(), scene, source, going_on, announced_bytes).await
    }

    /// Counts one more upload of a key that has so many open jobs, of so many in all; `None` when that is too many.
    fn go_on(&self, key_id: &str, theirs: u32, all: u32) -> Option<GoingOn> {
        let settings = &self.inner.settings;
        let mut uploading = self.inner.uploading.lock().unwrap_or_else(PoisonError::into_inner);
        let of_all = all.saturating_add(uploading.values().sum());
        let of_key = uploading.entry(key_id.to_owned()).or_default();
        if theirs.saturating_add(*of_key) >= settings.open_of_a_key || of_all >= settings.open_of_all {
            return None;
        }
        *of_key += 1;
        Some(GoingOn {
            jobs: self.clone(),
            key_id: key_id.to_owned(),
        })
    }

    /// How a job is doing.
    ///
    /// # Errors
    /// When there is none of this name, or the catalogue does not answer.
    pub async fn get(&self, id: JobId) -> Result<Job, JobError> {
        if let Some(open) = self.open(id) {
            return Ok(open.now.borrow().clone());
        }
        self.read(id).await
    }

    /// A job as the catalogue knows it.
    async fn read(&self, id: JobId) -> Result<Job, JobError> {
        let stored = self.inner.catalogue.job(&id.to_string()).await?;
        Ok(Job::read(&stored.ok_or(JobError::NoJob(id))?)?)
    }

    /// How a job is doing, now and whenever that changes, until it has ended. Who reads slowly misses what was between.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn follow(&self, id: JobId) -> Result<impl Stream<Item = Job> + Send + 'static, JobError> {
        let until = self.inner.stopping.clone().cancelled_owned();
        let Some(open) = self.open(id) else {
            let first = self.get(id).await?;
            let changes = stream::unfold((self.clone(), Some(first)), async move |(jobs, last)| {
                let last = last?;
                let next = jobs.change(&last).await;
                Some((last, (jobs, next)))
            });
            return Ok(changes.take_until(until).left_stream());
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
        Ok(changes.take_until(until).right_stream())
    }

    /// Waits until a job of another server is not as it was; `None` when it had ended.
    async fn change(&self, last: &Job) -> Option<Job> {
        if last.state.has_ended() {
            return None;
        }
        loop {
            tokio::time::sleep(LOOK_INTERVAL).await;
            match self.get(last.job).await {
                Ok(job) if job == *last => {}
                Ok(job) => return Some(job),
                Err(_) => return None,
            }
        }
    }

    /// Ends a job that has not ended by itself, and waits for that. One that has ended stays as it is.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn cancel(&self, id: JobId) -> Result<Job, JobError> {
        let Some(open) = self.open(id) else {
            return self.cancel_elsewhere(id).await;
        };
        open.cancelled.cancel();
        self.inner.changed.notify_one();
        let mut now = open.now.subscribe();
        let ended = now.wait_for(|job| job.state.has_ended()).await;
        let ended = ended.map(|job| job.clone());
        ended.map_err(|_| JobError::Internal(anyhow::anyhow!("the server stops; the job goes on with the next one")))
    }

    /// Ends a job that waits for another server.
    async fn cancel_elsewhere(&self, id: JobId) -> Result<Job, JobError> {
        if self.inner.catalogue.cancel_waiting_job(&id.to_string()).await? {
            self.remove_upload(id).await;
        }
        let job = self.get(id).await?;
        if job.state.has_ended() {
            Ok(job)
        } else {
            Err(JobError::Elsewhere(id))
        }
    }

    /// How many there are.
    #[must_use]
    pub fn counts(&self) -> JobCounts {
        let mut counts = *self.inner.ended.lock().unwrap_or_else(PoisonError::into_inner);
        let open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        counts.running = open
            .values()
            .filter(|open| open.now.borrow().state == State::Running)
            .count();
        counts.queued = open.len() - counts.running;
        counts
    }

    fn open(&self, id: JobId) -> Option<Arc<Open>> {
        let open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.get(&id).cloned()
    }

    /// Works on a job from now on, unless that is another server's task.
    fn admit(&self, job: Job) {
        if !self.inner.working.load(Ordering::Acquire) {
            return;
        }
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

    async fn remove_upload(&self, id: JobId) {
        if let Err(error) = tokio::fs::remove_dir_all(self.folder(id)).await {
            tracing::warn!(job = %id, %error, "cannot remove what was uploaded");
        }
    }

    /// Where the bytes of a job lie.
    fn folder(&self, id: JobId) -> PathBuf {
        self.uploads().join(id.to_string())
    }

    fn uploads(&self) -> PathBuf {
        self.inner.data.join("uploads")
    }
}
