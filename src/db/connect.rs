//! Which database holds the catalogue, and how is it reached? SQLite in the data folder, or PostgreSQL for several nodes.
//!
//! Every query is written once, in the SQL that both understand: `$1` for what is bound, integers for truth values, times
//! as texts in UTC. What differs stands in [`Dialect`], and in the two folders of migrations, which have the same versions.
//!
//! **Evolution.** Migrations expand first and contract a version later, so that nodes of two neighbouring versions share a
//! catalogue: a program takes a schema that is newer than it knows.

use std::{io::ErrorKind, path::Path, sync::Once, time::Duration};

use anyhow::Context;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_encode};
use sqlx::{
    AnyConnection, AnyPool, Connection, Executor,
    any::{AnyConnectOptions, AnyPoolOptions},
    migrate::Migrator,
};

use super::{Catalogue, change, pool, trial::Trials};
use crate::{folder, secret::Secret};

/// The file of the catalogue in a data folder.
pub const FILE_NAME: &str = "catalogue.sqlite";
/// How long a query waits for a connection to PostgreSQL; whoever asks over HTTP hears of it within its own time limit.
pub(super) const CONNECT_PATIENCE: Duration = Duration::from_secs(3);
const CONNECTIONS: u32 = 8;
/// So many more are for what must not wait behind whoever asks for something else.
const VITAL_CONNECTIONS: u32 = 4;
/// Writers of a SQLite file wait for each other for this long.
const BUSY: Duration = Duration::from_secs(10);

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

    fn migrations(self) -> Migrator {
        let mut migrations = match self {
            Self::Sqlite => sqlx::migrate!("migrations/sqlite"),
            Self::Postgres => sqlx::migrate!("migrations/postgres"),
        };
        migrations.set_ignore_missing(true);
        migrations
    }
}

impl Catalogue {
    /// Opens the catalogue of a data folder; makes both when they are not there and brings the schema up to date.
    ///
    /// # Errors
    /// When folder or file cannot be made, opened or brought up to date.
    pub async fn open(data: &Path) -> anyhow::Result<Self> {
        folder::make_data(data)?;
        let file = data.join(FILE_NAME);
        folder::make_private_file(&file).with_context(|| format!("cannot make {}", file.display()))?;
        let options = at(&file, "rwc")?;
        let place = format!("the catalogue {}", file.display());
        know_drivers();
        // A pool would try again and again, and then not say what is wrong.
        let first = async {
            let mut first = AnyConnection::connect_with(&options).await?;
            settle(&mut first).await?;
            first.close().await
        };
        first.await.map_err(|error| of_a_file(error, &place))?;
        let pool = AnyPoolOptions::new()
            .max_connections(4)
            .acquire_timeout(BUSY + CONNECT_PATIENCE)
            .after_connect(|connection, _| Box::pin(settle(connection)));
        let pool = pool.after_release(|connection, _| Box::pin(change::is_free(connection)));
        Self::over(pool, options, Dialect::Sqlite, &place).await
    }

    /// Whether the catalogue of a data folder can be read, where there is one; makes and changes nothing.
    ///
    /// # Errors
    /// When it cannot.
    pub async fn reach_file(data: &Path) -> anyhow::Result<()> {
        let file = data.join(FILE_NAME);
        let place = format!("the catalogue {}", file.display());
        match std::fs::metadata(&file) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            about => {
                let about = about.with_context(|| format!("cannot open {place}"))?;
                anyhow::ensure!(about.is_file(), "cannot open {place}: that is no file");
            }
        }
        know_drivers();
        // Nothing is made beside it. What somebody writes just now is in the log beside it.
        let is_in_use = data.join(format!("{FILE_NAME}-wal")).exists();
        let options = at(&file, if is_in_use { "ro" } else { "ro&immutable=true" })?;
        let reading = async {
            let mut connection = AnyConnection::connect_with(&options).await?;
            connection.execute("SELECT count(*) FROM sqlite_master").await?;
            connection.close().await
        };
        reading.await.map_err(|error| of_a_file(error, &place))
    }

    /// Connects to the catalogue in a PostgreSQL database, `postgres://user:password@host/name`, and brings the schema up
    /// to date. The database must be there; its tables are made. Several nodes may do this at the same time.
    ///
    /// # Errors
    /// When the address is none, nobody answers there within seconds, or the schema cannot be brought up to date. None
    /// holds the password.
    pub async fn connect(url: &Secret) -> anyhow::Result<Self> {
        let (options, place) = reached(url).await?;
        let pool = AnyPoolOptions::new()
            .max_connections(CONNECTIONS)
            .acquire_timeout(CONNECT_PATIENCE)
            .test_before_acquire(false)
            .before_acquire(|connection, about| {
                Box::pin(async move { Ok(pool::is_of_use(connection, about.age).await) })
            });
        Self::over(pool, options, Dialect::Postgres, &place).await
    }

    /// Whether a PostgreSQL database is there; changes nothing in it.
    ///
    /// # Errors
    /// As [`Catalogue::connect`].
    pub async fn reach(url: &Secret) -> anyhow::Result<()> {
        reached(url).await.map(drop)
    }

    async fn over(
        pool: AnyPoolOptions,
        options: AnyConnectOptions,
        dialect: Dialect,
        place: &str,
    ) -> anyhow::Result<Self> {
        know_drivers();
        let vital = pool.clone().max_connections(VITAL_CONNECTIONS);
        let vital = vital.connect_lazy_with(options.clone());
        let pool: AnyPool = pool
            .connect_with(options)
            .await
            .with_context(|| format!("cannot open {place}"))?;
        dialect
            .migrations()
            .run(&pool)
            .await
            .with_context(|| format!("cannot bring {place} up to date"))?;
        Ok(Self {
            pool,
            vital,
            dialect,
            trials: Trials::default(),
        })
    }
}

/// What every connection to a file has.
async fn settle(connection: &mut AnyConnection) -> Result<(), sqlx::Error> {
    // What a statement could be undone by would else be put into a file beside the data folder, where there may be no room for one.
    let settings = format!(
        "PRAGMA busy_timeout = {}; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; \
         PRAGMA temp_store = MEMORY;",
        BUSY.as_millis()
    );
    connection.execute(sqlx::AssertSqlSafe(settings)).await.map(drop)
}

/// Why a file cannot be opened, and what to do where it is no catalogue.
fn of_a_file(error: sqlx::Error, place: &str) -> anyhow::Error {
    /// `SQLITE_CORRUPT` and `SQLITE_NOTADB`.
    const DAMAGED: [&str; 2] = ["11", "26"];
    let way_out = match &error {
        sqlx::Error::Database(said) if said.code().is_some_and(|code| DAMAGED.contains(&code.as_ref())) => {
            "; put its copy there, or move it away to begin with an empty one"
        }
        _ => "",
    };
    told(error).context(format!("cannot open {place}{way_out}"))
}

/// A file, made when it is not there if the mode says so, as an address: that is all that both databases take.
fn at(file: &Path, mode: &str) -> anyhow::Result<AnyConnectOptions> {
    const KEPT: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'.').remove(b'-').remove(b'_');
    let path = percent_encode(file.as_os_str().as_encoded_bytes(), KEPT);
    Ok(format!("sqlite:{path}?mode={mode}").parse()?)
}

fn know_drivers() {
    static DRIVERS: Once = Once::new();
    DRIVERS.call_once(sqlx::any::install_default_drivers);
}

/// Nobody has answered.
#[derive(Debug, thiserror::Error)]
#[error("no answer within {CONNECT_PATIENCE:?}")]
pub(super) struct Silent;

/// What a database says, without the line of its own program where it says so.
fn told(error: sqlx::Error) -> anyhow::Error {
    let error = anyhow::Error::from(error);
    match error.downcast_ref() {
        Some(sqlx::Error::Database(said)) if !was_away(&error) => anyhow::anyhow!("{}", said.message()),
        _ => error,
    }
}

/// Connects once, since a pool would not say what is wrong; gives what the pool needs, and a name for errors.
async fn reached(url: &Secret) -> anyhow::Result<(AnyConnectOptions, String)> {
    know_drivers();
    // Whatever is wrong with an address, it is not repeated.
    let options: Result<AnyConnectOptions, _> = url.reveal().parse();
    let options = options
        .ok()
        .filter(|o| matches!(o.database_url.scheme(), "postgres" | "postgresql"));
    let options = options.with_context(|| {
        format!(
            "`database` must be an address like postgres://user:password@host/name; without it the catalogue is \
             {FILE_NAME} in the data folder"
        )
    })?;
    let url = &options.database_url;
    let (host, port) = (url.host_str().unwrap_or("localhost"), url.port().unwrap_or(5432));
    let place = format!("the catalogue in PostgreSQL at {host}:{port}{}", url.path());
    let cannot = || format!("cannot open {place}");
    let connecting = tokio::time::timeout(CONNECT_PATIENCE, AnyConnection::connect_with(&options));
    let connected = connecting.await.map_err(|_| Silent).with_context(cannot)?;
    let first = connected.map_err(told).with_context(cannot)?;
    first.close().await.with_context(cannot)?;
    Ok((options, place))
}

/// Whether the catalogue was away, so that the same may work another time.
#[must_use]
pub fn was_away(error: &anyhow::Error) -> bool {
    let away = |error: &sqlx::Error| match error {
        sqlx::Error::Io(_) | sqlx::Error::Tls(_) | sqlx::Error::PoolTimedOut | sqlx::Error::Protocol(_) => true,
        // Connections that broke (class 08), servers that have no room (53) or are going (57).
        sqlx::Error::Database(error) => error
            .code()
            .is_some_and(|code| ["08", "53", "57P"].iter().any(|class| code.starts_with(class))),
        _ => false,
    };
    // Nobody who would answer is as good as nobody who is there.
    let said_nothing =
        |cause: &(dyn std::error::Error + 'static)| cause.is::<tokio::time::error::Elapsed>() || cause.is::<Silent>();
    error
        .chain()
        .any(|cause| said_nothing(cause) || cause.downcast_ref().is_some_and(away))
}

/// Whether the disk had no room for what the catalogue should keep.
#[must_use]
pub fn found_no_room(error: &anyhow::Error) -> bool {
    /// `SQLITE_FULL`, `SQLITE_IOERR_SHMSIZE`, and PostgreSQL's `disk_full`.
    const FULL: [&str; 3] = ["13", "4874", "53100"];
    let full = |error: &sqlx::Error| {
        let code = error.as_database_error().and_then(sqlx::error::DatabaseError::code);
        code.is_some_and(|code| FULL.contains(&code.as_ref()))
    };
    error.chain().any(|cause| cause.downcast_ref().is_some_and(full))
}

#[cfg(test)]
mod tests {
    use sqlx::{Row, migrate::Migration};

    use super::*;

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
    async fn a_database_that_says_nothing_is_away() {
        let silent = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("postgres://user:secret@{}/catalogue", silent.local_addr().unwrap());
        let error = Catalogue::connect(&url.as_str().into()).await.unwrap_err();
        assert!(was_away(&error), "{error:#}");
        let told = format!("{error:#}");
        assert!(
            told.contains("127.0.0.1:") && told.ends_with(": no answer within 3s"),
            "{told}"
        );
    }

    #[tokio::test]
    async fn what_is_no_catalogue_is_told_at_once_and_left_as_it_is() {
        let data = tempfile::tempdir().unwrap();
        let file = data.path().join(FILE_NAME);
        Catalogue::reach_file(data.path()).await.unwrap();
        std::fs::write(
            &file,
            "no database, but a text that is long enough to be looked at as one".repeat(9),
        )
        .unwrap();
        for error in [
            Catalogue::open(data.path()).await.unwrap_err(),
            Catalogue::reach_file(data.path()).await.unwrap_err(),
        ] {
            let told = format!("{error:#}");
            assert!(
                told.contains("file is not a database") && told.contains("move it away"),
                "{told}"
            );
        }
        let left: Vec<_> = std::fs::read_dir(data.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        assert_eq!(left, [FILE_NAME]);
        std::fs::remove_file(&file).unwrap();
        std::fs::create_dir(&file).unwrap();
        assert!(Catalogue::open(data.path()).await.is_err() && Catalogue::reach_file(data.path()).await.is_err());
        std::fs::remove_dir(&file).unwrap();
        let open = Catalogue::open(data.path()).await.unwrap();
        Catalogue::reach_file(data.path()).await.unwrap();
        drop(open);
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
    async fn a_folder_with_any_name_can_hold_a_catalogue() {
        let data = tempfile::tempdir().unwrap();
        let odd = data.path().join("a b?c#d%20é");
        Catalogue::open(&odd).await.unwrap();
        assert!(odd.join(FILE_NAME).is_file());
    }

    #[tokio::test]
    async fn every_connection_to_a_file_writes_safely() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let mut connections = Vec::new();
        for _ in 0..3 {
            let mut connection = catalogue.pool.acquire().await.unwrap();
            let mut ask = async |sql: &'static str| sqlx::query(sql).fetch_one(&mut *connection).await.unwrap();
            assert_eq!(ask("PRAGMA journal_mode").await.get::<String, _>(0), "wal");
            for (sql, set) in [
                ("PRAGMA synchronous", 2),
                ("PRAGMA foreign_keys", 1),
                ("PRAGMA busy_timeout", 10_000),
                ("PRAGMA temp_store", 2),
            ] {
                assert_eq!(ask(sql).await.get::<i64, _>(0), set, "{sql}");
            }
            connections.push(connection);
        }
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

    #[tokio::test]
    async fn an_address_that_is_wrong_is_not_repeated() {
        for wrong in ["mysql://me:hush@host/db", "hush", "postgres://me:hush@127.0.0.1:1/db"] {
            let error = Catalogue::connect(&Secret::from(wrong)).await.unwrap_err();
            assert!(!format!("{error:#} {error:?}").contains("hush"), "{error:#}");
        }
    }
}
