//! Whose turn is it, and what becomes of a job whose worker is gone?

use super::{
    claims::{LATELY_S, claiming},
    *,
};
use crate::db::dialect::Dialect;

async fn catalogue() -> (tempfile::TempDir, Catalogue) {
    let data = tempfile::tempdir().unwrap();
    let catalogue = Catalogue::open(data.path()).await.unwrap();
    (data, catalogue)
}

async fn add(catalogue: &Catalogue, job: &str, key_id: &str) -> bool {
    add_of(catalogue, job, key_id, "town").await
}

async fn add_of(catalogue: &Catalogue, job: &str, key_id: &str, scene: &str) -> bool {
    let new = NewJob {
        job,
        scene: &scene.parse().unwrap(),
        title: None,
        source_bytes: 7,
        key_id,
        link_key: None,
    };
    catalogue.keep_job(&new, 2, 3).await.unwrap() == Keeping::Kept
}

async fn claim(catalogue: &Catalogue, worker: &str) -> Option<String> {
    let claimed = catalogue.claim_job(worker, 60).await.unwrap()?;
    assert!(claimed.state == "running" && claimed.started_at.is_some());
    Some(claimed.job)
}

#[tokio::test]
async fn each_key_and_all_together_have_a_quota_of_open_jobs() {
    let (_data, catalogue) = catalogue().await;
    assert!(add(&catalogue, "a1", "a").await && add(&catalogue, "a2", "a").await);
    assert!(!add(&catalogue, "a3", "a").await, "two of one key");
    assert!(add(&catalogue, "b1", "b").await);
    assert!(!add(&catalogue, "b2", "b").await, "three of all");
    assert_eq!(claim(&catalogue, "w").await.as_deref(), Some("a1"));
    assert!(catalogue.end_job(("a1", "w"), "done", None, Some("{}")).await.unwrap());
    assert!(add(&catalogue, "a3", "a").await, "what has ended makes room");
    assert_eq!(catalogue.open_jobs("a").await.unwrap(), (2, 3));
}

#[tokio::test]
async fn a_scene_becomes_private_with_the_job_that_wants_it_so_or_not_at_all() {
    let (_data, catalogue) = catalogue().await;
    let keep = async |job: &str, scene: &str, most| {
        let new = NewJob {
            job,
            scene: &scene.parse().unwrap(),
            title: None,
            source_bytes: 7,
            key_id: "a",
            link_key: Some(&"secret".into()),
        };
        catalogue.keep_job(&new, most, most).await.unwrap()
    };
    let private = async || {
        let all = catalogue.private_scenes().await.unwrap();
        all.into_iter().map(|one| one.scene.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(keep("a1", "town", 0).await, Keeping::NoRoom);
    assert!(private().await.is_empty());
    for published in [
        "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES ('open', '0', '', '', '', '')",
        "INSERT INTO scenes (scene, revision) VALUES ('open', '0')",
    ] {
        sqlx::query(published).execute(&catalogue.pool).await.unwrap();
    }
    assert_eq!(keep("a2", "open", 9).await, Keeping::Public);
    assert!(private().await.is_empty() && catalogue.unfinished_jobs().await.unwrap().is_empty());
    assert_eq!(keep("a3", "town", 9).await, Keeping::Kept);
    assert_eq!(private().await, ["town"]);
}

#[tokio::test]
async fn one_worker_has_a_job_and_one_bakes_a_scene() {
    let (_data, catalogue) = catalogue().await;
    add_of(&catalogue, "a1", "a", "town").await;
    add_of(&catalogue, "a2", "a", "town").await;
    add_of(&catalogue, "b1", "b", "hall").await;
    assert_eq!(claim(&catalogue, "here").await.as_deref(), Some("a1"));
    assert_eq!(
        claim(&catalogue, "there").await.as_deref(),
        Some("b1"),
        "the town is being baked"
    );
    assert_eq!(claim(&catalogue, "there").await, None);
    let end = |job, worker| catalogue.end_job((job, worker), "done", None, None);
    assert!(!end("a1", "there").await.unwrap(), "it is not theirs");
    assert!(end("a1", "here").await.unwrap());
    assert_eq!(claim(&catalogue, "there").await.as_deref(), Some("a2"));
}

#[tokio::test]
async fn a_key_that_has_had_its_turn_comes_after_those_that_have_not() {
    let (_data, catalogue) = catalogue().await;
    let add = async |job: &str, key_id: &str| {
        let new = NewJob {
            job,
            scene: &job.parse().unwrap(),
            title: None,
            source_bytes: 7,
            key_id,
            link_key: None,
        };
        assert_eq!(catalogue.keep_job(&new, 9, 9).await.unwrap(), Keeping::Kept);
    };
    for job in ["a1", "a2", "a3", "a4"] {
        add(job, "a").await;
    }
    assert_eq!(claim(&catalogue, "w").await.as_deref(), Some("a1"));
    add("b1", "b").await;
    add("b2", "b").await;
    add("c1", "c").await;
    let mut order = Vec::new();
    while let Some(job) = claim(&catalogue, "w").await {
        assert!(catalogue.end_job((&job, "w"), "done", None, None).await.unwrap());
        order.push(job);
    }
    assert_eq!(order, ["b1", "c1", "a2", "b2", "a3", "a4"]);
}

#[tokio::test]
async fn whose_turn_it_is_is_not_counted_among_all_that_a_key_ever_had() {
    let (_data, catalogue) = catalogue().await;
    let sql = format!("EXPLAIN QUERY PLAN {}", claiming(Dialect::Sqlite));
    let plan = sqlx::query(AssertSqlSafe(sql)).bind("w").bind(60_i64).bind(-LATELY_S);
    let plan = plan.fetch_all(&catalogue.pool).await.unwrap();
    let steps: Vec<String> = plan.iter().map(|row| row.get("detail")).collect();
    let is_counted = |table: &str, how: &str| {
        let mut of_it = steps
            .iter()
            .filter(|step| step.starts_with(&format!("SEARCH {table} ")));
        of_it.any(|step| step.contains(how))
    };
    assert!(is_counted("had", "(key_id=? AND ended_at>?)"), "{steps:#?}");
    assert!(
        !steps.iter().any(|step| step.contains("jobs_by_key (key_id=?)")),
        "{steps:#?}"
    );
}

#[tokio::test]
async fn what_was_uploaded_for_a_scene_first_is_baked_first_whoever_it_was() {
    let (_data, catalogue) = catalogue().await;
    for (job, key_id, scene) in [("a0", "a", "hall"), ("a1", "a", "town")] {
        assert!(add_of(&catalogue, job, key_id, scene).await);
    }
    assert_eq!(claim(&catalogue, "w").await.as_deref(), Some("a0"));
    assert!(catalogue.end_job(("a0", "w"), "done", None, None).await.unwrap());
    assert!(add_of(&catalogue, "b1", "b", "town").await);
    assert_eq!(claim(&catalogue, "w").await.as_deref(), Some("a1"), "it is older");
    assert!(catalogue.end_job(("a1", "w"), "done", None, None).await.unwrap());
    assert_eq!(claim(&catalogue, "w").await.as_deref(), Some("b1"));
}

#[tokio::test]
async fn how_far_a_bake_is_is_said_by_its_worker_alone_and_anew_by_the_next_one() {
    let (_data, catalogue) = catalogue().await;
    add(&catalogue, "a1", "a").await;
    claim(&catalogue, "here").await;
    let said = async || catalogue.job("a1").await.unwrap().unwrap().progress;
    catalogue.keep_progress(("a1", "here"), "1").await.unwrap();
    catalogue.keep_progress(("a1", "here"), "2").await.unwrap();
    catalogue.keep_progress(("a1", "there"), "3").await.unwrap();
    assert_eq!(said().await.as_deref(), Some("2"));
    catalogue.put_job_back("a1", "here").await.unwrap();
    claim(&catalogue, "there").await;
    assert_eq!(said().await, None);
}

#[tokio::test]
async fn what_was_running_when_a_server_ended_waits_again_and_is_counted() {
    let (_data, catalogue) = catalogue().await;
    add_of(&catalogue, "a1", "a", "town").await;
    add_of(&catalogue, "a2", "a", "hall").await;
    claim(&catalogue, "here").await;
    claim(&catalogue, "there").await;
    catalogue.requeue_jobs_of("here").await.unwrap();
    catalogue.requeue_forsaken_jobs().await.unwrap();
    let open = catalogue.unfinished_jobs().await.unwrap();
    let states: Vec<_> = open
        .iter()
        .map(|j| (j.job.as_str(), j.state.as_str(), j.interrupted))
        .collect();
    assert_eq!(states, [("a1", "queued", 1), ("a2", "running", 0)]);
    // A lease that has run out.
    catalogue.renew_jobs("there", 0).await.unwrap();
    while catalogue.job("a2").await.unwrap().unwrap().state == "running" {
        catalogue.requeue_forsaken_jobs().await.unwrap();
    }
    assert!(
        catalogue.renew_jobs("there", 60).await.unwrap().is_empty(),
        "it is not theirs any more"
    );
    claim(&catalogue, "here").await;
    catalogue.put_job_back("a1", "here").await.unwrap();
    assert_eq!(catalogue.job("a1").await.unwrap().unwrap().interrupted, 1);
}

#[tokio::test]
async fn what_was_cancelled_has_ended_when_its_worker_is_gone_before_it_could_end_it() {
    let (_data, catalogue) = catalogue().await;
    let state = async |job: &str| {
        let job = catalogue.job(job).await.unwrap().unwrap();
        (job.state, job.ended_at.is_some())
    };
    for job in ["a1", "a2", "a3"] {
        assert!(add(&catalogue, job, "a").await);
        assert_eq!(claim(&catalogue, "here").await.as_deref(), Some(job));
        assert!(!catalogue.cancel_job(job).await.unwrap(), "its worker ends it");
        match job {
            "a1" => catalogue.requeue_jobs_of("here").await.unwrap(),
            "a2" => catalogue.put_job_back("a2", "here").await.unwrap(),
            _ => catalogue.interrupt_job("a3", "here").await.unwrap(),
        }
        assert_eq!(state(job).await, ("cancelled".to_owned(), true), "{job}");
    }
    assert_eq!(claim(&catalogue, "there").await, None);
}

#[tokio::test]
async fn a_job_that_waits_is_cancelled_and_who_bakes_one_hears_of_it() {
    let (_data, catalogue) = catalogue().await;
    add_of(&catalogue, "a1", "a", "town").await;
    add_of(&catalogue, "a2", "a", "hall").await;
    claim(&catalogue, "w").await;
    assert!(!catalogue.cancel_job("a1").await.unwrap());
    assert_eq!(catalogue.renew_jobs("w", 60).await.unwrap(), [("a1".to_owned(), true)]);
    assert!(catalogue.cancel_job("a2").await.unwrap());
    catalogue.forget_ended_jobs(1).await.unwrap();
    assert_eq!(catalogue.job("a2").await.unwrap().unwrap().state, "cancelled");
}
