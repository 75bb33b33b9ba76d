//! What are files and things of rules called?

use serde_json::json;

use super::{GATE, GATE_CELL, names, read, rules};
use crate::import::testing::Gltf;

#[test]
fn a_file_may_be_named_from_here_and_must_be_named_whole() {
    let files = [
        ("lib/gate.dcg", GATE.into()),
        ("gate.glb", Vec::new()),
        ("gate.dcg", GATE.into()),
    ];
    let models = |text: &str| rules(text, &files).unwrap().scene.models.len();
    assert_eq!(
        models("import \"./gate.dcg\" as a import \"gate.dcg\" as b a() move(9, 0, 0) b()"),
        models("import \"gate.dcg\" as a a() move(9, 0, 0) a()"),
        "one file, whatever it is called"
    );
    for (text, wanted) in [
        (
            "import \"gate\" as a",
            "column 8: \"gate\" cannot be imported: there is no such file; did you mean \"gate.dcg\"?",
        ),
        (
            "import \"./lib/gate\" as a",
            "\"lib/gate\" cannot be imported: there is no such file; did you mean \"lib/gate.dcg\"?",
        ),
        (
            "model \"gate\"",
            "\"gate\" cannot be placed: there is no such file; did you mean \"gate.glb\"?",
        ),
    ] {
        let error = rules(text, &files).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

/// Numbers begin with the number of things of that name, so that names which were given before stay.
#[test]
fn each_object_has_a_name_of_its_own() {
    for (text, wanted) in [
        (
            "for i in 3 called \"a\" box(1, 1, 1) called \"a 2\" box(1, 1, 1)",
            &["a", "a 4", "a 3", "a 2"][..],
        ),
        (
            "called \"a 2\" box(1, 1, 1) called \"a 4\" box(1, 1, 1) for i in 2 called \"a 2\" box(1, 1, 1)
             for i in 3 called \"a\" box(1, 1, 1)",
            &["a 2", "a 4", "a 2 2", "a 2 3", "a", "a 5", "a 3"],
        ),
    ] {
        assert_eq!(names(&rules(text, &[]).unwrap()), wanted);
    }
    let scene = rules(
        &format!("box(1, 1, 1) for i in 2 {GATE_CELL} called \"cell:yard 2\" box(1, 1, 1)"),
        &[],
    )
    .unwrap()
    .scene;
    let cells: Vec<_> = scene.authored.cells.iter().map(|cell| cell.node.as_str()).collect();
    assert_eq!(cells, ["cell:yard", "cell:yard 3", "cell:yard 2"]);
    let text = "box(1, 1, 1) viewpoint \"Gate\" viewpoint \"Gate 2\" viewpoint \"Gate\" called \"Gate\" box(1, 1, 1)";
    let scene = rules(text, &[]).unwrap().scene;
    let viewpoints: Vec<_> = scene
        .viewpoints
        .iter()
        .map(|viewpoint| viewpoint.name.as_str())
        .collect();
    assert_eq!(viewpoints, ["Gate", "Gate 2", "Gate 3"]);
    assert_eq!(scene.objects[1].source_node, "Gate");
}

#[test]
fn parts_of_a_file_that_no_import_can_name_are_meshes() {
    for name in ["a\u{202e}b.dcg", "a\"b.dcg"] {
        let imported = read(name, b"part p() { box(1, 1, 1) } p()".to_vec(), &[]).unwrap();
        assert!(imported.scene.models[0].recipe.is_none(), "{name:?}");
        let kind = "part of a file whose name no `import` can have: offered as meshes";
        assert_eq!(imported.defects.count(kind), 1, "{name:?}");
    }
}

#[test]
fn parts_of_a_file_that_was_given_something_need_room_for_a_number_in_its_name() {
    let long = |letters: usize| -> &'static str { format!("{}.dcg", "x".repeat(letters)).leak() };
    let kind = "part of a file that is given something and whose name leaves no room for a number: offered as meshes";
    for (name, has_room) in [(long(251), false), (long(249), true), ("alone", true)] {
        let files = [(name, GATE.into())];
        let imported = rules(&format!("import \"{name}\" as gate gate(height = 3)"), &files).unwrap();
        assert_eq!(imported.scene.models[0].recipe.is_some(), has_room, "{name}");
        assert_eq!(imported.defects.count(kind) == 0, has_room, "{name}");
    }
}

#[test]
fn a_gltf_file_and_rules_that_place_each_other_end_whatever_the_rules_are_called() {
    for name in ["rules.txt", "x.DCG", "rules.dcg"] {
        let mut gltf = Gltf::triangle();
        gltf.push(
            "nodes",
            json!({"name": "grows", "extras": {"belvedere": {"procedural": name}}}),
        );
        gltf.json["scenes"][0]["nodes"] = json!([0, 1]);
        let files = [("b.gltf", gltf.glb()), (name, b"model \"b.gltf\"".to_vec())];
        let imported = read("b.gltf", gltf.glb(), &files).unwrap();
        assert_eq!(names(&imported), ["n", "grows/n"], "{name}");
        let left_out = "rules in a file that rules place: not grown";
        assert_eq!(imported.defects.count(left_out), 1, "{name}");
    }
}
