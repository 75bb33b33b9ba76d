//! Does the import mend or refuse what a file must not hold, without panicking, hanging or allocating on its word?

use glam::{DMat4, DVec3};
use serde_json::{Value, json};

use super::testing::{Gltf, import_bytes, rich};
use super::{FileError, ImportError, Imported, Limits, NoFiles, SourceFiles, import};
use crate::progress::{Progress, Silent, Stage};
use crate::source::{AuthoredShape, Role, Topology};

fn kinds(imported: &Imported) -> Vec<&'static str> {
    imported.defects.iter().map(|d| d.kind).collect()
}

#[test]
fn a_clean_document_imports_without_defects() {
    let imported = Gltf::triangle().import().unwrap();
    assert!(kinds(&imported).is_empty());
    assert_eq!(imported.scene.title.as_deref(), Some("title"));
    assert_eq!(imported.scene.objects[0].source_node, "n");
    assert_eq!(imported.scene.models[0].name, "mesh[0]");
    assert_eq!(imported.scene.models[0].primitives[0].positions, Gltf::CORNERS);
}

#[test]
fn everything_at_once_is_read() {
    let imported = rich().import().unwrap();
    let scene = &imported.scene;
    assert_eq!(scene.objects.len(), 4, "plain, skinned and two instances");
    assert_eq!(scene.models.len(), 2, "one shared, one posed");
    let primitive = &scene.models[0].primitives[0];
    assert_eq!(primitive.positions[1], [1.0, 0.0, 0.5], "half of the morph target");
    assert_eq!((primitive.uvs.len(), primitive.colors[0]), (1, [1.0; 4]));
    assert_eq!(scene.materials.len(), 1);
    let material = &scene.materials[0];
    assert!(material.see_through && !material.double_sided);
    assert_eq!(
        material.gltf["extensions"]["VENDOR_any"],
        json!({"glowTexture": {"index": 0}, "factor": 2})
    );
    assert_eq!((scene.textures.len(), scene.images[0].ext), (1, "png"));
    assert_eq!(scene.viewpoints[0].name, "c");
    let posed = scene.objects.iter().find(|o| o.model == 1).unwrap();
    let positions = &scene.models[1].primitives[0].positions;
    let world = posed
        .world_from_object
        .transform_point3(DVec3::from_array(positions[1].map(f64::from)));
    assert_eq!(
        world,
        DVec3::new(2.0, 2.0, 4.0),
        "moved by its joint, and the node's own weight of one"
    );
    // One normal was replaced by a zero vector.
    assert_eq!(
        imported
            .defects
            .count("normal without a direction: taken from its triangles"),
        2
    );
}

#[test]
fn other_versions_and_unknown_required_extensions_are_refused_by_name() {
    for (pointer, value, reason) in [
        ("/asset/version", json!("1.0"), "glTF version 1.0"),
        ("/asset/version", json!("3.0"), "glTF version 3.0"),
        ("/asset/minVersion", json!("2.1"), "glTF version 2.1"),
        ("/extensionsRequired", json!(["VENDOR_magic"]), "requires VENDOR_magic"),
    ] {
        let refused = Gltf::triangle().with(pointer, value).refusal();
        assert!(refused.contains(reason), "{refused}");
    }
    let known = json!(["KHR_materials_anything", "KHR_mesh_quantization"]);
    assert!(Gltf::triangle().with("/extensionsRequired", known).import().is_ok());
    let refused = import_bytes("x.json", b"{}".to_vec()).unwrap_err().to_string();
    assert!(refused.contains("not glTF"), "{refused}");
}

#[test]
fn a_mesh_that_is_not_there_is_told_where_it_is_asked_for() {
    let refused = Gltf::triangle().with("/nodes/0/mesh", json!(3)).refusal();
    assert!(refused.contains("/nodes/0/mesh, which names /meshes/3"), "{refused}");
}

#[test]
fn json_that_is_broken_or_too_deep_is_refused() {
    let deep = format!("{{\"a\":{}", "[".repeat(1_000_000));
    for text in ["{", "{\"asset\": NaN}", &deep] {
        let refused = import_bytes("x.gltf", text.as_bytes().to_vec()).unwrap_err();
        assert!(matches!(refused, ImportError::Json(_)), "{refused}");
    }
    let wide = format!("{{\"a\":[{}{{}}]}}", "{},".repeat(1_000_000));
    let refused = import_bytes("x.gltf", wide.into_bytes()).unwrap_err();
    assert!(matches!(refused, ImportError::Memory { .. }), "{refused}");
}

#[test]
fn uris_that_leave_the_folder_are_refused_and_named() {
    for uri in [
        "../secret.bin",
        "/etc/passwd",
        "c:\\x",
        "https://example.org/a.bin",
        "%2e%2e/x",
    ] {
        let buffer = Gltf::triangle().with("/buffers/0/uri", json!(uri)).refusal();
        assert!(buffer.contains(uri) && buffer.contains("/buffers/0"), "{buffer}");
        let mut gltf = rich();
        gltf.json["images"][0] = json!({"uri": uri});
        assert!(gltf.refusal().contains(uri));
    }
}

#[test]
fn a_missing_picture_costs_its_texture_and_a_missing_buffer_its_shapes() {
    let mut gltf = rich();
    gltf.json["images"][0] = json!({"uri": "gone.png"});
    let imported = gltf.import().unwrap();
    assert!(kinds(&imported).contains(&"picture missing: left out of its materials"));
    assert_eq!(imported.scene.textures.len() + imported.scene.images.len(), 0);
    assert!(
        imported.scene.materials[0].gltf["pbrMetallicRoughness"]
            .get("baseColorTexture")
            .is_none()
    );
    let refused = Gltf::triangle().with("/buffers/0/uri", json!("gone.bin")).refusal();
    assert!(
        refused.contains("\"gone.bin\"") && refused.contains("without that file nothing is left to draw"),
        "{refused}"
    );
}

#[test]
fn a_picture_of_unknown_type_is_left_out_and_webp_is_taken_when_the_plain_one_is_bad() {
    let mut gltf = rich();
    let webp = gltf.view(b"RIFF\x11\0\0\0WEBPVP8L\x05\0\0\0\x2F\0\0\0\0");
    let bad = gltf.view(b"what is this");
    gltf.json["images"] = json!([{"bufferView": bad}, {"bufferView": webp}]);
    gltf.json["textures"][0]["extensions"] = json!({"EXT_texture_webp": {"source": 1}});
    let imported = gltf.import().unwrap();
    assert_eq!(imported.scene.images[0].ext, "webp");
    assert!(kinds(&imported).contains(&"picture of unknown type: left out of its materials"));
}

#[test]
fn a_picture_that_is_none_or_claims_too_much_is_left_out_by_name() {
    let text = b"\x89PNG\r\n\x1A\nthis is no picture at all".to_vec();
    let wide = b"RIFF\x16\0\0\0WEBPVP8X\x0A\0\0\0\0\0\0\0\x2F\x75\0\x2F\x75\0".to_vec();
    for (bytes, kind, told) in [
        (text, "picture that cannot be decoded: left out of its materials", ""),
        (
            wide,
            "picture that claims too many pixels: left out of its materials",
            "claims 30000 × 30000 pixels, at most 8192 × 8192 are taken: shrink it",
        ),
    ] {
        let mut gltf = rich();
        let view = gltf.view(&bytes);
        gltf.json["images"] = json!([{"name": "brick", "bufferView": view}]);
        gltf.json["materials"][0]["name"] = json!("wall");
        let imported = gltf.import().unwrap();
        assert!(imported.scene.images.is_empty() && imported.scene.textures.is_empty());
        let defect = imported.defects.iter().find(|defect| defect.kind == kind).unwrap();
        let named = "/images/0 \"brick\" of /materials/0 \"wall\": ";
        assert!(
            defect.first.starts_with(named) && defect.first.ends_with(told),
            "{defect}"
        );
    }
}

#[test]
fn an_accessor_past_its_data_is_cut_off_without_allocating() {
    let gltf = Gltf::triangle().with("/accessors/0/count", json!(1_000_000_000u64));
    let imported = gltf.import().unwrap();
    assert_eq!(
        imported
            .defects
            .count("accessor past the end of its data: cut off there"),
        1
    );
    assert_eq!(imported.scene.models[0].triangle_count(), 1);
    for (pointer, value) in [
        ("/accessors/0/byteOffset", json!(u64::MAX)),
        ("/bufferViews/0/byteOffset", json!(u64::MAX)),
        ("/bufferViews/0/byteLength", json!(0)),
        ("/bufferViews/0/byteStride", json!(4)),
        ("/accessors/0/componentType", json!(5124)),
        ("/accessors/0/type", json!("VEC2")),
    ] {
        let refused = Gltf::triangle().with(pointer, value).refusal();
        assert!(refused.contains("nothing is left to draw"), "{pointer}: {refused}");
    }
    let wide = Gltf::triangle().with("/bufferViews/0/byteStride", json!(u64::MAX));
    assert!(wide.import().is_err());
}

#[test]
fn sparse_zeros_are_claimed_before_they_are_believed() {
    let mut gltf = Gltf::triangle();
    gltf.push(
        "accessors",
        json!({"componentType": 5126, "type": "VEC3", "count": 1_000_000_000u64, "sparse": {"count": 1,
            "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}}),
    );
    let gltf = gltf.with("/meshes/0/primitives/0/attributes/POSITION", json!(2));
    let refused = gltf.refusal();
    assert!(
        refused.contains("/accessors/2") && refused.contains("limit"),
        "{refused}"
    );
}

/// As glTF 2.0 has it (§5.1.1).
#[test]
fn an_accessor_without_data_is_zeros() {
    let mut gltf = Gltf::triangle();
    let moved = gltf.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 2}));
    let scaled = gltf.floats("VEC3", &[[1.0f32; 3], [2.0; 3]]);
    let attributes = json!({"TRANSLATION": moved, "SCALE": scaled});
    let gltf = gltf.with(
        "/nodes/0/extensions",
        json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}}),
    );
    let imported = gltf.import().unwrap();
    let placed = imported.scene.objects.iter().map(|o| o.world_from_object);
    assert_eq!(
        placed.collect::<Vec<_>>(),
        [1.0, 2.0].map(|scale| DMat4::from_scale(DVec3::splat(scale)))
    );
    assert_eq!(imported.defects.iter().count(), 0);
}

#[test]
fn sparse_values_replace_elements_and_bad_ones_do_not() {
    let mut gltf = Gltf::triangle();
    let values = gltf.view(&[9.0f32, 8.0, 7.0].map(f32::to_le_bytes).concat());
    let indices = gltf.view(&[2]);
    let sparse = json!({"count": 1, "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values}});
    let mut gltf = gltf.with("/accessors/0/sparse", sparse);
    let positions = |gltf: &Gltf| gltf.import().unwrap().scene.models[0].primitives[0].positions.clone();
    assert_eq!(positions(&gltf)[2], [9.0, 8.0, 7.0]);
    *gltf.bin.last_mut().unwrap() = 3;
    assert_eq!(positions(&gltf), Gltf::CORNERS);
}

#[test]
fn degenerate_and_infinite_triangles_and_bad_indices_are_dropped_and_counted() {
    let mut gltf = Gltf::triangle();
    let mut corners = Gltf::CORNERS.to_vec();
    corners.extend([[f32::INFINITY, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    let positions = gltf.floats("VEC3", &corners);
    let indices: Vec<u8> = [0u8, 1, 2, 0, 0, 1, 0, 1, 4, 0, 1, 3, 0, 1, 200, 0, 1].into();
    let indices = gltf.accessor("SCALAR", 5121, (indices.len(), &indices));
    let gltf = gltf
        .with("/meshes/0/primitives/0/attributes/POSITION", json!(positions))
        .with("/meshes/0/primitives/0/indices", json!(indices));
    let imported = gltf.import().unwrap();
    assert_eq!(
        imported.scene.models[0].primitives[0].positions,
        Gltf::CORNERS,
        "unused vertices are gone"
    );
    let count = |kind| imported.defects.count(kind);
    assert_eq!(count("degenerate triangle: dropped"), 2);
    assert_eq!(count("position that is not finite: its shape dropped"), 1);
    assert_eq!(count("index past the last vertex: its shape dropped"), 1);
    assert_eq!(count("indices left over after the last whole shape: dropped"), 2);
}

#[test]
fn quantised_positions_are_read_with_and_without_normalising() {
    let mut gltf = Gltf::triangle();
    let bytes: Vec<u8> = [0i16, 0, 0, 0, 32767, 0, 0, 0, 0, -32768, 0, 0]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    let positions = gltf.accessor("VEC3", 5122, (3, &bytes));
    gltf.json["bufferViews"][2]["byteStride"] = json!(8);
    let gltf = gltf.with("/meshes/0/primitives/0/attributes/POSITION", json!(positions));
    let read = |gltf: &Gltf| gltf.import().unwrap().scene.models[0].primitives[0].positions.clone();
    assert_eq!(read(&gltf), [[0.0; 3], [32767.0, 0.0, 0.0], [0.0, -32768.0, 0.0]]);
    let gltf = gltf.with("/accessors/2/normalized", json!(true));
    assert_eq!(read(&gltf), [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
}

#[test]
fn cycles_and_second_parents_are_counted_and_not_followed() {
    let cyclic = Gltf::triangle().with("/nodes", json!([{"mesh": 0, "children": [1]}, {"children": [0, 1]}]));
    let imported = cyclic.import().unwrap();
    assert_eq!(imported.scene.objects.len(), 1);
    assert_eq!(imported.defects.count("node below itself: not followed"), 2);
    let shared = json!([{"children": [1, 2]}, {"children": [2]}, {"mesh": 0}]);
    let imported = Gltf::triangle().with("/nodes", shared).import().unwrap();
    assert_eq!(imported.scene.objects.len(), 1);
    assert_eq!(
        imported.defects.count("node with two parents: drawn below the first"),
        1
    );
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_is_walked() {
    let count = 100_000;
    let node = |i: usize| {
        if i + 1 < count {
            json!({"translation": [0.5, 0, 0], "children": [i + 1]})
        } else {
            json!({"mesh": 0})
        }
    };
    let gltf = Gltf::triangle().with("/nodes", (0..count).map(node).collect());
    let limits = Limits::default();
    let scene = import("x.glb", gltf.glb(), &NoFiles, &limits, &Silent).unwrap().scene;
    assert_eq!(scene.objects[0].world_from_object.w_axis.x, 0.5 * (count - 1) as f64);
}

#[test]
fn transforms_mirror_vanish_flatten_or_are_refused() {
    let place = |node: Value| Gltf::triangle().with("/nodes/0", node).import();
    let mirrored = place(json!({"mesh": 0, "scale": [-1, 1, 1]})).unwrap().scene;
    assert!(mirrored.objects[0].world_from_object.determinant() < 0.0);
    assert_eq!(
        mirrored.models[0].primitives[0].indices,
        [0, 1, 2],
        "triangles stay as in the source"
    );
    let vanished = place(json!({"mesh": 0, "scale": [0, 0, 0]})).unwrap_err().to_string();
    assert!(vanished.contains("object with zero scale"), "{vanished}");
    let flat = place(json!({"mesh": 0, "scale": [1, 2, 0], "translation": [5, 0, 0]})).unwrap();
    assert_eq!(kinds(&flat), ["object flattened by its scale: published as it stands"]);
    let object = &flat.scene.objects[0];
    assert!(object.world_from_object.determinant() == 1.0);
    let corner = DVec3::from_array(flat.scene.models[0].primitives[0].positions[2].map(f64::from));
    assert_eq!(
        object.world_from_object.transform_point3(corner),
        DVec3::new(5.0, 4.0, 0.0)
    );
    for node in [
        json!({"mesh": 0, "scale": [1e308, 1, 1], "children": [1]}),
        json!({"mesh": 0, "matrix": [1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}),
        json!({"mesh": 0, "translation": [1, 2]}),
    ] {
        let _ = place(node);
    }
    let projective = json!({"mesh": 0, "matrix": [1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]});
    assert!(place(projective).unwrap_err().to_string().contains("not affine"));
}

#[test]
fn scenes_that_are_missing_are_made_up_for_and_counted() {
    let mut gltf = Gltf::triangle();
    gltf.json["scene"] = json!(7);
    assert_eq!(
        kinds(&gltf.import().unwrap()),
        ["scene that is not there: the first scene taken"]
    );
    gltf.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(
        kinds(&gltf.import().unwrap()),
        ["no scenes: all nodes without a parent taken"]
    );
    let unreached = Gltf::triangle().with("/scenes/0/nodes", json!([])).refusal();
    assert!(unreached.contains("no node with a mesh"), "{unreached}");
}

#[test]
fn too_many_instances_are_refused_at_the_limit() {
    let mut gltf = Gltf::triangle();
    let translations = gltf.floats("VEC3", &[[1.0; 3]; 1001]);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translations}}});
    let gltf = gltf.with("/nodes/0/extensions", instancing);
    let refused = gltf.import().unwrap_err();
    assert!(
        matches!(refused, ImportError::TooManyObjects { limit: 1000, .. }),
        "{refused}"
    );
    let fewer = gltf.with("/accessors/2/count", json!(1000)).import().unwrap().scene;
    assert_eq!((fewer.objects.len(), fewer.models.len()), (1000, 1));
}

#[test]
fn normalised_instance_rotations_are_read() {
    let mut gltf = Gltf::triangle();
    // A half turn about z.
    let rotations = gltf.accessor("VEC4", 5120, (1, &[0, 0, 127, 0]));
    gltf.json["accessors"][rotations]["normalized"] = json!(true);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": rotations}}});
    let scene = gltf.with("/nodes/0/extensions", instancing).import().unwrap().scene;
    let turned = scene.objects[0].world_from_object.transform_point3(DVec3::X);
    assert!((turned - DVec3::NEG_X).length() < 1e-12, "{turned}");
}

#[test]
fn a_bad_skin_leaves_its_mesh_unskinned() {
    for (pointer, value) in [
        ("/skins/0/joints", json!([])),
        ("/skins/0/joints", json!([99])),
        ("/skins/0/inverseBindMatrices", json!(0)),
        ("/nodes/2/skin", json!(5)),
        ("/nodes/1/scale", json!([1e308, 1e308, 1e308])),
    ] {
        let imported = rich().with(pointer, value.clone()).import().unwrap();
        assert_eq!(
            imported.defects.count("skinned mesh: published in its rest pose"),
            0,
            "{pointer} = {value}"
        );
        assert_eq!(imported.scene.objects.len(), 4, "{pointer} = {value}");
    }
}

#[test]
fn authors_marks_are_heeded() {
    let nodes = json!([
        {"children": [1, 2, 3, 4, 5, 7, 8]},
        {"name": "door: front", "children": [6]},
        {"name": "viewpoint: hall", "translation": [1, 2, 3], "scale": [2, 2, 2]},
        {"extras": {"belvedere": {"kind": "viewpoint", "name": "roof"}}},
        {"name": "cell: kitchen", "mesh": 0, "translation": [0, 5, 0]},
        {"name": "wall", "mesh": 0, "extras": {"belvedere": {"kind": "occluder"}}},
        {"mesh": 0},
        {"name": "portal: hatch", "children": [9]},
        {"name": "avatar: guest", "mesh": 0},
        {"name": "hatch", "mesh": 0},
    ]);
    let imported = Gltf::triangle().with("/nodes", nodes).import().unwrap();
    let scene = &imported.scene;
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(
        (scene.objects[0].role, scene.objects[0].source_node.as_str()),
        (Role::Door, "node[6]")
    );
    let names: Vec<_> = scene.viewpoints.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["hall", "roof"]);
    assert_eq!(
        scene.viewpoints[0].world_from_camera,
        glam::DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0))
    );
    let authored = &scene.authored;
    let node = |shapes: &[AuthoredShape]| shapes.iter().map(|s| s.node.clone()).collect::<Vec<_>>();
    assert_eq!(node(&authored.cells), ["cell: kitchen"]);
    assert_eq!(node(&authored.portals), ["hatch"], "marked by its parent");
    assert_eq!(node(&authored.occluders), ["wall"]);
    assert!(
        authored.cells[0].triangles[0].iter().all(|p| p.y >= 5.0),
        "where it stands"
    );
    assert_eq!(
        kinds(&imported),
        ["avatar: not part of the scene that stands still, left out"]
    );
}

#[test]
fn strips_without_indices_unroll() {
    let mut gltf = Gltf::triangle();
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0f32]];
    let positions = gltf.floats("VEC3", &square);
    gltf.json["meshes"][0]["primitives"] = json!([
        {"mode": 5, "attributes": {"POSITION": positions}},
        {"mode": 2, "attributes": {"POSITION": positions}},
        {"mode": 9, "attributes": {"POSITION": positions}},
        {"attributes": {}},
    ]);
    let imported = gltf.import().unwrap();
    let [strip, lines] = &imported.scene.models[0].primitives[..] else {
        panic!("not two primitives")
    };
    assert_eq!(strip.indices, [0, 1, 2, 1, 3, 2]);
    assert_eq!((lines.topology, lines.count()), (Topology::Lines, 4));
    assert_eq!(imported.defects.iter().count(), 2);
}

#[test]
fn a_data_uri_and_a_file_give_the_same_scene() {
    struct One(Vec<u8>);
    impl SourceFiles for One {
        fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
            (relative == "a b.bin")
                .then(|| self.0.clone())
                .ok_or(FileError::Missing)
        }
    }
    let (json, bin) = Gltf::triangle().with_file("./a%20b.bin");
    let from_file = import("x.gltf", json, &One(bin.clone()), &Limits::default(), &Silent).unwrap();
    let encoded: String = bin.iter().map(|b| format!("%{b:02X}")).collect();
    let (json, _) = Gltf::triangle().with_file(&format!("data:application/octet-stream,{encoded}"));
    let from_uri = import_bytes("x.gltf", json).unwrap();
    assert_eq!(
        from_file.scene.models[0].primitives,
        from_uri.scene.models[0].primitives
    );
}

#[test]
fn cancelling_stops_the_import() {
    struct Stop;
    impl Progress for Stop {
        fn start(&self, _: Stage, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let bytes = Gltf::triangle().glb();
    let refused = import("x.glb", bytes, &NoFiles, &Limits::default(), &Stop).unwrap_err();
    assert!(matches!(refused, ImportError::Cancelled));
}
