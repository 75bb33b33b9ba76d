//! Which database holds the catalogue, and how is it reached? SQLite in the data folder, or PostgreSQL for several nodes.
//!
//! What they say differently stands in [`Dialect`], and what is wrong when they do not answer in [`away`](super::away).

use std::{io::ErrorKind, path::Path, sync::Once, time::Duration};

use anyhow::Context;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_encode};
use sqlx::{
    AnyConnection, AnyPool, Connection, Executor,
    any::{AnyConnectOptions, AnyPoolOptions},
};

use super::{
    Catalogue,
    away::{Silent, of_a_file, told},
    change,
    dialect::Dialect,
    pool,
    trial::Trials,
};
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
        Self::over(pool, options, Dialect::Sqlite, place).await
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
        Self::over(pool, options, Dialect::Postgres, place).await
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
        place: String,
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
            place: place.into(),
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

/// A file, made when it is not there if the mode says so, as an address: that is all that both databases take.
pub(super) fn at(file: &Path, mode: &str) -> anyhow::Result<AnyConnectOptions> {
    const KEPT: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'.').remove(b'-').remove(b'_');
    let path = percent_encode(file.as_os_str().as_encoded_bytes(), KEPT);
    Ok(format!("sqlite:{path}?mode={mode}").parse()?)
}

fn know_drivers() {
    static DRIVERS: Once = Once::new();
    DRIVERS.call_once(sqlx::any::install_default_drivers);
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

#[cfg(test)]
mod tests {
    use sqlx::Row;

    use super::*;
    use crate::db::was_away;

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
    async fn an_address_that_is_wrong_is_not_repeated() {
        for wrong in ["mysql://me:hush@host/db", "hush", "postgres://me:hush@127.0.0.1:1/db"] {
            let error = Catalogue::connect(&Secret::from(wrong)).await.unwrap_err();
            assert!(!format!("{error:#} {error:?}").contains("hush"), "{error:#}");
        }
    }
}
