//! What becomes of rules as a source, alone and in glTF files.

mod found;
mod frames;
mod marks;
mod names;
mod watched;

use std::collections::BTreeMap;

use belvedere_scene::procedural::{Loader, Program, Settings, Value, grow};
use serde_json::json;

use super::{Ground, Sowing};
use crate::glb::write_whole;
use crate::import::testing::Gltf;
use crate::import::{FileError, ImportError, Imported, Limits, SourceFiles, import, import_sown};
use crate::progress::Silent;
use crate::source::{AuthoredShape, Primitive, Role, SourceRecipe};

const GATE: &str = "
parameter height = 2 from 1 to 9
material wood { colour = #8a6a45 }
part post(h) { paint wood cylinder(0.1, h) }
for i in 3 move(2 * i, 0, 0) post(height)
called \"door:gate\" box(1, 1, 0.1)
called \"cell:yard\" move(0, 0, 5) box(9, 3, 4)
move(0, 1.7, 5) viewpoint \"Yard\"
";

const GATE_CELL: &str = "called \"cell:yard\" box(1, 1, 1)";

/// Files beside the source.
struct Beside(BTreeMap<&'static str, Vec<u8>>);

impl SourceFiles for Beside {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        self.0.get(relative).cloned().ok_or(FileError::Missing)
    }

    fn names(&self, relative: &str) -> Vec<String> {
        let split = |path: &&'static str| path.rsplit_once('/').unwrap_or(("", path));
        let inside = self.0.keys().map(split).filter(|(folder, _)| *folder == relative);
        inside.map(|(_, name)| name.to_owned()).collect()
    }
}

fn read(name: &str, bytes: Vec<u8>, files: &[(&'static str, Vec<u8>)]) -> Result<Imported, ImportError> {
    let limits = Limits {
        memory_bytes: 64 << 20,
        max_objects: 1000,
    };
    import(name, bytes, &Beside(files.iter().cloned().collect()), &limits, &Silent)
}

fn rules(text: &str, files: &[(&'static str, Vec<u8>)]) -> Result<Imported, ImportError> {
    read("world.dcg", text.as_bytes().to_vec(), files)
}

fn names(imported: &Imported) -> Vec<&str> {
    let objects = imported.scene.objects.iter();
    objects.map(|object| object.source_node.as_str()).collect()
}

#[test]
fn parts_become_models_places_become_objects_and_names_keep_their_meaning() {
    let scene = rules(GATE, &[]).unwrap();
    assert_eq!(names(&scene), ["post", "post 2", "post 3", "door:gate"]);
    let scene = scene.scene;
    assert_eq!((scene.models.len(), scene.title.as_deref()), (2, Some("world")));
    assert_eq!(scene.objects[2].world_from_object.w_axis.x, 4.0);
    assert_eq!(scene.objects[3].role, Role::Door);
    assert_eq!(scene.authored.cells.len(), 1);
    assert_eq!(scene.viewpoints[0].name, "Yard");
    assert!(scene.models[0].recipe.is_some() && scene.models[1].recipe.is_none());
}

#[test]
fn imports_and_gltf_files_are_found_beside_the_rules() {
    let triangle = Gltf::triangle().glb();
    let text = "import \"lib/gate.dcg\" as gate
        gate(height = 3) move(0, 0, 9) gate() for i in 4 move(i, 0, 0) model \"lib/bench.glb\"";
    let files = [("lib/gate.dcg", GATE.into()), ("lib/bench.glb", triangle)];
    let imported = rules(text, &files).unwrap();
    assert_eq!(imported.scene.objects.len(), 12);
    // posts of two heights, a gate for each use of the file, one bench
    assert_eq!(imported.scene.models.len(), 5);
    for (text, wanted) in [
        ("import \"../x.dcg\" as x", "outside of the source's folder"),
        (
            "box(1, 1, 1)\nmove(0, 2, 0) model \"x.glb\"",
            "world.dcg, line 2, column 15: \"x.glb\" cannot be placed: there is no such file in the source's folder",
        ),
        ("model \"world.dcg\"", "use `import` for rules"),
        ("let a = 1", "the rules draw nothing"),
        (
            "bix(1, 1, 1)",
            "world.dcg, line 1, column 1: `bix` is not a rule here; did you mean `box`?",
        ),
    ] {
        let error = rules(text, &[]).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn what_rules_do_not_take_is_refused_before_they_take_it() {
    let refused = |name: &str, value: f64| {
        let sowing = Sowing {
            seed: 0,
            parameters: [(name.to_owned(), Value::Number(value))].into(),
        };
        let ground = Ground {
            files: &Beside(BTreeMap::new()),
            limits: &Limits::default(),
            progress: &Silent,
        };
        let error = import_sown("world.dcg", GATE.into(), &sowing, ground).unwrap_err();
        assert!(matches!(&error, ImportError::Rules(rules) if rules.line == 0));
        error.to_string()
    };
    let wanted = "`width` is not a parameter of `world.dcg`; it takes `height from 1 to 9`";
    assert_eq!(refused("width", 2.0), wanted);
    assert_eq!(refused("height", 10.0), "`height` is 10; it must be from 1 to 9");
}

/// As who grows them is told it: of the text as it is written, and of what it was given.
#[test]
fn a_mistake_of_rules_that_were_given_something_is_told_as_who_grows_them_is_told_it() {
    let text = "parameter outline = [[0, 0], [4, 0],\n [0, 3]] parameter height = 2 prism(outline, height) box(1 / (height - 2), 1, 1)";
    let ground = Ground {
        files: &Beside(BTreeMap::new()),
        limits: &Limits::default(),
        progress: &Silent,
    };
    let list = Value::from_json(&json!([1, 2])).unwrap();
    for (name, value, wanted) in [
        (
            "outline",
            Value::Number(4.0),
            "`outline` was given a number, and its default is a list",
        ),
        ("height", list, "`height` was given a list, and its default is a number"),
        ("height", Value::Number(2.0), "division by zero"),
    ] {
        let parameters = BTreeMap::from([(name.to_owned(), value)]);
        let settings = Settings {
            parameters: parameters.clone(),
            ..Settings::default()
        };
        let grown = super::plant("world.dcg", text.into(), &settings, ground).unwrap_err();
        let sowing = Sowing { seed: 0, parameters };
        let baked = import_sown("world.dcg", text.into(), &sowing, ground).unwrap_err();
        assert_eq!(baked.to_string(), grown.to_string());
        assert!(baked.to_string().contains(wanted), "{baked}");
    }
}

#[test]
fn placed_files_take_of_one_budget() {
    let file = Gltf::triangle().glb();
    let files = ["a.glb", "b.glb", "c.glb"].map(|name| (name, file.clone()));
    let read = |text: &str, memory_bytes: u64| {
        let limits = Limits {
            memory_bytes,
            ..Limits::default()
        };
        let files = Beside(files.clone().into());
        import("world.dcg", text.into(), &files, &limits, &Silent)
    };
    let (one, three) = ("model \"a.glb\"", "model \"a.glb\" model \"b.glb\" model \"c.glb\"");
    let needs = |text: &str| {
        (0..1 << 20)
            .step_by(256)
            .find(|memory_bytes| read(text, *memory_bytes).is_ok())
    };
    let [of_one, of_three] = [one, three].map(|text| needs(text).unwrap());
    assert!(of_three > 2 * of_one, "{of_one} bytes for one, {of_three} for three");
}

#[test]
fn what_is_placed_is_bounded_whatever_it_is() {
    let mut gltf = Gltf::triangle();
    for name in ["b", "c", "d"] {
        gltf.push("nodes", json!({"name": name, "mesh": 0}));
    }
    gltf.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    let files = [("n.glb", gltf.glb())];
    let placed = rules("for i in 250 model \"n.glb\"", &files).unwrap();
    assert_eq!(placed.scene.objects.len(), 1000);
    for (text, wanted) in [
        (
            "for i in 251 model \"n.glb\"",
            "n.glb: more than 1000 objects are placed",
        ),
        (
            "part a() { box(1, 1, 1) } model \"n.glb\" for i in 997 a()",
            "a: more than 1000 objects are placed",
        ),
        (
            "part a() { for i in 9 viewpoint \"v\" } for i in 101 a()",
            "more than 1000 placements",
        ),
        (
            "part a() { sphere(1, 256) } called \"cell:yard\" for i in 30 a()",
            "cell:yard: needs",
        ),
    ] {
        let error = rules(text, &files).unwrap_err().to_string();
        assert!(error.contains(wanted), "{text}: {error}");
    }
}

#[test]
fn a_gltf_node_grows_what_it_names() {
    let mut gltf = Gltf::triangle();
    let wish = |height: f64| json!({"belvedere": {"procedural": "gate.dcg", "parameters": {"height": height}}});
    for (name, x, height) in [("north", 10.0, 2.0), ("south", 20.0, 2.0), ("tall", 30.0, 5.0)] {
        gltf.push(
            "nodes",
            json!({"name": name, "translation": [x, 0, 0], "extras": wish(height)}),
        );
    }
    gltf.push(
        "nodes",
        json!({"name": "none", "extras": {"belvedere": {"procedural": "none.dcg"}}}),
    );
    gltf.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
    let files = [("gate.dcg", GATE.into())];
    let imported = read("scene.glb", gltf.glb(), &files).unwrap();
    assert_eq!(names(&imported)[..3], ["n", "north/post", "north/post 2"]);
    assert_eq!(imported.scene.objects.len(), 1 + 3 * 4);
    assert_eq!(imported.scene.models.len(), 1 + 2 * 2);
    assert_eq!(imported.scene.objects[6].world_from_object.w_axis.x, 22.0);
    assert_eq!(imported.scene.objects[4].role, Role::Door);
    assert_eq!(imported.defects.count("rules that cannot be read: not grown"), 1);
    let places: Vec<_> = imported.defects.iter().map(|defect| defect.first.clone()).collect();
    assert_eq!(
        places,
        ["node \"none\", none.dcg: there is no such file in the source's folder"]
    );

    gltf.json["nodes"][1]["extras"]["belvedere"]["parameters"]["height"] = json!(99);
    let imported = read("scene.glb", gltf.glb(), &files).unwrap();
    assert_eq!(imported.scene.objects.len(), 1 + 2 * 4);
    let kind = "rules that are wrong, or given what they do not take: not grown";
    let told = imported
        .defects
        .iter()
        .find(|defect| defect.kind == kind)
        .unwrap()
        .first;
    assert_eq!(told, "node \"north\", gate.dcg: `height` is 99; it must be from 1 to 9");
}

#[test]
fn what_rules_draw_for_the_bake_stands_where_their_node_stands() {
    let drawn = "called \"door:gate\" box(1, 1, 0.1) called \"cell:yard\" box(2, 3, 2)
        called \"portal:gap\" box(1, 2, 0) called \"occluder:core\" box(1, 1, 1)
        move(0, 1.7, 5) turn(90) viewpoint \"Yard\"";
    let mut gltf = Gltf::triangle();
    gltf.push("cameras", json!({"type": "perspective"}));
    gltf.push("nodes", json!({"name": "eye", "camera": 0}));
    let extras = json!({"belvedere": {"procedural": "yard.dcg"}});
    for (name, x) in [("north", 10.0), ("south", 20.0)] {
        gltf.push(
            "nodes",
            json!({"name": name, "translation": [x, 0, 0], "scale": [2, 2, 2], "extras": extras}),
        );
    }
    gltf.push("nodes", json!({"name": "flat", "scale": [0, 0, 0], "extras": extras}));
    gltf.push("nodes", json!({"name": "cell:x", "children": [0], "extras": extras}));
    gltf.json["scenes"][0]["nodes"] = json!([1, 2, 3, 4]);
    gltf.json["nodes"][1]["mesh"] = json!(0);
    let files = [("yard.dcg", drawn.into())];
    let imported = read("scene.glb", gltf.glb(), &files).unwrap();
    let scene = &imported.scene;
    assert_eq!(names(&imported), ["eye", "north/door:gate", "south/door:gate"]);
    let viewpoints = scene.viewpoints.iter();
    let viewpoints: Vec<_> = viewpoints
        .map(|viewpoint| {
            (
                viewpoint.name.as_str(),
                viewpoint.world_from_camera.w_axis.truncate().to_array(),
            )
        })
        .collect();
    assert_eq!(
        viewpoints,
        [
            ("eye", [0.0; 3]),
            ("Yard", [10.0, 3.4, 10.0]),
            ("Yard 2", [20.0, 3.4, 10.0])
        ]
    );
    // A viewpoint has no scale, and looks along −z of its own, turned by 90°.
    let towards = scene.viewpoints[1].world_from_camera.z_axis;
    assert!((towards - glam::DVec4::X).length() < 1e-12, "{towards}");
    let shape = |shapes: &[AuthoredShape]| {
        let points = shapes[1].triangles.iter().flatten().map(|p| p.to_array());
        let bounds = belvedere_scene::Bounds::around(points);
        (shapes[0].node.clone(), shapes[1].node.clone(), bounds.min, bounds.max)
    };
    let named = |name: &str| (format!("north/{name}"), format!("south/{name}"));
    let (north, south) = named("cell:yard");
    assert_eq!(
        shape(&scene.authored.cells),
        (north, south, [18.0, 0.0, -2.0], [22.0, 6.0, 2.0])
    );
    let (north, south) = named("portal:gap");
    assert_eq!(
        shape(&scene.authored.portals),
        (north, south, [19.0, 0.0, 0.0], [21.0, 4.0, 0.0])
    );
    let (north, south) = named("occluder:core");
    assert_eq!(
        shape(&scene.authored.occluders),
        (north, south, [19.0, 0.0, -1.0], [21.0, 2.0, 1.0])
    );
    let defects: Vec<_> = imported.defects.iter().map(|defect| defect.to_string()).collect();
    assert_eq!(defects, ["1 × rules at a node without volume: not grown (first: flat)"]);

    gltf.json["scenes"][0]["nodes"] = json!([1, 5]);
    let imported = read("scene.glb", gltf.glb(), &files).unwrap();
    let kind = "rules at a node that is a cell, a portal or an occluder: not grown";
    assert_eq!(imported.defects.count(kind), 1);
}

#[test]
fn a_node_that_asks_for_rules_wrongly_is_told() {
    let told = |extras: serde_json::Value| {
        let mut gltf = Gltf::triangle();
        gltf.push("nodes", json!({"name": "wrong", "extras": {"belvedere": extras}}));
        gltf.json["scenes"][0]["nodes"] = json!([0, 1]);
        let imported = read("scene.glb", gltf.glb(), &[("gate.dcg", GATE.into())]).unwrap();
        imported
            .defects
            .iter()
            .map(|defect| defect.kind.to_owned())
            .collect::<Vec<_>>()
    };
    for seed in [json!(-1), json!(1.5), json!("abc"), json!(4_294_967_296_u64)] {
        let kinds = told(json!({"procedural": "gate.dcg", "seed": seed}));
        assert_eq!(
            kinds,
            ["a `seed` that is not a whole number from 0 to 4294967295: not grown"]
        );
    }
    let kinds = told(json!({"procedural": "gate.dcg", "parameters": [1]}));
    assert_eq!(
        kinds,
        ["`parameters` that are not an object of names and values: not grown"]
    );
    assert!(told(json!({"procedural": "gate.dcg", "seed": 4_294_967_295_u64})).is_empty());
    assert_eq!(
        told(json!({"procedural": "gate.dcg", "sead": 7})),
        ["member of `extras.belvedere` that is not known, perhaps `seed`: ignored"]
    );
}

/// Some exporters know no whole numbers.
#[test]
fn parts_of_a_file_that_was_given_something_are_grown_from_a_text_that_has_it() {
    const POSTS: &str = "parameter n = 2 from 1 to 20 parameter tall = 1 + n / 4 import \"paint.dcg\" as shades
        let wide = n / 10 + random(0, 0.1)
        part post(h) { paint shades.wood(n) box(wide, h * tall, random(0.1, 0.2)) }
        for i in n move(i, 0, 0) post(mod(i, 2) + 1)";
    const PAINT: &str = "material wood(n) { colour = [n / 20, 0.5, 0] }";
    let files = [("posts.dcg", POSTS.into()), ("paint.dcg", PAINT.into())];
    let two = "import \"posts.dcg\" as posts posts() move(0, 0, 9) posts(n = 5) move(0, 0, 20) posts(5, tall = 3) move(0, 0, 30) posts(5)";
    let wish = json!({"procedural": "posts.dcg", "parameters": {"n": 7}, "seed": 3});
    let mut gltf = Gltf::triangle();
    gltf.push("nodes", json!({"name": "row", "extras": {"belvedere": wish}}));
    gltf.json["scenes"][0]["nodes"] = json!([1]);
    for (imported, given) in [(rules(two, &files), 3), (read("row.glb", gltf.glb(), &files), 1)] {
        let scene = imported.unwrap().scene;
        let mut texts = BTreeMap::new();
        for model in &scene.models {
            let SourceRecipe {
                texts: all,
                recipe,
                seed,
            } = model.recipe.as_ref().unwrap();
            *texts.entry(&all[&recipe.file]).or_insert(0) += 1;
            let settings = Settings {
                seed: *seed,
                ..Settings::default()
            };
            let program = Program::read("alone", recipe.text(), &Texts(all)).unwrap();
            let alone = grow(&program, &settings).unwrap();
            assert_eq!(alone.parts[1].meshes[0].positions, model.primitives[0].positions);
        }
        // Posts of two heights for each way in which the file was given something.
        assert_eq!(texts.into_values().collect::<Vec<_>>(), vec![2; given]);
    }
}

#[test]
fn parts_of_a_file_that_was_given_more_than_a_text_may_hold_are_meshes() {
    let post = "parameter l = [0] part post() { box(1, count(l), 1) } post()";
    let files = [("post.dcg", post.into())];
    let world = |count: usize| {
        let list = vec!["1/3"; count].join(",");
        rules(&format!("import \"post.dcg\" as post post(l = [{list}])"), &files).unwrap()
    };
    assert!(world(20_000).scene.models[0].recipe.is_some(), "0.4 MB");
    let imported = world(60_000);
    assert!(imported.scene.models[0].recipe.is_none(), "1.2 MB");
    let kind =
        "part of a file that is given so much, or in so many ways, that its rules would be too long: offered as meshes";
    assert_eq!(imported.defects.count(kind), 1);
}

/// The texts of a recipe.
struct Texts<'t>(&'t BTreeMap<String, String>);

impl Loader for Texts<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        self.0.get(path).cloned().ok_or_else(|| path.to_owned())
    }
}

#[test]
fn a_seed_that_is_written_with_a_point_is_what_it_is() {
    let grown = |seed: serde_json::Value| {
        let mut gltf = Gltf::triangle();
        gltf.push(
            "nodes",
            json!({"name": "grows", "extras": {"belvedere": {"procedural": "dice.dcg", "seed": seed}}}),
        );
        gltf.json["scenes"][0]["nodes"] = json!([0, 1]);
        let files = [("dice.dcg", b"box(random(1, 2), 1, 1)".to_vec())];
        let imported = read("scene.glb", gltf.glb(), &files).unwrap();
        assert_eq!(imported.defects.iter().count(), 0);
        imported.scene.models[1].primitives.clone()
    };
    assert_eq!(grown(json!(7.0)), grown(json!(7)));
    assert_ne!(grown(json!(7.0)), grown(json!(8)));
}

#[test]
fn what_is_written_as_a_plain_glb_is_read_as_the_same_scene() {
    let scene = rules(GATE, &[]).unwrap().scene;
    let again = read("again.glb", write_whole(&scene), &[]).unwrap();
    assert_eq!(names(&again), ["post", "post 2", "post 3", "door:gate"]);
    assert_eq!(again.scene.models[0].primitives, scene.models[0].primitives);
    assert_eq!(again.scene.materials[0].gltf, scene.materials[0].gltf);
    assert_eq!(again.defects.iter().count(), 0);
}

#[test]
fn what_grows_with_less_detail_is_the_authors_coarser_look() {
    let text = "material leaf(shade) { colour = mix(#fff, #000, shade) }
        part bush(size) { for i in 1 + 2 * detail paint leaf(detail / 4) move(i, 0, 0) box(size, 1, 1) }
        part post() { box(1, 3, 1) }
        part thorn() { box(1 / (detail - 2), 1, 1) box(1, if detail > 2 then detail else 9, 1) }
        bush(2) move(0, 0, 5) post() move(0, 0, 9) thorn()";
    let imported = rules(text, &[]).unwrap();
    let [bush, post, thorn] = &imported.scene.models[..] else {
        panic!("three models")
    };
    let boxes = |looks: &[Primitive]| looks.iter().map(|look| look.indices.len() / 36).sum::<usize>();
    let coarser: Vec<_> = bush.coarser.iter().map(|look| boxes(look)).collect();
    assert_eq!((boxes(&bush.primitives), coarser), (9, vec![7, 5, 3, 1]));
    assert_eq!(bush.coarser[0][0].positions[0], bush.primitives[0].positions[0]);
    let colour = |look: &[Primitive]| &imported.scene.materials[look[0].material.unwrap()].gltf;
    assert_ne!(colour(&bush.coarser[3]), colour(&bush.primitives));
    assert!(post.coarser.is_empty() && thorn.coarser.is_empty());
    let told: Vec<_> = imported
        .defects
        .iter()
        .map(|defect| (defect.count, defect.first))
        .collect();
    assert_eq!(told, [(1 + 2, "thorn, detail 2".to_owned())]);
}
