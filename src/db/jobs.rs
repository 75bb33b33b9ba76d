//! Which uploads are on their way, and what became of those that ended?

use belvedere_scene::SceneName;
use sqlx::{AssertSqlSafe, Row, sqlite::SqliteRow};

use super::Catalogue;

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
}

const COLUMNS: &str = "SELECT job, scene, title, state, source_bytes, interrupted, error, report, created_at, \
     started_at, ended_at FROM jobs";
const NOW: &str = "strftime('%Y-%m-%dT%H:%M:%fZ', 'now')";

impl Catalogue {
    /// Keeps a new job as queued, unless `most` jobs of its key, or `most_of_all` jobs, have not ended yet. Says
    /// whether there was room.
    pub async fn keep_job(&self, new: &NewJob<'_>, most: u32, most_of_all: u32) -> anyhow::Result<bool> {
        const OPEN: &str = "SELECT count(*) FROM jobs WHERE state IN ('queued', 'running')";
        let sql = AssertSqlSafe(format!(
            "INSERT INTO jobs (job, scene, title, state, source_bytes, key_id) SELECT ?, ?, ?, 'queued', ?, ? \
             WHERE ({OPEN} AND key_id = ?) < ? AND ({OPEN}) < ?"
        ));
        let kept = sqlx::query(sql)
            .bind(new.job)
            .bind(new.scene.as_str())
            .bind(new.title)
            .bind(i64::try_from(new.source_bytes)?)
            .bind(new.key_id)
            .bind(new.key_id)
            .bind(i64::from(most))
            .bind(i64::from(most_of_all))
            .execute(&self.pool)
            .await?;
        Ok(kept.rows_affected() > 0)
    }

    /// How many jobs of a key, and of all keys, have not ended.
    pub async fn open_jobs(&self, key_id: &str) -> anyhow::Result<(u32, u32)> {
        let row = sqlx::query(
            "SELECT count(*) FILTER (WHERE key_id = ?) AS theirs, count(*) AS total FROM jobs \
             WHERE state IN ('queued', 'running')",
        )
        .bind(key_id)
        .fetch_one(&self.pool)
        .await?;
        Ok((row.try_get("theirs")?, row.try_get("total")?))
    }

    /// A job by its name.
    pub async fn job(&self, job: &str) -> anyhow::Result<Option<StoredJob>> {
        let sql = AssertSqlSafe(format!("{COLUMNS} WHERE job = ?"));
        let row = sqlx::query(sql).bind(job).fetch_optional(&self.pool).await?;
        row.as_ref().map(stored).transpose()
    }

    /// Jobs that have not ended, oldest first.
    pub async fn unfinished_jobs(&self) -> anyhow::Result<Vec<StoredJob>> {
        let sql = AssertSqlSafe(format!("{COLUMNS} WHERE state IN ('queued', 'running') ORDER BY rowid"));
        let rows = sqlx::query(sql).fetch_all(&self.pool).await?;
        rows.iter().map(stored).collect()
    }

    /// A waiting job is being baked from now on; says whether it was still waiting.
    pub async fn start_job(&self, job: &str) -> anyhow::Result<bool> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = 'running', started_at = coalesce(started_at, {NOW}) \
             WHERE job = ? AND state = 'queued'"
        ));
        Ok(sqlx::query(sql).bind(job).execute(&self.pool).await?.rows_affected() > 0)
    }

    /// Ends a job that waits; says whether it did.
    pub async fn cancel_waiting_job(&self, job: &str) -> anyhow::Result<bool> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = 'cancelled', ended_at = {NOW} WHERE job = ? AND state = 'queued'"
        ));
        Ok(sqlx::query(sql).bind(job).execute(&self.pool).await?.rows_affected() > 0)
    }

    /// A job waits again, because this server ends.
    pub async fn put_job_back(&self, job: &str) -> anyhow::Result<()> {
        sqlx::query("UPDATE jobs SET state = 'queued' WHERE job = ? AND state = 'running'")
            .bind(job)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What was running when the last server ended waits again.
    pub async fn requeue_interrupted_jobs(&self) -> anyhow::Result<()> {
        sqlx::query("UPDATE jobs SET state = 'queued', interrupted = interrupted + 1 WHERE state = 'running'")
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// A job has ended, in this state, with this error or that report.
    pub async fn end_job(
        &self,
        job: &str,
        state: &str,
        error: Option<&str>,
        report: Option<&str>,
    ) -> anyhow::Result<()> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = ?, error = ?, report = ?, ended_at = {NOW} WHERE job = ?"
        ));
        sqlx::query(sql)
            .bind(state)
            .bind(error)
            .bind(report)
            .bind(job)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// Forgets jobs that ended more than so many days ago.
    pub async fn forget_ended_jobs(&self, days: u32) -> anyhow::Result<()> {
        sqlx::query("DELETE FROM jobs WHERE ended_at < strftime('%Y-%m-%dT%H:%M:%fZ', 'now', ?)")
            .bind(format!("-{days} days"))
            .execute(&self.pool)
            .await?;
        Ok(())
    }
}

fn stored(row: &SqliteRow) -> anyhow::Result<StoredJob> {
    Ok(StoredJob {
        job: row.try_get("job")?,
        scene: row.try_get::<&str, _>("scene")?.parse()?,
        title: row.try_get("title")?,
        state: row.try_get("state")?,
        source_bytes: u64::try_from(row.try_get::<i64, _>("source_bytes")?)?,
        interrupted: row.try_get("interrupted")?,
        error: row.try_get("error")?,
        report: row.try_get("report")?,
        created_at: row.try_get("created_at")?,
        started_at: row.try_get("started_at")?,
        ended_at: row.try_get("ended_at")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn add(catalogue: &Catalogue, job: &str, key_id: &str) -> bool {
        let new = NewJob {
            job,
            scene: &"town".parse().unwrap(),
            title: None,
            source_bytes: 7,
            key_id,
        };
        catalogue.keep_job(&new, 2, 3).await.unwrap()
    }

    #[tokio::test]
    async fn each_key_and_all_together_have_a_quota_of_open_jobs() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        assert!(add(&catalogue, "a1", "a").await && add(&catalogue, "a2", "a").await);
        assert!(!add(&catalogue, "a3", "a").await, "two of one key");
        assert!(add(&catalogue, "b1", "b").await);
        assert!(!add(&catalogue, "b2", "b").await, "three of all");
        catalogue.end_job("a1", "done", None, Some("{}")).await.unwrap();
        assert!(add(&catalogue, "a3", "a").await, "what has ended makes room");
        assert_eq!(catalogue.open_jobs("a").await.unwrap(), (2, 3));
    }

    #[tokio::test]
    async fn what_was_running_when_a_server_ended_waits_again_and_is_counted() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        assert!(add(&catalogue, "a1", "a").await && add(&catalogue, "a2", "a").await);
        assert!(catalogue.start_job("a1").await.unwrap());
        assert!(!catalogue.start_job("a1").await.unwrap(), "it runs already");
        assert!(!catalogue.cancel_waiting_job("a1").await.unwrap());
        catalogue.requeue_interrupted_jobs().await.unwrap();
        let open = catalogue.unfinished_jobs().await.unwrap();
        let states: Vec<_> = open
            .iter()
            .map(|j| (j.job.as_str(), j.state.as_str(), j.interrupted))
            .collect();
        assert_eq!(states, [("a1", "queued", 1), ("a2", "queued", 0)]);
        assert!(open[0].started_at.is_some());
        catalogue.start_job("a1").await.unwrap();
        catalogue.put_job_back("a1").await.unwrap();
        assert_eq!(catalogue.job("a1").await.unwrap().unwrap().interrupted, 1);
        assert!(catalogue.cancel_waiting_job("a2").await.unwrap());
        catalogue.forget_ended_jobs(1).await.unwrap();
        assert_eq!(catalogue.job("a2").await.unwrap().unwrap().state, "cancelled");
    }
}
