//! What the generators of levels of detail say and write as tools for one file.

use belvedere_scene::{BlobHash, smooth::Decoder};
use serde_json::{Value, json};

use crate::program::{Data, text};

/// A bumpy sheet of n × n quads as a glTF with its buffer beside it.
fn sheet(data: &Data, n: u32) -> String {
    sheet_at(data, n, |x| x)
}

/// The same with other coordinates.
fn sheet_at(data: &Data, n: u32, place: impl Fn(f32) -> f32) -> String {
    let at = |i: u32| i as f32 / n as f32;
    let vertex = |i: u32| {
        let (x, z) = (at(i % (n + 1)), at(i / (n + 1)));
        [x, 0.1 * (9.0 * x).sin() * (7.0 * z).cos(), z]
    };
    let count = (n + 1) * (n + 1);
    let mut bytes: Vec<u8> = (0..count)
        .flat_map(vertex)
        .map(place)
        .flat_map(f32::to_le_bytes)
        .collect();
    let quads = (0..n * n).map(|q| q / n * (n + 1) + q % n);
    let corners = quads.flat_map(|a| [a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2]);
    bytes.extend(corners.flat_map(u32::to_le_bytes));
    let gltf = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "sheet.bin", "byteLength": bytes.len()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12 * count},
            {"buffer": 0, "byteOffset": 12 * count, "byteLength": 24 * n * n},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", "min": [0, -1, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5125, "count": 6 * n * n, "type": "SCALAR"},
        ],
        "meshes": [{"name": "sheet", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    });
    data.write("sheet.bin", bytes);
    let file = data.write("sheet.gltf", gltf.to_string());
    file.to_str().expect("a path in UTF-8").to_owned()
}

fn levels(report: &Value) -> Vec<Value> {
    report["meshes"][0]["levels"].as_array().expect("levels").clone()
}

#[test]
fn mesh_lod_makes_ever_coarser_levels_and_writes_them() {
    let data = Data::new();
    let file = sheet(&data, 24);
    let folder = data.folder("out");
    let out = folder.to_str().expect("UTF-8");
    for method in ["octree", "quadric", "best"] {
        let args = [
            "mesh", "lod", &file, "--levels", "10", "--all", "--method", method, "--error", "1%", "--json", "-o", out,
        ];
        let report: Value = serde_json::from_str(&data.ok(&args)).expect("JSON");
        let levels = levels(&report);
        assert_eq!(levels.len(), 10, "{method}");
        assert_eq!(levels[0]["triangles"], 1152);
        assert!(levels[0]["geometric_error_m"].as_f64() < Some(1e-4), "rounding alone");
        for pair in levels.windows(2) {
            let rises = |name: &str| pair[0][name].as_f64() <= pair[1][name].as_f64();
            assert!(
                rises("geometric_error_m") && rises("switch_distance_m") && rises("range_m"),
                "{method}"
            );
            assert!(
                pair[1]["triangles"].as_u64() < pair[0]["triangles"].as_u64(),
                "{method}"
            );
        }
        for level in &levels {
            let glb = gltf::Gltf::open(folder.join(level["file"].as_str().expect("a file"))).expect("a valid GLB");
            let indices = glb.meshes().flat_map(|m| m.primitives().collect::<Vec<_>>());
            let triangles: usize = indices
                .filter(|p| p.mode() == gltf::mesh::Mode::Triangles)
                .map(|p| p.indices().expect("indices").count() / 3)
                .sum();
            assert_eq!(Some(triangles as u64), level["triangles"].as_u64());
        }
    }
    let printed = data.ok(&["mesh", "lod", &file, "--levels", "100", "--json"]);
    let few = levels(&serde_json::from_str(&printed).expect("JSON"));
    for pair in few[1..].windows(2) {
        let error = |level: &Value| level["geometric_error_m"].as_f64().expect("a number");
        assert!(
            error(&pair[1]) > error(&pair[0]),
            "a level that brings nothing: {pair:?}"
        );
    }
    let printed = data.ok(&["mesh", "lod", &file, "--levels", "100", "--all", "--json"]);
    let all = levels(&serde_json::from_str(&printed).expect("JSON"));
    assert!(all.len() > few.len(), "{} of {}", few.len(), all.len());
    let table = data.ok(&["mesh", "lod", &file, "--levels", "3"]);
    assert!(table.contains("level  triangles  lines  points"), "{table}");
}

#[test]
fn a_larger_error_on_the_screen_brings_levels_nearer() {
    let data = Data::new();
    let file = sheet(&data, 20);
    let distance = |error: &str| {
        let printed = data.ok(&["mesh", "lod", &file, "--levels", "2", "--error", error, "--json"]);
        let report: Value = serde_json::from_str(&printed).expect("JSON");
        levels(&report)[1]["switch_distance_m"].as_f64().expect("a number")
    };
    assert!((distance("1%") / distance("2%") - 2.0).abs() < 1e-9);
}

/// A triangle and a line, each a mesh of its own, over the same three vertices.
fn triangle_and_line(data: &Data) -> String {
    let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    data.write("both.bin", corners.map(f32::to_le_bytes).concat());
    let gltf = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "both.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "meshes": [
            {"name": "sail", "primitives": [{"attributes": {"POSITION": 0}}]},
            {"name": "rope", "primitives": [{"attributes": {"POSITION": 0}, "mode": 3}]},
        ],
        "nodes": [{"mesh": 0}, {"mesh": 1}],
        "scenes": [{"nodes": [0, 1]}],
    });
    let file = data.write("both.gltf", gltf.to_string());
    file.to_str().expect("a path in UTF-8").to_owned()
}

#[test]
fn mesh_smooth_names_what_it_leaves_out() {
    let data = Data::new();
    let file = triangle_and_line(&data);
    let printed = data.ok(&["mesh", "smooth", &file]);
    assert!(
        printed.contains("rope: skipped, it has lines or points only"),
        "{printed}"
    );
    let report: Value = serde_json::from_str(&data.ok(&["mesh", "smooth", &file, "--json"])).expect("JSON");
    assert_eq!(report["skipped"], json!(["rope"]));
    assert_eq!(report["meshes"].as_array().map(Vec::len), Some(1));
}

/// Triangles, lines and points over four corners, and an index too many: a mesh that `mesh smooth` holds in part.
fn mixed(data: &Data) -> String {
    let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0];
    let mut bytes = corners.map(f32::to_le_bytes).concat();
    bytes.extend([0u32, 1, 2, 3].map(u32::to_le_bytes).concat());
    data.write("mixed.bin", bytes);
    let gltf = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "mixed.bin", "byteLength": 64}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 16}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5125, "count": 4, "type": "SCALAR"},
        ],
        "meshes": [{"name": "mixed", "primitives": [
            {"attributes": {"POSITION": 0}, "indices": 1},
            {"attributes": {"POSITION": 0}, "indices": 1, "mode": 1},
            {"attributes": {"POSITION": 0}, "indices": 1, "mode": 0},
        ]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    });
    let file = data.write("mixed.gltf", gltf.to_string());
    file.to_str().expect("a path in UTF-8").to_owned()
}

#[test]
fn what_is_wrong_with_the_source_of_a_mesh_is_told() {
    let data = Data::new();
    let file = mixed(&data);
    let kind = "indices left over after the last whole shape: dropped";
    for tool in ["lod", "smooth"] {
        let output = data.run(&["mesh", tool, &file, "--json"]);
        let said = text(&output.stderr);
        assert!(
            said.contains(&format!("mixed.gltf: 1 × {kind} (first: /meshes/0")),
            "{tool}: {said}"
        );
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(report["defects"][0]["kind"], kind, "{tool}");
    }
    let printed = data.ok(&["mesh", "smooth", &file]);
    let left_out = "mixed: 2 lines and 4 points left out, only triangles have smooth LODs";
    assert!(printed.contains(left_out), "{printed}");
    let report: Value = serde_json::from_str(&data.ok(&["mesh", "smooth", &file, "--json"])).expect("JSON");
    let of_mesh = |name: &str| report["meshes"][0][name].clone();
    assert_eq!(
        (of_mesh("lines_left_out"), of_mesh("points_left_out")),
        (json!(2), json!(4))
    );
}

/// The coarser level of the smaller sheet has fewer corners and takes no fewer bytes.
#[test]
fn mesh_lod_keeps_what_saves_bytes_and_says_what_its_files_take() {
    let data = Data::new();
    let folder = data.folder("out");
    let out = folder.to_str().expect("UTF-8");
    for (quads, fewest) in [(2, 1), (8, 2)] {
        let file = sheet(&data, quads);
        let printed = data.ok(&["mesh", "lod", &file, "--levels", "100", "--json", "-o", out]);
        let levels = levels(&serde_json::from_str(&printed).expect("JSON"));
        assert!(levels.len() >= fewest);
        for pair in levels.windows(2) {
            assert!(pair[1]["bytes"].as_u64() < pair[0]["bytes"].as_u64(), "{pair:?}");
        }
        for (number, level) in levels.iter().enumerate() {
            let name = level["file"].as_str().expect("a file");
            assert_eq!(name, format!("mesh0.lod{number}.glb"));
            let length = std::fs::metadata(folder.join(name)).expect("a file").len();
            assert_eq!(level["file_bytes"].as_u64(), Some(length));
        }
    }
}

#[test]
fn a_triangle_that_comes_once_is_one_level() {
    let data = Data::new();
    let file = triangle_and_line(&data);
    let report: Value = serde_json::from_str(&data.ok(&["mesh", "lod", &file, "--all", "--json"])).expect("JSON");
    assert_eq!(levels(&report).len(), 1);
}

#[test]
fn mesh_decode_says_what_a_cut_stream_lacks() {
    let data = Data::new();
    let file = sheet(&data, 8);
    let folder = data.folder("smooth");
    data.ok(&["mesh", "smooth", &file, "-o", folder.to_str().expect("UTF-8")]);
    let stream = std::fs::read(folder.join("m0.slod")).expect("a stream");
    let (out, all) = (data.folder("out.glb"), stream.len());
    let decode = |length: usize| {
        let cut = data.write("cut.slod", &stream[..length]);
        let args = [
            "mesh",
            "decode",
            cut.to_str().expect("UTF-8"),
            "-o",
            out.to_str().expect("UTF-8"),
        ];
        let output = data.run(&args);
        (output.status.code(), text(&output.stderr))
    };
    for length in [0, 3, 20] {
        let (code, said) = decode(length);
        let wanted = format!("its header is not whole in {length} bytes");
        assert!(code == Some(1) && said.contains(&wanted) && !out.exists(), "{said}");
    }
    let (code, said) = decode(all - 1);
    let wanted = format!("{} of {all} bytes: the mesh is not whole yet", all - 1);
    assert!(code == Some(0) && said.contains(&wanted) && out.exists(), "{said}");
    assert_eq!(decode(all), (Some(0), String::new()));
}

/// A flipped bit of a position reads as another position: only the name of a published file tells.
#[test]
fn mesh_decode_compares_a_hash_that_is_a_name() {
    let data = Data::new();
    let file = sheet(&data, 8);
    let (folder, out) = (data.folder("smooth"), data.folder("out.glb"));
    data.ok(&["mesh", "smooth", &file, "-o", folder.to_str().expect("UTF-8")]);
    let stream = std::fs::read(folder.join("m0.slod")).expect("a stream");
    let decode = |hash: String| {
        let named = data.write(&format!("{hash}.slod"), &stream);
        let paths = [named, out.clone()].map(|path| path.to_str().expect("UTF-8").to_owned());
        data.run(&["mesh", "decode", &paths[0], "-o", &paths[1]])
    };
    assert!(decode(BlobHash::of(&stream).to_string()).status.success());
    let output = decode(BlobHash::of(b"another").to_string());
    let said = text(&output.stderr);
    assert!(
        !output.status.success() && said.contains("do not have the hash that is its name"),
        "{said}"
    );
}

#[test]
fn a_mesh_that_is_too_small_for_a_lattice_is_not_lost_without_a_word() {
    let data = Data::new();
    let file = sheet_at(&data, 8, |x| 1e-42 * x);
    let said = data.fails(&["mesh", "smooth", &file]);
    assert!(said.contains("is too small or has too few bits"), "{said}");
}

#[test]
fn a_mesh_of_which_something_lies_far_away_says_what_that_costs() {
    let data = Data::new();
    let file = sheet_at(&data, 8, |x| if x > 0.9 { 1e6 } else { 1e-3 * x });
    let said = data.ok(&["mesh", "smooth", &file]);
    assert!(said.contains("left out, of which corners fall together"), "{said}");
    assert!(said.contains("mm off, which more --bits may mend"), "{said}");
}

#[test]
fn levels_of_points_say_how_many_they_have() {
    let data = Data::new();
    let file = triangle_and_line(&data);
    let gltf = std::fs::read_to_string(&file).expect("a glTF");
    let points = data.write("points.gltf", gltf.replace(r#""mode":3"#, r#""mode":0"#));
    let printed = data.ok(&["mesh", "lod", points.to_str().expect("UTF-8"), "--no-join", "--json"]);
    let report: Value = serde_json::from_str(&printed).expect("JSON");
    let level = &report["meshes"][1]["levels"][0];
    assert_eq!((&level["triangles"], &level["points"]), (&json!(0), &json!(3)));
}

#[test]
fn mesh_decode_writes_what_a_decoder_gives_however_far_from_the_origin() {
    let data = Data::new();
    let file = sheet_at(&data, 20, |x| 6.0 * x + 1e5);
    let (folder, out) = (data.folder("smooth"), data.folder("out.glb"));
    data.ok(&["mesh", "smooth", &file, "-o", folder.to_str().expect("UTF-8")]);
    let stream = folder.join("m0.slod");
    let mut decoder = Decoder::new(u64::MAX);
    decoder.push(&std::fs::read(&stream).expect("a stream")).expect("whole");
    let (stream, glb) = (stream.to_str().expect("UTF-8"), out.to_str().expect("UTF-8"));
    data.ok(&["mesh", "decode", stream, "-o", glb]);
    let gltf = gltf::Gltf::open(&out).expect("a valid GLB");
    let primitive = gltf.meshes().flat_map(|mesh| mesh.primitives()).next().expect("one");
    let reader = primitive.reader(|_| gltf.blob.as_deref());
    let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
    assert_eq!(positions, decoder.snapshot().positions);
}

#[test]
fn what_begins_like_packets_of_the_thesis_is_called_so() {
    let data = Data::new();
    let out = data.folder("out.glb");
    for length in 3..16 {
        let cut = data.write("cut.slth", &b"SLTH\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f"[..length]);
        let message = data.fails(&[
            "mesh",
            "decode",
            cut.to_str().expect("UTF-8"),
            "-o",
            out.to_str().expect("UTF-8"),
        ]);
        let wanted = format!("its header is not whole in {length} bytes");
        assert!(message.contains(&wanted), "{message}");
    }
}

#[test]
fn what_reaches_too_far_for_a_distance_is_refused() {
    let data = Data::new();
    let file = sheet_at(&data, 4, |x| 3e38 * x);
    for tool in ["lod", "smooth"] {
        let message = data.fails(&["mesh", tool, &file]);
        assert!(message.contains("at most 1e9 m are possible"), "{message}");
    }
}

#[test]
fn a_bad_file_and_a_bad_share_are_refused() {
    let data = Data::new();
    let file = data.write("cut.glb", b"glTF\x02\0\0\0\xff\xff\0\0");
    let file = file.to_str().expect("UTF-8");
    let message = data.fails(&["mesh", "lod", file]);
    assert!(
        message.contains("cut.glb") && !message.contains("panicked"),
        "{message}"
    );
    let refused = data.run(&["mesh", "lod", file, "--error", "0"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn mesh_decode_does_not_write_over_what_it_reads() {
    let data = Data::new();
    let file = sheet(&data, 8);
    let folder = data.folder("smooth");
    data.ok(&["mesh", "smooth", &file, "-o", folder.to_str().expect("UTF-8")]);
    let stream = folder.join("m0.slod");
    let before = std::fs::read(&stream).expect("a stream");
    let name = stream.to_str().expect("UTF-8");
    let said = data.fails(&["mesh", "decode", name, "-o", name]);
    assert!(said.contains("name another file with -o"), "{said}");
    assert_eq!(std::fs::read(&stream).expect("a stream"), before);
}

/// As a quantised mesh has its scale in its node.
#[test]
fn lengths_of_a_mesh_whose_node_scales_it_say_what_they_are_counted_in() {
    let data = Data::new();
    let file = sheet_at(&data, 8, |x| 1e3 * x);
    let gltf = std::fs::read_to_string(&file).expect("a glTF");
    let scaled = gltf.replace(r#"{"mesh":0}"#, r#"{"mesh":0,"scale":[0.002,0.002,0.002]}"#);
    let scaled = data.write("scaled.gltf", scaled);
    let scaled = scaled.to_str().expect("UTF-8");
    for tool in ["lod", "smooth"] {
        let said = data.ok(&["mesh", tool, scaled]);
        assert!(said.contains("one of which is 2.0000e-3 m in the scene"), "{said}");
        assert!(!data.ok(&["mesh", tool, &file]).contains("its own units"));
        let report: Value = serde_json::from_str(&data.ok(&["mesh", tool, scaled, "--json"])).expect("JSON");
        let metres = report["meshes"][0]["metres_per_unit"].as_f64().expect("a number");
        assert!((metres - 0.002).abs() < 1e-12, "{metres}");
    }
}
