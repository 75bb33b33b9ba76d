//! Two rooms and a door between them: what does closing it hide?

use belvedere_client::{ByteSource, HttpSource};
use belvedere_scene::record::CellJson;
use serde_json::Value;

use crate::{boxes::two_rooms, program::Data};

pub(crate) async fn document(source: &HttpSource, path: &str) -> Value {
    serde_json::from_slice(&source.get(path).await.expect(path)).expect(path)
}

/// The objects of a page by their names in the source.
pub(crate) fn names(page: &Value) -> Vec<(String, String)> {
    assert!(page["next"].is_null(), "{page}");
    let objects = page["objects"].as_array().expect("objects");
    let text = |object: &Value, name: &str| object[name].as_str().expect(name).to_owned();
    objects
        .iter()
        .map(|object| (text(object, "source_node"), text(object, "object")))
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_closed_door_hides_what_stands_behind_it_and_nothing_else() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let server = data.serve();
    let source = HttpSource::new(&server.base).expect("an address");

    let at = document(&source, "/v1/scenes/rooms/cells?at=8,1.5,1").await;
    let cell = format!("/v1/scenes/rooms/cells/{}", at["cell"].as_str().expect("a cell"));
    let open = names(&document(&source, &format!("{cell}/visible?limit=1000")).await);
    let id = |name: &str| {
        let found = open.iter().find(|(node, _)| node == name);
        found
            .unwrap_or_else(|| panic!("{name} is not seen: {open:?}"))
            .1
            .clone()
    };
    let door = id("door:between");
    let (here, beyond) = (id("here"), id("beyond"));

    let closed = names(&document(&source, &format!("{cell}/visible?limit=1000&closed={door}")).await);
    assert!(!closed.iter().any(|(_, object)| *object == beyond), "{closed:?}");
    for seen in [&here, &door] {
        assert!(closed.iter().any(|(_, object)| object == seen), "{closed:?}");
    }
    let record: CellJson = serde_json::from_value(document(&source, &cell).await).expect("a record");
    let doors = |object: &str| {
        let seen = record.opvs.iter().chain(&record.lpvs);
        let mut seen = seen.filter(|visible| visible.object.to_string() == object);
        let visible = seen.next().expect("an entry");
        visible.doors.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!((doors(&beyond), doors(&here)), (vec![door], vec![]));
}
