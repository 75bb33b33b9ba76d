//! What becomes of people in a scene when their server dies and is started again? They go on: same session, same token.

use std::time::Duration;

use belvedere::db::{Catalogue, HousedSession};
use belvedere_client::live::{LiveEvent, SessionEvent};
use serde_json::json;
use tokio::time::Instant;

use crate::{
    live_wire::{Person, json},
    meeting::{self, Cable},
    program::{Data, Server, THREE_ROOMS},
    wire::metric,
};

const PATIENCE: Duration = Duration::from_secs(30);

fn rooms() -> Data {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data
}

async fn enter(server: &Server, x: f64) -> Person {
    let body = json!({"position": [x, 1.5, 2.5], "max_speed_mps": 1.5, "radius_m": 0.3});
    Person::enter_scene(server.address(), "rooms", &body).await
}

/// Waits until a line of the catalogue says so of a session.
pub(crate) async fn is_kept(data: &Data, session: &str, so: impl Fn(&HousedSession) -> bool) {
    let catalogue = Catalogue::open(&data.path()).await.expect("the catalogue");
    let number = session.trim_start_matches('s').parse().expect("a number");
    let end = Instant::now() + PATIENCE;
    loop {
        let line = catalogue.kept_sessions(&[number]).await.expect("an answer").remove(0);
        if line.as_ref().is_some_and(&so) {
            return;
        }
        assert!(Instant::now() < end, "{session}: {line:?}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_go_on_after_a_kill_where_they_were() {
    let data = rooms();
    let server = data.serve();
    let (mut west, mut east) = (enter(&server, 2.5).await, enter(&server, 6.5).await);
    let mut hears = west.listen().await;
    let last = hears.wait("object-info").await;
    assert_eq!(last.data["object"], east.object);
    east.stand(json!([7.0, 1.5, 2.5])).await;
    is_kept(&data, &west.session, |_| true).await;
    is_kept(&data, &east.session, |line| {
        line.stand.as_ref().is_some_and(|stand| stand.contains("7.0"))
    })
    .await;
    server.kill();

    let server = data.serve();
    (west.address, east.address) = (server.address(), server.address());
    let mut hears = west.listen_after(&format!("Last-Event-ID: {}\r\n", last.id)).await;
    let (resync, hello) = (hears.next().await, hears.next().await);
    assert_eq!(
        (resync.name.as_str(), &resync.data["reason"]),
        ("resync", &json!("missed"))
    );
    assert!(
        resync.id > last.id,
        "numbers only rise: {} after {}",
        resync.id,
        last.id
    );
    assert_eq!(
        (&hello.data["session"], &hello.data["object"]),
        (&json!(west.session), &json!(west.object))
    );
    assert!(hello.data["cell"].is_string(), "{:?}", hello.data);

    // The other one is back as soon as it listens, where it stood last.
    let mut east_hears = east.listen().await;
    let back = hears.wait("object-info").await.data;
    assert_eq!(
        (&back["object"], &back["pose"]["position"]),
        (&json!(east.object), &json!([7.0, 1.5, 2.5]))
    );
    assert_eq!(east_hears.wait("object-info").await.data["object"], west.object);
    east.stand(json!([7.1, 1.5, 2.5])).await;
    hears.wait_for(&east.object, 7.1).await;
    assert_eq!(
        metric(server.address(), "belvedere_live_taken_up_sessions_total").await,
        "2"
    );

    // What was heard since is resumed as ever, and a newcomer is somebody else.
    let mut again = west.listen_after(&format!("Last-Event-ID: {}\r\n", hello.id)).await;
    assert_eq!(again.next().await.id, hello.id + 1);
    let newcomer = enter(&server, 3.0).await;
    assert!(![&west.object, &east.object].contains(&&newcomer.object));

    assert_eq!(east.leave().await, 204);
    let (code, _) = server.stop();
    assert_eq!(code, Some(0));
    let server = data.serve();
    (west.address, east.address) = (server.address(), server.address());
    west.stand(json!([2.6, 1.5, 2.5])).await;
    let pose = json!({"position": [7, 1.5, 2.5]});
    assert_eq!(east.put("/pose", &pose).await.status, 404, "who has left has left");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_taken_up_once_and_by_nobody_without_its_token() {
    let data = rooms();
    let server = data.serve();
    let (mut west, other) = (enter(&server, 2.5).await, enter(&server, 6.5).await);
    is_kept(&data, &west.session, |_| true).await;
    is_kept(&data, &other.session, |_| true).await;
    server.kill();
    let server = data.serve();
    west.address = server.address();
    let (path, pose) = (west.path("/pose"), json!({"position": [2.6, 1.5, 2.5]}));
    for token in [None, Some(other.token.as_str())] {
        let stolen = json(west.address, ("PUT", &path), token, &pose).await;
        assert_eq!(stolen.status, 404, "{stolen:?}");
    }
    let poses = (0..8).map(|_| west.put("/pose", &pose));
    for answer in futures_util::future::join_all(poses).await {
        assert_eq!(answer.status, 200, "{answer:?}");
    }
    assert_eq!(
        metric(west.address, "belvedere_live_taken_up_sessions_total").await,
        "1"
    );
    let stolen = json(west.address, ("PUT", &path), Some(&other.token), &pose).await;
    assert_eq!(stolen.status, 403, "{stolen:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_program_goes_on_through_a_proxy_that_has_lost_its_server_for_a_while() {
    let data = rooms();
    let server = data.serve();
    let cable = Cable::to(server.address()).await;
    let mut person = meeting::Person::enter(&cable.base, "West", [2.5, 1.5, 2.5]).await;
    let hello = |event: &LiveEvent| matches!(event, LiveEvent::Hello(_));
    let end = Instant::now() + PATIENCE;
    while person.was_told(hello) == 0 {
        assert!(Instant::now() < end, "never greeted: {:?}", person.told);
        person.live().await;
    }
    let object = person.told.iter().find_map(|event| match event {
        SessionEvent::Opened(object) => Some(object.to_string()),
        _ => None,
    });
    let object = object.expect("an avatar");
    let number: u64 = object.trim_start_matches('o').parse().expect("a number");
    is_kept(&data, &format!("s{}", number - 100_000_000), |_| true).await;
    server.kill();
    cable.lead_to(None);
    // It is told 502 for a while, on the stream and on poses.
    let away = Instant::now() + Duration::from_secs(2);
    while Instant::now() < away {
        person.position[0] += 0.01;
        person.live().await;
    }
    let server = data.serve();
    cable.lead_to(Some(server.address()));
    let end = Instant::now() + PATIENCE;
    while person.was_told(hello) < 2 {
        assert!(Instant::now() < end, "never again: {:?}", person.told);
        person.live().await;
    }
    let opened = person
        .told
        .iter()
        .filter(|event| matches!(event, SessionEvent::Opened(_)));
    assert_eq!(opened.count(), 1, "it is the same session: {:?}", person.told);

    // Others find it where it is by now, though it has said so before the kill or into nothing.
    let watcher = enter(&server, 3.5).await;
    let mut hears = watcher.listen().await;
    let info = hears.wait("object-info").await.data;
    assert_eq!(info["object"], json!(object));
    let mut x = info["pose"]["position"][0].as_f64().expect("a number");
    while (x - person.position[0]).abs() > 0.05 {
        assert!(
            Instant::now() < end,
            "it is taken to be at {x}, not {}",
            person.position[0]
        );
        person.live().await;
        let next = tokio::time::timeout(Duration::from_millis(10), hears.wait("object-pos")).await;
        x = next.map_or(x, |moved| {
            moved.data["objects"][0]["position"][0].as_f64().expect("a number")
        });
    }
    person.session.close().await.expect("it leaves");
}
