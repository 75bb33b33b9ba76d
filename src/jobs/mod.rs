//! How does an uploaded scene get published? As a job: it waits, is baked by a child process, and ends.
//!
//! * [`upload`](Upload): bytes arrive on the disk, and become a job only when they are all there.
//! * `queue`: which job is next; one at a time for each scene.
//! * `child`: the bake, in a process of its own with limits of its own.
//!
//! Jobs stand in the catalogue, so they outlive the server. A worker claims one there, says every second that it is still at
//! work, and loses it when nothing is heard of it for long. There is one worker for a data folder; several nodes that share
//! a catalogue have one each. Every server takes uploads, and reads in the catalogue what became of them. A bake goes on
//! where it was, because what it has found is kept in the data folder.

mod child;
mod job;
mod queue;
mod settings;
mod tidying;
mod upload;

use std::{
    collections::BTreeMap,
    io,
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use belvedere_scene::SceneName;
use futures_util::{Stream, StreamExt, stream};
use tokio::{
    process::{Child, Command},
    sync::{Notify, watch},
};
use tokio_util::sync::CancellationToken;

pub(crate) use child::{CLAIM, Fault};
pub use job::{Failure, Job, JobId, NoJob, Progress, State};
pub use settings::JobSettings;
pub use upload::{Format, Source, Upload};

use crate::{
    db::Catalogue, keys::Grant, place::Place, published::Publications, secret::Secret, store::Errands, traces::Traces,
};

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
    /// Too many jobs of one key wait or are baked.
    #[error(
        "{most} jobs of one key may wait or run, and so many do; send it again when one of them has ended, or cancel one"
    )]
    QuotaMet {
        /// How many may.
        most: u32,
    },
    /// Too many jobs of all keys do.
    #[error("{most} jobs of all keys together may wait or run, and so many do; send it again when some have ended")]
    Full {
        /// How many may.
        most: u32,
    },
    /// The scene was to be private.
    #[error("scene `{0}` is published for everybody; whoever runs the server hides it: belvedere private {0}")]
    Public(SceneName),
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
    /// How a child finds the catalogue and the blobs.
    environment: Vec<(String, Secret)>,
    errands: Errands,
    publications: Publications,
    settings: JobSettings,
    traces: Traces,
    /// How the process of a bake is started.
    start: fn(&mut Command) -> io::Result<Child>,
    /// Jobs that are baked here.
    open: Mutex<BTreeMap<JobId, Arc<Open>>>,
    /// How many wait, as the worker has last seen.
    waiting: AtomicUsize,
    ended: Mutex<JobCounts>,
    /// Uploads that go on, by the key that was shown.
    uploading: Mutex<BTreeMap<String, u32>>,
    /// Rung when a job came.
    changed: Notify,
    /// Rung when a bake starts here.
    begun: Notify,
    stopping: CancellationToken,
}

/// How many jobs wait, how many this server bakes, and how those ended that it has baked or cancelled.
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

/// A job that is baked here.
#[derive(Debug)]
struct Open {
    now: watch::Sender<Job>,
    cancelled: CancellationToken,
    /// Another server has it.
    lost: CancellationToken,
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
    /// The jobs of a catalogue. Nothing is baked here before [`Jobs::work`].
    ///
    /// # Errors
    /// When the settings of the bucket, through which uploads travel, cannot be used.
    pub fn new(
        catalogue: Catalogue,
        place: &Place,
        publications: Publications,
        settings: JobSettings,
        traces: Traces,
        stopping: CancellationToken,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            inner: Arc::new(Inner {
                catalogue,
                data: place.data.clone(),
                environment: place.environment(),
                errands: place.errands()?,
                publications,
                settings,
                traces,
                start: Command::spawn,
                open: Mutex::default(),
                waiting: AtomicUsize::new(0),
                ended: Mutex::default(),
                uploading: Mutex::default(),
                changed: Notify::new(),
                begun: Notify::new(),
                stopping,
            }),
        })
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
        let going_on = self.go_on(&grant.id, theirs, all)?;
        Upload::begin(self.clone(), scene, source, going_on, announced_bytes).await
    }

    /// Counts one more upload of a key that has so many open jobs, of so many in all.
    fn go_on(&self, key_id: &str, theirs: u32, all: u32) -> Result<GoingOn, JobError> {
        let settings = &self.inner.settings;
        let mut uploading = self.inner.uploading.lock().unwrap_or_else(PoisonError::into_inner);
        let of_all = all.saturating_add(uploading.values().sum());
        let of_key = uploading.entry(key_id.to_owned()).or_default();
        settings.room(theirs.saturating_add(*of_key), of_all)?;
        *of_key += 1;
        Ok(GoingOn {
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
        let first = self.get(id).await?;
        let changes = stream::unfold((self.clone(), Some(first)), async move |(jobs, last)| {
            let last = last?;
            let next = jobs.change(&last).await;
            Some((last, (jobs, next)))
        });
        Ok(changes.take_until(self.inner.stopping.clone().cancelled_owned()))
    }

    /// Waits until a job is not as it was; `None` when it had ended or is gone.
    async fn change(&self, last: &Job) -> Option<Job> {
        if last.state.has_ended() {
            return None;
        }
        loop {
            let begun = self.inner.begun.notified();
            if let Some(open) = self.open(last.job) {
                // It is baked here: every step is told. When that breaks off, the catalogue knows more.
                let mut now = open.now.subscribe();
                drop(open);
                if let Ok(job) = now.wait_for(|job| job != last).await {
                    return Some(job.clone());
                }
            } else {
                tokio::select! {
                    () = begun => {}
                    () = tokio::time::sleep(LOOK_INTERVAL) => {}
                }
            }
            match self.get(last.job).await {
                Ok(job) if job != *last => return Some(job),
                // While the catalogue is away, nothing is known.
                Ok(_) | Err(JobError::Internal(_)) => {}
                Err(_) => return None,
            }
        }
    }

    /// Ends a job that has not ended by itself, and waits for that. One that has ended stays as it is.
    ///
    /// # Errors
    /// As [`Jobs::get`].
    pub async fn cancel(&self, id: JobId) -> Result<Job, JobError> {
        if self.inner.catalogue.cancel_job(&id.to_string()).await? {
            self.recall(id).await;
            self.inner
                .ended
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .cancelled += 1;
        }
        // A worker elsewhere reads it in the catalogue.
        if let Some(open) = self.open(id) {
            open.cancelled.cancel();
        }
        let ended = async {
            let mut job = self.get(id).await?;
            while let Some(next) = self.change(&job).await {
                job = next;
            }
            Ok(job)
        };
        let ended = self.inner.stopping.run_until_cancelled(ended).await;
        ended.unwrap_or_else(|| Err(anyhow::anyhow!("the server stops; the job goes on with the next one").into()))
    }

    /// How many there are.
    #[must_use]
    pub fn counts(&self) -> JobCounts {
        let mut counts = *self.inner.ended.lock().unwrap_or_else(PoisonError::into_inner);
        counts.running = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner).len();
        counts.queued = self.inner.waiting.load(Ordering::Relaxed);
        counts
    }

    fn open(&self, id: JobId) -> Option<Arc<Open>> {
        let open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.get(&id).cloned()
    }

    fn all_open(&self) -> Vec<(JobId, Arc<Open>)> {
        let open = self.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.iter().map(|(id, open)| (*id, open.clone())).collect()
    }

    /// Removes what was uploaded, wherever it is.
    async fn recall(&self, id: JobId) {
        self.remove_copy(id).await;
        if let Err(error) = self.inner.errands.remove(&id.to_string()).await {
            tracing::warn!(job = %id, %error, "cannot remove what was uploaded");
        }
    }

    /// Removes what of an upload is in the data folder.
    async fn remove_copy(&self, id: JobId) {
        match tokio::fs::remove_dir_all(self.folder(id)).await {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                tracing::warn!(job = %id, %error, "cannot remove what was uploaded");
            }
            _ => {}
        }
    }

    /// Where the bytes of a job lie while they are here.
    fn folder(&self, id: JobId) -> PathBuf {
        self.uploads().join(id.to_string())
    }

    fn uploads(&self) -> PathBuf {
        self.inner.data.join("uploads")
    }
}
