//! `belvedere private` and `belvedere sign`: a scene that only its link opens, for every client there is.

use serde_json::Value;

use crate::{
    program::{Data, THREE_ROOMS},
    wire::get,
};

const STANDING: &str =
    "{\"t_ms\": 0, \"position\": [2.5, 1.5, 2.5]}\n{\"t_ms\": 1000, \"position\": [2.6, 1.5, 2.5]}\n";

#[tokio::test(flavor = "multi_thread")]
async fn a_link_walks_through_a_private_scene_and_nothing_else_does() {
    let data = Data::new();
    let plan = data.write("rooms.plan", THREE_ROOMS);
    let plan = plan.to_str().expect("UTF-8");
    assert!(
        data.ok(&["bake", plan, "--scene", "rooms", "--private"])
            .contains("published")
    );
    data.ok(&["bake", plan, "--scene", "hall"]);
    let server = data.serve();

    let signed: Value =
        serde_json::from_str(&data.ok(&["sign", "rooms", "--at", &server.base, "--json"])).expect("JSON");
    let (base, url) = (
        signed["base"].as_str().expect("a base"),
        signed["url"].as_str().expect("a URL"),
    );
    assert_eq!(url, format!("{base}?scene=rooms"));
    assert_eq!(data.ok(&["sign", "rooms", "--expires", "90s"]).lines().count(), 1);

    let script = data.write("way.jsonl", STANDING);
    let script = script.to_str().expect("UTF-8");
    let walk = |tree| data.run(&["walk", tree, "--scene", "rooms", "--script", script, "--json"]);
    let walked = walk(base);
    let seen: Value = serde_json::from_slice(&walked.stdout).expect("JSON");
    assert_eq!((&seen["lost_files"], &seen["holes"]), (&0.into(), &0.into()), "{seen}");
    assert_ne!(walk(&server.base).status.code(), Some(0));

    assert!(
        data.fails(&["private", "hall", "--show-key"])
            .contains("is not private")
    );
    assert!(data.fails(&["sign", "hall"]).contains("is not private"));
    assert!(
        data.fails(&["publish", "rooms", "--to", "tree"])
            .contains("--although-private")
    );
    data.ok(&["publish", "rooms", "--to", "tree", "--although-private"]);
    let listed = data.ok(&["private", "--list"]);
    assert!(listed.contains("rooms") && !listed.contains("hall"), "{listed}");
    let key = data.ok(&["private", "rooms", "--show-key"]);
    assert_eq!(key.trim().len(), 64);
    data.ok(&["private", "rooms", "--new-key"]);
    assert_ne!(data.ok(&["private", "rooms", "--show-key"]), key);
    data.ok(&["private", "rooms", "--end"]);
    assert!(data.fails(&["private", "rooms", "--end"]).contains("is not private"));
    for _ in 0..200 {
        if get(server.address(), "/v1/scenes/rooms").await.status == 200 {
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    panic!("it never became public");
}
