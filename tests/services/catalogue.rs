//! Does PostgreSQL hold the catalogue as SQLite does, and for several nodes at a time?

use std::collections::{BTreeSet, HashSet};

use belvedere::{
    db::{Catalogue, Claim, Keeping, KeptDoor, KeptMover, NewJob, NewRevision},
    keys::{Keys, Scope, Wanted},
    secret::Secret,
    store::BlobStore,
};
use belvedere_scene::ObjectId;
use futures_util::future::join_all;
use sqlx::{Connection, Executor, PgConnection, PgPool, migrate::Migrator};

use crate::{scene, shared::Database};

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn every_earlier_schema_is_brought_up_to_date_by_many_nodes_at_once() {
    let all: Vec<_> = sqlx::migrate!("migrations/postgres").iter().cloned().collect();
    for known in 0..=all.len() {
        let database = Database::new().await;
        let old = PgPool::connect(&database.url).await.unwrap();
        Migrator::with_migrations(all[..known].to_vec())
            .run(&old)
            .await
            .unwrap();
        old.close().await;
        if known >= 4 {
            let job =
                "INSERT INTO jobs (job, scene, state, source_bytes, key_id) VALUES ('j', 'town', 'queued', 1, 'k')";
            database.sql(job).await;
        }
        let nodes = join_all((0..4).map(|_| database.catalogue())).await;
        for node in &nodes {
            assert_eq!(node.job("j").await.unwrap().is_some(), known >= 4, "from {known}");
        }
        database.sql("INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time) VALUES (9999, 'later', TRUE, '', 0)").await;
        assert!(
            database.catalogue().await.pointers().await.unwrap().is_empty(),
            "a newer schema"
        );
        database.drop().await;
    }
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn many_publish_the_same_and_each_revision_is_whole() {
    let database = Database::new().await;
    let data = tempfile::tempdir().unwrap();
    let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
    let nodes = join_all((0..4).map(|_| database.catalogue())).await;
    let pointers = join_all(nodes.iter().map(|node| scene::publish(node, &blobs, "A row"))).await;
    let pointer = &pointers[0];
    assert_eq!(nodes[0].pointers().await.unwrap(), pointers[..1]);
    let stored: BTreeSet<_> = blobs.list().await.unwrap().into_keys().collect();
    let needed = nodes[0].blobs_of(&pointer.scene, pointer.revision).await.unwrap();
    assert_eq!(
        needed.into_iter().map(|(blob, _)| blob).collect::<BTreeSet<_>>(),
        stored
    );

    // As if the clock had been set back since.
    database
        .sql("UPDATE revisions SET published_at = '2999-12-31T23:59:59.999Z'")
        .await;
    let newer = scene::publish(&nodes[1], &blobs, "Another row").await;
    let kept = nodes[2].kept_revisions(&pointer.scene).await.unwrap();
    assert_eq!(kept[0].published_at, "3000-01-01T00:00:00.000Z");
    let kept: Vec<_> = kept.iter().map(|kept| (kept.revision, kept.current)).collect();
    assert_eq!(kept, [(newer.revision, true), (pointer.revision, false)]);
    assert!(nodes[2].make_current(&pointer.scene, pointer.revision).await.unwrap());
    assert_eq!(
        nodes[3].forget_old_revisions(1).await.unwrap(),
        0,
        "the newest and the current one"
    );
    assert!(nodes[2].make_current(&pointer.scene, newer.revision).await.unwrap());
    assert_eq!(nodes[3].old_revisions(1).await.unwrap(), 1);
    assert_eq!(nodes[3].forget_old_revisions(1).await.unwrap(), 1);
    let in_use = nodes[0].blobs_in_use(u32::MAX).await.unwrap();
    assert!(in_use.contains(&newer.manifest) && !in_use.contains(&pointer.manifest));
    database.drop().await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn names_are_in_the_order_of_their_bytes_whatever_the_collation() {
    let database = Database::new().await;
    let data = tempfile::tempdir().unwrap();
    let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
    let catalogue = database.catalogue().await;
    let mut pointer = scene::publish(&catalogue, &blobs, "A row").await;
    for name in ["a_a", "a-b", "ab", "a0"] {
        pointer.scene = name.parse().unwrap();
        let new = NewRevision {
            pointer: &pointer,
            source_key: "",
            sources: &[],
            report: &serde_json::Value::Null,
            blobs: &[],
            claim: None,
        };
        catalogue.publish(&new).await.unwrap();
    }
    let names: Vec<_> = catalogue
        .pointers()
        .await
        .unwrap()
        .into_iter()
        .map(|p| p.scene)
        .collect();
    let sorted: BTreeSet<_> = names.iter().cloned().collect();
    assert_eq!(names, Vec::from_iter(sorted));
    database.drop().await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn keys_expire_and_are_revoked_and_what_stays_of_live_sessions_comes_back() {
    let database = Database::new().await;
    let catalogue = database.catalogue().await;
    let keys = Keys::new(catalogue.clone());
    let make = async |days| {
        let wanted = Wanted {
            name: "test".into(),
            scopes: vec![Scope::Publish],
            scenes: None,
            days,
        };
        keys.create(&wanted).await.unwrap()
    };
    let (ends, stays, revoked) = (make(Some(1)).await, make(None).await, make(None).await);
    assert!(keys.revoke(revoked.id()).await.unwrap());
    assert!(keys.grant(&ends).await.unwrap().is_some() && keys.grant(&stays).await.unwrap().is_some());
    assert!(keys.grant(&revoked).await.unwrap().is_none());
    database
        .sql("UPDATE api_keys SET expires_at = '2026-01-01T00:00:00.000Z' WHERE expires_at IS NOT NULL")
        .await;
    assert!(keys.grant(&ends).await.unwrap().is_none());
    let listed = keys.list().await.unwrap();
    let valid: Vec<_> = listed
        .iter()
        .filter(|key| key.valid)
        .map(|key| key.grant.id.as_str())
        .collect();
    assert_eq!((listed.len(), valid), (3, vec![stays.id()]));

    let scene = "row".parse().unwrap();
    let revision = "0".repeat(16).parse().unwrap();
    let mover = KeptMover {
        object: ObjectId(100_000_007),
        token: "t".into(),
        mover: "{}".into(),
        pose: None,
    };
    assert!(
        !catalogue.keep_mover(&scene, &mover).await.unwrap(),
        "no such scene is published"
    );
    for published in [
        "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES ('row', '1', '', '', '', '')",
        "INSERT INTO scenes (scene, revision) VALUES ('row', '1')",
    ] {
        database.sql(published).await;
    }
    assert!(catalogue.keep_mover(&scene, &mover).await.unwrap());
    assert!(
        !catalogue.keep_mover(&scene, &mover).await.unwrap(),
        "an id is used once"
    );
    catalogue.keep_poses(&[(mover.object, "p".to_owned())]).await.unwrap();
    for open in [true, false] {
        let door = KeptDoor {
            object: ObjectId(3),
            bounds: "{}".into(),
            open,
        };
        catalogue.keep_door(&scene, revision, &door).await.unwrap();
        assert_eq!(catalogue.kept_doors(&scene, revision).await.unwrap(), [door]);
    }
    let moved = KeptMover {
        pose: Some("p".into()),
        ..mover
    };
    assert_eq!(catalogue.kept_movers(&scene).await.unwrap(), [moved]);
    assert_eq!(catalogue.scenes_with_kept().await.unwrap(), [scene]);
    database.drop().await;
}

async fn add(catalogue: &Catalogue, job: &str, scene: &str) -> bool {
    let new = NewJob {
        job,
        scene: &scene.parse().unwrap(),
        title: None,
        source_bytes: 7,
        key_id: "k",
        link_key: None,
    };
    catalogue.keep_job(&new, 100, 100).await.unwrap() == Keeping::Kept
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn many_workers_claim_and_each_scene_is_baked_by_one() {
    let database = Database::new().await;
    let workers = join_all((0..6).map(|_| database.catalogue())).await;
    for round in 0..20 {
        for job in 0..4 {
            assert!(add(&workers[0], &format!("j{round}{job}"), ["town", "hall"][job % 2]).await);
        }
    }
    let mut baked = BTreeSet::new();
    while baked.len() < 80 {
        let names: Vec<_> = (0..workers.len()).map(|i| format!("w{i}")).collect();
        let claims = workers
            .iter()
            .zip(&names)
            .map(|(worker, name)| worker.claim_job(name, 60));
        let claimed = join_all(claims).await.into_iter().map(Result::unwrap);
        let claimed: Vec<_> = names
            .iter()
            .zip(claimed)
            .filter_map(|(name, job)| Some((name, job?)))
            .collect();
        let scenes: BTreeSet<_> = claimed.iter().map(|(_, job)| job.scene.clone()).collect();
        assert!(scenes.len() == claimed.len(), "two bake one scene: {claimed:?}");
        for (name, job) in claimed {
            assert!(workers[0].end_job((&job.job, name), "done", None, None).await.unwrap());
            assert!(baked.insert(job.job), "it was baked twice");
        }
    }
    assert_eq!(workers[0].waiting_jobs().await.unwrap(), 0);
    assert!(add(&workers[0], "last", "town").await);
    workers[0].claim_job("w0", 0).await.unwrap().unwrap();
    while workers[0].job("last").await.unwrap().unwrap().state == "running" {
        workers[1].requeue_forsaken_jobs().await.unwrap();
    }
    assert!(
        !workers[0].end_job(("last", "w0"), "done", None, None).await.unwrap(),
        "its lease had run out"
    );
    workers[1].forget_ended_jobs(1).await.unwrap();
    assert!(workers[1].job("j00").await.unwrap().is_some());
    workers[1].forget_ended_jobs(0).await.unwrap();
    assert!(workers[1].job("j00").await.unwrap().is_none());
    database.drop().await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn a_claim_beside_one_that_is_not_committed_yet_gets_no_job_of_its_scene() {
    let database = Database::new().await;
    let here = database.catalogue().await;
    assert!(add(&here, "j1", "town").await && add(&here, "j2", "town").await);
    let mut there = PgConnection::connect(&database.url).await.unwrap();
    let mut claim = there.begin().await.unwrap();
    claim
        .execute("UPDATE jobs SET state = 'running', worker = 'there' WHERE job = 'j2'")
        .await
        .unwrap();
    // It sees no bake of the town, and takes the job that was there first.
    let other = tokio::spawn({
        let here = here.clone();
        async move { here.claim_job("here", 60).await }
    });
    let mut watching = PgConnection::connect(&database.url).await.unwrap();
    let waits = "SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND datname = current_database()";
    while !other.is_finished()
        && sqlx::query_scalar::<_, i64>(waits)
            .fetch_one(&mut watching)
            .await
            .unwrap()
            == 0
    {
        tokio::task::yield_now().await;
    }
    claim.commit().await.unwrap();
    assert_eq!(other.await.unwrap().unwrap(), None);
    database.drop().await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn a_job_is_published_only_by_the_worker_that_has_it() {
    let (database, data) = (Database::new().await, tempfile::tempdir().unwrap());
    let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
    for catalogue in [database.catalogue().await, Catalogue::open(data.path()).await.unwrap()] {
        let older = scene::publish(&catalogue, &blobs, "A row").await;
        let newer = scene::publish(&catalogue, &blobs, "Another row").await;
        assert!(add(&catalogue, "j", "row").await);
        let claim = |worker: &str| format!("j/{worker}").parse::<Claim>().unwrap();
        let publish = async |claim: Claim| {
            let new = NewRevision {
                pointer: &older,
                source_key: "",
                sources: &[],
                report: &serde_json::Value::Null,
                blobs: &[],
                claim: Some(&claim),
            };
            let published = catalogue.publish(&new).await;
            (published.is_ok(), catalogue.pointers().await.unwrap())
        };
        assert_eq!(publish(claim("here")).await, (false, vec![newer.clone()]), "it waits");
        catalogue.claim_job("there", 60).await.unwrap().unwrap();
        assert_eq!(publish(claim("here")).await, (false, vec![newer]), "another one has it");
        assert_eq!(publish(claim("there")).await, (true, vec![older.clone()]));
    }
    database.drop().await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn what_is_collected_waits_for_bakes_on_other_nodes() {
    let database = Database::new().await;
    let (here, there) = (database.catalogue().await, database.catalogue().await);
    let mut bake = here.lock_for_writing().await.unwrap();
    let another = there.lock_for_writing().await.unwrap();
    assert!(there.lock_for_collecting().await.unwrap().is_none());
    assert!(bake.holds().await);
    let end_all = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid()";
    database.sql(end_all).await;
    assert!(!bake.holds().await, "its connection is gone");
    drop((bake, another));
    assert!(there.lock_for_collecting().await.unwrap().is_some());
    database.drop().await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL: make test-services"]
async fn keys_take_turns_and_a_scene_becomes_private_with_a_job_that_is_kept() {
    let database = Database::new().await;
    let catalogue = database.catalogue().await;
    let keep = async |job: &str, key_id: &str, link_key: Option<&Secret>| {
        let new = NewJob {
            job,
            scene: &job.parse().unwrap(),
            title: None,
            source_bytes: 7,
            key_id,
            link_key,
        };
        catalogue.keep_job(&new, 3, 9).await.unwrap()
    };
    let secret = Secret::from("secret");
    for job in ["a1", "a2", "a3"] {
        assert_eq!(keep(job, "a", None).await, Keeping::Kept);
    }
    assert_eq!(keep("a4", "a", Some(&secret)).await, Keeping::NoRoom);
    assert!(catalogue.private_scenes().await.unwrap().is_empty());
    assert_eq!(keep("b1", "b", Some(&secret)).await, Keeping::Kept);
    assert_eq!(catalogue.private_scenes().await.unwrap().len(), 1);
    let mut order = Vec::new();
    while let Some(job) = catalogue.claim_job("w", 60).await.unwrap() {
        assert!(catalogue.end_job((&job.job, "w"), "done", None, None).await.unwrap());
        order.push(job.job);
    }
    assert_eq!(order, ["a1", "b1", "a2", "a3"]);

    let data = tempfile::tempdir().unwrap();
    let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
    let pointer = scene::publish(&catalogue, &blobs, "A row").await;
    let of_it = catalogue.blobs_of(&pointer.scene, pointer.revision).await.unwrap();
    let needed: HashSet<_> = of_it.into_iter().map(|(blob, _)| blob).collect();
    assert!(!needed.is_empty());
    assert_eq!(catalogue.blobs_of_scene(&pointer.scene).await.unwrap(), needed);
    assert_eq!(catalogue.public_blobs().await.unwrap(), needed);
    catalogue.make_private(&pointer.scene, &secret).await.unwrap();
    assert!(catalogue.public_blobs().await.unwrap().is_empty());
    database.drop().await;
}
