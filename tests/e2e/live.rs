//! Who hears of whom in a baked building? Three rooms: a doorway joins two of them, the third is closed.

use std::net::SocketAddr;

use belvedere_client::HttpSource;
use serde_json::json;

use crate::{
    boxes::two_rooms,
    doors::{document, names},
    live_wire::{Person, ask, json},
    program::{Data, Server, THREE_ROOMS},
};

pub(crate) fn address(server: &Server) -> SocketAddr {
    server.base.trim_start_matches("http://").parse().expect("an address")
}

async fn enter(server: &Server, x: f64, z: f64) -> Person {
    let body = json!({"position": [x, 1.5, z], "max_speed_mps": 1.5, "radius_m": 0.3});
    Person::enter_scene(address(server), "rooms", &body).await
}

#[tokio::test(flavor = "multi_thread")]
async fn walls_hide_people_and_those_whom_they_hide_need_not_speak() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let west = enter(&server, 2.5, 2.5).await;
    let mut hears = west.listen().await;
    // Seen through the doorway, behind the wall of the closed room, and through the doorway again.
    let east = enter(&server, 6.5, 2.5).await;
    assert_eq!(hears.wait("object-info").await.data["object"], east.object);
    let closed_in = enter(&server, 10.5, 2.5).await;
    assert!(
        closed_in.hush["tbv"]["radius_m"].is_f64(),
        "nobody sees it: {}",
        closed_in.hush
    );
    let mut hears_nothing = closed_in.listen().await;
    assert!(closed_in.stand(json!([10.6, 1.5, 2.6])).await["hush"].is_object());
    east.stand(json!([6.6, 1.5, 2.5])).await;
    hears.wait("object-pos").await;
    assert_eq!(east.leave().await, 204);
    assert_eq!(hears.wait("object-gone").await.data["objects"], json!([east.object]));
    assert!(!hears.text.contains(&closed_in.object), "{}", hears.text);

    let (code, log) = server.stop();
    assert_eq!(code, Some(0), "open streams do not hold up the end: {log}");
    for stream in [&mut hears, &mut hears_nothing] {
        stream.ends().await;
    }
    assert!(!hears_nothing.text.contains("object-"), "{}", hears_nothing.text);
    for token in [&west.token, &closed_in.token] {
        assert!(!log.contains(token.as_str()), "the log shows a token");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_door_that_closes_hides_people_from_each_other_until_it_opens() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let server = data.serve();
    let west = enter(&server, 2.5, 2.5).await;
    let mut hears = west.listen().await;
    let east = enter(&server, 8.0, 2.5).await;
    let beside = enter(&server, 8.0, 1.0).await;
    let mut seen_by_east = east.listen().await;
    assert_eq!(hears.wait("object-info").await.data["object"], east.object);

    let source = HttpSource::new(&server.base).expect("an address");
    let around = document(&source, "/v1/scenes/rooms/objects?bbox=5,0,2,5.2,2.2,3").await;
    let door = names(&around)
        .into_iter()
        .find(|(node, _)| node == "door:between")
        .expect("a door")
        .1;
    let set = |open: bool| {
        let path = format!("/v1/scenes/rooms/doors/{door}");
        let (address, token) = (address(&server), west.token.clone());
        async move {
            json(address, ("PUT", &path), Some(&token), &json!({"open": open}))
                .await
                .status
        }
    };
    assert_eq!(set(false).await, 200);
    assert_eq!(hears.wait("door").await.data, json!({"object": door, "open": false}));
    let gone = hears.wait("object-gone").await.data;
    assert_eq!(gone["reason"], "hidden");
    assert_eq!(
        seen_by_east.wait("object-gone").await.data["objects"],
        json!([west.object])
    );
    assert!(
        west.stand(json!([2.5, 1.5, 2.5])).await["hush"].is_object(),
        "nobody sees it"
    );
    let so_far = hears.text.len();
    for step in 0..5 {
        east.stand(json!([8.0 + 0.1 * f64::from(step), 1.5, 2.5])).await;
        assert!(
            beside.stand(json!([8.0, 1.5, 1.0])).await["hush"].is_null(),
            "east sees it"
        );
    }

    assert_eq!(set(true).await, 200);
    assert_eq!(hears.wait("door").await.data["open"], true);
    east.stand(json!([8.2, 1.5, 2.5])).await;
    hears.wait("object-pos").await;
    let between = hears.text[so_far..].split("event: door").next().expect("a text");
    assert!(!between.contains("object-"), "while it was closed: {between}");
}

#[tokio::test(flavor = "multi_thread")]
async fn movers_that_stay_and_doors_are_as_they_were_after_a_kill() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let movers = "/v1/scenes/rooms/movers";
    let server = data.serve();
    let make = async |body: serde_json::Value| json(address(&server), ("POST", movers), None, &body).await.json();
    let text = |answer: &serde_json::Value, name: &str| answer[name].as_str().expect(name).to_owned();
    let robot = json!({"position": [2.0, 1.5, 2.5], "max_speed_mps": 2, "persistent": true, "name": "Robot"});
    let (robot, guest) = (make(robot).await, make(json!({"position": [3, 1.5, 2.5]})).await);
    let gone = make(json!({"position": [1, 1.5, 2.5], "persistent": true})).await;
    let key = |t_ms: u32, z: f64| json!({"t_ms": t_ms, "position": [4.0, 1.5, z]});
    let tram = make(json!({"trajectory": {"keys": [key(0, 1.0), key(60_000, 4.0)]}, "persistent": true})).await;
    let (robot_token, robot) = (text(&robot, "token"), text(&robot, "object"));
    let pose = format!("/v1/movers/{robot}/pose");
    let moved = json!({"position": [2.5, 1.5, 2.5]});
    assert_eq!(
        json(address(&server), ("PUT", &pose), Some(&robot_token), &moved)
            .await
            .status,
        200
    );
    let delete = format!("/v1/movers/{}", text(&gone, "object"));
    let none = ("application/json", "");
    assert_eq!(
        ask(address(&server), ("DELETE", &delete), Some(&text(&gone, "token")), none)
            .await
            .status,
        204
    );
    let door = "/v1/scenes/rooms/doors/o5";
    assert_eq!(
        json(
            address(&server),
            ("PUT", door),
            Some(&robot_token),
            &json!({"open": false})
        )
        .await
        .status,
        200
    );
    // Where a mover is follows a second behind.
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    server.kill();

    let server = data.serve();
    let still = json!({"position": [2.6, 1.5, 2.5]});
    assert_eq!(
        json(address(&server), ("PUT", &pose), Some(&robot_token), &still)
            .await
            .status,
        200
    );
    let other = json(
        address(&server),
        ("PUT", &format!("/v1/movers/{}/pose", text(&guest, "object"))),
        Some(&text(&guest, "token")),
        &moved,
    )
    .await;
    assert_eq!(other.status, 404, "it was not to stay");
    let person = enter(&server, 1.5, 2.5).await;
    let mut hears = person.listen().await;
    let mut infos = [
        hears.wait("object-info").await.data,
        hears.wait("object-info").await.data,
    ];
    infos.sort_by_key(|info| info["object"].to_string());
    assert_eq!(
        (&infos[0]["object"], &infos[0]["source_node"]),
        (&json!(robot), &json!("Robot"))
    );
    assert_eq!(infos[1]["object"], tram["object"]);
    let z = infos[1]["pose"]["position"][2].as_f64().expect("a number");
    assert!(z > 1.05, "it has gone on meanwhile: {z}");
    assert!(person.object > text(&tram, "object"), "ids are never used again");
}
