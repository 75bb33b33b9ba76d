//! Which files do rules find, what is known of glTF files among them, and what is told of a node whose rules are wrong?

use belvedere_scene::procedural::Settings;
use serde_json::json;

use super::super::{Ground, measure, plant};
use super::{Beside, GATE, names, read, rules};
use crate::cells::author;
use crate::defect::Defects;
use crate::growable::Growable;
use crate::import::split::SplitSettings;
use crate::import::testing::Gltf;
use crate::import::{Limits, SourceFiles};
use crate::pipeline::as_published;
use crate::progress::Silent;

#[test]
fn files_are_found_through_folders_that_are_left_again_and_whatever_the_case_of_their_endings() {
    let files = [
        ("lib/gate.dcg", GATE.into()),
        ("Leaf.DCG", GATE.into()),
        ("lib/bench.glb", Gltf::triangle().glb()),
        ("chair.obj", b"o chair\nv 0 0 0\n".to_vec()),
    ];
    let text = "import \"x/../lib/gate.dcg\" as a import \"lib/gate.dcg\" as b import \"Leaf.DCG\" as c
        a() move(9, 0, 0) b() move(0, 0, 9) c() model \"lib/deep/../bench.glb\"";
    let scene = rules(text, &files).unwrap().scene;
    assert_eq!(
        (scene.objects.len(), scene.models.len()),
        (3 * 4 + 1, 5),
        "one gate.dcg, whatever it is called"
    );
    for (text, wanted) in [
        (
            "import \"x/../../gate.dcg\" as a",
            "\"../gate.dcg\" cannot be imported: it lies outside of the source's folder",
        ),
        ("import \"\" as a", "world.dcg, line 1, column 8: no file is named here"),
        ("model \"./\"", "world.dcg, line 1, column 7: no file is named here"),
        (
            "import \"lib/bench.glb\" as a",
            "`import` reads rules; place a glTF file with `model`",
        ),
        ("model \"Leaf.DCG\"", "use `import` for rules"),
        (
            "model \"chair.obj\"",
            ", and `model` places glTF 2.0 (.glb, .gltf with its files, or a .zip that holds one); other formats can be converted",
        ),
        (
            "model \"http://harbour.org/boat.glb\"",
            "line 1, column 1: \"http://harbour.org/boat.glb\" cannot be placed: it is an address, and nothing is fetched",
        ),
        (
            "model \"lib\\bench.glb\"",
            "a path has no `\\` in it: write `/` behind each folder",
        ),
        ("import \"C:/gate.dcg\" as a", "a path has no `:` in it"),
        ("import \"/gate.dcg\" as a", "at the root of a disk"),
        (
            "model \"a\0.glb\"",
            "line 1, column 7: U+0000 is not seen, and has no place in a name or path; leave it out",
        ),
    ] {
        let error = rules(text, &files).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
    for name in ["gate.dcg", "gate.DCG", "Gate.Dcg"] {
        let imported = read(name, GATE.into(), &[]).unwrap();
        assert_eq!(imported.scene.title.unwrap().to_lowercase(), "gate");
    }
    assert_eq!(
        read("a.PLAN", b"a".to_vec(), &[]).unwrap_err().to_string(),
        read("a.plan", b"a".to_vec(), &[]).unwrap_err().to_string()
    );
}

#[test]
fn gltf_files_are_in_the_bounds_and_must_lie_in_what_a_part_declares() {
    let ground = |files: &dyn SourceFiles, text: &str| {
        let (limits, bytes) = (Limits::default(), text.as_bytes().to_vec());
        let ground = Ground {
            files,
            limits: &limits,
            progress: &Silent,
        };
        plant("sub/world.dcg", bytes, &Settings::default(), ground)
    };
    let mut gltf = Gltf::triangle();
    gltf.json["nodes"][0]["translation"] = json!([4, 0, 0]);
    let files = Beside([("sub/bench.glb", gltf.glb())].into());
    let part =
        |within: &str| format!("part p() {within} {{\n  move(50, 0, 0) model \"bench.glb\"\n}}\nbox(1, 1, 1) p()");
    let growth = ground(&files, &part("within [0, 0, 0] to [55, 2, 0]")).unwrap();
    assert_eq!(growth.grown.parts[0].bounds.max, [55.0, 2.0, 0.5]);
    assert_eq!(growth.scene.bounds(), growth.grown.parts[0].bounds);
    let error = ground(&files, &part("within [0, 0, 0] to [1, 1, 1]")).unwrap_err();
    assert_eq!(
        error.to_string().lines().next(),
        Some(
            "world.dcg, line 2, column 18: part `p` reaches 54 m beyond what it declares with `within`, towards +x; widen that"
        )
    );
}

/// Whatever is wrong with rules at a node, all else is imported; and each such node is told, by where its mistake is.
#[test]
fn no_mistake_of_rules_at_a_node_ends_the_import() {
    let files = [
        ("sub/gate.dcg", GATE.into()),
        ("sub/leaf.dcg", b"parameter size = 1\nbox(1 / size, 1, 1)".to_vec()),
        (
            "sub/tree.dcg",
            b"import \"leaf.dcg\" as leaf\nparameter size = 1\nleaf(size = size)".to_vec(),
        ),
        (
            "far.dcg",
            b"part p() within [0, 0, 0] to [1, 1, 1] { box(1, 9, 1) }\np()".to_vec(),
        ),
        ("models.dcg", b"model \"bench.glb\"".to_vec()),
        ("ok.gltf", br#"{"asset": {"version": "2.0"}}"#.to_vec()),
    ];
    let wrong = "rules that are wrong, or given what they do not take: not grown";
    let unread = "rules that cannot be read: not grown";
    for (extras, kind, place) in [
        (
            json!({"procedural": "sub/gate.dcg", "parameters": {"height": 12}}),
            wrong,
            "sub/gate.dcg: `height` is 12; it must be from 1 to 9",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "parameters": {"hieght": 2}}),
            wrong,
            "sub/gate.dcg: `hieght` is not a parameter of `gate.dcg`; did you mean `height`?",
        ),
        (
            json!({"procedural": "./sub/tree.dcg", "parameters": {"size": 0}}),
            wrong,
            "sub/leaf.dcg, line 2, column 7: division by zero; test the divisor with `if` before\n    box(1 / size, 1, 1)\n    \
             called from line 3, column 1 of sub/tree.dcg",
        ),
        (
            json!({"procedural": "models.dcg"}),
            wrong,
            "models.dcg, line 1, column 1: \"bench.glb\" cannot be placed: there is no such file in the source's folder\n    \
             model \"bench.glb\"",
        ),
        (
            json!({"procedural": "sub/gat.dcg"}),
            unread,
            "sub/gat.dcg: there is no such file; did you mean \"sub/gate.dcg\"?",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "parameters": {"height": "2"}}),
            "`parameters` that are not numbers or lists of them: not grown",
            "sub/gate.dcg: `height` is \"2\"; write `2`",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "parameters": {"height": "tall"}}),
            "`parameters` that are not numbers or lists of them: not grown",
            "sub/gate.dcg: `height` is \"tall\"; write a number or a list of numbers",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "parameters": {"height": "#f00"}}),
            "`parameters` that are not numbers or lists of them: not grown",
            "sub/gate.dcg: `height` is \"#f00\"; write a number, or, where a colour is wanted, `[1,0,0]`",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "parameters": [2]}),
            "`parameters` that are not an object of names and values: not grown",
            "sub/gate.dcg: `parameters` is [2]; write names and values, as in {\"height\": 12}",
        ),
        (
            json!({"procedural": "sub/gate.dcg", "seed": 1.5}),
            "a `seed` that is not a whole number from 0 to 4294967295: not grown",
            "sub/gate.dcg: `seed` is 1.5",
        ),
        (
            json!({"procedural": 7}),
            "`procedural` that names no file beside the source: not grown",
            "`procedural` is 7; write the path of a file, as in \"tree.dcg\"",
        ),
        (
            json!({"procedural": "ok.gltf"}),
            "`procedural` that names no rules: not grown",
            "ok.gltf: this is glTF or an archive, and `procedural` takes rules (.dcg); rules place it with `model \"ok.gltf\"`",
        ),
        (
            json!({"procedural": "https://harbour.org/boat.dcg"}),
            "`procedural` that names no file beside the source: not grown",
            "`procedural` is \"https://harbour.org/boat.dcg\": it is an address, and nothing is fetched: put the file beside the \
             source, and write its path",
        ),
        (
            json!({"procedural": "../harbour/boat.dcg"}),
            "`procedural` that names no file beside the source: not grown",
            "`procedural` is \"../harbour/boat.dcg\": it lies outside of the source's folder: put it beside the source",
        ),
    ] {
        let mut gltf = Gltf::triangle();
        for name in ["oak", "elm"] {
            gltf.push("nodes", json!({"name": name, "extras": {"belvedere": extras}}));
        }
        gltf.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
        let imported = read("scene.glb", gltf.glb(), &files).unwrap();
        assert_eq!(names(&imported), ["n"]);
        let told: Vec<_> = imported.defects.iter().map(|defect| defect.to_string()).collect();
        assert_eq!(
            told,
            [format!("2 × {kind} (node \"oak\", {place}, node \"elm\", {place})")]
        );
        gltf.json["scenes"][0]["nodes"] = json!([1]);
        let refused = read("scene.glb", gltf.glb(), &files).unwrap_err().to_string();
        assert!(
            refused.starts_with("nothing is left to draw: ") && refused.contains(place),
            "{refused}"
        );
    }
    // Names are told in one line, and no more of them than of a line of rules.
    let long = "x".repeat(100_000);
    let mut gltf = Gltf::triangle();
    let extras = json!({"belvedere": {"procedural": long}});
    gltf.push("nodes", json!({"name": format!("two\nlines{long}"), "extras": extras}));
    gltf.json["scenes"][0]["nodes"] = json!([0, 1]);
    let told = read("scene.glb", gltf.glb(), &files)
        .unwrap()
        .defects
        .iter()
        .next()
        .unwrap()
        .to_string();
    let places = format!("node \"two\\nlines{}…\", {}…: there is", &long[..111], &long[..120]);
    assert!(told.contains(&places) && told.len() < 500, "{told}");
    let mut gltf = Gltf::triangle();
    gltf.json["nodes"][0]["extras"] = json!({"belvedere": {"parameters": {"height": 2}, "procedral": "gate.dcg"}});
    let imported = read("scene.glb", gltf.glb(), &files).unwrap();
    let kind = "`parameters` or `seed` without `procedural`, which names the rules: ignored";
    assert_eq!(imported.defects.count(kind), 1);
}

#[test]
fn what_keeps_a_model_from_being_grown_alone_is_counted() {
    let files = [("bench.glb", Gltf::triangle().glb())];
    let text = "material red { colour = #f00 }
        part own() { paint red box(1, 1, 1) }
        part worn() { box(1, 2, 1) }
        part both() { box(1, 3, 1) own() }
        part other() { paint red box(2, 1, 1) }
        other() own() paint red move(3, 0, 0) worn() move(6, 0, 0) both() called \"door:a\" box(1, 1, 2) model \"bench.glb\"";
    let scene = rules(text, &files).unwrap().scene;
    let growable = Growable::of(&scene);
    assert_eq!(
        growable.sentence().unwrap(),
        "2 of 6 published models can be grown by clients; 1 takes what its caller paints it with: let the part paint itself, with a parameter for \
         what differs; 1 is what `called` names: draw it in a `part`, and call that behind `called`; 1 holds other parts, glTF \
         files or something `called`: let a rule place parts side by side; 1 comes from a glTF file"
    );
    // Also where there is nothing in what is called.
    let text = "part hall() { called \"cell:a\" {} box(1, 1, 1) } hall()";
    assert_eq!(
        Growable::of(&rules(text, &[]).unwrap().scene).sentence().unwrap(),
        "0 of 1 published model can be grown by clients; 1 holds other parts, glTF files or something `called`, as `hall`: let a rule place parts \
         side by side"
    );
    let text = "part own() { box(1, 1, 1) } box(1, 2, 1) move(4, 0, 0) own()";
    assert_eq!(
        Growable::of(&rules(text, &[]).unwrap().scene).sentence().unwrap(),
        "1 of 2 published models can be grown by clients; 1 is drawn outside of parts: put it into a `part`"
    );
    assert_eq!(
        Growable::of(&rules("box(1, 1, 1)", &[]).unwrap().scene)
            .sentence()
            .unwrap(),
        "1 of 1 published model can be grown by clients"
    );
    let text = "part pane(x) { box(x, 1, 1) } paint red for i in 3 move(2 * i, 0, 0) pane(i + 1) material red {}";
    assert_eq!(
        Growable::of(&rules(text, &[]).unwrap().scene).sentence().unwrap(),
        "0 of 3 published models can be grown by clients; 3 take what their caller paints them with, as `pane`: let the part paint itself, \
         with a parameter for what differs"
    );
    let plain = read("a.glb", Gltf::triangle().glb(), &[]).unwrap();
    assert_eq!(Growable::of(&plain.scene).sentence(), None);
}

/// Before a bake and after it: equal ones are published once.
#[test]
fn models_that_are_published_are_counted() {
    let text = "part own() { box(1, 1, 1) } own() for i in 4 move(2 * i, 0, 9) called \"pot\" sphere(0.5)";
    let scene = rules(text, &[]).unwrap().scene;
    assert_eq!(scene.models.len(), 5);
    let published = as_published(scene, &SplitSettings::default(), &mut Defects::default());
    let counted = Growable::of(&published);
    assert_eq!((counted.alone, counted.models), (1, 2));
}

#[test]
fn bytes_of_placed_models_count_with_what_the_rules_made() {
    let (limits, files) = (
        Limits::default(),
        Beside([("bench.glb", Gltf::triangle().glb())].into()),
    );
    let ground = Ground {
        files: &files,
        limits: &limits,
        progress: &Silent,
    };
    let text = "box(1, 1, 1) for i in 3 move(2 * i, 0, 0) model \"bench.glb\"";
    let growth = plant("world.dcg", text.into(), &Settings::default(), ground).unwrap();
    assert_eq!(growth.explicit_bytes, 24 * 12 + 12 * 6 + 3 * (3 * 12 + 6));
}

/// What a bake would refuse of cells is known when they have grown, with its place in the rules, at nodes of a glTF file too.
#[test]
fn cells_that_a_bake_would_refuse_are_told_by_file_and_line() {
    let told =
        |text: &str| author::refusal(&rules(text, &[]).unwrap().scene.authored).map(|refusal| refusal.to_string());
    for (cell, wanted) in [
        (
            "prism([[0, 0], [4, 0], [4, 4], [2, 1]], 3)",
            "is not convex: it reaches 1.",
        ),
        ("cylinder(1, 2, closed = 0)", "is not closed: "),
        ("polygon([[0, 0, 0], [1, 0, 0], [0, 0, 1]])", "has no volume"),
        ("sphere(2, sides = 40)", "has more than 128 faces"),
    ] {
        let text = format!("box(1, 1, 1)\nrule r() {{\n  called \"cell:hall\" {cell}\n}}\nr()");
        let refused = told(&text).unwrap();
        let place = "world.dcg, line 3, column 3: author's cell `cell:hall` ";
        assert!(refused.starts_with(&format!("{place}{wanted}")), "{refused}");
        assert_eq!(
            refused.lines().nth(1),
            Some(format!("    called \"cell:hall\" {cell}").as_str())
        );
    }
    let rooms = "called \"cell:a\" box(2, 2, 2) part p() { box(3, 1, 3) }\ncalled \"cell:b\" p() box(1, 1, 1)";
    let refused = told(rooms).unwrap();
    assert!(
        refused.contains("`cell:b` and `cell:a` overlap by 1.000 m"),
        "{refused}"
    );
    assert_eq!(
        told("box(1, 1, 1) called \"cell:a\" box(2, 2, 2) move(2, 0, 0) called \"cell:b\" box(2, 2, 2)"),
        None
    );

    let files = [(
        "sub/flat.dcg",
        b"box(1, 1, 1)\n\ncalled \"cell:flat\" box(1, 0, 1)".to_vec(),
    )];
    let mut gltf = Gltf::triangle();
    let wish = json!({"belvedere": {"procedural": "sub/flat.dcg"}});
    gltf.push("nodes", json!({"name": "house", "extras": wish}));
    gltf.json["scenes"][0]["nodes"] = json!([1]);
    let scene = read("scene.glb", gltf.glb(), &files).unwrap().scene;
    let refused = author::refusal(&scene.authored).unwrap().to_string();
    assert!(
        refused.starts_with("sub/flat.dcg, line 3, column 1: author's cell `house/cell:flat` has no volume"),
        "{refused}"
    );
}

/// Bounds are found without growing anything; glTF files and what parts say of themselves are in them.
#[test]
fn a_box_that_holds_a_model_is_found_without_growing_it() {
    let (limits, files) = (
        Limits::default(),
        Beside([("bench.glb", Gltf::triangle().glb())].into()),
    );
    let measured = |text: &str| {
        let ground = Ground {
            files: &files,
            limits: &limits,
            progress: &Silent,
        };
        measure("world.dcg", text.into(), &Settings::default(), ground)
    };
    let text = "part p() within [-9, 0, 0] to [1, 2, 1] { for i in 1000 sphere(0.1, sides = 256) } p() move(40, 0, 0) model \"bench.glb\"";
    let (bounds, usage) = measured(text).unwrap();
    assert_eq!((bounds.min[0], bounds.max[0]), (-9.0, 41.0));
    assert!(
        usage.triangles == 0 && usage.steps < 20 && usage.parts == 2,
        "{usage:?}"
    );
    let error = measured("box(1, 1, 1) model \"bank.glb\"")
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(error.contains("\"bank.glb\" cannot be placed"), "{error}");
}

#[test]
fn why_rules_draw_nothing_is_said() {
    for (text, wanted) in [
        ("rule r() { box(1, 1, 1) }", "a rule draws when it is called"),
        ("called \"cell:a\" box(1, 1, 1)", "is for the bake and no object"),
        ("box(0, 0, 0)", "none of their triangles has an area"),
    ] {
        let error = rules(text, &[]).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}
