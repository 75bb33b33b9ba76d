//! What becomes of sessions whose node dies, or whose database is away? Nodes that share PostgreSQL and hear each other
//! through NATS.

use std::time::Duration;

use belvedere::{db::Catalogue, secret::Secret};
use futures_util::future::join;
use serde_json::json;

use crate::{
    away::Postgres,
    faulty::Way,
    live_wire::ask,
    nats::{Nats, enter, hears_gone, ready, within},
    program::{Data, Server, THREE_ROOMS},
    shared::Database,
    wire::metric,
};

const TAKEN_UP: &str = "belvedere_live_taken_up_sessions_total";

/// A scene in a catalogue of PostgreSQL.
fn rooms(url: &str) -> Data {
    let data = Data::new();
    let file = data.write("rooms.plan", THREE_ROOMS);
    let file = file.to_str().expect("a path in UTF-8");
    data.ok(&["bake", file, "--scene", "rooms", "--database", url]);
    data
}

async fn node(data: &Data, url: &str, nats: &Nats, name: &str) -> Server {
    let server = data.serve_with(&["--database", url, "--nats", &nats.url(), "--node", name]);
    ready(&server, "nats: answers").await;
    server
}

/// Waits until the catalogue has a line for a session, or none any more.
async fn is_kept(url: &str, session: &str, kept: bool) {
    let catalogue = Catalogue::connect(&Secret::from(url)).await.expect("the catalogue");
    let number = session.trim_start_matches('s').parse().expect("a number");
    within(async {
        while catalogue
            .kept_sessions(&[number])
            .await
            .expect("an answer")
            .remove(0)
            .is_some()
            != kept
        {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await;
}

#[ignore = "needs PostgreSQL and nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn who_loses_its_node_goes_on_at_another_and_at_one_alone() {
    let (database, nats) = (Database::new().await, Nats::start().await);
    let data = rooms(&database.url);
    let (a, b, c) = (
        node(&data, &database.url, &nats, "a").await,
        node(&data, &database.url, &nats, "b").await,
        node(&data, &database.url, &nats, "c").await,
    );
    let mut west = enter(&a, 2.5, 2.5).await;
    let last = west.listen().await.wait("hello").await;
    let east = enter(&b, 6.5, 2.5).await;
    let mut east_hears = east.listen().await;
    assert_eq!(east_hears.wait("object-info").await.data["object"], west.object);
    is_kept(&database.url, &west.session, true).await;

    // While its node lives, the others say so.
    let pose = json!({"position": [2.6, 1.5, 2.5]});
    for other in [&b, &c] {
        west.address = other.address();
        let misdirected = west.put("/pose", &pose).await;
        assert_eq!(misdirected.status, 421, "{misdirected:?}");
        let problem = misdirected.problem();
        assert_eq!(problem["type"], "/problems/misdirected");
        let detail = problem["detail"].as_str().expect("a detail");
        assert!(
            detail.contains(&west.session) && detail.contains("another node"),
            "{detail}"
        );
        assert_eq!(metric(other.address(), TAKEN_UP).await, "0");
    }
    west.address = a.address();
    west.stand(json!([2.6, 1.5, 2.5])).await;

    // When it is dead, one of those that are asked has the session, whatever the others wish.
    a.kill();
    let path = west.path("/pose");
    let text = pose.to_string();
    let put = |server: &Server| {
        let (address, body) = (server.address(), ("application/json", text.as_str()));
        ask(address, ("PUT", path.as_str()), Some(&west.token), body)
    };
    let (at_b, at_c) = join(put(&b), put(&c)).await;
    let mut statuses = [at_b.status, at_c.status];
    statuses.sort_unstable();
    assert_eq!(statuses, [200, 421], "{at_b:?} {at_c:?}");
    let (home, other) = if at_b.status == 200 { (&b, &c) } else { (&c, &b) };
    assert_eq!(metric(home.address(), TAKEN_UP).await, "1");
    assert_eq!(metric(other.address(), TAKEN_UP).await, "0");

    west.address = home.address();
    let mut hears = west.listen_after(&format!("Last-Event-ID: {}\r\n", last.id)).await;
    let resync = hears.next().await;
    assert!(resync.name == "resync" && resync.id > last.id, "{resync:?}");
    assert_eq!(hears.next().await.data["object"], west.object);
    assert_eq!(hears.wait("object-info").await.data["object"], east.object);
    within(async {
        loop {
            west.stand(json!([2.8, 1.5, 2.5])).await;
            let heard = tokio::time::timeout(Duration::from_millis(200), east_hears.wait_for(&west.object, 2.8));
            if heard.await.is_ok() {
                break;
            }
            west.stand(json!([2.7, 1.5, 2.5])).await;
        }
    })
    .await;

    // Whoever is stopped properly need not be missed first.
    let (home, left) = if home.base == b.base { (b, c) } else { (c, b) };
    assert_eq!(home.stop().0, Some(0));
    west.address = left.address();
    let mut hears = west.listen_after(&format!("Last-Event-ID: {}\r\n", resync.id)).await;
    let again = hears.next().await;
    assert!(again.name == "resync" && again.id > resync.id, "{again:?}");
    assert_eq!(west.leave().await, 204);
    is_kept(&database.url, &west.session, false).await;
    drop(left);
    database.drop().await;
}

#[ignore = "needs PostgreSQL and nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_was_taken_for_dead_parts_from_what_others_have_taken_up() {
    let (database, nats) = (Database::new().await, Nats::start().await);
    let data = rooms(&database.url);
    let (a, b) = (
        // It waited for the catalogue while it stood still.
        node(&data, &database.url, &nats, "a").await.may_warn(),
        node(&data, &database.url, &nats, "b").await,
    );
    let mut west = enter(&a, 2.5, 2.5).await;
    let stays = enter(&a, 2.0, 2.0).await;
    let watcher = enter(&b, 3.5, 2.5).await;
    let mut watches = watcher.listen().await;
    is_kept(&database.url, &west.session, true).await;
    is_kept(&database.url, &stays.session, true).await;
    // Else B may ask for what it sees only once nobody answers.
    while watches.wait("object-info").await.data["object"] != west.object {}
    a.pause();
    assert_eq!(hears_gone(&mut watches, &west.object).await, "left");
    west.address = b.address();
    west.stand(json!([2.6, 1.5, 2.5])).await;
    a.resume();
    // It finds out by itself.
    within(async {
        while metric(a.address(), "belvedere_live_sessions").await != "1" {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await;
    west.stand(json!([2.7, 1.5, 2.5])).await;
    stays.stand(json!([2.1, 1.5, 2.0])).await;
    west.address = a.address();
    let pose = json!({"position": [2.6, 1.5, 2.5]});
    assert_eq!(west.put("/pose", &pose).await.status, 421);
    drop((a, b));
    database.drop().await;
}

#[ignore = "needs PostgreSQL and nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_has_lost_the_database_alone_keeps_who_is_there_while_others_hear_it() {
    let (database, nats) = (Database::new().await, Nats::start().await);
    let data = rooms(&database.url);
    let (user, rest) = database.url.split_once('@').expect("a user");
    let (host, name) = rest.split_once('/').expect("a name");
    let server = host.parse().expect("the address of a database on this machine");
    let way = Way::to(server).await;
    let url = format!("{user}@{}/{name}", way.address);
    let (a, b) = (
        node(&data, &url, &nats, "a").await.may_warn(),
        node(&data, &database.url, &nats, "b").await,
    );
    let mut west = enter(&a, 2.5, 2.5).await;
    let east = enter(&b, 3.5, 2.5).await;
    let mut east_hears = east.listen().await;
    while east_hears.wait("object-info").await.data["object"] != west.object {}
    is_kept(&database.url, &west.session, true).await;
    way.cut();
    let pose = json!({"position": [2.6, 1.5, 2.5]});
    // The first time perhaps since its number has just risen, and later although it does not rise any more.
    for _ in 0..3 {
        west.address = b.address();
        let misdirected = west.put("/pose", &pose).await;
        assert_eq!(misdirected.status, 421, "{misdirected:?}");
        tokio::time::sleep(Duration::from_secs(3)).await;
    }
    assert_eq!(metric(b.address(), TAKEN_UP).await, "0");
    west.address = a.address();
    west.stand(json!([2.7, 1.5, 2.5])).await;
    drop((a, b));
    database.drop().await;
}

#[ignore = "needs PostgreSQL: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn while_the_database_is_away_people_come_and_go_and_those_who_came_outlive_their_server() {
    let postgres = Postgres::start("sessions");
    let url = postgres.url();
    let data = rooms(&url);
    let key = data.ok(&["keys", "create", "--database", &url]).trim().to_owned();
    let server = data.serve_with(&["--database", &url]).may_warn();
    let early = enter(&server, 2.5, 2.5).await;
    is_kept(&url, &early.session, true).await;

    postgres.kill();
    let mut late = enter(&server, 6.5, 2.5).await;
    late.stand(json!([6.6, 1.5, 2.5])).await;
    let mut hears = late.listen().await;
    assert_eq!(hears.wait("object-info").await.data["object"], early.object);
    // Nobody who leaves waits for the database, as whoever shows a key does.
    let plan = ("application/octet-stream", THREE_ROOMS);
    tokio::select! {
        left = early.leave() => assert_eq!(left, 204),
        refused = ask(server.address(), ("PUT", "/v1/scenes/other"), Some(&key), plan) => panic!("{refused:?}"),
    }
    server
        .until_it_says("sessions go on here and cannot be taken up elsewhere")
        .await;

    postgres.again();
    is_kept(&url, &early.session, false).await;
    is_kept(&url, &late.session, true).await;
    server.until_it_says("sessions can be taken up elsewhere again").await;
    server.kill();
    let server = data.serve_with(&["--database", &url]);
    late.address = server.address();
    late.stand(json!([6.7, 1.5, 2.5])).await;
    drop(server);
    postgres.kill();
}
