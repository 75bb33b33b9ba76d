//! Which uploads are on their way, and what became of those that ended?

mod claims;
#[cfg(test)]
mod tests;

use belvedere_scene::SceneName;
use sqlx::{AssertSqlSafe, Row, any::AnyRow};

pub use self::claims::Claim;
use super::{Catalogue, private::hide_unseen};
use crate::secret::Secret;

/// A job as it is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredJob {
    /// Its name.
    pub job: String,
    /// What it publishes.
    pub scene: SceneName,
    /// The scene's name for people, if one was given.
    pub title: Option<String>,
    /// `queued`, `running`, `done`, `failed` or `cancelled`.
    pub state: String,
    /// What was uploaded.
    pub source_bytes: u64,
    /// How often a server has ended while it was baked.
    pub interrupted: u32,
    /// JSON: how far the bake is or was, as whoever bakes it has said last.
    pub progress: Option<String>,
    /// JSON: of a job that failed.
    pub error: Option<String>,
    /// JSON: of a job that is done.
    pub report: Option<String>,
    /// When it was uploaded.
    pub created_at: String,
    /// When its bake was first started.
    pub started_at: Option<String>,
    /// When it ended.
    pub ended_at: Option<String>,
}

/// A job that is about to be kept.
#[derive(Debug)]
pub struct NewJob<'a> {
    /// Its name.
    pub job: &'a str,
    /// What it publishes.
    pub scene: &'a SceneName,
    /// The scene's name for people.
    pub title: Option<&'a str>,
    /// What was uploaded.
    pub source_bytes: u64,
    /// Whose upload it is.
    pub key_id: &'a str,
    /// What links of its scene are to be signed with, where that is to be private.
    pub link_key: Option<&'a Secret>,
}

/// Whether a new job was kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeping {
    /// It waits.
    Kept,
    /// Too many have not ended.
    NoRoom,
    /// Its scene, which was to be private, is published for everybody.
    Public,
}

const COLUMNS: &str =
    "job, scene, title, state, source_bytes, interrupted, progress, error, report, created_at, started_at, ended_at";

impl Catalogue {
    /// Keeps a new job as queued, unless `most` jobs of its key, or `most_of_all` jobs, have not ended yet. With it its scene
    /// becomes private, if it is to; where the job is not kept, nothing has changed.
    pub async fn keep_job(&self, new: &NewJob<'_>, most: u32, most_of_all: u32) -> anyhow::Result<Keeping> {
        const OPEN: &str = "SELECT count(*) FROM jobs WHERE state IN ('queued', 'running')";
        let sql = AssertSqlSafe(format!(
            "INSERT INTO jobs (job, scene, title, state, source_bytes, key_id) SELECT $1, $2, $3, 'queued', $4, $5 \
             WHERE ({OPEN} AND key_id = $5) < $6 AND ({OPEN}) < $7"
        ));
        let mut tx = self.transaction().await?;
        let kept = sqlx::query(sql)
            .bind(new.job)
            .bind(new.scene.as_str())
            .bind(new.title)
            .bind(i64::try_from(new.source_bytes)?)
            .bind(new.key_id)
            .bind(i64::from(most))
            .bind(i64::from(most_of_all))
            .execute(&mut *tx)
            .await?;
        if kept.rows_affected() == 0 {
            return Ok(Keeping::NoRoom);
        }
        if let Some(link_key) = new.link_key
            && !hide_unseen(&mut tx, new.scene, link_key).await?
        {
            return Ok(Keeping::Public);
        }
        tx.commit().await?;
        Ok(Keeping::Kept)
    }

    /// How many jobs of a key, and of all keys, have not ended.
    pub async fn open_jobs(&self, key_id: &str) -> anyhow::Result<(u32, u32)> {
        let row = sqlx::query(
            "SELECT count(*) FILTER (WHERE key_id = $1) AS theirs, count(*) AS total FROM jobs \
             WHERE state IN ('queued', 'running')",
        )
        .bind(key_id)
        .fetch_one(&self.pool)
        .await?;
        let count = |name| -> anyhow::Result<u32> { Ok(u32::try_from(row.try_get::<i64, _>(name)?)?) };
        Ok((count("theirs")?, count("total")?))
    }

    /// A job by its name.
    pub async fn job(&self, job: &str) -> anyhow::Result<Option<StoredJob>> {
        let sql = AssertSqlSafe(format!("SELECT {COLUMNS} FROM jobs WHERE job = $1"));
        let row = sqlx::query(sql).bind(job).fetch_optional(&self.pool).await?;
        row.as_ref().map(stored).transpose()
    }

    /// Jobs that have not ended, oldest first.
    pub async fn unfinished_jobs(&self) -> anyhow::Result<Vec<StoredJob>> {
        let sql = AssertSqlSafe(format!(
            "SELECT {COLUMNS} FROM jobs WHERE state IN ('queued', 'running') ORDER BY created_at, job"
        ));
        let rows = sqlx::query(sql).fetch_all(&self.pool).await?;
        rows.iter().map(stored).collect()
    }

    /// How many jobs wait.
    pub async fn waiting_jobs(&self) -> anyhow::Result<u64> {
        let row = sqlx::query("SELECT count(*) AS waiting FROM jobs WHERE state = 'queued'")
            .fetch_one(&self.pool)
            .await?;
        Ok(u64::try_from(row.try_get::<i64, _>("waiting")?)?)
    }

    /// Ends a job that waits, and says whether it did; a worker that bakes it hears of the wish.
    pub async fn cancel_job(&self, job: &str) -> anyhow::Result<bool> {
        sqlx::query("UPDATE jobs SET cancelling = 1 WHERE job = $1 AND state IN ('queued', 'running')")
            .bind(job)
            .execute(&self.pool)
            .await?;
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = 'cancelled', ended_at = {} WHERE job = $1 AND state = 'queued'",
            self.dialect.now()
        ));
        Ok(sqlx::query(sql).bind(job).execute(&self.pool).await?.rows_affected() > 0)
    }

    /// Forgets jobs that ended more than so many days ago.
    pub async fn forget_ended_jobs(&self, days: u32) -> anyhow::Result<()> {
        let sql = AssertSqlSafe(format!(
            "DELETE FROM jobs WHERE ended_at < {}",
            self.dialect.in_seconds("$1")
        ));
        sqlx::query(sql)
            .bind(-24 * 3600 * i64::from(days))
            .execute(&self.pool)
            .await?;
        Ok(())
    }
}

fn stored(row: &AnyRow) -> anyhow::Result<StoredJob> {
    Ok(StoredJob {
        job: row.try_get("job")?,
        scene: row.try_get::<&str, _>("scene")?.parse()?,
        title: row.try_get("title")?,
        state: row.try_get("state")?,
        source_bytes: u64::try_from(row.try_get::<i64, _>("source_bytes")?)?,
        interrupted: u32::try_from(row.try_get::<i64, _>("interrupted")?)?,
        progress: row.try_get("progress")?,
        error: row.try_get("error")?,
        report: row.try_get("report")?,
        created_at: row.try_get("created_at")?,
        started_at: row.try_get("started_at")?,
        ended_at: row.try_get("ended_at")?,
    })
}
