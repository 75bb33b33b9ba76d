//! What is told of names for the bake under which nothing is drawn?

use serde_json::json;

use super::{read, rules};
use crate::import::Imported;
use crate::import::testing::Gltf;

/// Where nothing is drawn under such a name.
fn places(imported: &Imported) -> Vec<String> {
    let defects = imported.defects.iter();
    let defects = defects.filter(|defect| defect.kind.contains("without geometry"));
    defects
        .flat_map(|defect| [vec![defect.first], defect.others].concat())
        .collect()
}

#[test]
fn a_mark_on_nothing_is_told_with_its_place() {
    let wood = "part post(h) { cylinder(0.1, h) }\nbox(1, 1, 1)\n";
    for (text, wanted) in [
        ("  called \"cell:a\" { } box(4, 3, 4)", "line 3, column 3: `cell:a`"),
        ("called \"portal:p\" if 0 box(1, 1, 1)", "line 3, column 1: `portal:p`"),
        ("called \"occluder:o\" box(1, 0, 0)", "line 3, column 1: `occluder:o`"),
        ("called \"door:d\" for i in 0 post(1)", "line 3, column 1: `door:d`"),
        ("called \"door:d\" model \"leaf.glb\"", "line 3, column 1: `door:d`"),
        (
            "called \"door:d\" { called \"handle\" sphere(1) }",
            "line 3, column 1: `door:d`",
        ),
        (
            "for h in [3, 0, 5] called \"cell:a\" move(2 * h, 0, 0) box(h, h, 1)",
            "line 3, column 20: `cell:a`, 1 of 3 times",
        ),
        (
            "rule r() { called \"cell:\" {} } r() r()",
            "line 3, column 12: `cell:`, 2 of 2 times",
        ),
    ] {
        let files = [("leaf.glb", Gltf::triangle().glb())];
        let imported = rules(&format!("{wood}{text}"), &files).unwrap();
        assert_eq!(places(&imported), [format!("world.dcg, {wanted}")], "{text}");
    }
    for text in [
        "called \"cell:a\" box(4, 3, 4)",
        "called \"door:d\" post(2)",
        "called \"door:d\" { post(2) {} called \"handle\" sphere(1) }",
        "rule leaf() { { post(2) } } called \"door:d\" turn(9) leaf()",
        "part pair() { post(1) post(2) } called \"door:d\" pair()",
        "called \"well\" { } called \"garden: roses\" {}",
    ] {
        let imported = rules(&format!("{wood}{text}"), &[]).unwrap();
        assert_eq!(places(&imported), [""; 0], "{text}");
    }
}

#[test]
fn a_mark_may_be_all_of_a_name() {
    let imported = rules("called \"cell:\" box(4, 3, 4) called \"door:\" box(1, 2, 0.1)", &[]).unwrap();
    assert_eq!(imported.scene.authored.cells[0].node, "cell:");
    assert_eq!(imported.scene.objects[0].role, crate::source::Role::Door);
    assert_eq!(imported.defects.iter().count(), 0);
}

#[test]
fn a_mark_on_nothing_is_told_of_rules_that_a_node_names_with_their_folder() {
    let mut gltf = Gltf::triangle();
    gltf.json["nodes"][0]["extras"] = json!({"belvedere": {"procedural": "lib/room.dcg"}});
    let room = b"import \"walls.dcg\" as walls\nbox(1, 1, 1) called \"cell:a\" {} walls()".to_vec();
    let walls = b"box(1, 1, 1)\n called \"door:d\" {}".to_vec();
    let files = [("lib/room.dcg", room), ("lib/walls.dcg", walls)];
    let imported = read("world.glb", gltf.glb(), &files).unwrap();
    assert_eq!(
        places(&imported),
        [
            "lib/room.dcg, line 2, column 14: `cell:a`",
            "lib/walls.dcg, line 2, column 2: `door:d`"
        ]
    );
}

#[test]
fn what_is_called_almost_like_a_mark_is_named_with_its_place() {
    let text = "box(1, 1, 1)\nfor i in 2 move(2 * i, 0, 0)\n  called \"Door:gate\" box(1, 2, 0.1)";
    let told: Vec<_> = rules(text, &[]).unwrap().defects.iter().collect();
    assert_eq!(told.len(), 1);
    assert!(told[0].kind.starts_with("name that looks as if it marked something"));
    assert_eq!(
        (told[0].count, told[0].first.as_str()),
        (1, "world.dcg, line 3, column 3: \"Door:gate\" looks like `door:`")
    );
    let mut gltf = Gltf::triangle();
    gltf.json["nodes"][0]["name"] = "cell :hall".into();
    let told: Vec<_> = read("hall.glb", gltf.glb(), &[]).unwrap().defects.iter().collect();
    assert_eq!(
        (told.len(), told[0].first.as_str()),
        (1, "\"cell :hall\" looks like `cell:`")
    );
}

/// Rules have a statement for viewpoints, and no mark for bodies that move.
#[test]
fn what_looks_like_a_mark_that_rules_do_not_have_is_not_told() {
    let text = "box(1, 1, 1) called \"Viewpoint:Hall\" box(1, 1, 1) called \"Avatar: guide\" box(1, 1, 1)";
    assert_eq!(rules(text, &[]).unwrap().defects.iter().count(), 0);
}

#[test]
fn a_node_that_says_otherwise_what_it_is_may_have_any_name() {
    let told = |node: serde_json::Value| {
        let mut gltf = Gltf::triangle();
        gltf.push(
            "cameras",
            json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}),
        );
        let node = gltf.push("nodes", node);
        gltf.json["scenes"][0]["nodes"]
            .as_array_mut()
            .unwrap()
            .push(node.into());
        let imported = read("hall.glb", gltf.glb(), &[]).unwrap();
        let told: Vec<_> = imported.defects.iter().map(|defect| defect.first).collect();
        (imported.scene.viewpoints.len(), told)
    };
    let stated = json!({"name": "Viewpoint: Hall", "extras": {"belvedere": {"kind": "viewpoint"}}});
    assert_eq!(told(stated), (1, vec![]));
    assert_eq!(told(json!({"name": "Viewpoint: Hall", "camera": 0})), (1, vec![]));
    let wanted = "\"Viewpoint: Hall\" looks like `viewpoint:`".to_owned();
    assert_eq!(told(json!({"name": "Viewpoint: Hall"})), (0, vec![wanted]));
}
