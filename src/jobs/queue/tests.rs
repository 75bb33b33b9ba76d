//! What becomes of a job that nobody bakes.

use std::{io, process::Stdio, time::SystemTime};

use tokio::process::{Child, Command};

use super::{tidying::LEFTOVER, *};
use crate::{
    db::{Catalogue, Keeping, NewJob},
    jobs::{Inner, JobSettings},
    place::{Absent, Place, PlaceArgs},
    published::Publications,
    traces::Traces,
};

/// A catalogue with one job that waits, and the worker `w`.
struct Waiting {
    _data: tempfile::TempDir,
    catalogue: Catalogue,
    worker: Worker,
    job: JobId,
}

impl Waiting {
    /// Processes are started so.
    async fn with(start: fn(&mut Command) -> io::Result<Child>) -> Self {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let args = PlaceArgs {
            data: Some(data.path().to_owned()),
            ..PlaceArgs::default()
        };
        let place = Place::try_from(&args).unwrap();
        let blobs = place.open_store(1 << 20).await.unwrap();
        let poll = Duration::from_secs(1);
        let publications = Publications::follow(catalogue.clone(), blobs, poll, CancellationToken::new()).await;
        let jobs = Jobs::new(
            catalogue.clone(),
            &place,
            publications.unwrap(),
            JobSettings::default(),
            Traces::default(),
            CancellationToken::new(),
        )
        .unwrap();
        let inner = Arc::into_inner(jobs.inner).unwrap();
        let jobs = Jobs {
            inner: Arc::new(Inner { start, ..inner }),
        };
        let job = JobId::random().unwrap();
        let new = NewJob {
            job: &job.to_string(),
            scene: &"town".parse().unwrap(),
            title: None,
            source_bytes: 7,
            key_id: "k",
            link_key: None,
        };
        assert_eq!(catalogue.keep_job(&new, 1, 1).await.unwrap(), Keeping::Kept);
        std::fs::create_dir_all(jobs.folder(job)).unwrap();
        std::fs::write(jobs.folder(job).join("town.glb"), "a scene").unwrap();
        let worker = Worker {
            jobs,
            name: "w".to_owned(),
            heard_since: None,
            rests_until: Instant::now(),
        };
        Self {
            _data: data,
            catalogue,
            worker,
            job,
        }
    }

    async fn stored(&self) -> (String, u32, Option<String>) {
        let stored = self.catalogue.job(&self.job.to_string()).await.unwrap().unwrap();
        (stored.state, stored.interrupted, stored.error)
    }

    /// Claims the job and bakes it; says how long to rest.
    async fn bake(&mut self) -> Option<Duration> {
        let (job, open) = self.worker.claim().await.expect("it waits");
        run(self.worker.jobs.clone(), self.worker.name.clone(), job, open).await
    }
}

#[tokio::test]
async fn a_job_that_was_claimed_without_an_answer_waits_again() {
    let mut waiting = Waiting::with(Command::spawn).await;
    waiting.catalogue.claim_job("w", LEASE_S).await.unwrap().unwrap();
    waiting.worker.look().await;
    assert_eq!(waiting.stored().await.0, "queued");
    let (claimed, _open) = waiting.worker.claim().await.unwrap();
    waiting.worker.look().await;
    assert_eq!(claimed.job, waiting.job);
    assert_eq!(waiting.stored().await.0, "running");
}

#[tokio::test]
async fn what_broken_uploads_have_left_is_removed_also_where_nothing_is_baked() {
    let mut waiting = Waiting::with(Command::spawn).await;
    let inner = Arc::get_mut(&mut waiting.worker.jobs.inner).unwrap();
    inner.settings.bakes = 0;
    let jobs = waiting.worker.jobs.clone();
    let uploads = jobs.uploads();
    let [left, growing] = ["left", "growing"].map(|name| uploads.join(name));
    for folder in [&left, &growing] {
        std::fs::create_dir(folder).unwrap();
        std::fs::write(folder.join("town.glb"), "half a scene").unwrap();
    }
    let queued = jobs.folder(waiting.job);
    for old in [&left, &queued] {
        for path in [&old.join("town.glb"), old] {
            let file = File::open(path).unwrap();
            file.set_modified(SystemTime::now() - 2 * LEFTOVER).unwrap();
        }
    }
    let working = tokio::spawn({
        let jobs = jobs.clone();
        async move { jobs.work().await }
    });
    for _ in 0..500 {
        if !left.exists() {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert!(!left.exists(), "nobody waits for it");
    assert!(growing.exists() && queued.exists());
    jobs.inner.stopping.cancel();
    working.await.unwrap();
}

#[tokio::test]
async fn a_job_for_which_there_is_no_room_waits_again_longer_and_longer_but_not_for_ever() {
    for no_room in [no_process as fn(&mut Command) -> io::Result<Child>, no_memory] {
        let mut waiting = Waiting::with(no_room).await;
        let mut rested = Duration::ZERO;
        for times in 1..=MOST_INTERRUPTIONS + 1 {
            let rest = waiting.bake().await.expect("it takes no job for a while");
            assert!(rest > rested);
            rested = rest;
            assert_eq!(waiting.stored().await, ("queued".to_owned(), times, None));
        }
        assert_eq!(waiting.bake().await, None);
        let (state, _, error) = waiting.stored().await;
        assert_eq!(state, "failed");
        assert!(error.unwrap().contains("no room for the bake"));
        assert_eq!(waiting.worker.jobs.counts().failed, 1);
    }
}

#[tokio::test]
async fn a_program_that_is_not_there_is_no_matter_of_time() {
    let mut waiting = Waiting::with(|_| Err(io::ErrorKind::NotFound.into())).await;
    assert_eq!(waiting.bake().await, None);
    assert_eq!(waiting.stored().await.0, "failed");
}

#[tokio::test]
async fn a_bake_that_found_nobody_at_home_waits_again_and_at_last_says_who_it_was() {
    let mut waiting = Waiting::with(|_| ends_with(r#"{"failed":{"absent":"store"}}"#)).await;
    for times in 1..=MOST_INTERRUPTIONS {
        assert!(waiting.bake().await.is_some(), "it takes no job for a while");
        assert_eq!(waiting.stored().await, ("queued".to_owned(), times, None));
    }
    waiting.bake().await;
    let (state, _, error) = waiting.stored().await;
    let error = error.unwrap();
    assert_eq!(state, "failed");
    assert!(
        error.contains("/problems/unavailable") && error.contains("the store does not answer"),
        "{error}"
    );
    assert!(!error.contains("s3://"), "{error}");
}

#[tokio::test]
async fn time_that_a_bake_waits_is_not_told_as_the_limit_of_its_author() {
    type Start = fn(&mut Command) -> io::Result<Child>;
    let away: Start = |_| goes_on_after(r#"{"waits":{"absent":"store","why":"it is away"}}"#);
    let back: Start = |_| goes_on_after(r#"{"waits":{"absent":null,"why":"it goes on"}}"#);
    for (start, state) in [(away, "queued"), (back, "failed")] {
        let mut waiting = Waiting::with(start).await;
        let inner = Arc::get_mut(&mut waiting.worker.jobs.inner).unwrap();
        inner.settings.time = Duration::from_secs(2);
        waiting.bake().await;
        let (found, _, error) = waiting.stored().await;
        assert_eq!(found, state);
        assert!(error.is_none_or(|error| error.contains("/problems/bake-limit")));
    }
}

#[test]
fn only_who_had_room_for_it_is_told_that_what_was_found_is_kept() {
    for (absent, kept) in [(Absent::Store, true), (Absent::Catalogue, true), (Absent::Room, false)] {
        let told = serde_json::to_string(&child::given_up(absent)).unwrap();
        assert_eq!(told.contains("is kept"), kept, "{told}");
    }
}

#[tokio::test]
async fn only_what_is_wrong_with_the_source_is_told_to_its_author() {
    for (failed, kind, told) in [
        (
            r#"{"failed":{"source":"it has no floor"}}"#,
            "bake-failed",
            "it has no floor",
        ),
        (r#"{"failed":"server"}"#, "internal", "could not be published"),
        ("", "internal", "could not be published"),
    ] {
        let start: fn(&mut Command) -> io::Result<Child> = match failed {
            "" => |_| ends_with(""),
            _ if failed.contains("source") => |_| ends_with(r#"{"failed":{"source":"it has no floor"}}"#),
            _ => |_| ends_with(r#"{"failed":"server"}"#),
        };
        let mut waiting = Waiting::with(start).await;
        assert_eq!(waiting.bake().await, None);
        let error = waiting.stored().await.2.unwrap();
        assert!(
            error.contains(&format!("/problems/{kind}")) && error.contains(told),
            "{error}"
        );
        assert!(!error.contains("s3://"), "{error}");
    }
}

/// A child that says this as its last line, and more on standard error.
fn ends_with(line: &'static str) -> io::Result<Child> {
    Command::new("sh")
        .args([
            "-c",
            r#"echo "$0"; echo "belvedere: cannot store it in s3://worlds at 10.0.0.7" >&2; exit 1"#,
            line,
        ])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
}

/// A child that says this, and nothing more until it is untied.
fn goes_on_after(line: &'static str) -> io::Result<Child> {
    Command::new("sh")
        .args(["-c", r#"echo "$0"; cat"#, line])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
}

fn no_process(_: &mut Command) -> io::Result<Child> {
    Err(rustix::io::Errno::AGAIN.into())
}

fn no_memory(_: &mut Command) -> io::Result<Child> {
    Err(rustix::io::Errno::NOMEM.into())
}
