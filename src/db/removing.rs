//! What goes with a scene that shall be no more?

use belvedere_scene::SceneName;
use serde::Serialize;

use super::Catalogue;

/// What went with a scene.
#[derive(Debug, Default, PartialEq, Eq, Serialize)]
pub struct Removed {
    /// Revisions, of which one was served, unless only jobs were on their way.
    pub revisions: u64,
    /// Movers that were to outlive the server.
    pub movers: u64,
    /// Doors that did not stand as they were built.
    pub doors: u64,
    /// Jobs that would have published it again.
    pub jobs: u64,
}

impl Catalogue {
    /// Forgets a scene with all that hangs on it, in one transaction, and ends its jobs: at once those that wait; a worker that
    /// bakes one hears of the wish. Blobs stay until they are collected. Where it was private its name stays so, since it must
    /// not become public by being published anew.
    pub async fn remove_scene(&self, scene: &SceneName) -> anyhow::Result<Removed> {
        let mut tx = self.transaction().await?;
        let now = self.dialect.now();
        let ending = format!(
            "UPDATE jobs SET cancelling = 1, state = CASE WHEN state = 'queued' THEN 'cancelled' ELSE state END, \
             ended_at = CASE WHEN state = 'queued' THEN {now} END WHERE scene = $1 AND state IN ('queued', 'running')"
        );
        let mut run = async |sql: &str| -> anyhow::Result<u64> {
            let done = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(scene.as_str());
            Ok(done.execute(&mut *tx).await?.rows_affected())
        };
        let jobs = run(&ending).await?;
        // Whoever publishes changes the revision first, too, and then the pointer.
        run("UPDATE revisions SET source_key = source_key WHERE scene = $1").await?;
        run("DELETE FROM scenes WHERE scene = $1").await?;
        let removed = Removed {
            jobs,
            revisions: run("DELETE FROM revisions WHERE scene = $1").await?,
            movers: run("DELETE FROM kept_movers WHERE scene = $1").await?,
            doors: run("DELETE FROM kept_doors WHERE scene = $1").await?,
        };
        tx.commit().await?;
        Ok(removed)
    }
}

#[cfg(test)]
mod tests {
    use sqlx::Executor;

    use super::*;
    use crate::db::{Claim, Keeping, KeptDoor, KeptMover, NewJob};

    fn kept(object: u32) -> (KeptMover, KeptDoor) {
        let object = belvedere_scene::ObjectId(object);
        let mover = KeptMover {
            object,
            token: "t".into(),
            mover: "{}".into(),
            pose: None,
        };
        let door = KeptDoor {
            object,
            bounds: "{}".into(),
            open: true,
        };
        (mover, door)
    }

    #[tokio::test]
    async fn all_of_a_scene_goes_and_nothing_of_another_one() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        for scene in ["town", "hall"] {
            let rows = format!(
                "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES \
                   ('{scene}', '1', '', '', '', ''), ('{scene}', '2', '', '', '', ''); \
                 INSERT INTO revision_blobs VALUES ('{scene}', '1', 'b', 7); \
                 INSERT INTO scenes VALUES ('{scene}', '2'); \
                 INSERT INTO kept_movers (object, scene, token, mover) VALUES ({}, '{scene}', '', ''); \
                 INSERT INTO kept_doors VALUES ('{scene}', '2', 1, '', 1)",
                u8::from(scene == "hall"),
            );
            catalogue.pool.execute(sqlx::AssertSqlSafe(rows)).await.unwrap();
        }
        let town: SceneName = "town".parse().unwrap();
        let hall: SceneName = "hall".parse().unwrap();
        for (job, scene) in [("a1", &town), ("a2", &town), ("a3", &hall)] {
            let new = NewJob {
                job,
                scene,
                title: None,
                source_bytes: 7,
                key_id: "a",
                link_key: None,
            };
            assert_eq!(catalogue.keep_job(&new, 9, 9).await.unwrap(), Keeping::Kept);
        }
        assert_eq!(catalogue.claim_job("w", 60).await.unwrap().unwrap().job, "a1");
        let removed = catalogue.remove_scene(&town).await.unwrap();
        let all = Removed {
            revisions: 2,
            movers: 1,
            doors: 1,
            jobs: 2,
        };
        assert_eq!(removed, all);
        assert_eq!(catalogue.job("a2").await.unwrap().unwrap().state, "cancelled");
        assert_eq!(catalogue.renew_jobs("w", 60).await.unwrap(), [("a1".to_owned(), true)]);
        let counts = "SELECT (SELECT count(*) FROM revisions) + (SELECT count(*) FROM revision_blobs) + (SELECT count(*) FROM scenes) \
             + (SELECT count(*) FROM kept_movers) + (SELECT count(*) FROM kept_doors)";
        let left: i64 = sqlx::query_scalar(counts).fetch_one(&catalogue.pool).await.unwrap();
        assert_eq!(left, 6, "all of the hall");
        // Neither the worker that bakes it nor a server that runs brings anything of it back.
        let claim = Claim {
            job: "a1".into(),
            worker: "w".into(),
        };
        let mut tx = catalogue.transaction().await.unwrap();
        assert!(!claim.hold(&mut tx).await.unwrap());
        drop(tx);
        assert!(
            catalogue
                .end_job(("a1", "w"), "failed", Some("{}"), None)
                .await
                .unwrap()
        );
        assert_eq!(catalogue.job("a1").await.unwrap().unwrap().state, "cancelled");
        let (mover, door) = kept(9);
        let revision = "1".repeat(16).parse().unwrap();
        assert!(!catalogue.keep_mover(&town, &mover).await.unwrap());
        catalogue.keep_door(&town, revision, &door).await.unwrap();
        let left: i64 = sqlx::query_scalar(counts).fetch_one(&catalogue.pool).await.unwrap();
        assert_eq!(left, 6);
        assert!(catalogue.keep_mover(&hall, &mover).await.unwrap());
        catalogue.keep_door(&hall, revision, &door).await.unwrap();
        let left: i64 = sqlx::query_scalar(counts).fetch_one(&catalogue.pool).await.unwrap();
        assert_eq!(left, 8, "what is published keeps them");
        assert_eq!(catalogue.job("a3").await.unwrap().unwrap().state, "queued");
    }
}
