//! What is progress told while rules grow?

use serde_json::json;

use super::{Beside, GATE};
use crate::import::testing::Gltf;
use crate::import::{Limits, import};
use crate::progress::Counted;

/// What reading a source announces, and what it makes.
fn counted(name: &str, bytes: Vec<u8>) -> (u64, u64) {
    let counted = Counted::default();
    let files = [("gate.dcg", GATE.into()), ("bench.glb", Gltf::triangle().glb())];
    let files = Beside(files.into());
    import(name, bytes, &files, &Limits::default(), &counted).unwrap();
    (counted.announced.into_inner(), counted.made.into_inner())
}

#[test]
fn rules_at_nodes_take_their_part_of_the_import_each_wish_once() {
    let mut gltf = Gltf::triangle();
    let mut counts = vec![counted("scene.glb", gltf.glb())];
    for height in [2, 2, 5, 99] {
        let wish = json!({"belvedere": {"procedural": "gate.dcg", "parameters": {"height": height}}});
        let node = gltf.push("nodes", json!({"extras": wish}));
        gltf.json["scenes"][0]["nodes"]
            .as_array_mut()
            .unwrap()
            .push(node.into());
        counts.push(counted("scene.glb", gltf.glb()));
    }
    let of_rules = counted("gate.dcg", GATE.into()).0;
    let announced: Vec<_> = counts.iter().map(|(announced, _)| *announced).collect();
    assert_eq!(
        announced,
        [1, 2 + of_rules, 3 + of_rules, 4 + 2 * of_rules, 5 + 3 * of_rules]
    );
    assert!(counts.iter().all(|(announced, made)| announced == made), "{counts:?}");
}

#[test]
fn a_file_that_rules_place_is_part_of_their_growth() {
    let count = |text: &str| counted("world.dcg", text.into());
    assert_eq!(count("box(1, 1, 1) model \"bench.glb\""), count("box(1, 1, 1)"));
}
