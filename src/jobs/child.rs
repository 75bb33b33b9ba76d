//! How is an uploaded scene baked? By a child process of the same program, so that whatever a hostile file does to a
//! bake, it does to nobody else: it has limits of its own, nothing in its environment but where to publish, and a pipe as its
//! only tie. When that pipe closes, because the job was cancelled or this process was killed, the child stops.
//!
//! The child writes one JSON object a line: how far it is, and at its end the report. What it says on standard error is
//! for whoever runs the server; whoever uploaded hears of it what a limit or a crash is told by.

use std::{
    io,
    path::PathBuf,
    process::Stdio,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use anyhow::Context;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tokio::{
    io::{AsyncBufReadExt, AsyncReadExt, BufReader},
    process::{Child, ChildStderr, ChildStdout, Command},
};

use super::{Failure, Job, Jobs, Open, Progress};
use crate::{db::Claim, place::Absent, traces::BakeSpan};

/// The variable by which a child hears whose job it bakes: whoever knows a job's name may ask about it, and arguments are
/// for everybody to read.
pub(crate) const CLAIM: &str = "BELVEDERE_CLAIM";
/// How long a child may take to stop once it was asked to.
const GRACE: Duration = Duration::from_secs(5);
/// The end of what it said is kept.
const SAID_BYTES: usize = 4 << 10;

/// How a bake ended.
#[derive(Debug)]
pub(super) enum Ended {
    /// It published; its report.
    Done(Value),
    Failed(Failure),
    Cancelled,
    /// Not now: this server stops, or does not get the source; another one goes on.
    Stopped,
    /// Not now: the system has no room for another process at the moment.
    NoRoom,
    /// Not now: somebody did not answer for longer than the bake has waited, or the disk is full.
    Absent(Absent),
    /// This server was not heard of in time, so another one has the job.
    Lost,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Line {
    Progress(Progress),
    /// For what the bake waits, nothing when it goes on, and in words for whoever runs the server.
    Waits {
        absent: Option<Absent>,
        why: String,
    },
    Report(Value),
    Failed(Fault),
}

/// Whose fault it is that a bake failed, as the child says it; all else that it says of that is for the log.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Fault {
    /// The source's, in words for its author.
    Source(String),
    /// Nobody's: it may work another time.
    Absent(Absent),
    /// The server's.
    Server,
}

/// What a child has said at its end.
enum Last {
    Report(Value),
    Failed(Fault),
}

pub(super) async fn bake(jobs: &Jobs, worker: &str, job: &Job, open: &Open) -> Ended {
    let starting = command(jobs, worker, job).and_then(|mut command| Ok((jobs.inner.start)(&mut command)?));
    let mut child = match starting {
        Ok(child) => child,
        Err(error) if may_pass(&error) => {
            tracing::warn!(job = %job.job, error = format!("{error:#}"), "cannot start a bake now; the job waits again");
            return Ended::NoRoom;
        }
        Err(error) => {
            tracing::error!(job = %job.job, error = format!("{error:#}"), "cannot start a bake");
            return Ended::Failed(Failure::new(
                "internal",
                "The server failed",
                "the bake could not be started",
            ));
        }
    };
    let tie = child.stdin.take();
    let stdout = child.stdout.take().expect("it is piped");
    let stderr = child.stderr.take().expect("it is piped");
    let reading = tokio::spawn(said(stderr));
    let waits_for = Mutex::new(None);
    let following = follow(stdout, job, open, &waits_for, jobs.inner.traces.bake(&job.scene));
    tokio::pin!(following);
    let limit = jobs.inner.settings.time;
    let out_of_memory = out_of_memory_kills();
    let (last, asked) = tokio::select! {
        last = &mut following => (last, None),
        () = open.cancelled.cancelled() => (None, Some(Ended::Cancelled)),
        () = open.lost.cancelled() => (None, Some(Ended::Lost)),
        () = jobs.inner.stopping.cancelled() => (None, Some(Ended::Stopped)),
        () = tokio::time::sleep(limit) => (None, Some(too_long(limit, job, &waits_for))),
    };
    drop(tie);
    let last = match asked {
        None => last,
        // It may have published just then.
        Some(_) => tokio::time::timeout(GRACE, following).await.ok().flatten(),
    };
    let status = end(&mut child).await;
    let said = reading.await.unwrap_or_default();
    let fault = match (last, asked) {
        (Some(Last::Report(report)), _) if status.is_some_and(|status| status.success()) => return Ended::Done(report),
        (_, Some(asked)) => return asked,
        // Whoever stops a server may stop its bakes by the same signal, which they hear first.
        (_, None) if jobs.inner.stopping.is_cancelled() => return Ended::Stopped,
        (Some(Last::Failed(fault)), None) => fault,
        (_, None) => Fault::Server,
    };
    let ran_out = out_of_memory
        .zip(out_of_memory_kills())
        .map(|(before, now)| now > before);
    if let Some(failure) = crashed(status, &said, jobs, ran_out) {
        return Ended::Failed(failure);
    }
    if let Fault::Source(sentence) = fault {
        return Ended::Failed(Failure::new("bake-failed", "The scene cannot be baked", sentence));
    }
    let said = said.trim_end();
    if let Fault::Absent(absent) = fault {
        tracing::warn!(job = %job.job, said, "{absent}, so a bake has ended; the job waits again");
        return Ended::Absent(absent);
    }
    tracing::error!(job = %job.job, said, "a bake has failed, and not for what its source is");
    Ended::Failed(Failure::new(
        "internal",
        "The server failed",
        "the scene could not be published; whoever runs this server finds the reason in its log",
    ))
}

/// Whether the system may have room later for what it has none for now: a process, memory, an open file.
fn may_pass(error: &anyhow::Error) -> bool {
    let Some(error) = error.downcast_ref::<io::Error>() else {
        return false;
    };
    #[cfg(unix)]
    if let Some(code) = error.raw_os_error() {
        use rustix::io::Errno;
        let passing = [Errno::AGAIN, Errno::NOMEM, Errno::MFILE, Errno::NFILE];
        return passing.into_iter().any(|passing| passing.raw_os_error() == code);
    }
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::OutOfMemory)
}

fn command(jobs: &Jobs, worker: &str, job: &Job) -> anyhow::Result<Command> {
    let settings = &jobs.inner.settings;
    // The program that runs, even when another one was installed in its place.
    let program = if cfg!(target_os = "linux") {
        "/proc/self/exe".into()
    } else {
        std::env::current_exe()?
    };
    let mut command = Command::new(program);
    command
        .arg("bake")
        .arg(uploaded(jobs, job)?)
        .args(["--scene", job.scene.as_str(), "--tied"])
        .arg("--data")
        .arg(&jobs.inner.data)
        .arg("--memory-mib")
        // Half is for what the bake makes of the source.
        .arg(((settings.memory_bytes / 2) >> 20).max(1).to_string())
        .arg("--limit-memory-mib")
        .arg((settings.memory_bytes >> 20).to_string())
        .arg("--limit-minutes")
        .arg(settings.time.as_secs().div_ceil(60).to_string());
    if let Some(title) = &job.title {
        command.arg(format!("--title={title}"));
    }
    let claim = Claim {
        job: job.job.to_string(),
        worker: worker.to_owned(),
    };
    command
        .env_clear()
        .env(CLAIM, claim.to_string())
        .envs(
            jobs.inner
                .environment
                .iter()
                .map(|(name, value)| (name, value.reveal())),
        )
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true);
    Ok(command)
}

/// The one file in a job's folder.
fn uploaded(jobs: &Jobs, job: &Job) -> anyhow::Result<PathBuf> {
    let folder = jobs.folder(job.job);
    let first = std::fs::read_dir(&folder).and_then(|mut files| files.next().transpose());
    let file = first.with_context(|| format!("cannot read {}", folder.display()))?;
    Ok(file.with_context(|| format!("{} is empty", folder.display()))?.path())
}

/// Tells how far the child is until it says no more; gives what it says at its end.
async fn follow(
    stdout: ChildStdout,
    job: &Job,
    open: &Open,
    waits_for: &Mutex<Option<Absent>>,
    mut span: Option<BakeSpan>,
) -> Option<Last> {
    let mut lines = BufReader::new(stdout).lines();
    let mut last = None;
    while let Ok(Some(line)) = lines.next_line().await {
        match serde_json::from_str(&line) {
            Ok(Line::Progress(progress)) => {
                if let Some(span) = &mut span {
                    span.stage(&progress.stage);
                }
                open.now.send_modify(|job| job.progress = Some(progress));
            }
            Ok(Line::Waits { absent, why }) => {
                *waits_for.lock().unwrap_or_else(PoisonError::into_inner) = absent;
                tracing::warn!(job = %job.job, why, "a bake waits, or does no longer");
            }
            Ok(Line::Report(report)) => last = Some(Last::Report(report)),
            Ok(Line::Failed(fault)) => last = Some(Last::Failed(fault)),
            Err(error) => tracing::warn!(%error, "a bake says what nobody understands"),
        }
    }
    if let (None | Some(Last::Failed(_)), Some(span)) = (&last, &span) {
        span.failed();
    }
    last
}

/// The end of what the child says on standard error.
async fn said(mut stderr: ChildStderr) -> String {
    let (mut said, mut buffer) = (Vec::new(), [0; 1024]);
    while let Ok(read @ 1..) = stderr.read(&mut buffer).await {
        said.extend_from_slice(&buffer[..read]);
        let excess = said.len().saturating_sub(SAID_BYTES);
        said.drain(..excess);
    }
    String::from_utf8_lossy(&said).into_owned()
}

/// Waits for the child's end, and brings it about if need be.
async fn end(child: &mut Child) -> Option<std::process::ExitStatus> {
    if let Ok(ended) = tokio::time::timeout(GRACE, child.wait()).await {
        return ended.ok();
    }
    // It is gone already when this fails.
    _ = child.kill().await;
    child.wait().await.ok()
}

/// What a bake's limit of time ends: one that waits then is not its author's to mend.
fn too_long(limit: Duration, job: &Job, waits_for: &Mutex<Option<Absent>>) -> Ended {
    if let Some(absent) = *waits_for.lock().unwrap_or_else(PoisonError::into_inner) {
        tracing::warn!(job = %job.job, "{absent}, and a bake that waits for it went over its time; the job waits again");
        return Ended::Absent(absent);
    }
    Ended::Failed(Failure::new(
        "bake-limit",
        "The bake went over a limit",
        format!(
            "it took more than {} minutes; what it has found is kept, so another upload of the same scene goes on from there",
            limit.as_secs() / 60
        ),
    ))
}

/// What to tell of a job that has waited for a place often enough.
pub(super) fn given_up(absent: Absent) -> Failure {
    let then = match absent {
        // What was found last may have had no room either.
        Absent::Room => "upload the scene again when there is",
        Absent::Catalogue | Absent::Store => {
            "what the bake has found is kept, so another upload of the same scene goes on from there"
        }
    };
    Failure::new(
        "unavailable",
        "The server cannot do this now",
        format!("{absent}; {then}"),
    )
}

/// How many processes the system has killed since it runs because it, or a group of them, was out of memory; none where it does
/// not count them.
fn out_of_memory_kills() -> Option<u64> {
    let counts = std::fs::read_to_string("/proc/vmstat").ok()?;
    let kills = counts.lines().find_map(|line| line.strip_prefix("oom_kill "))?;
    kills.trim().parse().ok()
}

/// What to tell of a child that was killed: a limit of its own ends it otherwise.
fn killed(mib: u64, ran_out: Option<bool>) -> Failure {
    let detail = match ran_out {
        Some(true) => format!(
            "it was killed before it came to its own limit of {mib} MiB, and the system ran out of memory meanwhile, so probably \
             for that; upload a smaller scene, or give the machine more memory"
        ),
        Some(false) => "somebody killed it, and the system was not out of memory; upload the scene again".to_owned(),
        None => "it was killed, by somebody or by a system that ran out of memory; upload the scene again".to_owned(),
    };
    Failure::new("bake-killed", "The bake was killed", detail)
}

/// What to tell of a child that was ended, or went down: by a limit, by a signal, or by a fault of the program. `ran_out` says
/// whether the system has killed anything for want of memory meanwhile, if that is known.
fn crashed(
    status: Option<std::process::ExitStatus>,
    said: &str,
    jobs: &Jobs,
    ran_out: Option<bool>,
) -> Option<Failure> {
    let over = |what: String| Some(Failure::new("bake-limit", "The bake went over a limit", what));
    let crash = |what: String| Some(Failure::new("bake-crashed", "The bake crashed", what));
    let mib = jobs.inner.settings.memory_bytes >> 20;
    // Rust's allocator says the first, whoever cannot have a thread or a mapping one of the others.
    const OUT_OF_MEMORY: [&str; 3] = [
        "memory allocation of",
        "Cannot allocate memory",
        "Resource temporarily unavailable",
    ];
    if OUT_OF_MEMORY.iter().any(|words| said.contains(words)) {
        return over(format!(
            "it needed more than {mib} MiB of memory; upload a smaller scene, or raise `bake_memory_mib`"
        ));
    }
    #[cfg(unix)]
    if let Some(signal) = status.and_then(|status| std::os::unix::process::ExitStatusExt::signal(&status)) {
        use rustix::process::Signal;
        return match signal {
            signal if signal == Signal::XCPU.as_raw() => over("it took too much time of the processors".to_owned()),
            signal if signal == Signal::XFSZ.as_raw() => over("it wrote too large a file".to_owned()),
            signal if signal == Signal::KILL.as_raw() => Some(killed(mib, ran_out)),
            signal => crash(format!(
                "it was ended by signal {signal}; this is a fault of the program, please report it"
            )),
        };
    }
    let sentence = said.lines().rev().find_map(|line| line.strip_prefix("belvedere: "));
    match sentence {
        Some(sentence) if sentence.contains(" panicked with message ") => {
            crash(format!("{sentence}; this is a fault of the program, please report it"))
        }
        Some(_) => None,
        None => crash(match status.and_then(|status| status.code()) {
            Some(code) => format!("it ended with code {code} and said nothing"),
            None => "it is not known how it ended".to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_was_killed_is_told_by_whom_and_never_to_raise_its_limit() {
        for (ran_out, told) in [
            (Some(true), "the system ran out of memory"),
            (Some(false), "somebody killed it"),
            (None, "by somebody or by a system"),
        ] {
            let failure = killed(8192, ran_out);
            assert!(
                failure.detail.contains(told) && !failure.detail.contains("raise"),
                "{failure:?}"
            );
        }
    }
}
