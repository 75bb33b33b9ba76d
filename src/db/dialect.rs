//! What do the two databases say differently?
//!
//! Every query is written once, in the SQL that both understand: `$1` for what is bound, integers for truth values, times
//! as texts in UTC. What differs stands in [`Dialect`], and in the two folders of migrations, which have the same versions.
//!
//! **Evolution.** Migrations expand first and contract a version later, so that nodes of two neighbouring versions share a
//! catalogue: a program takes a schema that is newer than it knows.

use sqlx::migrate::Migrator;

/// What the two databases say differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    Sqlite,
    Postgres,
}

impl Dialect {
    /// What ends a SELECT whose rows must stay as they are until the transaction ends. SQLite has one writer.
    pub(super) fn held(self) -> &'static str {
        match self {
            Self::Sqlite => "",
            Self::Postgres => " FOR SHARE",
        }
    }

    /// SQL for this moment. Texts of this form are ordered as their times are.
    pub(super) fn now(self) -> &'static str {
        match self {
            Self::Sqlite => "strftime('%Y-%m-%dT%H:%M:%fZ', 'now')",
            Self::Postgres => "to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"')",
        }
    }

    /// SQL for so many seconds from now, negative ones before; `NULL` when they are.
    pub(super) fn in_seconds(self, seconds: &str) -> String {
        match self {
            Self::Sqlite => format!("strftime('%Y-%m-%dT%H:%M:%fZ', 'now', {seconds} || ' seconds')"),
            Self::Postgres => format!(
                "to_char((clock_timestamp() + CAST({seconds} AS double precision) * interval '1 second') \
                 AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"')"
            ),
        }
    }

    /// SQL for this moment or, where the clock has been set back, a millisecond after that time, which may be `NULL`.
    pub(super) fn now_after(self, time: &str) -> String {
        let now = self.now();
        match self {
            Self::Sqlite => {
                format!("max({now}, coalesce(strftime('%Y-%m-%dT%H:%M:%fZ', {time}, '+0.001 seconds'), ''))")
            }
            Self::Postgres => format!(
                "greatest({now}, to_char(CAST({time} AS timestamptz) AT TIME ZONE 'UTC' + interval '1 millisecond', \
                 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"'))"
            ),
        }
    }

    pub(super) fn migrations(self) -> Migrator {
        let mut migrations = match self {
            Self::Sqlite => sqlx::migrate!("migrations/sqlite"),
            Self::Postgres => sqlx::migrate!("migrations/postgres"),
        };
        migrations.set_ignore_missing(true);
        migrations
    }
}

#[cfg(test)]
mod tests {
    use sqlx::{AnyPool, Executor, Row, migrate::Migration};

    use super::*;
    use crate::db::{Catalogue, FILE_NAME, connect::at};

    #[test]
    fn both_databases_have_the_same_versions() {
        let versions = |dialect: Dialect| -> Vec<_> {
            let migrations = dialect.migrations();
            migrations.iter().map(|m| (m.version, m.description.clone())).collect()
        };
        assert_eq!(versions(Dialect::Sqlite), versions(Dialect::Postgres));
    }

    #[test]
    fn what_databases_out_there_were_made_with_has_not_changed() {
        let digest = |m: &Migration| {
            m.checksum
                .iter()
                .take(8)
                .map(|byte| format!("{byte:02x}"))
                .collect::<String>()
        };
        let digests: Vec<_> = Dialect::Sqlite.migrations().iter().take(4).map(digest).collect();
        assert_eq!(
            digests,
            [
                "5ce793edab3fce70",
                "9aec1d663063cb27",
                "513fcf01ddd1ba23",
                "2329d1e892530b9b"
            ]
        );
    }

    #[tokio::test]
    async fn every_earlier_schema_is_brought_up_to_date_with_what_it_holds() {
        sqlx::any::install_default_drivers();
        let all: Vec<Migration> = Dialect::Sqlite.migrations().iter().cloned().collect();
        for known in 0..=all.len() {
            let data = tempfile::tempdir().unwrap();
            let old = AnyPool::connect_with(at(&data.path().join(FILE_NAME), "rwc").unwrap())
                .await
                .unwrap();
            Migrator::with_migrations(all[..known].to_vec())
                .run(&old)
                .await
                .unwrap();
            if known >= 4 {
                let job =
                    "INSERT INTO jobs (job, scene, state, source_bytes, key_id) VALUES ('j', 'town', 'queued', 1, 'k')";
                old.execute(job).await.unwrap();
            }
            old.close().await;
            let catalogue = Catalogue::open(data.path()).await.unwrap();
            assert_eq!(catalogue.job("j").await.unwrap().is_some(), known >= 4, "from {known}");
        }
    }

    #[tokio::test]
    async fn a_schema_that_is_newer_is_taken_as_it_is() {
        let data = tempfile::tempdir().unwrap();
        let newer = Catalogue::open(data.path()).await.unwrap();
        let later = "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time) \
             VALUES (9999, 'later', TRUE, x'00', 0)";
        newer.pool.execute(later).await.unwrap();
        let older = Catalogue::open(data.path()).await.unwrap();
        assert!(older.pointers().await.unwrap().is_empty());
    }

    #[tokio::test]
    async fn times_are_of_one_form_and_go_by_the_second() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let sqlite = Dialect::Sqlite;
        let sql = format!("SELECT {} AS now, {} AS later", sqlite.now(), sqlite.in_seconds("$1"));
        let row = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(-90_i64);
        let row = row.fetch_one(&catalogue.pool).await.unwrap();
        let (now, before): (String, String) = (row.get("now"), row.get("later"));
        assert!(now.len() == "2026-01-01T00:00:00.000Z".len() && before.len() == now.len() && before < now);
    }

    #[tokio::test]
    async fn a_time_after_another_is_later_whatever_the_clock_says() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let sql = format!("SELECT {} AS after", Dialect::Sqlite.now_after("$1"));
        for ms in (0..1000).map(|ms| format!("{ms:03}")) {
            let time = format!("2999-12-31T23:59:58.{ms}Z");
            let row = sqlx::query(sqlx::AssertSqlSafe(sql.clone())).bind(&time);
            let after: String = row.fetch_one(&catalogue.pool).await.unwrap().get("after");
            assert!(after > time && after.starts_with("2999"), "{after} after {time}");
        }
        let row = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(None::<&str>);
        let now: String = row.fetch_one(&catalogue.pool).await.unwrap().get("after");
        assert!(now.starts_with("20"), "{now}");
    }
}
