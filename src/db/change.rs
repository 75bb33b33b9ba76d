//! How is the catalogue changed, so that whoever hears that something is kept can rely on it?
//!
//! Changes that belong together go through [`Catalogue::transaction`], all of them. On a full disk SQLite rolls back by itself,
//! where the driver still counts a transaction: the next one over the same connection would be a savepoint, and when that is
//! rolled back the transaction around it, which nobody knows of, stays. All that is kept from there on would be seen by nobody
//! else and go with the process, and the write lock would stay. So a transaction begins with a statement that is refused inside
//! of another one, and a connection that still counts as in one when it is given back is closed ([`is_free`]).

use sqlx::{AnyConnection, AnyPool, Connection, Transaction, any::AnyRow};

use super::{Catalogue, Dialect};

impl Catalogue {
    /// What is changed by this is kept when it is committed, all of it, and not at all when it is dropped before.
    pub(super) async fn transaction(&self) -> Result<Transaction<'static, sqlx::Any>, sqlx::Error> {
        self.begin(&self.pool).await
    }

    /// The same over a connection that no visitor keeps busy.
    pub(super) async fn vital_transaction(&self) -> Result<Transaction<'static, sqlx::Any>, sqlx::Error> {
        self.begin(&self.vital).await
    }

    async fn begin(&self, pool: &AnyPool) -> Result<Transaction<'static, sqlx::Any>, sqlx::Error> {
        pool.begin_with(match self.dialect {
            // Who waits for the lock waits here, and no later statement finds that what it read is old.
            Dialect::Sqlite => "BEGIN IMMEDIATE",
            Dialect::Postgres => "BEGIN",
        })
        .await
    }
}

/// Whether a SQLite connection that is given back is in no transaction. One whose rollback failed still counts as in one.
pub(super) async fn is_free(connection: &mut AnyConnection) -> Result<bool, sqlx::Error> {
    // A rollback that nobody waits for has been tried when this is answered.
    connection.ping().await?;
    Ok(!connection.is_in_transaction())
}

/// What a statement that changes something returns, once the change is kept. `fetch_one` would give the row before SQLite has
/// written it, and say nothing when that fails.
pub(super) async fn returned(
    pool: &AnyPool,
    statement: sqlx::query::Query<'_, sqlx::Any, sqlx::any::AnyArguments>,
) -> Result<AnyRow, sqlx::Error> {
    let rows = statement.fetch_all(pool).await?;
    rows.into_iter().next().ok_or(sqlx::Error::RowNotFound)
}

#[cfg(test)]
mod tests {
    use sqlx::{AssertSqlSafe, Executor};

    use super::*;
    use crate::db::{KeptSession, SessionChanges};

    /// More than the pool ever has.
    const MANY: u64 = 12;

    fn opened(session: u64) -> SessionChanges {
        let kept = KeptSession {
            session,
            scene: "rooms".parse().unwrap(),
            visitor: "{}".into(),
            statics: false,
        };
        SessionChanges {
            opened: vec![kept],
            ..SessionChanges::default()
        }
    }

    fn standing(session: u64, stand: String) -> SessionChanges {
        SessionChanges {
            stands: vec![(session, stand)],
            ..SessionChanges::default()
        }
    }

    #[tokio::test]
    async fn what_is_kept_after_a_full_disk_is_there_for_everybody() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        for session in 0..MANY {
            catalogue.keep_sessions("a", &opened(session)).await.unwrap();
        }
        // The first rolls the whole transaction back, as SQLite does by itself when the disk is full as it commits.
        for failing in ["ROLLBACK", "ABORT"] {
            let full =
                format!("CREATE TRIGGER full BEFORE UPDATE ON sessions BEGIN SELECT RAISE({failing}, 'full'); END");
            catalogue.pool.execute(AssertSqlSafe(full)).await.unwrap();
            for session in 0..MANY {
                let lost = standing(session, "there".into());
                catalogue.keep_sessions("a", &lost).await.unwrap_err();
            }
            catalogue.pool.execute("DROP TRIGGER full").await.unwrap();
        }
        for session in 0..MANY {
            let small = standing(session, "here".into());
            catalogue.keep_sessions("a", &small).await.unwrap();
        }
        // Beside the first one, of which nothing is closed, as after a kill.
        let beside = Catalogue::open(data.path()).await.unwrap();
        let all: Vec<_> = (0..MANY).collect();
        for found in beside.kept_sessions(&all).await.unwrap() {
            assert_eq!(found.unwrap().stand.as_deref(), Some("here"));
        }
        beside.beat_home("b").await.unwrap();
    }

    #[tokio::test]
    async fn a_row_of_what_could_not_be_kept_is_not_given() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let pool = &catalogue.pool;
        let tables = "CREATE TABLE above (id INTEGER PRIMARY KEY); \
             CREATE TABLE below (above INTEGER REFERENCES above DEFERRABLE INITIALLY DEFERRED)";
        pool.execute(tables).await.unwrap();
        // What it hangs on is missed when it is committed, after its row was given.
        let orphan = sqlx::query("INSERT INTO below VALUES (7) RETURNING above");
        returned(pool, orphan).await.map(drop).unwrap_err();
        pool.execute("INSERT INTO above VALUES (7)").await.unwrap();
        let kept = sqlx::query("INSERT INTO below VALUES (7) RETURNING above");
        let row = returned(pool, kept).await.unwrap();
        assert_eq!(sqlx::Row::get::<i64, _>(&row, "above"), 7);
    }
}
