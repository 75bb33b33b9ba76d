//! Is what somebody uploads worn in other scenes, and does it outlive the scene that it came from?

use std::time::Duration;

use belvedere_client::{
    HttpSource,
    live::{Avatar, Participant, Session, SessionEvent, Stand},
};
use belvedere_live::event::FIRST_MOVER;
use serde_json::json;

use crate::{
    boxes::two_rooms,
    doors::{document, names},
    live_wire::{Person, json as ask},
    program::{Data, THREE_ROOMS},
    resuming::is_kept,
    uploading::{ended, key, upload_to},
    wire::get,
};

const PATIENCE: Duration = Duration::from_secs(30);

#[tokio::test(flavor = "multi_thread")]
async fn what_is_uploaded_is_worn_in_another_scene_and_outlives_its_own() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let key = key(&data);
    let server = data.serve();
    let job = upload_to(&server, "/v1/scenes/people", &key, THREE_ROOMS).await;
    assert_eq!(ended(&server, &job).await["state"], "done");
    let source = HttpSource::new(&server.base).expect("an address");
    let all = names(&document(&source, "/v1/scenes/people/objects?bbox=-9,-9,-9,99,9,99&limit=1000").await);
    let objects = [&all[0].1, &all[all.len() - 1].1];
    let pointer = document(&source, "/v1/scenes/people").await;
    let manifest = pointer["manifest"].as_str().expect("an address").to_owned();

    let at = json!({"position": [2.5, 1.5, 2.5], "radius_m": 0.3});
    let watcher = Person::enter_scene(server.address(), "rooms", &at).await;
    let mut hears = watcher.listen().await;
    hears.wait("hello").await;
    let who = Participant {
        avatar: Some(Avatar {
            scene: Some("people".parse().expect("a name")),
            object: objects[0].parse().expect("an object"),
        }),
        ..Participant::default()
    };
    let rooms = "rooms".parse().expect("a name");
    let mut wearer = Session::offered(source.clone(), &rooms, who)
        .await
        .expect("an answer")
        .expect("sessions");
    wearer.stand(Stand::upright([2.0, 1.5, 2.5]), [0.0; 3]);
    let opened = async {
        loop {
            if let Some(SessionEvent::Opened(object)) = wearer.advance().await {
                return object;
            }
        }
    };
    let object = tokio::time::timeout(PATIENCE, opened).await.expect("a session");
    let mover = json!({"position": [3.0, 1.5, 2.5], "persistent": true,
        "avatar": {"scene": "people", "object": objects[1]}});
    let made = ask(server.address(), ("POST", "/v1/scenes/rooms/movers"), None, &mover).await;
    assert_eq!(made.status, 201, "{made:?}");
    let mut urls = Vec::new();
    while urls.len() < 2 {
        let info = hears.wait("object-info").await.data;
        urls.push(info["levels"][0]["url"].as_str().expect("a model").to_owned());
    }
    assert_ne!(urls[0], urls[1]);
    is_kept(&data, &format!("s{}", object.0 - FIRST_MOVER), |_| true).await;
    server.kill();

    data.ok(&["remove", "people"]);
    data.ok(&["gc", "--keep", "1"]);
    let server = data.serve();
    for url in &urls {
        assert_eq!(get(server.address(), url).await.status, 200, "{url}");
    }
    assert_eq!(
        get(server.address(), &manifest).await.status,
        404,
        "what nobody wears has gone"
    );
    let watcher = Person::enter_scene(server.address(), "rooms", &at).await;
    let info = watcher.listen().await.wait("object-info").await.data;
    assert_eq!(
        info["levels"][0]["url"], urls[1],
        "the mover is back, and looks as it did"
    );
}
