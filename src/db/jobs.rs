//! Which uploads are on their way, and what became of those that ended?

use std::{convert::Infallible, fmt, str::FromStr};

use belvedere_scene::SceneName;
use sqlx::{AnyConnection, AssertSqlSafe, Row, any::AnyRow};

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

/// Whose a job is. As a text, `job/worker`, it reaches the process that bakes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The job's name.
    pub job: String,
    /// The name of the worker that has it.
    pub worker: String,
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.job, self.worker)
    }
}

/// Takes any text; a claim that nobody has made is not held.
impl FromStr for Claim {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let (job, worker) = text.split_once('/').unwrap_or((text, ""));
        Ok(Self {
            job: job.to_owned(),
            worker: worker.to_owned(),
        })
    }
}

impl Claim {
    /// Whether the job is still this worker's. If so, nobody takes it before the transaction of this connection ends.
    pub(super) async fn hold(&self, connection: &mut AnyConnection) -> Result<bool, sqlx::Error> {
        let held = sqlx::query("UPDATE jobs SET worker = worker WHERE job = $1 AND worker = $2 AND state = 'running'")
            .bind(&self.job)
            .bind(&self.worker)
            .execute(connection)
            .await?;
        Ok(held.rows_affected() > 0)
    }
}

const COLUMNS: &str =
    "job, scene, title, state, source_bytes, interrupted, error, report, created_at, started_at, ended_at";

impl Catalogue {
    /// Keeps a new job as queued, unless `most` jobs of its key, or `most_of_all` jobs, have not ended yet. Says
    /// whether there was room.
    pub async fn keep_job(&self, new: &NewJob<'_>, most: u32, most_of_all: u32) -> anyhow::Result<bool> {
        const OPEN: &str = "SELECT count(*) FROM jobs WHERE state IN ('queued', 'running')";
        let sql = AssertSqlSafe(format!(
            "INSERT INTO jobs (job, scene, title, state, source_bytes, key_id) SELECT $1, $2, $3, 'queued', $4, $5 \
             WHERE ({OPEN} AND key_id = $5) < $6 AND ({OPEN}) < $7"
        ));
        let kept = sqlx::query(sql)
            .bind(new.job)
            .bind(new.scene.as_str())
            .bind(new.title)
            .bind(i64::try_from(new.source_bytes)?)
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

    /// Takes the oldest waiting job whose scene nobody bakes; it is this worker's from now on, for so many seconds. No
    /// other worker gets the same job, nor another one of the same scene.
    pub async fn claim_job(&self, worker: &str, lease_s: u32) -> anyhow::Result<Option<StoredJob>> {
        let (now, until) = (self.dialect.now(), self.dialect.in_seconds("$2"));
        // The condition outside counts for whoever waited here while another worker took the job.
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = 'running', worker = $1, lease_until = {until}, \
             started_at = coalesce(started_at, {now}) \
             WHERE state = 'queued' AND job = (SELECT job FROM jobs AS waiting WHERE state = 'queued' AND NOT EXISTS \
               (SELECT 1 FROM jobs AS baked WHERE baked.scene = waiting.scene AND baked.state = 'running') \
               ORDER BY created_at, job LIMIT 1) \
             RETURNING {COLUMNS}"
        ));
        let claimed = sqlx::query(sql)
            .bind(worker)
            .bind(i64::from(lease_s))
            .fetch_all(&self.pool)
            .await;
        match claimed {
            Ok(rows) => rows.first().map(stored).transpose(),
            // Somebody has taken another job of the scene just now.
            Err(sqlx::Error::Database(error)) if error.is_unique_violation() => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// A worker is still at work: all of its jobs stay its own for so many seconds more. Gives them, and whether somebody has
    /// asked for their end.
    pub async fn renew_jobs(&self, worker: &str, lease_s: u32) -> anyhow::Result<Vec<(String, bool)>> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET lease_until = {} WHERE worker = $1 AND state = 'running' RETURNING job, cancelling",
            self.dialect.in_seconds("$2")
        ));
        let rows = sqlx::query(sql)
            .bind(worker)
            .bind(i64::from(lease_s))
            .fetch_all(&self.pool)
            .await?;
        rows.iter()
            .map(|row| Ok((row.try_get("job")?, row.try_get::<i64, _>("cancelling")? != 0)))
            .collect()
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

    /// A worker's job waits again, because this server ends.
    pub async fn put_job_back(&self, job: &str, worker: &str) -> anyhow::Result<()> {
        sqlx::query(
            "UPDATE jobs SET state = 'queued', worker = NULL, lease_until = NULL \
             WHERE job = $1 AND worker = $2 AND state = 'running'",
        )
        .bind(job)
        .bind(worker)
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// A worker's job waits again, because there is no room for it now, or somebody whom it needs did not answer; that is counted.
    pub async fn interrupt_job(&self, job: &str, worker: &str) -> anyhow::Result<()> {
        sqlx::query(AssertSqlSafe(format!("{REQUEUE} AND job = $1 AND worker = $2")))
            .bind(job)
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What this worker was baking when it ended waits again, and what nobody says to be baking.
    pub async fn requeue_jobs_of(&self, worker: &str) -> anyhow::Result<()> {
        sqlx::query(AssertSqlSafe(format!("{REQUEUE} AND (worker = $1 OR worker IS NULL)")))
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What was being baked by workers of which nothing was heard in time waits again.
    pub async fn requeue_forsaken_jobs(&self) -> anyhow::Result<()> {
        let sql = AssertSqlSafe(format!("{REQUEUE} AND lease_until < {}", self.dialect.now()));
        sqlx::query(sql).execute(&self.pool).await?;
        Ok(())
    }

    /// A worker's job has ended, in this state, with this error or that report. Says whether it was still its own.
    pub async fn end_job(
        &self,
        (job, worker): (&str, &str),
        state: &str,
        error: Option<&str>,
        report: Option<&str>,
    ) -> anyhow::Result<bool> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = $1, error = $2, report = $3, ended_at = {} \
             WHERE job = $4 AND worker = $5 AND state = 'running'",
            self.dialect.now()
        ));
        let ended = sqlx::query(sql)
            .bind(state)
            .bind(error)
            .bind(report)
            .bind(job)
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(ended.rows_affected() > 0)
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

const REQUEUE: &str = "UPDATE jobs SET state = 'queued', worker = NULL, lease_until = NULL, \
     interrupted = interrupted + 1 WHERE state = 'running'";

fn stored(row: &AnyRow) -> anyhow::Result<StoredJob> {
    Ok(StoredJob {
        job: row.try_get("job")?,
        scene: row.try_get::<&str, _>("scene")?.parse()?,
        title: row.try_get("title")?,
        state: row.try_get("state")?,
        source_bytes: u64::try_from(row.try_get::<i64, _>("source_bytes")?)?,
        interrupted: u32::try_from(row.try_get::<i64, _>("interrupted")?)?,
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
        };
        catalogue.keep_job(&new, 2, 3).await.unwrap()
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
}
