//! A database and a bucket of one test, on the servers that the environment names.

use std::{
    net::SocketAddr,
    sync::atomic::{AtomicU32, Ordering},
};

use belvedere::{db::Catalogue, secret::Secret, store::Bucket};
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection};

use crate::wire::send;

fn named(variable: &str) -> String {
    std::env::var(variable).unwrap_or_else(|_| panic!("{variable} is not set; run `make test-services`"))
}

/// A name that nothing else has: of this process, and counted in it.
fn fresh(prefix: &str) -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    format!(
        "{prefix}{}x{}",
        std::process::id(),
        COUNT.fetch_add(1, Ordering::Relaxed)
    )
}

/// An empty database.
pub(crate) struct Database {
    name: String,
    /// Its address, with a password that must be seen nowhere.
    pub(crate) url: String,
}

pub(crate) const PASSWORD: &str = "hush-hush";

impl Database {
    pub(crate) async fn new() -> Self {
        let name = fresh("belvedere_test_");
        let mut admin = admin().await;
        admin
            .execute(AssertSqlSafe(format!("CREATE DATABASE {name}")))
            .await
            .unwrap();
        let (server, _) = named("BELVEDERE_TEST_POSTGRES")
            .rsplit_once('/')
            .map(|(a, b)| (a.to_owned(), b.to_owned()))
            .unwrap();
        let (user, host) = server.trim_start_matches("postgres://").split_once('@').unwrap();
        let user = if user.contains(':') {
            user.to_owned()
        } else {
            format!("{user}:{PASSWORD}")
        };
        let url = format!("postgres://{user}@{host}/{name}");
        Self { name, url }
    }

    pub(crate) async fn catalogue(&self) -> Catalogue {
        Catalogue::connect(&Secret::from(self.url.as_str())).await.unwrap()
    }

    pub(crate) async fn sql(&self, sql: &str) {
        let mut connection = PgConnection::connect(&self.url).await.unwrap();
        connection.execute(AssertSqlSafe(sql.to_owned())).await.unwrap();
    }

    /// Removes it. After a test that failed it stays, to be looked at.
    pub(crate) async fn drop(self) {
        let sql = format!("DROP DATABASE {} WITH (FORCE)", self.name);
        admin().await.execute(AssertSqlSafe(sql)).await.unwrap();
    }
}

async fn admin() -> PgConnection {
    PgConnection::connect(&named("BELVEDERE_TEST_POSTGRES")).await.unwrap()
}

/// Where the S3 server listens.
pub(crate) fn s3() -> SocketAddr {
    named("BELVEDERE_TEST_S3")
        .trim_start_matches("http://")
        .parse()
        .unwrap()
}

/// Makes a bucket; gives the address of a place in it.
pub(crate) async fn bucket() -> String {
    let name = fresh("belvedere-test-");
    let made = send(s3(), "PUT", &format!("/{name}"), &[("Content-Length", "0")]).await;
    assert_eq!(made.status, 200, "{made:?}");
    format!("s3://{name}/worlds")
}

/// The place in the bucket, on this server or through what stands before it.
pub(crate) fn at(store: &str, server: SocketAddr) -> Bucket {
    Bucket::new(store, Some(&format!("http://{server}")), false).unwrap()
}
