//! Which scenes are published, and which revision of each is current?
//!
//! The catalogue is a small SQLite database beside the blobs, or a PostgreSQL database that several nodes share. Publishing inserts a revision with its blobs and moves
//! the scene's pointer in **one transaction, last**: a crash before it leaves the old revision served and nothing but
//! blobs that `gc` collects.
//!
//! It also holds what of live sessions outlives the server ([`KeptMover`], [`KeptDoor`], [`KeptSession`]), and who may change
//! what is published ([`StoredKey`]), who may read what is not for everybody ([`PrivateScene`]), and what is on its way
//! ([`StoredJob`]).

mod away;
mod change;
mod connect;
mod dialect;
mod identity;
mod jobs;
mod kept;
mod keys;
mod lock;
mod pool;
mod private;
mod removing;
mod sessions;
mod trial;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use anyhow::Context;
use belvedere_scene::{
    BlobName, Revision, SceneName,
    pointer::{Pointer, SceneList},
};
use sqlx::{AnyPool, AssertSqlSafe, Row};

pub use away::{found_no_room, was_away};
pub use connect::FILE_NAME;
use dialect::Dialect;
pub use jobs::{Claim, Keeping, NewJob, StoredJob};
pub use kept::{KeptDoor, KeptMover};
pub use keys::{NewKey, StoredKey};
pub use lock::BlobLock;
#[cfg(test)]
pub(crate) use pool::silence;
pub use private::PrivateScene;
pub use removing::Removed;
pub use sessions::{Beat, HousedSession, KeptSession, SessionChanges, SessionHome, Taking};
use trial::Trials;

/// The catalogue. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Catalogue {
    pool: AnyPool,
    /// For signs of life, for taking from who gives none, and for how jobs end. If these waited while visitors keep all other
    /// connections busy, a server that is well would be taken for dead. Which job is next takes longer to say, and may wait. A
    /// server takes sessions, ends a job, renews its jobs and is heard of at the same time: each has one, however long another
    /// one waits for rows that somebody changes.
    vital: AnyPool,
    dialect: Dialect,
    /// Where it is, for people.
    place: Arc<str>,
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
    /// Whether it is the first one of a bake that went on after it.
    pub preview: bool,
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
                "the job was cancelled meanwhile, or nothing was heard of this server for too long, so another one has it"
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
        let rows = match in_time(PATIENCE, reading).await {
            Err(error) if matches!(error.downcast_ref(), Some(sqlx::Error::PoolTimedOut)) => {
                return Err(pool::why_none(&self.pool).await);
            }
            rows => rows?,
        };
        rows.iter()
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

    /// The pointer of a revision of a scene, as long as that is kept.
    pub async fn pointer_of(&self, scene: &SceneName, revision: Revision) -> anyhow::Result<Option<Pointer>> {
        let row = sqlx::query("SELECT pointer FROM revisions WHERE scene = $1 AND revision = $2")
            .bind(scene.as_str())
            .bind(revision.to_string())
            .fetch_optional(&self.pool)
            .await?;
        row.map(|row| Ok(serde_json::from_str(row.try_get("pointer")?)?))
            .transpose()
    }

    /// The revisions of a scene that are kept, newest first.
    pub async fn kept_revisions(&self, scene: &SceneName) -> anyhow::Result<Vec<KeptRevision>> {
        let rows = sqlx::query(
            "SELECT r.revision, r.published_at, r.source_key, CASE WHEN s.revision IS NULL THEN 0 ELSE 1 END AS current \
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
                    preview: row.try_get::<&str, _>("source_key")?.starts_with(PREVIEW_OF),
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

    /// Which of these blobs current revisions need, each with the first scene that does, by name.
    pub async fn scenes_that_need(&self, blobs: &[BlobName]) -> anyhow::Result<BTreeMap<BlobName, SceneName>> {
        let places = (1..=blobs.len()).map(|place| format!("${place}"));
        let places = places.collect::<Vec<_>>().join(", ");
        let asked = format!(
            "SELECT blob, min(scene) AS scene FROM scenes JOIN revision_blobs USING (scene, revision) WHERE blob IN ({places}) GROUP BY blob"
        );
        let asking = blobs.iter().fold(sqlx::query(AssertSqlSafe(asked)), |asking, blob| {
            asking.bind(blob.to_string())
        });
        // One statement for each number of them is not worth remembering.
        let rows = asking.persistent(false).fetch_all(&self.pool).await?;
        rows.iter()
            .map(|row| {
                Ok((
                    row.try_get::<&str, _>("blob")?.parse()?,
                    row.try_get::<&str, _>("scene")?.parse()?,
                ))
            })
            .collect()
    }

    /// Every blob that the newest `keep` revisions of some scene need, previews left out; the current one always counts.
    pub async fn blobs_in_use(&self, keep: u32) -> anyhow::Result<BTreeSet<BlobName>> {
        let sql = AssertSqlSafe(format!(
            "SELECT DISTINCT blob FROM revision_blobs WHERE (scene, revision) NOT IN ({})",
            old_revisions()
        ));
        let rows = sqlx::query(sql).bind(i64::from(keep)).fetch_all(&self.pool).await?;
        rows.iter()
            .map(|row| Ok(row.try_get::<&str, _>("blob")?.parse()?))
            .collect()
    }

    /// How many revisions [`Catalogue::forget_old_revisions`] would remove.
    pub async fn old_revisions(&self, keep: u32) -> anyhow::Result<u64> {
        let sql = AssertSqlSafe(format!("SELECT count(*) AS old FROM ({}) AS aged", old_revisions()));
        let row = sqlx::query(sql).bind(i64::from(keep)).fetch_one(&self.pool).await?;
        Ok(u64::try_from(row.try_get::<i64, _>("old")?)?)
    }

    /// Forgets all but the newest `keep` revisions of each scene, and previews; the current one is always kept. Says how many went.
    pub async fn forget_old_revisions(&self, keep: u32) -> anyhow::Result<u64> {
        let sql = AssertSqlSafe(format!(
            "DELETE FROM revisions WHERE (scene, revision) IN ({})",
            old_revisions()
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

/// What the catalogue answers; an error when that takes longer, since its machine may be gone without a word.
pub(crate) async fn in_time<T, E: Into<anyhow::Error>>(
    limit: Duration,
    asking: impl Future<Output = Result<T, E>>,
) -> anyhow::Result<T> {
    let answer = tokio::time::timeout(limit, asking).await;
    answer.context("the catalogue does not answer")?.map_err(Into::into)
}

/// So many rows are inserted by one statement: each takes a round trip, and parameters are numbered up to 32766.
const BLOBS_AT_ONCE: usize = 500;

/// What the key begins with of a preview, which whoever bakes the same next shall not take for the whole.
pub(crate) const PREVIEW_OF: &str = "first of ";

/// Revisions that are neither current nor among the newest; binds how many to keep. Previews are not counted and are old at once:
/// `gc` runs beside no bake, so what comes after one is there or never will be.
fn old_revisions() -> String {
    format!(
        "SELECT scene, revision FROM ( \
           SELECT scene, revision, preview, row_number() OVER (PARTITION BY scene, preview ORDER BY published_at DESC) AS age FROM ( \
             SELECT scene, revision, published_at, CASE WHEN source_key LIKE '{PREVIEW_OF}%' THEN 1 ELSE 0 END AS preview \
             FROM revisions) AS told) AS aged \
         WHERE (age > $1 OR preview = 1) AND (scene, revision) NOT IN (SELECT scene, revision FROM scenes)"
    )
}

/// The list of scenes that these pointers make.
pub fn scene_list(pointers: &[Pointer]) -> SceneList {
    SceneList {
        scenes: pointers.iter().map(Pointer::summary).collect(),
    }
}

#[cfg(test)]
mod tests {
    use sqlx::Executor;

    use super::*;

    /// Where nothing but the data folder can be written there is no place for such a file.
    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn what_a_large_change_could_be_undone_by_is_in_no_temporary_file() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let mut tx = catalogue.transaction().await.unwrap();
        let revision = "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) \
             VALUES ('town', '1', '', '', '', '')";
        tx.execute(revision).await.unwrap();
        let names: Vec<_> = (0..20 * BLOBS_AT_ONCE)
            .map(|i| BlobName::of(&i.to_le_bytes(), "glb").unwrap())
            .collect();
        for some in names.chunks(BLOBS_AT_ONCE) {
            let rows: Vec<_> = some.iter().map(|blob| format!("('town', '1', '{blob}', 7)")).collect();
            let sql = format!(
                "INSERT INTO revision_blobs (scene, revision, blob, bytes) VALUES {}",
                rows.join(", ")
            );
            tx.execute(AssertSqlSafe(sql)).await.unwrap();
        }
        let open = std::fs::read_dir("/proc/self/fd").unwrap();
        let files = open.filter_map(|file| std::fs::read_link(file.unwrap().path()).ok());
        let temporary: Vec<_> = files
            .filter(|file| file.to_string_lossy().contains("etilqs_"))
            .collect();
        tx.commit().await.unwrap();
        assert!(temporary.is_empty(), "{temporary:?}");
    }

    #[tokio::test]
    async fn a_preview_is_not_one_of_the_revisions_to_keep() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let revisions = format!(
            "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report, published_at) VALUES \
             ('town', '0000000000000001', '', 'a', '', '', '1'), ('town', '0000000000000002', '', '{PREVIEW_OF}b', '', '', '2'), \
             ('town', '0000000000000003', '', 'b', '', '', '3'), ('hall', '0000000000000004', '', '{PREVIEW_OF}c', '', '', '1'); \
             INSERT INTO scenes VALUES ('town', '0000000000000003'), ('hall', '0000000000000004')"
        );
        catalogue.pool.execute(AssertSqlSafe(revisions)).await.unwrap();
        assert_eq!(catalogue.old_revisions(2).await.unwrap(), 1);
        assert_eq!(catalogue.forget_old_revisions(2).await.unwrap(), 1);
        let kept = async |scene: &str| {
            let kept = catalogue.kept_revisions(&scene.parse().unwrap()).await.unwrap();
            kept.iter().map(|kept| kept.preview).collect::<Vec<_>>()
        };
        assert_eq!(kept("town").await, [false, false]);
        assert_eq!(kept("hall").await, [true], "it is what is served");
    }

    #[tokio::test]
    async fn a_blob_is_needed_by_the_current_revision_that_names_it() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let [old, new, strange] = [b"old", b"new", b"who"].map(|bytes| BlobName::of(bytes, "glb").unwrap());
        let revision = "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) \
             VALUES ('town', '1', '', '', '', ''), ('town', '2', '', '', '', ''); \
             INSERT INTO scenes VALUES ('town', '2')";
        catalogue.pool.execute(revision).await.unwrap();
        for (revision, blob) in [("1", &old), ("2", &new)] {
            let insert = sqlx::query("INSERT INTO revision_blobs VALUES ('town', $1, $2, 7)");
            let insert = insert.bind(revision).bind(blob.to_string());
            insert.execute(&catalogue.pool).await.unwrap();
        }
        let needed = catalogue.scenes_that_need(&[old, new.clone(), strange]).await.unwrap();
        assert_eq!(needed, BTreeMap::from([(new, "town".parse().unwrap())]));
    }
}
