//! Does the catalogue's pool of connections recover by itself, and does it say why it has none?

use belvedere::{db::Catalogue, secret::Secret};
use futures_util::future::join_all;
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection};

use crate::away::Postgres;

const END_ALL: &str = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE pid <> pg_backend_pid() \
     AND backend_type = 'client backend'";

/// Says it to the database, which takes it also where it is read-only for others.
async fn say(postgres: &Postgres, words: &[&str]) {
    let mut admin = PgConnection::connect(&postgres.url()).await.unwrap();
    admin.execute("SET default_transaction_read_only = off").await.unwrap();
    for sql in words {
        admin.execute(AssertSqlSafe((*sql).to_owned())).await.unwrap();
    }
}

/// Whether the catalogue can be written, asked often enough that each of its connections has been used.
async fn is_writable(catalogue: &Catalogue) -> bool {
    let scene = "rooms".parse().unwrap();
    let tries = (0..16).map(|_| catalogue.make_public(&scene));
    join_all(tries).await.iter().all(Result::is_ok)
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn a_database_that_was_read_only_for_a_while_is_written_again() {
    let postgres = Postgres::start("read-only");
    let catalogue = Catalogue::connect(&Secret::from(postgres.url().as_str()))
        .await
        .unwrap();
    assert!(is_writable(&catalogue).await);
    let setting = "ALTER DATABASE postgres SET default_transaction_read_only";
    say(&postgres, &[&format!("{setting} = on"), END_ALL]).await;
    assert!(!is_writable(&catalogue).await);
    assert!(catalogue.pointers().await.is_ok(), "it can still be read");
    // Its sessions stay, and each is read-only as long as it lives.
    say(&postgres, &[&format!("{setting} = off")]).await;
    for _ in 0..100 {
        if is_writable(&catalogue).await {
            return postgres.kill();
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    panic!("ten seconds were not enough");
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn why_no_connection_is_to_be_had_is_told_in_the_words_of_the_database() {
    let postgres = Postgres::start("no-room");
    let made = ["CREATE ROLE tenant LOGIN", "CREATE DATABASE catalogue OWNER tenant"];
    say(&postgres, &made).await;
    let url = postgres
        .url()
        .replace("belvedere@", "tenant@")
        .replace("/postgres", "/catalogue");
    let catalogue = Catalogue::connect(&Secret::from(url.as_str())).await.unwrap();
    say(&postgres, &["ALTER ROLE tenant CONNECTION LIMIT 0", END_ALL]).await;
    let error = catalogue.pointers().await.unwrap_err();
    assert!(
        format!("{error:#}").contains("too many connections for role"),
        "{error:#}"
    );
    assert!(belvedere::db::was_away(&error), "{error:#}");
    say(&postgres, &["ALTER ROLE tenant CONNECTION LIMIT -1"]).await;
    catalogue.pointers().await.unwrap();
    postgres.kill();
}
