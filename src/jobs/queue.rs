//! Which job is next, and whose is it? Of the oldest ones of each scene that nobody bakes that of the key that has had the fewest
//! turns lately, as long as fewer bakes run here than may.
//!
//! One server works for a data folder: whoever holds `{data}/jobs.lock`, which also holds the worker's name. It begins with
//! what it, or the one before it, has left: jobs that it was baking wait again. Workers of other folders that share the
//! catalogue are told apart by that name. Each says every second that it is at work; what a worker was baking that has not
//! said so for [`LEASE_S`] waits again, and goes to another one.

use std::{
    collections::BTreeMap,
    fs::{File, TryLockError},
    io::{Read, Seek, Write},
    sync::{Arc, PoisonError, atomic::Ordering},
    time::Duration,
};

use anyhow::Context;
use tokio::{
    sync::watch,
    task::JoinSet,
    time::{Instant, MissedTickBehavior},
};
use tokio_util::sync::CancellationToken;

use super::{
    Failure, Job, JobId, Jobs, LOOK_INTERVAL, Open, State,
    child::{self, Ended},
    job::random,
    tidying,
};
use crate::{db::in_time, folder};

/// A job is its worker's for so long after it was last heard of.
const LEASE_S: u32 = 30;
const LEASE: Duration = Duration::from_secs(LEASE_S as u64);
/// How long to wait when the catalogue or the store does not answer.
const RETRY: Duration = Duration::from_secs(2);
/// `w` and 128 random bits in hex.
const NAME_LEN: usize = 33;
/// A job that was interrupted so often, because servers ended meanwhile, had no room for it or did not reach where scenes are kept,
/// is given up: it may be what ends them.
const MOST_INTERRUPTIONS: u32 = 5;
/// How long to take no job after the first time that there was no room for one; twice as long after each time more.
const NO_ROOM: Duration = Duration::from_secs(5);

pub(super) async fn work(jobs: Jobs) {
    let stopping = jobs.inner.stopping.clone();
    tokio::join!(
        stopping.run_until_cancelled(tidying::tidy(&jobs)),
        work_off(jobs.clone())
    );
}

async fn work_off(jobs: Jobs) {
    let inner = &jobs.inner;
    if inner.settings.bakes == 0 {
        return;
    }
    let Some((_lock, name)) = inner.stopping.run_until_cancelled(alone(&jobs)).await else {
        return;
    };
    let mut worker = Worker {
        jobs: jobs.clone(),
        name,
        heard_since: None,
        rests_until: Instant::now(),
    };
    if inner.stopping.run_until_cancelled(worker.recover()).await.is_none() {
        return;
    }
    let mut looking = tokio::time::interval(LOOK_INTERVAL);
    looking.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut bakes = JoinSet::new();
    loop {
        while bakes.len() < inner.settings.bakes
            && worker.rests_until <= Instant::now()
            && let Some((job, open)) = worker.claim().await
        {
            bakes.spawn(run(jobs.clone(), worker.name.clone(), job, open));
        }
        tokio::select! {
            () = inner.stopping.cancelled() => break,
            () = inner.changed.notified() => {}
            _ = looking.tick() => worker.look().await,
            Some(ended) = bakes.join_next() => {
                if let Some(rest) = told(ended) {
                    worker.rests_until = worker.rests_until.max(Instant::now() + rest);
                }
            }
        }
    }
    while let Some(ended) = bakes.join_next().await {
        told(ended);
    }
}

/// How long to take no job, if this one has found no room.
fn told(ended: Result<Option<Duration>, tokio::task::JoinError>) -> Option<Duration> {
    ended.unwrap_or_else(|error| {
        tracing::error!(%error, "a job broke off");
        None
    })
}

/// Waits until no other server works for this data folder; gives the lock and the worker's name.
async fn alone(jobs: &Jobs) -> (File, String) {
    let mut told = false;
    loop {
        match lock(jobs) {
            Ok(Some(locked)) => return locked,
            Ok(None) if !told => tracing::info!("another server works the jobs of this data folder off"),
            Ok(None) => {}
            Err(error) if !told => tracing::error!(error = format!("{error:#}"), "jobs cannot be worked off"),
            Err(_) => {}
        }
        told = true;
        tokio::time::sleep(LOOK_INTERVAL).await;
    }
}

fn lock(jobs: &Jobs) -> anyhow::Result<Option<(File, String)>> {
    let path = jobs.inner.data.join("jobs.lock");
    folder::make_private(&jobs.inner.data).with_context(|| format!("cannot make {}", jobs.inner.data.display()))?;
    let file = File::options()
        .create(true)
        .truncate(false)
        .read(true)
        .write(true)
        .open(&path);
    let mut file = file.with_context(|| format!("cannot open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Ok(None),
        Err(TryLockError::Error(cause)) => return Err(cause).context("cannot lock the jobs"),
    }
    let cannot = || format!("cannot keep the worker's name in {}", path.display());
    let mut name = String::new();
    file.read_to_string(&mut name).with_context(cannot)?;
    if name.len() != NAME_LEN {
        name = format!("w{:032x}", random()?);
        file.set_len(0).and_then(|()| file.rewind()).with_context(cannot)?;
        file.write_all(name.as_bytes()).with_context(cannot)?;
    }
    Ok(Some((file, name)))
}

/// Takes jobs and says that it is at work.
struct Worker {
    jobs: Jobs,
    name: String,
    /// Since when the catalogue has answered without a break.
    heard_since: Option<Instant>,
    /// Until when it takes no job.
    rests_until: Instant,
}

impl Worker {
    /// Takes over what the server before has left.
    async fn recover(&mut self) {
        let catalogue = &self.jobs.inner.catalogue;
        while let Err(error) = catalogue.requeue_jobs_of(&self.name).await {
            tracing::error!(error = catalogue.why(&error), "cannot read which jobs there are");
            tokio::time::sleep(RETRY).await;
        }
    }

    /// The next job, if there is one and it is this worker's now.
    async fn claim(&mut self) -> Option<(Job, Arc<Open>)> {
        let inner = &self.jobs.inner;
        let claiming = async {
            let claimed = inner.catalogue.claim_job(&self.name, LEASE_S).await?;
            claimed.as_ref().map(Job::read).transpose()
        };
        // One that was claimed without an answer is let go by the next renewal.
        match in_time(LEASE, claiming).await {
            Ok(claimed) => {
                let job = claimed?;
                let open = Arc::new(Open {
                    now: watch::Sender::new(job.clone()),
                    cancelled: CancellationToken::new(),
                    lost: CancellationToken::new(),
                });
                let mut all = inner.open.lock().unwrap_or_else(PoisonError::into_inner);
                all.insert(job.job, open.clone());
                drop(all);
                inner.begun.notify_waiters();
                Some((job, open))
            }
            Err(error) => {
                self.unheard(&error);
                None
            }
        }
    }

    /// Says that it is at work, and looks what became of its jobs and of those of others.
    async fn look(&mut self) {
        match in_time(LEASE, self.renew()).await {
            Ok(()) if self.heard_since.is_none() => self.heard_since = Some(Instant::now()),
            Ok(()) => {}
            Err(error) => self.unheard(&error),
        }
    }

    async fn renew(&self) -> anyhow::Result<()> {
        let inner = &self.jobs.inner;
        let ours = inner.catalogue.renew_jobs(&self.name, LEASE_S).await?;
        let mut ours: BTreeMap<_, _> = ours.into_iter().collect();
        let mut told = Vec::new();
        for (id, open) in self.jobs.all_open() {
            match ours.remove(&id.to_string()) {
                Some(true) => open.cancelled.cancel(),
                Some(false) => told.push((id, open)),
                None => open.lost.cancel(),
            }
        }
        // Claimed when the answer was lost, or let go while the catalogue was away: nobody bakes these, and nobody else
        // would as long as they are renewed. One that has ended just now stays as it is.
        for job in ours.into_keys() {
            inner.catalogue.put_job_back(&job, &self.name).await?;
        }
        // After the catalogue was away, others need the time to say that they are still at work.
        if self.heard_since.is_some_and(|since| since.elapsed() > LEASE) {
            inner.catalogue.requeue_forsaken_jobs().await?;
        }
        let waiting = inner.catalogue.waiting_jobs().await?;
        inner.waiting.store(usize::try_from(waiting)?, Ordering::Relaxed);
        for (id, open) in told {
            self.tell_progress(id, &open).await?;
        }
        Ok(())
    }

    /// Keeps how far a bake is, for other servers.
    async fn tell_progress(&self, id: JobId, open: &Open) -> anyhow::Result<()> {
        let said = open
            .now
            .borrow()
            .progress
            .as_ref()
            .map(serde_json::to_string)
            .transpose()?;
        let Some(said) = said else { return Ok(()) };
        let catalogue = &self.jobs.inner.catalogue;
        catalogue.keep_progress((&id.to_string(), &self.name), &said).await
    }

    /// The catalogue does not answer; that is told once.
    fn unheard(&mut self, error: &anyhow::Error) {
        if self.heard_since.take().is_some() {
            let error = self.jobs.inner.catalogue.why(error);
            tracing::error!(error, "cannot read which jobs there are");
        }
    }
}

/// Bakes one job. Says how long to take none when there was no room for it.
async fn run(jobs: Jobs, worker: String, job: Job, open: Arc<Open>) -> Option<Duration> {
    let id = job.job;
    let ended = if job.interrupted > MOST_INTERRUPTIONS {
        Ended::Failed(Failure::new(
            "bake-interrupted",
            "The bake was interrupted too often",
            format!(
                "{} times the server ended while this was baked, had no room for the bake, or could not reach where scenes \
                 are kept; it is not tried again",
                job.interrupted
            ),
        ))
    } else if let Err(ended) = fetch(&jobs, &open, id).await {
        ended
    } else {
        tracing::info!(job = %id, scene = %job.scene, "a bake starts");
        child::bake(&jobs, &worker, &job, &open).await
    };
    let rests = matches!(ended, Ended::NoRoom | Ended::Absent(_));
    let rest = rests.then(|| NO_ROOM * 2_u32.pow(job.interrupted.min(MOST_INTERRUPTIONS)));
    let ended = match ended {
        Ended::Absent(absent) if job.interrupted >= MOST_INTERRUPTIONS => Ended::Failed(child::given_up(absent)),
        ended => ended,
    };
    end(&jobs, &worker, &open, ended).await;
    rest
}

/// Gets what was uploaded, unless the job ends here meanwhile.
async fn fetch(jobs: &Jobs, open: &Open, id: JobId) -> Result<(), Ended> {
    let fetching = async {
        let fetched = jobs.inner.errands.fetch(&id.to_string(), &jobs.folder(id)).await;
        if let Err(error) = &fetched {
            tracing::error!(job = %id, %error, "cannot fetch what was uploaded; the job waits again");
            tokio::time::sleep(RETRY).await;
        }
        fetched.map_err(|_| Ended::Stopped)
    };
    tokio::select! {
        fetched = fetching => fetched,
        () = open.cancelled.cancelled() => Err(Ended::Cancelled),
        () = open.lost.cancelled() => Err(Ended::Lost),
        () = jobs.inner.stopping.cancelled() => Err(Ended::Stopped),
    }
}

/// Writes down how a job ended and tells whoever follows it.
async fn end(jobs: &Jobs, worker: &str, open: &Open, ended: Ended) {
    let id = open.now.borrow().job;
    let name = id.to_string();
    let catalogue = &jobs.inner.catalogue;
    let (state, error, report) = match &ended {
        Ended::Stopped | Ended::NoRoom | Ended::Absent(_) | Ended::Lost => {
            return leave(jobs, worker, open, &ended).await;
        }
        Ended::Done(report) => (State::Done, None, Some(report.to_string())),
        Ended::Failed(failure) => (State::Failed, serde_json::to_string(failure).ok(), None),
        Ended::Cancelled => (State::Cancelled, None, None),
    };
    tracing::info!(job = %id, state = state.name(), error, "a job has ended");
    if state == State::Done {
        // Whoever hears of it shall find the scene.
        jobs.inner.publications.refresh().await;
    }
    let write = async || -> anyhow::Result<(bool, Job)> {
        let job = (name.as_str(), worker);
        let ours = catalogue
            .end_job(job, state.name(), error.as_deref(), report.as_deref())
            .await?;
        let stored = catalogue.job(&name).await?;
        Ok((ours, Job::read(&stored.context("a job that was kept is gone")?)?))
    };
    let (ours, job) = loop {
        match write().await {
            Ok(written) => break written,
            Err(error) => tracing::error!(error = catalogue.why(&error), "cannot write down how a job ended"),
        }
        let pause = tokio::time::sleep(RETRY);
        if jobs.inner.stopping.run_until_cancelled(pause).await.is_none() {
            return;
        }
    };
    if ours || job.state.has_ended() {
        jobs.recall(id).await;
    }
    forget(jobs, open, job);
}

/// Lets go of a job that goes on elsewhere.
async fn leave(jobs: &Jobs, worker: &str, open: &Open, ended: &Ended) {
    let id = open.now.borrow().job;
    if jobs.inner.errands.travel() {
        jobs.remove_copy(id).await;
    }
    let (name, catalogue) = (id.to_string(), &jobs.inner.catalogue);
    let put_back = match ended {
        Ended::Stopped => catalogue.put_job_back(&name, worker).await,
        Ended::NoRoom | Ended::Absent(_) => catalogue.interrupt_job(&name, worker).await,
        _ => Ok(()),
    };
    if let Err(error) = put_back {
        // The next renewal puts it back, or its lease ends.
        tracing::warn!(error = catalogue.why(&error), "a job is put back later");
    }
    let job = jobs.read(id).await.unwrap_or_else(|_| open.now.borrow().clone());
    forget(jobs, open, job);
}

/// Tells how a job is, for the last time here.
fn forget(jobs: &Jobs, open: &Open, job: Job) {
    let mut all = jobs.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
    // One that was lost may have been claimed anew meanwhile.
    if all.get(&job.job).is_some_and(|known| std::ptr::eq(&**known, open)) {
        all.remove(&job.job);
        let mut ended = jobs.inner.ended.lock().unwrap_or_else(PoisonError::into_inner);
        match job.state {
            State::Done => ended.done += 1,
            State::Failed => ended.failed += 1,
            State::Cancelled => ended.cancelled += 1,
            State::Queued | State::Running => {}
        }
    }
    drop(all);
    open.now.send_replace(job);
}

#[cfg(test)]
mod tests;
