//! Does an audit notice that somebody was to be silent whom others may see, and nothing where nothing is?

use std::time::Duration;

use belvedere_client::HttpSource;
use serde_json::json;

use crate::{
    auditing::{audit, enter, sum, tampered},
    boxes::two_rooms,
    doors::{document, names},
    live::address,
    live_wire::json as ask,
    program::Data,
};

#[tokio::test(flavor = "multi_thread")]
async fn who_is_not_woken_though_a_door_opens_is_found() {
    let data = Data::new();
    data.bake(&data.write("doors.glb", two_rooms()), "rooms");
    let server = data.serve_with(&["--record", "live.rec"]);
    let west = enter(&server, "rooms", [1.9, 2.5]).await;
    let east = enter(&server, "rooms", [6.9, 2.5]).await;
    let (mut hears_west, mut hears_east) = (west.listen().await, east.listen().await);
    assert_eq!(hears_west.wait("object-info").await.data["object"], east.object);
    let source = HttpSource::new(&server.base).expect("an address");
    let around = document(&source, "/v1/scenes/rooms/objects?bbox=5,0,2,5.2,2.2,3").await;
    let named = names(&around);
    let door = &named
        .iter()
        .find(|(node, _)| *node == "door:between")
        .expect("a door")
        .1;
    let path = format!("/v1/scenes/rooms/doors/{door}");
    let swing = async |open: bool| {
        let answer = ask(
            address(&server),
            ("PUT", &path),
            Some(&west.token),
            &json!({"open": open}),
        )
        .await;
        assert_eq!(answer.status, 200);
    };
    swing(false).await;
    assert_eq!(hears_west.wait("object-gone").await.data["reason"], "hidden");
    let hush = loop {
        let hush = hears_east.wait("hush").await.data;
        if hush["object"] == east.object {
            break hush;
        }
    };
    assert!(
        hush["tbv"]["radius_m"].as_f64().is_some_and(|radius_m| radius_m > 0.0),
        "{hush}"
    );
    swing(true).await;
    assert_eq!(hears_east.wait("wake").await.data["object"], east.object);
    // It says nothing all the same: its last pose counts after a while.
    hears_west.wait("object-pos").await;
    tokio::time::sleep(Duration::from_millis(2_000)).await;
    server.kill();

    let (clean, report) = audit(&data, "live.rec");
    assert!(clean && sum(&report, "hushed") > 0, "{report:#}");
    assert_eq!(sum(&report, "broken"), 0, "{report:#}");
    tampered(&data, "unwoken.rec", |_, output| {
        let told = output["told"].as_array_mut().expect("a list");
        told.retain(|told| told[1] != "wake");
    });
    let (clean, report) = audit(&data, "unwoken.rec");
    assert!(!clean && sum(&report, "misses") > 0, "{report:#}");
    let missed = &report["scenes"][0]["misses"]["first"][0];
    assert!(
        missed["why"].as_str().is_some_and(|why| why.contains("hush")),
        "{missed:#}"
    );
    let message = data.fails(&["audit", "unwoken.rec"]);
    assert!(message.contains("miss"), "{message}");

    // A promise of a place where the mover is not.
    tampered(&data, "elsewhere.rec", |_, output| {
        for told in output["told"].as_array_mut().expect("a list") {
            if told[1] == "hush" {
                told[2]["tbv"] = json!({"center": [1.0, 1.5, 1.0], "radius_m": 0.5});
            }
        }
    });
    let (clean, report) = audit(&data, "elsewhere.rec");
    assert!(!clean && sum(&report, "untrue") > 0, "{report:#}");
    assert_eq!(report["scenes"][0]["untrue"]["first"][0]["event"], "hush");
}
