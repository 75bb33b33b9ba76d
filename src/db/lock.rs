//! Who keeps blobs from being collected? Bakes on several nodes that share a PostgreSQL catalogue hold an advisory lock of
//! that database while they write; `gc` takes it alone. A catalogue in a data folder needs none: the folder has a lock file.
//!
//! Such a lock lives as long as its connection. Whoever depends on it asks [`BlobLock::holds`] before it publishes.

use std::time::Duration;

use sqlx::{AnyConnection, Connection, Row};

use super::{Catalogue, Dialect};

/// Names the lock among others of the database: "blobs" in ASCII.
const KEY: i64 = 0x62_6c_6f_62_73;
/// A connection that says nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(5);

/// A lock of the whole catalogue, until it is dropped or its connection breaks.
#[derive(Debug)]
pub struct BlobLock {
    /// None where a lock file does it.
    connection: Option<AnyConnection>,
}

impl Catalogue {
    /// Keeps `gc` away, on all nodes, beside others who do so too. Waits until a `gc` that is at work has ended.
    pub async fn lock_for_writing(&self) -> anyhow::Result<BlobLock> {
        let mut lock = self.lock().await?;
        if let Some(connection) = &mut lock.connection {
            sqlx::query("SELECT 1 AS locked FROM (SELECT pg_advisory_lock_shared($1)) AS lock")
                .bind(KEY)
                .execute(connection)
                .await?;
        }
        Ok(lock)
    }

    /// Keeps bakes away, on all nodes; `None` while one is at work.
    pub async fn lock_for_collecting(&self) -> anyhow::Result<Option<BlobLock>> {
        let mut lock = self.lock().await?;
        if let Some(connection) = &mut lock.connection {
            let row = sqlx::query("SELECT CASE WHEN pg_try_advisory_lock($1) THEN 1 ELSE 0 END AS locked")
                .bind(KEY)
                .fetch_one(connection)
                .await?;
            if row.try_get::<i64, _>("locked")? == 0 {
                return Ok(None);
            }
        }
        Ok(Some(lock))
    }

    async fn lock(&self) -> anyhow::Result<BlobLock> {
        let connection = match self.dialect {
            Dialect::Sqlite => None,
            Dialect::Postgres => Some(self.pool.acquire().await?.detach()),
        };
        Ok(BlobLock { connection })
    }
}

impl BlobLock {
    /// Whether it was held all the time until now.
    pub async fn holds(&mut self) -> bool {
        let Some(connection) = &mut self.connection else {
            return true;
        };
        let answer = tokio::time::timeout(PATIENCE, connection.ping()).await;
        answer.is_ok_and(|answer| answer.is_ok())
    }
}
