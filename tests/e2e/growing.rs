//! What grows out of rules: as a file, as a scene, and on a client that knows the language.

use belvedere_scene::{
    BlobName, ObjectId,
    population::Population,
    procedural::{Loader, Program, Settings, grow},
};
use serde_json::Value;

use crate::program::{Data, text};

const HUT: &str = "
import \"post.dcg\" as post
parameter size = 4 from 2 to 9
material wall { colour = #d8c39a }
part hut(size, floors) { paint wall box(size, 3 * floors, size) move(0, 3 * floors, 0) cone(size, 2, sides = 4) }
for i in 3 move(12 * i, 0, 0) { hut(size, 1 + mod(i, 2)) move(6, 0, 0) post() }
move(0, 1.7, 14) viewpoint \"Huts\"
";
const POST: &str = "parameter height = 2\ncylinder(0.1, height)";

fn files(data: &Data) -> String {
    data.write("post.dcg", POST);
    let file = data.write("huts.dcg", HUT);
    file.to_str().expect("a path in UTF-8").to_owned()
}

#[test]
fn grow_writes_a_glb_and_says_what_it_took() {
    let data = Data::new();
    let file = files(&data);
    let out = data.folder("huts.glb");
    let out = out.to_str().expect("UTF-8");
    let args = ["grow", &file, "-o", out, "--set", "size=5", "--seed", "7", "--json"];
    let report: Value = serde_json::from_str(&data.ok(&args)).expect("JSON");
    assert_eq!((&report["objects"], &report["parts"]), (&6.into(), &3.into()));
    assert_eq!(report["limits"]["levels"], serde_json::json!([1, 64]));
    let glb = gltf::Gltf::open(out).expect("a valid GLB");
    assert_eq!((glb.nodes().count(), glb.meshes().count()), (6, 3));
    assert!(data.ok(&["grow", &file]).contains("used 1 of 64 levels"));
    let inspected = data.ok(&["inspect", &file]);
    assert!(
        inspected.contains("6 objects of 3 models")
            && inspected.contains("3 of 3 published models can be grown by clients\n"),
        "{inspected}"
    );
    let block = data.write("block.dcg", "box(1, 1, 1)");
    let block = block.to_str().expect("UTF-8");
    let grown = data.ok(&["grow", block]);
    assert!(grown.contains("12 triangles in 1 object of 1 part, "), "{grown}");
    let inspected = data.ok(&["inspect", block]);
    assert!(
        inspected.contains("1 object of 1 model, ")
            && inspected.contains("1 of 1 published model can be grown by clients\n"),
        "{inspected}"
    );
    // Triangles, objects and size of what is placed, of glTF files too.
    let yard = data.write(
        "yard.dcg",
        "move(-0.5, 0, 0) box(1, 1, 1)\nmove(50, 0, 0) model \"huts.glb\"",
    );
    let yard = yard.to_str().expect("UTF-8");
    let placed: Value = serde_json::from_str(&data.ok(&["grow", yard, "--json"])).expect("JSON");
    let huts = report["triangles"].as_u64().expect("a number");
    assert_eq!(
        (&placed["objects"], &placed["triangles"]),
        (&7.into(), &(12 + huts).into())
    );
    let far = report["bounds"]["max"][0].as_f64().expect("a number") + 50.0;
    let told = |place: &str| placed.pointer(place).and_then(Value::as_f64).expect("a number");
    assert!(
        (told("/bounds/max/0") - far).abs() < 1e-3 && (told("/size_m/0") - far - 1.0).abs() < 1e-3,
        "{placed}"
    );
    let error = data.fails(&["grow", out]);
    assert!(
        error.contains("huts.glb: this is glTF or an archive, and `grow` takes rules"),
        "{error}"
    );
    let shouted = data.write("HUTS.DCG", HUT);
    assert!(
        data.ok(&["inspect", shouted.to_str().expect("UTF-8")])
            .contains("6 objects of 3 models")
    );
    for (argument, wanted) in [
        ("size=99", "`size` is 99; it must be from 2 to 9"),
        ("sise=3", "did you mean `size`?"),
        ("walls=3", "it takes `size from 2 to 9`"),
    ] {
        let error = data.fails(&["grow", &file, "--set", argument]);
        assert!(error.contains(wanted) && error.contains("`--set`"), "{error}");
    }
}

#[test]
fn grow_takes_rules_that_begin_with_a_brace_and_no_document() {
    let data = Data::new();
    let rules = data.write("brace.dcg", "{ box(1, 1, 1) }");
    assert!(
        data.ok(&["grow", rules.to_str().expect("UTF-8")])
            .contains("12 triangles")
    );
    let document = data.write("document.dcg", r#"  {"scenes": [], "asset": {"version": "2.0"}}"#);
    let error = data.fails(&["grow", document.to_str().expect("UTF-8")]);
    assert!(error.contains("this is glTF or an archive"), "{error}");
}

#[test]
fn grow_says_what_its_options_take_and_reads_no_device() {
    let data = Data::new();
    let file = files(&data);
    for (option, value, wanted) in [
        ("--seed", "-1", "from 0 to 4294967295"),
        ("--seed", "abc", "from 0 to 4294967295"),
        ("--detail", "-1", "from 0 to 4"),
        ("--detail", "5", "from 0 to 4"),
        ("--set", "=3", "the name of a parameter is missing"),
        (
            "--set",
            "size=tall",
            "`--set`: the value of `size` is neither a number nor a list of them: `tall`",
        ),
    ] {
        let refused = data.run(&["grow", &file, option, value]);
        let said = text(&refused.stderr);
        assert!(
            refused.status.code() == Some(2) && said.contains(wanted),
            "{option} {value}: {said}"
        );
    }
    // No more is repeated of what was given than of a line.
    let long = "7".repeat(100_000);
    for args in [
        &["grow", &file, "--seed", &long][..],
        &["grow", &file, "--detail", &long],
        &["grow", &long],
    ] {
        let refused = data.run(args);
        let said = text(&refused.stderr);
        assert!(
            !refused.status.success() && said.contains("777…") && said.len() < 500,
            "{said}"
        );
    }
    for (rules, wanted) in [
        (
            "import \"pots.dcg\" as post",
            "there is no such file; did you mean \"post.dcg\"?",
        ),
        ("model \"bench.glb\"", "there is no such file in the source's folder"),
        (
            "import \"post.dcg\" as post post.rail(2)",
            "`rail` is not a rule of \"post.dcg\"; it declares none",
        ),
    ] {
        let file = data.write("wrong.dcg", rules);
        let error = data.fails(&["grow", file.to_str().expect("UTF-8")]);
        assert!(error.contains(wanted), "{error}");
    }
    let flat = data.write("flat.dcg", "box(0, 0, 0) box(1, 1, 1)");
    let said = data.ok(&["grow", flat.to_str().expect("UTF-8")]);
    assert!(
        said.contains("  12 triangles in") && said.contains("  12 more triangles have no area and are left out"),
        "{said}"
    );
    let dense = data.write(
        "dense.dcg",
        "part p() { for i in 500 box(1, 1, 1) } for i in 1000 for j in 716 move(i, 0, j) p()",
    );
    let dense = dense.to_str().expect("UTF-8");
    for command in ["grow", "inspect"] {
        let said = data.ok(&[command, dense]);
        assert!(
            said.contains("4296000000 of 4294967295 placed triangles") && said.contains("a bake would refuse it"),
            "{said}"
        );
        let said = data.ok(&[command, &file]);
        assert!(
            said.contains(" of 4194304 numbers kept") && said.contains(" 2 of 256 files") && !said.contains("refuse"),
            "{said}"
        );
    }
    let long = data.write("long.dcg", format!("box(1, 1, 1)\n{}", "// long\n".repeat(200_000)));
    let long = long.to_str().expect("UTF-8");
    for command in [
        &["grow", long][..],
        &["inspect", long],
        &["bake", long, "--scene", "long"],
    ] {
        let error = data.fails(command);
        let wanted = "long.dcg, line 1, column 1: more than 1048576 bytes of text; make it smaller";
        assert!(error.contains(wanted), "{error}");
    }
    let [name, value] = ["x".repeat(100_000), format!("size={}", "x".repeat(100_000))];
    let prism = data.write("prism.dcg", "parameter fp = [[0, 0], [4, 0], [0, 3]] prism(fp, 2)");
    let prism = prism.to_str().expect("UTF-8");
    for command in [&["grow"][..], &["inspect"], &["bake", "--scene", "prism"]] {
        for long in [&value, &format!("{name}=3")] {
            let said = text(&data.run(&[command, &[&file, "--set", long]].concat()).stderr);
            assert!(said.contains("xxx…") && said.len() < 600, "{said}");
        }
        let error = data.fails(&[command, &[prism, "--set", "fp=4"]].concat());
        assert!(
            error.contains("prism.dcg, line 1, column 47: ")
                && error.contains("`fp` was given a number, and its default is a list"),
            "{error}"
        );
    }
    let dice = data.write("dice.dcg", "parameter size = 4\nbox(size, 1 + detail, random(1, 2))");
    let dice = dice.to_str().expect("UTF-8");
    let size_m = |given: &[&str]| -> [f64; 3] {
        let report: Value =
            serde_json::from_str(&data.ok(&[&["inspect", dice, "--json"], given].concat())).expect("JSON");
        serde_json::from_value(report["growth"]["size_m"].clone()).expect("three numbers")
    };
    let usual = size_m(&[]);
    assert_eq!(usual[..2], [4.0, 5.0]);
    assert_eq!(size_m(&["--set", "size=9", "--detail", "0"])[..2], [9.0, 1.0]);
    assert_eq!(size_m(&["--seed", "0"]), usual);
    assert_ne!(size_m(&["--seed", "2"])[2], usual[2]);
    let error = data.fails(&["inspect", &file, "--set", "sise=9"]);
    assert!(
        error.contains("`--set`") && error.contains("did you mean `size`?"),
        "{error}"
    );
    let plan = data.write("room.plan", "");
    let error = data.fails(&["inspect", plan.to_str().expect("UTF-8"), "--detail", "2"]);
    assert!(
        error.contains("for rules (.dcg), and room.plan is none: leave them out"),
        "{error}"
    );
    let twice = data.fails(&["grow", &file, "--set", "size=3", "--set", "size=4"]);
    assert!(twice.contains("`--set size=…` is given twice"), "{twice}");
    let endless = data.folder("endless.dcg");
    std::os::unix::fs::symlink("/dev/zero", &endless).expect("a link");
    let endless = endless.to_str().expect("UTF-8");
    for command in [&["grow", endless][..], &["mesh", "lod", endless]] {
        let error = data.fails(command);
        assert!(error.contains("endless.dcg is not a regular file"), "{error}");
    }
}

#[test]
fn cells_that_a_bake_refuses_are_told_by_grow_and_inspect_too() {
    let data = Data::new();
    let file = data.write(
        "hall.dcg",
        "box(1, 1, 1)\n  called \"cell:hall\" prism([[0, 0], [4, 0], [4, 4], [2, 1]], 3)",
    );
    let file = file.to_str().expect("UTF-8");
    let wanted = "hall.dcg, line 2, column 3: author's cell `cell:hall` is not convex: it reaches ";
    for command in ["grow", "inspect"] {
        let said = data.ok(&[command, file]);
        assert!(said.contains(&format!("  a bake would refuse it: {wanted}")), "{said}");
        assert!(
            said.contains("  1 cell, portal or occluder is for the bake and no object"),
            "{said}"
        );
    }
    let report: Value = serde_json::from_str(&data.ok(&["grow", file, "--json"])).expect("JSON");
    assert!(
        report["refused"].as_str().is_some_and(|told| told.contains(wanted)),
        "{report}"
    );
    let error = data.fails(&["bake", file, "--scene", "hall"]);
    assert!(error.contains(wanted), "{error}");
    // The same of glTF in which such rules grow.
    let node = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "hall", "extras": {"belvedere": {"procedural": "hall.dcg"}}}]}"#;
    let node = data.write("node.gltf", node);
    for file in [file, node.to_str().expect("UTF-8")] {
        let report: Value = serde_json::from_str(&data.ok(&["inspect", file, "--json"])).expect("JSON");
        assert!(
            report["refused"]
                .as_str()
                .is_some_and(|told| told.contains("is not convex")),
            "{report}"
        );
        assert_eq!(report["growth"].get("refused"), None, "told once");
    }
}

#[test]
fn marks_on_nothing_are_told_with_their_place() {
    let data = Data::new();
    let file = data.write("hall.dcg", "box(1, 1, 1)\n  called \"cell:hall\" { } box(4, 3, 4)");
    let file = file.to_str().expect("UTF-8");
    let wanted = "`door:` without geometry: not used; ";
    for command in ["grow", "inspect"] {
        let said = data.ok(&[command, file]);
        assert!(
            said.contains(wanted) && said.contains("(first: hall.dcg, line 2, column 3: `cell:hall`)"),
            "{said}"
        );
    }
    let report = data.bake(std::path::Path::new(file), "hall");
    let defects = report["defects"].as_array().expect("a list").iter();
    let told = defects.filter(|defect| defect["first"] == "hall.dcg, line 2, column 3: `cell:hall`");
    assert_eq!(told.count(), 1, "{report}");
}

#[test]
fn what_is_for_the_bake_alone_is_not_in_the_box_around_what_is_drawn() {
    let data = Data::new();
    let text = "turn(45) box(2, 1, 2) called \"cell:hall\" move(0, 0, 20) box(4, 3, 4)";
    let hall = data.write("hall.dcg", text);
    let report: Value =
        serde_json::from_str(&data.ok(&["grow", hall.to_str().expect("UTF-8"), "--json"])).expect("JSON");
    let told = |place: &str| report.pointer(place).and_then(Value::as_f64).expect("a number");
    let half = 2.0_f64.sqrt();
    assert!(
        (told("/bounds/max/2") - half).abs() < 1e-6 && (told("/size_m/0") - 2.0 * half).abs() < 1e-6,
        "{report}"
    );
    assert_eq!(report["shapes"], 1);
}

#[test]
fn doors_that_close_nothing_are_told() {
    let data = Data::new();
    let idle = |name: &str, text: &str| -> Vec<(String, String)> {
        let report = data.bake(&data.write(&format!("{name}.dcg"), text), name);
        let defects = report["defects"].as_array().cloned().unwrap_or_default();
        let told = |defect: &Value, member: &str| defect[member].as_str().unwrap_or_default().to_owned();
        let defects = defects
            .iter()
            .map(|defect| (told(defect, "kind"), told(defect, "first")));
        defects.filter(|(kind, _)| kind.starts_with("door that ")).collect()
    };
    let rooms = |leaf: &str| {
        format!(
            "part leaf() {{ move(0.5, 0, 0) box(1, 2, 0.06) }}
             move(0, -0.1, 0) box(8, 0.1, 8) move(-1, 0, 2) box(0.4, 0.4, 0.4)
             called \"cell:a\" move(0, 0, -2) box(4, 3, 4)
             called \"cell:b\" move(0, 0, 2) box(4, 3, 4)
             called \"portal:p\" polygon([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 2, 0], [-0.5, 2, 0]])
             move(-0.5, 0, 0) called \"door:front\" {leaf} leaf()"
        )
    };
    assert_eq!(idle("shut", &rooms("")), []);
    for (name, leaf, wanted, middle) in [
        (
            "open",
            "turn(-90)",
            "its leaf covers no opening",
            "-0.500, 1.000, 0.500",
        ),
        (
            "half",
            "scale(0.5, 1, 1)",
            "its leaf covers only a part",
            "-0.250, 1.000, 0.000",
        ),
    ] {
        let told = idle(name, &rooms(leaf));
        assert!(
            told.len() == 1 && told[0].0.contains(wanted) && told[0].1 == format!("door:front at {middle}"),
            "{told:?}"
        );
    }
    let lone = idle(
        "lone",
        "move(0, -0.1, 0) box(8, 0.1, 8) called \"door:lone\" turn(30) box(1, 2, 0.06)",
    );
    assert!(lone.len() == 1 && lone[0].0.contains("hides nothing"), "{lone:?}");
}

#[test]
fn bounds_are_found_without_growing() {
    let data = Data::new();
    let file = data.write(
        "grove.dcg",
        "part tree(h) within [-h, 0, -h] to [h, 2 * h, h] { for i in 1000 sphere(h, sides = 256) } parameter h = 2 move(9, 0, 0) tree(h)",
    );
    let file = file.to_str().expect("UTF-8");
    let said = data.ok(&["grow", file, "--bounds"]);
    assert!(
        said.contains("within [7.0, 0.0, -2.0] and [11.0, 4.0, 2.0], 4.0 × 4.0 × 4.0 m")
            && said.contains("used 1 of 64 levels"),
        "{said}"
    );
    let found: Value =
        serde_json::from_str(&data.ok(&["grow", file, "--bounds", "--json", "--set", "h=3"])).expect("JSON");
    assert_eq!(
        found["bounds"],
        serde_json::json!({"min": [6.0, 0.0, -3.0], "max": [12.0, 6.0, 3.0]})
    );
    assert_eq!(found["limits"]["parts"], serde_json::json!([2, 65536]));
    let empty = data.write("empty.dcg", "rule r() {}");
    let empty = empty.to_str().expect("UTF-8");
    for arguments in [&["grow", empty, "--json"][..], &["grow", empty, "--bounds", "--json"]] {
        let report: Value = serde_json::from_str(&data.ok(arguments)).expect("JSON");
        assert_eq!(report["bounds"], Value::Null);
    }
    assert!(
        data.ok(&["grow", empty, "--bounds"])
            .contains("there is nothing to hold")
    );
}

/// Rules by the names that an object info gives them.
struct Published(Vec<(String, String)>);

impl Loader for Published {
    fn load(&self, path: &str) -> Result<String, String> {
        let found = self.0.iter().find(|(name, _)| name == path);
        found
            .map(|(_, text)| text.clone())
            .ok_or_else(|| "not published".to_owned())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_grows_what_others_download() {
    let data = Data::new();
    files(&data);
    data.bake(&data.folder("huts.dcg"), "huts");
    let server = data.serve();
    let scene = server
        .client()
        .open(&"huts".parse().expect("a name"))
        .await
        .expect("a scene");
    let mut rules = std::collections::BTreeSet::<BlobName>::new();
    for number in 0..6 {
        let info = scene.object(ObjectId(number)).await.expect("an object");
        let procedural = info.procedural.expect("it has grown from rules");
        rules.insert(procedural.rules.clone());
        let mut texts = vec![("rules".to_owned(), procedural.rules)];
        let mut sizes = vec![procedural.rules_bytes];
        for (name, import) in procedural.imports {
            texts.push((name, import.url));
            sizes.push(import.bytes);
        }
        let mut loader = Published(Vec::new());
        for ((name, blob), size) in texts.into_iter().zip(sizes) {
            let bytes = scene.blob(&blob).await.expect("the rules are there");
            assert_eq!(bytes.len() as u64, size, "{name}");
            loader.0.push((name, String::from_utf8(bytes.to_vec()).expect("text")));
        }
        let parameters = procedural
            .parameters
            .iter()
            .map(|(name, value)| format!("{name} = {value}"));
        let parameters: Vec<String> = parameters.collect();
        let part = procedural.part.map_or(String::new(), |part| format!(".{part}"));
        let text = format!("import \"rules\" as rules rules{part}({})", parameters.join(", "));
        let program = Program::read("model", text, &loader).expect("sound rules");
        let grown = grow(&program, &Settings::default()).expect("they grow");
        let triangles: usize = grown.parts[1].meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
        assert_eq!(triangles as u64, info.levels[0].triangles, "{}", info.source_node);
    }
    assert_eq!(rules.len(), 2, "one object of rules for each file");
}

#[tokio::test(flavor = "multi_thread")]
async fn populations_say_in_few_bytes_what_stands_where() {
    let data = Data::new();
    files(&data);
    let report = data.bake(&data.folder("huts.dcg"), "huts");
    let server = data.serve();
    let scene = server
        .client()
        .open(&"huts".parse().expect("a name"))
        .await
        .expect("a scene");
    let root = scene.manifest().populations.as_ref().expect("huts can be grown");
    let [entry] = &root.entries[..] else {
        panic!("six objects are one population");
    };
    let bytes = scene.blob(&entry.url).await.expect("the population is there");
    assert_eq!(report["bytes"]["populations"], bytes.len());
    assert_eq!(report["bytes"]["rules"], HUT.len() + POST.len());
    assert_eq!(
        (&report["growable"]["models"], &report["growable"]["alone"]),
        (&3.into(), &3.into())
    );
    let population = Population::decode(&bytes, ObjectId(entry.first), entry.count).expect("a population");
    assert_eq!((population.rules.len(), population.recipes.len()), (2, 3));
    assert_eq!(population.members.len(), 6);
    for member in &population.members {
        let info = scene.object(member.object).await.expect("an object");
        assert_eq!(population.procedural(member.recipe), info.procedural);
        let recipe = &population.recipes[member.recipe];
        assert_eq!(
            (Some(recipe.model), recipe.triangles),
            (info.model, info.levels[0].triangles)
        );
        let pairs = member.transform().into_iter().zip(info.transform);
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-4),
            "{}",
            info.source_node
        );
    }
}

#[test]
fn a_world_is_baked_with_the_parameters_that_it_is_given() {
    let data = Data::new();
    let file = files(&data);
    let usual = data.bake(&data.folder("huts.dcg"), "huts");
    let bake = |arguments: &[&str]| -> Value {
        let all = [&["bake", &file, "--scene", "huts", "--json"], arguments].concat();
        serde_json::from_str(&data.ok(&all)).expect("JSON")
    };
    let large = bake(&["--set", "size=5"]);
    assert_eq!(large["unchanged"], false);
    assert_ne!(large["revision"], usual["revision"]);
    let given = HUT.len() + POST.len() + "5.0".len() - "4".len();
    assert_eq!(large["bytes"]["rules"], given, "what was given stands in the rules");
    assert_eq!(bake(&["--set", "size=5"])["unchanged"], true);
    for (argument, wanted) in [
        ("size=99", "`size` is 99; it must be from 2 to 9"),
        ("sise=3", "did you mean `size`?"),
        ("walls=3", "it takes `size from 2 to 9`"),
    ] {
        let error = data.fails(&["bake", &file, "--scene", "huts", "--set", argument]);
        assert!(error.contains(wanted) && error.contains("`--set`"), "{error}");
    }
    let plan = data.write("room.plan", "");
    let plan = plan.to_str().expect("UTF-8");
    let error = data.fails(&["bake", plan, "--scene", "room", "--seed", "3"]);
    assert!(error.contains("room.plan is none: leave them out"), "{error}");
}
