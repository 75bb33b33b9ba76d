//! Why is an object in a cell's set, or why not? Two rooms, and something outside behind the west wall.

use belvedere_client::HttpSource;
use serde_json::Value;

use crate::{
    boxes::{TWO_ROOMS, boxes},
    doors::{document, names},
    program::Data,
};

#[tokio::test(flavor = "multi_thread")]
async fn a_sight_line_shows_what_is_seen_and_a_wall_is_named_that_hides() {
    let outside = ("outside", [-3.0, 1.0, 2.3], [-2.6, 1.4, 2.7]);
    let data = Data::new();
    data.bake(
        &data.write("rooms.glb", boxes(&[&TWO_ROOMS[..], &[outside]].concat())),
        "rooms",
    );
    let server = data.serve();
    let source = HttpSource::new(&server.base).expect("an address");
    let at = document(&source, "/v1/scenes/rooms/cells?at=8,1.5,1").await;
    let cell = at["cell"].as_str().expect("a cell");
    let all = document(&source, "/v1/scenes/rooms/objects?bbox=-9,-9,-9,19,9,9&limit=1000").await;
    let all = names(&all);
    let id = |name: &str| &all.iter().find(|(node, _)| node == name).expect(name).1;
    let explained = |object: &str| -> Value {
        let json = data.ok(&["inspect", "rooms", "--cell", cell, "--object", object, "--json"]);
        serde_json::from_str(&json).expect("JSON")
    };

    let seen = explained(id("beyond"));
    assert_eq!(seen["source_node"], "beyond");
    assert_eq!(seen["listed"]["doors"][0], **id("door:between"), "{seen}");
    assert!(seen["hidden"].is_null(), "{seen}");
    let coordinate = |end: &str, axis: usize| seen["sight_line"][end][axis].as_f64().expect("a number");
    // From the east room through the doorway onto the box.
    assert!((5.0..=10.2).contains(&coordinate("eye", 0)), "{seen}");
    let (share, z) = {
        let (from, to) = (coordinate("eye", 0), coordinate("point", 0));
        let share = (from - 5.1) / (from - to);
        (
            share,
            coordinate("eye", 2) * (1.0 - share) + coordinate("point", 2) * share,
        )
    };
    assert!((0.0..=1.0).contains(&share) && (2.0..=3.0).contains(&z), "{seen}");
    for (axis, [low, high]) in [[1.0, 1.4], [0.0, 0.5], [1.0, 1.4]].into_iter().enumerate() {
        assert!(
            (low - 1e-4..=high + 1e-4).contains(&coordinate("point", axis)),
            "{seen}"
        );
    }

    let hidden = explained(id("outside"));
    assert!(hidden["listed"].is_null() && hidden["sight_line"].is_null(), "{hidden}");
    let reasons = hidden["hidden"].as_array().expect("reasons");
    assert!(!reasons.is_empty(), "{hidden}");
    for reason in reasons.iter().filter(|reason| reason["by"] == "body") {
        let by = (reason["source_node"].as_str(), reason["object"].as_str());
        assert!(all.iter().any(|(node, id)| by == (Some(node), Some(id))), "{reason}");
        // It stands between.
        assert!(reason["bounds"]["min"][0].as_f64() > Some(-2.6), "{reason}");
    }

    let told = |object: &str| data.ok(&["inspect", "rooms", "--cell", cell, "--object", object]);
    assert!(told(id("beyond")).contains("seen from ["), "{}", told(id("beyond")));
    assert!(told(id("outside")).contains("hidden from"), "{}", told(id("outside")));

    let table = data.ok(&["inspect", "rooms", "--cell", cell]);
    assert!(table.contains("miss bound 0; "), "{table}");
    assert!(!table.contains(".0,") && !table.contains("00000"), "{table}");

    let refused = data.fails(&["inspect", "rooms", "--cell", cell, "--object", "o99"]);
    assert!(refused.contains("no object o99"), "{refused}");

    assert_eq!(told("beyond"), told(id("beyond")), "by the name of its node");
    let refused = data.fails(&["inspect", "rooms", "--cell", cell, "--object", "eyond"]);
    assert!(
        refused.contains("did you mean") && refused.contains(id("beyond").as_str()),
        "{refused}"
    );

    let seen_from = |object: &str| -> Value {
        let json = data.ok(&["inspect", "rooms", "--object", object, "--json"]);
        serde_json::from_str(&json).unwrap()
    };
    let is_listed = |object: &str| seen_from(object)["cells"].as_array().unwrap().contains(&cell.into());
    assert!(is_listed(id("beyond")), "{}", seen_from(id("beyond")));
    assert!(!is_listed(id("outside")), "{}", seen_from(id("outside")));
}
