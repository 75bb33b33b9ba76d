//! Which scenes are published, and which revision of each is current?
//!
//! The catalogue is a small SQLite database beside the blobs, or a PostgreSQL database that several nodes share. Publishing inserts a revision with its blobs and moves
//! the scene's pointer in **one transaction, last**: a crash before it leaves the old revision served and nothing but
//! blobs that `gc` collects.
//!
//! It also holds what of live sessions outlives the server ([`KeptMover`], [`KeptDoor`], [`KeptSession`]), and who may change
//! what is published ([`StoredKey`]), who may read what is not for everybody ([`PrivateScene`]), and what is on its way
//! ([`StoredJob`]).

mod change;
mod connect;
mod jobs;
mod kept;
mod keys;
mod lock;
mod private;
mod sessions;
mod trial;

use std::{collections::BTreeSet, time::Duration};

use anyhow::Context;
use belvedere_scene::{
    BlobName, Revision, SceneName,
    pointer::{Pointer, SceneList},
};
use sqlx::{AnyPool, AssertSqlSafe, Row};

use connect::Dialect;
pub use connect::{FILE_NAME, found_no_room, was_away};
pub use jobs::{Claim, NewJob, StoredJob};
pub use kept::{KeptDoor, KeptMover};
pub use keys::{NewKey, StoredKey};
pub use lock::BlobLock;
pub use private::PrivateScene;
pub use sessions::{HousedSession, KeptSession, SessionChanges, SessionHome, Taking};
use trial::Trials;

/// The catalogue. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Catalogue {
    pool: AnyPool,
    dialect: Dialect,
    trials: Trials,
}

/// A revision that is ready: all of its blobs are stored.
#[derive(Debug)]
pub struct NewRevision<'a> {
    /// Becomes the scene's pointer.
    pub pointer: &'a Pointer,
    /// A key over everything but the source files that decides the result.
    pub source_key: &'a str,
    /// Name and SHA-256 of each file that was read.
    pub sources: &'a [(String, String)],
    /// The bake's report.
    pub report: &'a serde_json::Value,
    /// Every blob with its size.
    pub blobs: &'a [(BlobName, u64)],
    /// The job that it comes of, if any.
    pub claim: Option<&'a Claim>,
}

/// What the current revision of a scene was made from.
#[derive(Debug)]
pub struct Baked {
    /// Its pointer.
    pub pointer: Pointer,
    /// The key over everything but the source files.
    pub source_key: String,
    /// Name and SHA-256 of each file that was read.
    pub sources: Vec<(String, String)>,
    /// The bake's report.
    pub report: serde_json::Value,
}

/// A revision that one may go back to.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct KeptRevision {
    /// Which.
    pub revision: Revision,
    /// When it was published last; later than what was published before, also where the clock has been set back.
    pub published_at: String,
    /// Whether it is what is served.
    pub current: bool,
}

impl Catalogue {
    /// Adds a revision and moves the scene's pointer to it, in one transaction. Publishing the same revision again
    /// only moves the pointer. What comes of a job that has been given to another worker is refused: that one may have
    /// published, and newer ones after it.
    pub async fn publish(&self, new: &NewRevision<'_>) -> anyhow::Result<()> {
        let (scene, revision) = (new.pointer.scene.as_str(), new.pointer.revision.to_string());
        let mut tx = self.transaction().await?;
        if let Some(claim) = new.claim {
            let held = claim.hold(&mut tx).await?;
            anyhow::ensure!(
                held,
                "nothing was heard of this server for too long, so another one has the job"
            );
        }
        // The revision first, since it keeps whoever publishes the same revision waiting until this is done.
        let sql = AssertSqlSafe(format!(
            "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report, published_at) \
             VALUES ($1, $2, $3, $4, $5, $6, {}) \
             ON CONFLICT (scene, revision) DO UPDATE SET pointer = excluded.pointer, source_key = excluded.source_key, \
             sources = excluded.sources, report = excluded.report, published_at = excluded.published_at",
            self.dialect
                .now_after("(SELECT max(published_at) FROM revisions WHERE scene = $1)")
        ));
        sqlx::query(sql)
            .bind(scene)
            .bind(&revision)
            .bind(serde_json::to_string(new.pointer)?)
            .bind(new.source_key)
            .bind(serde_json::to_string(new.sources)?)
            .bind(new.report.to_string())
            .execute(&mut *tx)
            .await?;
        sqlx::query("DELETE FROM revision_blobs WHERE scene = $1 AND revision = $2")
            .bind(scene)
            .bind(&revision)
            .execute(&mut *tx)
            .await?;
        for blobs in new.blobs.chunks(BLOBS_AT_ONCE) {
            let rows: Vec<_> = (0..blobs.len())
                .map(|row| format!("($1, $2, ${}, ${})", 2 * row + 3, 2 * row + 4))
                .collect();
            let sql = format!(
                "INSERT INTO revision_blobs (scene, revision, blob, bytes) VALUES {}",
                rows.join(", ")
            );
            let mut insert = sqlx::query(AssertSqlSafe(sql)).bind(scene).bind(&revision);
            for (blob, bytes) in blobs {
                insert = insert.bind(blob.to_string()).bind(i64::try_from(*bytes)?);
            }
            insert.execute(&mut *tx).await?;
        }
        sqlx::query(
            "INSERT INTO scenes (scene, revision) VALUES ($1, $2) \
             ON CONFLICT (scene) DO UPDATE SET revision = excluded.revision",
        )
        .bind(scene)
        .bind(&revision)
        .execute(&mut *tx)
        .await?;
        tx.commit().await?;
        Ok(())
    }

    /// The pointers of all scenes, by name. Fails within seconds when the catalogue is away, also when its machine went
    /// without a word.
    pub async fn pointers(&self) -> anyhow::Result<Vec<Pointer>> {
        let reading = sqlx::query("SELECT pointer FROM scenes JOIN revisions USING (scene, revision) ORDER BY scene")
            .fetch_all(&self.pool);
        let rows = tokio::time::timeout(PATIENCE, reading).await;
        rows.context("the catalogue does not answer")??
            .iter()
            .map(|row| Ok(serde_json::from_str(row.try_get("pointer")?)?))
            .collect()
    }

    /// What the current revision of a scene was made from.
    pub async fn baked(&self, scene: &SceneName) -> anyhow::Result<Option<Baked>> {
        let row = sqlx::query(
            "SELECT pointer, source_key, sources, report FROM scenes JOIN revisions USING (scene, revision) \
             WHERE scene = $1",
        )
        .bind(scene.as_str())
        .fetch_optional(&self.pool)
        .await?;
        let Some(row) = row else { return Ok(None) };
        Ok(Some(Baked {
            pointer: serde_json::from_str(row.try_get("pointer")?)?,
            source_key: row.try_get("source_key")?,
            sources: serde_json::from_str(row.try_get("sources")?)?,
            report: serde_json::from_str(row.try_get("report")?)?,
        }))
    }

    /// The revisions of a scene that are kept, newest first.
    pub async fn kept_revisions(&self, scene: &SceneName) -> anyhow::Result<Vec<KeptRevision>> {
        let rows = sqlx::query(
            "SELECT r.revision, r.published_at, CASE WHEN s.revision IS NULL THEN 0 ELSE 1 END AS current \
             FROM revisions r LEFT JOIN scenes s ON s.scene = r.scene AND s.revision = r.revision \
             WHERE r.scene = $1 ORDER BY r.published_at DESC, r.revision",
        )
        .bind(scene.as_str())
        .fetch_all(&self.pool)
        .await?;
        rows.iter()
            .map(|row| {
                Ok(KeptRevision {
                    revision: row.try_get::<&str, _>("revision")?.parse()?,
                    published_at: row.try_get("published_at")?,
                    current: row.try_get::<i64, _>("current")? != 0,
                })
            })
            .collect()
    }

    /// Moves a scene's pointer to a revision that is kept; says whether it is.
    pub async fn make_current(&self, scene: &SceneName, revision: Revision) -> anyhow::Result<bool> {
        let moved = sqlx::query(
            "UPDATE scenes SET revision = $1 WHERE scene = $2 \
             AND EXISTS (SELECT 1 FROM revisions WHERE scene = $2 AND revision = $1)",
        )
        .bind(revision.to_string())
        .bind(scene.as_str())
        .execute(&self.pool)
        .await?;
        Ok(moved.rows_affected() > 0)
    }

    /// The blobs of a revision with their sizes, by name.
    pub async fn blobs_of(&self, scene: &SceneName, revision: Revision) -> anyhow::Result<Vec<(BlobName, u64)>> {
        let rows =
            sqlx::query("SELECT blob, bytes FROM revision_blobs WHERE scene = $1 AND revision = $2 ORDER BY blob")
                .bind(scene.as_str())
                .bind(revision.to_string())
                .fetch_all(&self.pool)
                .await?;
        rows.iter()
            .map(|row| {
                let bytes: i64 = row.try_get("bytes")?;
                Ok((row.try_get::<&str, _>("blob")?.parse()?, u64::try_from(bytes)?))
            })
            .collect()
    }

    /// Every blob that the newest `keep` revisions of some scene need; the current one always counts.
    pub async fn blobs_in_use(&self, keep: u32) -> anyhow::Result<BTreeSet<BlobName>> {
        let sql = AssertSqlSafe(format!(
            "SELECT DISTINCT blob FROM revision_blobs WHERE (scene, revision) NOT IN ({OLD_REVISIONS})"
        ));
        let rows = sqlx::query(sql).bind(i64::from(keep)).fetch_all(&self.pool).await?;
        rows.iter()
            .map(|row| Ok(row.try_get::<&str, _>("blob")?.parse()?))
            .collect()
    }

    /// How many revisions [`Catalogue::forget_old_revisions`] would remove.
    pub async fn old_revisions(&self, keep: u32) -> anyhow::Result<u64> {
        let sql = AssertSqlSafe(format!("SELECT count(*) AS old FROM ({OLD_REVISIONS}) AS aged"));
        let row = sqlx::query(sql).bind(i64::from(keep)).fetch_one(&self.pool).await?;
        Ok(u64::try_from(row.try_get::<i64, _>("old")?)?)
    }

    /// Forgets all but the newest `keep` revisions of each scene; the current one is always kept. Says how many went.
    pub async fn forget_old_revisions(&self, keep: u32) -> anyhow::Result<u64> {
        let sql = AssertSqlSafe(format!(
            "DELETE FROM revisions WHERE (scene, revision) IN ({OLD_REVISIONS})"
        ));
        Ok(sqlx::query(sql)
            .bind(i64::from(keep))
            .execute(&self.pool)
            .await?
            .rows_affected())
    }
}

/// Whoever follows the catalogue waits no longer for an answer.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);

/// So many rows are inserted by one statement: each takes a round trip, and parameters are numbered up to 32766.
const BLOBS_AT_ONCE: usize = 500;

/// Revisions that are neither current nor among the newest; binds how many to keep.
const OLD_REVISIONS: &str = "SELECT scene, revision FROM ( \
       SELECT scene, revision, row_number() OVER (PARTITION BY scene ORDER BY published_at DESC) AS age FROM revisions) AS aged \
     WHERE age > $1 AND (scene, revision) NOT IN (SELECT scene, revision FROM scenes)";

/// The list of scenes that these pointers make.
pub fn scene_list(pointers: &[Pointer]) -> SceneList {
    SceneList {
        scenes: pointers.iter().map(Pointer::summary).collect(),
    }
}
