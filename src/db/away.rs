//! Why does the catalogue not do what was asked: is it away, or its disk full, and what should an operator read of that?

use sqlx::error::DatabaseError;

use super::{Catalogue, connect::CONNECT_PATIENCE, dialect::Dialect};

/// What the driver tells by how many bytes it has missed.
const CLOSED: &str = "PostgreSQL closed the connection, or a proxy before it did";

/// Nobody has answered.
#[derive(Debug, thiserror::Error)]
#[error("no answer within {CONNECT_PATIENCE:?}")]
pub(super) struct Silent;

/// What a database says, without the line of its own program where it says so.
pub(super) fn told(error: sqlx::Error) -> anyhow::Error {
    let error = anyhow::Error::from(error);
    match error.downcast_ref() {
        Some(sqlx::Error::Database(said)) if !was_away(&error) => anyhow::anyhow!("{}", said.message()),
        _ if was_closed(&error) => error.context(CLOSED),
        _ => error,
    }
}

/// Why a file cannot be opened, and what to do where it is no catalogue.
pub(super) fn of_a_file(error: sqlx::Error, place: &str) -> anyhow::Error {
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
        let code = error.as_database_error().and_then(DatabaseError::code);
        code.is_some_and(|code| FULL.contains(&code.as_ref()))
    };
    error.chain().any(|cause| cause.downcast_ref().is_some_and(full))
}

/// Whether the other side has closed a connection without a word, as a database that is killed does, or a proxy before it.
fn was_closed(error: &anyhow::Error) -> bool {
    use std::io::ErrorKind as K;
    let closed = |error: &sqlx::Error| match error {
        sqlx::Error::Io(error) => matches!(
            error.kind(),
            K::UnexpectedEof | K::ConnectionReset | K::ConnectionAborted | K::BrokenPipe | K::NotConnected
        ),
        _ => false,
    };
    error.chain().any(|cause| cause.downcast_ref().is_some_and(closed))
}

impl Catalogue {
    /// What has gone wrong, for the log: where PostgreSQL has closed a connection, whose that was and what becomes of it too.
    #[must_use]
    pub fn why(&self, error: &anyhow::Error) -> String {
        if self.dialect == Dialect::Postgres && was_closed(error) {
            let place = &self.place;
            return format!("{CLOSED}, to {place}; it is tried again over another one ({error:#})");
        }
        format!("{error:#}")
    }
}

#[cfg(test)]
mod tests {
    use anyhow::Context;
    use sqlx::{AnyConnection, AnyPool, Connection, any::AnyConnectOptions};
    use tokio::{io::AsyncReadExt, net::TcpListener};

    use super::*;
    use crate::db::trial::Trials;

    /// A server, or a proxy without one behind it, that listens to the first words and closes; gives its address.
    async fn closing() -> String {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        tokio::spawn(async move {
            while let Ok((mut stream, _)) = listener.accept().await {
                _ = stream.read(&mut [0; 1024]).await;
            }
        });
        format!("{address}/catalogue")
    }

    #[tokio::test]
    async fn that_postgresql_has_closed_a_connection_is_told_with_where_that_is() {
        let place = closing().await;
        let url = format!("postgres://me:hush@{place}?sslmode=disable");
        let opening = Catalogue::connect(&url.as_str().into()).await.unwrap_err();
        let told = format!("{opening:#}");
        assert!(
            told.contains(CLOSED) && told.contains(&place) && !told.contains("hush"),
            "{told}"
        );
        assert!(was_away(&opening), "{told}");

        let options: AnyConnectOptions = url.parse().unwrap();
        let pool = AnyPool::connect_lazy_with(options.clone());
        let catalogue = Catalogue {
            vital: pool.clone(),
            pool,
            dialect: Dialect::Postgres,
            place: format!("the catalogue in PostgreSQL at {place}").into(),
            trials: Trials::default(),
        };
        let closed = AnyConnection::connect_with(&options).await.map(drop);
        let told = catalogue.why(&closed.context("cannot read which jobs there are").unwrap_err());
        assert!(
            told.starts_with(CLOSED) && told.contains(&place) && told.contains("tried again"),
            "{told}"
        );
        assert!(told.contains("cannot read which jobs there are"), "{told}");
        let other = anyhow::anyhow!("no such table").context("cannot read");
        assert_eq!(catalogue.why(&other), "cannot read: no such table");
    }
}
