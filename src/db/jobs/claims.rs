//! Who bakes which job?
//!
//! A worker takes the job whose turn it is for some seconds, and again and again for some more; of whom nothing is heard in time,
//! its jobs wait again. So a job is one worker's, and one bakes a scene, whoever dies.

use std::{convert::Infallible, fmt, str::FromStr};

use sqlx::{AnyConnection, AssertSqlSafe, Row};

use super::{COLUMNS, StoredJob, stored};
use crate::db::{Catalogue, dialect::Dialect};

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
    /// Whether the job is still this worker's, and nobody has asked for its end. If so, nobody takes it before the transaction of
    /// this connection ends.
    pub(in crate::db) async fn hold(&self, connection: &mut AnyConnection) -> Result<bool, sqlx::Error> {
        const HELD: &str = "UPDATE jobs SET worker = worker \
            WHERE job = $1 AND worker = $2 AND state = 'running' AND cancelling = 0";
        let held = sqlx::query(HELD)
            .bind(&self.job)
            .bind(&self.worker)
            .execute(connection)
            .await?;
        Ok(held.rows_affected() > 0)
    }
}

impl Catalogue {
    /// Takes the next waiting job whose scene nobody bakes; it is this worker's from now on, for so many seconds. No other worker
    /// gets the same job, nor another one of the same scene: of these the oldest is the first, as the newest is to be what is
    /// served. Of different scenes next is whose key has had the fewest baked lately, those that are being
    /// baked counted: so no key keeps others waiting with many. Of these the oldest.
    pub async fn claim_job(&self, worker: &str, lease_s: u32) -> anyhow::Result<Option<StoredJob>> {
        let claimed = sqlx::query(AssertSqlSafe(claiming(self.dialect)))
            .bind(worker)
            .bind(i64::from(lease_s))
            .bind(-LATELY_S)
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
            .fetch_all(&self.vital)
            .await?;
        rows.iter()
            .map(|row| Ok((row.try_get("job")?, row.try_get::<i64, _>("cancelling")? != 0)))
            .collect()
    }

    /// How far a worker is with its job (JSON), for other servers to tell.
    pub async fn keep_progress(&self, (job, worker): (&str, &str), progress: &str) -> anyhow::Result<()> {
        sqlx::query(
            "UPDATE jobs SET progress = $1 WHERE job = $2 AND worker = $3 AND state = 'running' \
             AND progress IS DISTINCT FROM $1",
        )
        .bind(progress)
        .bind(job)
        .bind(worker)
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// A worker's job waits again, because this server ends.
    pub async fn put_job_back(&self, job: &str, worker: &str) -> anyhow::Result<()> {
        let sql = format!(
            "{} WHERE job = $1 AND worker = $2 AND state = 'running'",
            waiting(self.dialect)
        );
        sqlx::query(AssertSqlSafe(sql))
            .bind(job)
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// A worker's job waits again, because there is no room for it now, or somebody whom it needs did not answer; that is counted.
    pub async fn interrupt_job(&self, job: &str, worker: &str) -> anyhow::Result<()> {
        let requeue = requeue(self.dialect);
        sqlx::query(AssertSqlSafe(format!("{requeue} AND job = $1 AND worker = $2")))
            .bind(job)
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What this worker was baking when it ended waits again, and what nobody says to be baking.
    pub async fn requeue_jobs_of(&self, worker: &str) -> anyhow::Result<()> {
        let requeue = requeue(self.dialect);
        sqlx::query(AssertSqlSafe(format!("{requeue} AND (worker = $1 OR worker IS NULL)")))
            .bind(worker)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What was being baked by workers of which nothing was heard in time waits again.
    pub async fn requeue_forsaken_jobs(&self) -> anyhow::Result<()> {
        let (requeue, now) = (requeue(self.dialect), self.dialect.now());
        let sql = AssertSqlSafe(format!("{requeue} AND lease_until < {now}"));
        sqlx::query(sql).execute(&self.vital).await?;
        Ok(())
    }

    /// A worker's job has ended, in this state, with this error or that report; one whose end somebody has asked for, and that is
    /// not done, is cancelled. Says whether it was still its own.
    pub async fn end_job(
        &self,
        (job, worker): (&str, &str),
        state: &str,
        error: Option<&str>,
        report: Option<&str>,
    ) -> anyhow::Result<bool> {
        let sql = AssertSqlSafe(format!(
            "UPDATE jobs SET state = CASE WHEN cancelling = 1 AND $1 = 'failed' THEN 'cancelled' ELSE $1 END, error = $2, report = $3, ended_at = {} \
             WHERE job = $4 AND worker = $5 AND state = 'running'",
            self.dialect.now()
        ));
        let ended = sqlx::query(sql)
            .bind(state)
            .bind(error)
            .bind(report)
            .bind(job)
            .bind(worker)
            .execute(&self.vital)
            .await?;
        Ok(ended.rows_affected() > 0)
    }
}

/// Takes the next job for worker `$1`, for `$2` seconds; what has ended in the last `-$3` seconds counts for whose turn it is.
pub(super) fn claiming(dialect: Dialect) -> String {
    let (now, until, lately) = (dialect.now(), dialect.in_seconds("$2"), dialect.in_seconds("$3"));
    // The condition outside counts for whoever waited here while another worker took the job. What is baked and what has ended
    // are counted apart, each by key and end: of a key that has had very many jobs few are looked at.
    format!(
        "UPDATE jobs SET state = 'running', worker = $1, lease_until = {until}, progress = NULL, \
         started_at = coalesce(started_at, {now}) \
         WHERE state = 'queued' AND job = (SELECT job FROM jobs AS waiting WHERE state = 'queued' AND NOT EXISTS \
           (SELECT 1 FROM jobs AS other WHERE other.scene = waiting.scene AND (other.state = 'running' \
             OR (other.state = 'queued' AND (other.created_at, other.job) < (waiting.created_at, waiting.job)))) \
           ORDER BY (SELECT count(*) FROM jobs AS baked WHERE baked.key_id = waiting.key_id \
               AND baked.ended_at IS NULL AND baked.state = 'running') \
             + (SELECT count(*) FROM jobs AS had WHERE had.key_id = waiting.key_id \
               AND had.ended_at > {lately} AND had.started_at IS NOT NULL), created_at, job LIMIT 1) \
         RETURNING {COLUMNS}"
    )
}

/// What ended so long ago counts no more for whose turn it is.
pub(super) const LATELY_S: i64 = 24 * 3600;

/// A job is nobody's any more, and waits; where somebody has asked for its end, which its worker had no time for, it has ended.
fn waiting(dialect: Dialect) -> String {
    format!(
        "UPDATE jobs SET state = CASE WHEN cancelling = 1 THEN 'cancelled' ELSE 'queued' END, \
         ended_at = CASE WHEN cancelling = 1 THEN {} END, worker = NULL, lease_until = NULL",
        dialect.now()
    )
}

/// What is being baked is so no more, and that is counted.
fn requeue(dialect: Dialect) -> String {
    format!(
        "{}, interrupted = interrupted + 1 WHERE state = 'running'",
        waiting(dialect)
    )
}
