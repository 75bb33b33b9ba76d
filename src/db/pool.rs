//! Is a connection to PostgreSQL that has rested in the pool still of use, and why is there none to be had?
//!
//! A session may be left read-only for good when its database no longer is, as `default_transaction_read_only` and a standby
//! behind a proxy leave it. So a connection is asked for that before it is used, in place of the pool's own question whether
//! it is alive, which takes as long.

use std::time::Duration;

#[cfg(test)]
use sqlx::{Any, pool::PoolConnection};
use sqlx::{AnyConnection, AnyPool, Connection, Executor, Row};

use super::{away::Silent, connect::CONNECT_PATIENCE};

/// A connection lives at least this long, also where all new ones are read-only as well.
const YOUNG: Duration = Duration::from_secs(1);

/// Whether a connection of this age is alive and can be written, or is too young for another one to be different.
pub(super) async fn is_of_use(connection: &mut AnyConnection, age: Duration) -> bool {
    let asking = async {
        let row = connection.fetch_one("SHOW transaction_read_only").await?;
        row.try_get::<String, _>(0)
    };
    // One that does not answer is closed and not spoken of, since another one follows.
    asking.await.is_ok_and(|read_only| read_only == "off" || age < YOUNG)
}

/// Why the pool has given no connection. It tries again and again and then says that the time was over; one attempt beside it
/// is told what the database says.
pub(super) async fn why_none(pool: &AnyPool) -> anyhow::Error {
    let options = pool.connect_options();
    let connecting = tokio::time::timeout(CONNECT_PATIENCE, AnyConnection::connect_with(&options));
    let why = match connecting.await {
        Err(_) => Silent.into(),
        Ok(Err(error)) => error.into(),
        Ok(Ok(connection)) => {
            // That it cannot take its leave changes nothing.
            _ = connection.close().await;
            anyhow::Error::from(sqlx::Error::PoolTimedOut)
        }
    };
    why.context("no connection to the database was free in time")
}

/// Takes every connection that the catalogue reads with: as long as these are held, it answers nobody.
#[cfg(test)]
pub(crate) async fn silence(catalogue: &super::Catalogue) -> Vec<PoolConnection<Any>> {
    let mut held = Vec::new();
    for _ in 0..catalogue.pool.options().get_max_connections() {
        held.push(catalogue.pool.acquire().await.unwrap());
    }
    held
}
