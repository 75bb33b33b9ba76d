//! Which job is next? The oldest one whose scene is not being baked, as long as fewer bakes run than may.
//!
//! One server of a data folder works its jobs off: whoever holds `{data}/jobs.lock`. It begins with what the one
//! before it left: jobs that were running wait again, and uploads that never became jobs are removed.

use std::{
    collections::BTreeMap,
    fs::{File, TryLockError},
    sync::{Arc, PoisonError, atomic::Ordering},
    time::{Duration, SystemTime},
};

use anyhow::Context;
use belvedere_scene::SceneName;
use tokio::task::JoinSet;

use super::{
    Failure, Job, JobId, Jobs, LOOK_INTERVAL, Open, State,
    child::{self, Ended},
};

/// How long to wait when the catalogue does not answer.
const RETRY: Duration = Duration::from_secs(2);
/// Jobs that ended so long ago are forgotten.
const REMEMBERED_DAYS: u32 = 30;
/// An upload without a job is a leftover when it has not grown for so long.
const LEFTOVER: Duration = Duration::from_secs(3600);
/// A job during which servers ended so often is given up: it may be what ends them.
const MOST_INTERRUPTIONS: u32 = 5;

pub(super) async fn work(jobs: Jobs) {
    let inner = &jobs.inner;
    if inner.settings.bakes == 0 {
        return;
    }
    let Some(_lock) = inner.stopping.run_until_cancelled(alone(&jobs)).await else {
        return;
    };
    inner.working.store(true, Ordering::Release);
    if inner.stopping.run_until_cancelled(recover(&jobs)).await.is_none() {
        return;
    }
    let mut looking = tokio::time::interval(LOOK_INTERVAL);
    let mut bakes = JoinSet::new();
    let mut busy = BTreeMap::new();
    loop {
        while bakes.len() < inner.settings.bakes
            && let Some((job, open)) = next(&jobs, &busy)
        {
            busy.insert(job.scene.clone(), job.job);
            bakes.spawn(run(jobs.clone(), job, open));
        }
        tokio::select! {
            () = inner.stopping.cancelled() => break,
            () = inner.changed.notified() => {}
            _ = looking.tick() => {
                if let Err(error) = take_in(&jobs).await {
                    tracing::warn!(error = format!("{error:#}"), "cannot read which jobs there are");
                }
            }
            Some(ended) = bakes.join_next() => free(&mut busy, ended),
        }
        cancel_waiting(&jobs, &busy).await;
    }
    while let Some(ended) = bakes.join_next().await {
        free(&mut busy, ended);
    }
}

fn free(busy: &mut BTreeMap<SceneName, JobId>, ended: Result<SceneName, tokio::task::JoinError>) {
    match ended {
        Ok(scene) => {
            busy.remove(&scene);
        }
        // Which scene it was is not known; it stays closed until the server starts again.
        Err(error) => tracing::error!(%error, "a job broke off"),
    }
}

/// Waits until no other server works jobs off.
async fn alone(jobs: &Jobs) -> File {
    let mut told = false;
    loop {
        match lock(jobs) {
            Ok(Some(lock)) => return lock,
            Ok(None) if !told => tracing::info!("another server works the jobs of this data folder off"),
            Ok(None) => {}
            Err(error) if !told => tracing::error!(error = format!("{error:#}"), "jobs cannot be worked off"),
            Err(_) => {}
        }
        told = true;
        tokio::time::sleep(LOOK_INTERVAL).await;
    }
}

fn lock(jobs: &Jobs) -> anyhow::Result<Option<File>> {
    let path = jobs.inner.data.join("jobs.lock");
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    let file = file.with_context(|| format!("cannot open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(cause)) => Err(cause).context("cannot lock the jobs"),
    }
}

/// Takes over what the server before has left.
async fn recover(jobs: &Jobs) {
    let taking_over = async || -> anyhow::Result<()> {
        jobs.inner.catalogue.requeue_interrupted_jobs().await?;
        jobs.inner.catalogue.forget_ended_jobs(REMEMBERED_DAYS).await?;
        take_in(jobs).await
    };
    while let Err(error) = taking_over().await {
        tracing::error!(error = format!("{error:#}"), "cannot read which jobs there are");
        tokio::time::sleep(RETRY).await;
    }
    if let Err(error) = remove_leftovers(jobs) {
        tracing::warn!(%error, "cannot look for uploads that ended early");
    }
}

/// Knows every job that waits, those too that other servers of the data folder have taken.
async fn take_in(jobs: &Jobs) -> anyhow::Result<()> {
    for stored in jobs.inner.catalogue.unfinished_jobs().await? {
        let job = Job::read(&stored)?;
        if job.state == State::Queued && jobs.open(job.job).is_none() {
            jobs.admit(job);
        }
    }
    Ok(())
}

fn remove_leftovers(jobs: &Jobs) -> std::io::Result<()> {
    let entries = match std::fs::read_dir(jobs.uploads()) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let wanted = name
            .to_str()
            .and_then(|name| name.parse().ok())
            .is_none_or(|id| jobs.open(id).is_some());
        if !wanted && last_change(&entry)?.elapsed().is_ok_and(|age| age > LEFTOVER) {
            std::fs::remove_dir_all(entry.path())?;
        }
    }
    Ok(())
}

/// When anything in an upload's folder was last written.
fn last_change(folder: &std::fs::DirEntry) -> std::io::Result<SystemTime> {
    let mut last = folder.metadata()?.modified()?;
    for file in std::fs::read_dir(folder.path())? {
        last = last.max(file?.metadata()?.modified()?);
    }
    Ok(last)
}

/// The oldest waiting job of a scene that is not busy.
fn next(jobs: &Jobs, busy: &BTreeMap<SceneName, JobId>) -> Option<(Job, Arc<Open>)> {
    let open = jobs.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
    let waiting = open.values().map(|open| (open.now.borrow().clone(), open));
    waiting
        .filter(|(job, open)| {
            job.state == State::Queued && !open.cancelled.is_cancelled() && !busy.contains_key(&job.scene)
        })
        .min_by(|(a, _), (b, _)| (&a.created_at, a.job).cmp(&(&b.created_at, b.job)))
        .map(|(job, open)| (job, open.clone()))
}

/// Ends jobs that were cancelled before they ran.
async fn cancel_waiting(jobs: &Jobs, busy: &BTreeMap<SceneName, JobId>) {
    let cancelled: Vec<_> = {
        let open = jobs.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
        let all = open.values().map(|open| (open.now.borrow().clone(), open.clone()));
        all.filter(|(job, open)| job.state == State::Queued && open.cancelled.is_cancelled())
            .collect()
    };
    for (job, open) in cancelled {
        // One that a bake has just taken up hears of it there.
        if busy.get(&job.scene) != Some(&job.job) {
            end(jobs, &open, Ended::Cancelled).await;
        }
    }
}

/// Bakes one job; gives its scene.
async fn run(jobs: Jobs, job: Job, open: Arc<Open>) -> SceneName {
    let (id, scene) = (job.job, job.scene.clone());
    if job.interrupted > MOST_INTERRUPTIONS {
        let detail = format!(
            "the server ended {} times while this was baked; it is not tried again",
            job.interrupted
        );
        end(
            &jobs,
            &open,
            Ended::Failed(Failure::new(
                "bake-interrupted",
                "The bake was interrupted too often",
                detail,
            )),
        )
        .await;
        return scene;
    }
    match jobs.inner.catalogue.start_job(&id.to_string()).await {
        Ok(true) => {}
        Ok(false) => {
            // Another server has cancelled it.
            match jobs.read(id).await {
                Ok(job) => forget(&jobs, &open, job),
                Err(_) => tokio::time::sleep(RETRY).await,
            }
            return scene;
        }
        Err(error) => {
            // It is still queued; another time it may work.
            tracing::error!(error = format!("{error:#}"), "cannot start a job");
            tokio::time::sleep(RETRY).await;
            return scene;
        }
    }
    open.now.send_modify(|job| job.state = State::Running);
    if let Ok(started) = jobs.read(id).await {
        open.now.send_replace(started);
    }
    tracing::info!(job = %id, %scene, "a bake starts");
    let ended = child::bake(&jobs, &job, &open).await;
    end(&jobs, &open, ended).await;
    scene
}

/// Writes down how a job ended and tells whoever follows it.
async fn end(jobs: &Jobs, open: &Open, ended: Ended) {
    let id = open.now.borrow().job;
    let name = id.to_string();
    let catalogue = &jobs.inner.catalogue;
    let (state, error, report) = match &ended {
        Ended::Stopped => {
            if let Err(error) = catalogue.put_job_back(&name).await {
                tracing::warn!(error = format!("{error:#}"), "a job counts as interrupted");
            }
            return;
        }
        Ended::Done(report) => (State::Done, None, Some(report.to_string())),
        Ended::Failed(failure) => (State::Failed, serde_json::to_string(failure).ok(), None),
        Ended::Cancelled => (State::Cancelled, None, None),
    };
    tracing::info!(job = %id, state = state.name(), error, "a job has ended");
    let write = async || -> anyhow::Result<Job> {
        catalogue
            .end_job(&name, state.name(), error.as_deref(), report.as_deref())
            .await?;
        let stored = catalogue.job(&name).await?;
        Job::read(&stored.context("a job that was kept is gone")?)
    };
    let job = loop {
        match write().await {
            Ok(job) => break job,
            Err(error) => tracing::error!(error = format!("{error:#}"), "cannot write down how a job ended"),
        }
        if jobs
            .inner
            .stopping
            .run_until_cancelled(tokio::time::sleep(RETRY))
            .await
            .is_none()
        {
            return;
        }
    };
    jobs.remove_upload(id).await;
    forget(jobs, open, job);
}

/// Tells how a job ended, for the last time.
fn forget(jobs: &Jobs, open: &Open, job: Job) {
    let mut all = jobs.inner.open.lock().unwrap_or_else(PoisonError::into_inner);
    if all.remove(&job.job).is_some() {
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
