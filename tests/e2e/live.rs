//! Who hears of whom in a baked building? Three rooms: a doorway joins two of them, the third is closed.

use std::net::SocketAddr;

use serde_json::json;

use crate::{
    live_wire::Person,
    program::{Data, Server, THREE_ROOMS},
};

fn address(server: &Server) -> SocketAddr {
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
