//! What becomes of a job that nobody bakes.

use std::io;

use tokio::process::{Child, Command};

use super::*;
use crate::{
    db::{Catalogue, NewJob},
    jobs::{Inner, JobSettings},
    place::{Place, PlaceArgs},
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
        let jobs = Jobs::new(
            catalogue.clone(),
            &Place::try_from(&args).unwrap(),
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
        };
        assert!(catalogue.keep_job(&new, 1, 1).await.unwrap());
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

fn no_process(_: &mut Command) -> io::Result<Child> {
    Err(rustix::io::Errno::AGAIN.into())
}

fn no_memory(_: &mut Command) -> io::Result<Child> {
    Err(rustix::io::Errno::NOMEM.into())
}
