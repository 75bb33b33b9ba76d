use serde_json::{Value, json};

use super::*;
use crate::glb::lattice::LONGEST_STEP_M;
use crate::source::Topology;

fn triangle(material: Option<usize>) -> Primitive {
    Primitive {
        material,
        positions: vec![[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.1, -2.0]],
        normals: vec![[0.0, 1.0, 0.0]; 3],
        uvs: vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
        indices: vec![0, 1, 2],
        ..Primitive::default()
    }
}

fn material(gltf: Value) -> Material {
    Material {
        gltf,
        see_through: false,
        double_sided: false,
    }
}

fn texture(image: usize, sampler: Option<Value>) -> Texture {
    Texture { image, sampler }
}

/// A scene with a bit of everything.
struct Sample {
    primitives: Vec<Primitive>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    uris: Vec<&'static str>,
}

impl Sample {
    fn new() -> Self {
        let repeat = json!({"wrapS": 10497, "wrapT": 10497});
        Self {
            primitives: vec![
                triangle(Some(3)),
                triangle(None),
                Primitive {
                    topology: Topology::Lines,
                    indices: vec![0, 1, 1, 2],
                    colors: vec![[0.25, 0.5, 1.0, 1.0]; 3],
                    ..triangle(Some(1))
                },
                Primitive {
                    topology: Topology::Points,
                    positions: vec![[4.0, 5.0, 6.0]],
                    indices: vec![0],
                    ..Primitive::default()
                },
            ],
            materials: vec![
                material(json!({"name": "not used", "normalTexture": {"index": 0}})),
                material(json!({"extensions": {"KHR_materials_unlit": {}}})),
                material(json!({})),
                material(json!({
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": 3, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}},
                    "emissiveTexture": {"index": 1},
                    "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatTexture": {"index": 2}}},
                    "extras": {"oldTexture": {"index": 77}}
                })),
            ],
            textures: vec![
                texture(0, None),
                texture(2, Some(repeat.clone())),
                texture(1, Some(repeat)),
                texture(3, None),
            ],
            uris: vec!["a.png", "b.webp", "c.jpg", "d.ktx2"],
        }
    }

    fn glb(&self) -> Vec<u8> {
        self.on(Lattice::of_size(8.0, 1.0)).bytes
    }

    fn on(&self, lattice: Lattice) -> Glb {
        let input = GlbInput {
            primitives: &self.primitives,
            materials: &self.materials,
            textures: &self.textures,
            image_uri: &|image| self.uris[image].to_owned(),
        };
        write(&input, lattice)
    }
}

fn word(glb: &[u8], at: usize) -> usize {
    u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize
}

fn json_of(glb: &[u8]) -> Value {
    serde_json::from_slice(&glb[20..20 + word(glb, 12)]).unwrap()
}

/// The accessors of a level as floats, read from its plain form.
fn floats(glb: &[u8], accessor: &Value) -> Vec<f32> {
    let plain = plain(glb, "").unwrap();
    let json = json_of(&plain);
    let binary = &plain[28 + word(&plain, 12)..];
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    let bytes = &binary[start..][..view["byteLength"].as_u64().unwrap() as usize];
    match accessor["componentType"].as_u64().unwrap() {
        5126 => bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        5125 => bytes
            .as_chunks()
            .0
            .iter()
            .map(|b| u32::from_le_bytes(*b) as f32)
            .collect(),
        5123 => {
            let scale = if accessor["normalized"] == true { 65535.0 } else { 1.0 };
            let word = |b: &[u8; 2]| f32::from(u16::from_le_bytes(*b)) / scale;
            bytes.as_chunks().0.iter().map(word).collect()
        }
        5121 => bytes.iter().map(|b| f32::from(*b) / 255.0).collect(),
        other => panic!("component {other}"),
    }
}

/// An attribute of the corners of a primitive's shapes, one after the other.
fn corners<const N: usize>(glb: &[u8], primitive: usize, name: &str) -> Vec<[f32; N]> {
    let json = json_of(glb);
    let primitive = &json["meshes"][0]["primitives"][primitive];
    let rows = floats(glb, &primitive["attributes"][name]);
    let indices = floats(glb, &primitive["indices"]);
    indices.iter().map(|i| rows.as_chunks().0[*i as usize]).collect()
}

/// A wavy sheet of n × n quads over a square of a side.
fn sheet(n: u32, side: f32) -> Primitive {
    let mut sheet = Primitive::default();
    let at = |i: u32| i as f32 / n as f32;
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let height = (7.0 * at(i)).sin() * (5.0 * at(j)).cos() * 0.1;
        sheet.positions.push([at(i) * side, height * side, at(j) * side]);
        let normal = glam::Vec3::new(at(i) - 0.5, 1.0, at(j)).normalize();
        sheet.normals.push(normal.to_array());
    }
    sheet.uvs = vec![
        sheet.positions.iter().map(|p| [p[0] / side, p[2] / side]).collect(),
        sheet.positions.iter().map(|p| [p[0], -3.7 * p[2]]).collect(),
    ];
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| i * (n + 1) + j);
        sheet.indices.extend([a, b, c, a, c, d]);
    }
    sheet
}

/// Triangles by their corners' places in order, so that two lists of them compare.
fn sorted<const N: usize>(corners: &[[f32; N]]) -> Vec<[[i64; N]; 3]> {
    let keys = |t: &[[f32; N]; 3]| {
        let mut t = t.map(|corner| corner.map(|x| (f64::from(x) * 4096.0).round() as i64));
        let least = (0..3).min_by_key(|i| t[*i]).unwrap();
        t.rotate_left(least);
        t
    };
    let mut triangles: Vec<_> = corners.as_chunks().0.iter().map(keys).collect();
    triangles.sort_unstable();
    triangles
}

fn sheet_sample(primitive: Primitive) -> Sample {
    Sample {
        primitives: vec![primitive],
        ..Sample::new()
    }
}

#[test]
fn the_container_says_how_long_it_and_its_chunks_are() {
    let glb = Sample::new().glb();
    assert_eq!((&glb[..4], word(&glb, 4), word(&glb, 8)), (&b"glTF"[..], 2, glb.len()));
    let json_bytes = word(&glb, 12);
    assert_eq!(json_bytes % 4, 0);
    let binary_bytes = word(&glb, 20 + json_bytes);
    assert_eq!(28 + json_bytes + binary_bytes, glb.len());
    assert_eq!(json_of(&glb)["buffers"][0]["byteLength"], json!(binary_bytes));
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert_eq!(Sample::new().glb(), Sample::new().glb());
}

#[test]
fn only_used_materials_textures_and_pictures_are_written_under_new_numbers() {
    let json = json_of(&Sample::new().glb());
    let materials = json["materials"].as_array().unwrap();
    assert_eq!(materials.len(), 2);
    assert_eq!(materials[1]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 2);
    assert_eq!(materials[1]["emissiveTexture"]["index"], 0);
    assert_eq!(
        materials[1]["extensions"]["KHR_materials_clearcoat"]["clearcoatTexture"]["index"],
        1
    );
    assert_eq!(materials[1]["extras"]["oldTexture"]["index"], 77);
    assert_eq!(
        json["images"],
        json!([{"uri": "b.webp"}, {"uri": "c.jpg"}, {"uri": "d.ktx2"}])
    );
    assert_eq!(
        json["textures"],
        json!([
            {"sampler": 0, "source": 1},
            {"sampler": 0, "extensions": {"EXT_texture_webp": {"source": 0}}},
            {"extensions": {"KHR_texture_basisu": {"source": 2}}}
        ])
    );
    let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
    let numbers: Vec<&Value> = primitives.iter().map(|p| &p["material"]).collect();
    assert_eq!(numbers, [&json!(1), &Value::Null, &json!(0), &Value::Null]);
}

#[test]
fn extensions_are_listed_and_those_without_fallback_required() {
    let json = json_of(&Sample::new().glb());
    assert_eq!(
        json["extensionsUsed"],
        json!([
            "EXT_texture_webp",
            "KHR_materials_clearcoat",
            "KHR_materials_unlit",
            "KHR_mesh_quantization",
            "KHR_texture_basisu",
            "KHR_texture_transform"
        ])
    );
    assert_eq!(
        json["extensionsRequired"],
        json!(["EXT_texture_webp", "KHR_mesh_quantization", "KHR_texture_basisu"])
    );
}

#[test]
fn used_textures_are_those_that_the_glb_refers_to() {
    let sample = Sample::new();
    let used = used_textures(&sample.primitives, &sample.materials);
    assert_eq!(used.into_iter().collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn indices_take_two_bytes_while_they_fit_and_four_beyond() {
    for (vertices, component) in [(65_535, 5123), (65_536, 5125)] {
        let mut sample = Sample::new();
        sample.primitives = vec![Primitive {
            topology: Topology::Points,
            positions: (0..vertices)
                .map(|i| [(i % 256) as f32, (i / 256) as f32, 0.0])
                .collect(),
            indices: (0..vertices as u32).collect(),
            ..Primitive::default()
        }];
        assert_eq!(json_of(&sample.glb())["accessors"][1]["componentType"], component);
    }
}

#[test]
fn every_corner_keeps_its_place_and_attributes_to_the_stated_precision() {
    let source = sheet(40, 8.0);
    let glb = sheet_sample(source.clone()).on(Lattice::of_size(8.0, 1.0));
    let step = Lattice::of_size(8.0, 1.0).step();
    assert!((2f64.powi(-13)..=2f64.powi(-12)).contains(&step), "{step}");
    assert!(glb.rounding > 0.0 && glb.rounding <= 0.5 * step * 3f64.sqrt());
    let places = |p: &Primitive| p.indices.iter().map(|i| p.positions[*i as usize]).collect::<Vec<_>>();
    // Twice rounded, by the lattice and by the test, so no more than neighbours.
    let (written, given) = (corners::<3>(&glb.bytes, 0, "POSITION"), places(&source));
    assert_eq!(written.len(), given.len());
    for (a, b) in sorted(&written).iter().zip(sorted(&given)) {
        let near = |(a, b): (&[i64; 3], [i64; 3])| (0..3).all(|i| (a[i] - b[i]).abs() <= 1);
        assert!(a.iter().zip(b).all(near), "{a:?} is not {b:?}");
    }
    // Each corner with all its attributes, found again by where it stands.
    let (normals, first, second) = (
        corners::<3>(&glb.bytes, 0, "NORMAL"),
        corners::<2>(&glb.bytes, 0, "TEXCOORD_0"),
        corners::<2>(&glb.bytes, 0, "TEXCOORD_1"),
    );
    for corner in 0..written.len() {
        let [x, _, z] = written[corner];
        let vertex = ((x / 8.0 * 40.0).round() * 41.0 + (z / 8.0 * 40.0).round()) as usize;
        let apart = glam::Vec3::from(normals[corner]).angle_between(source.normals[vertex].into());
        assert!(apart.to_degrees() < 1.0, "{apart} rad");
        assert!((glam::Vec3::from(normals[corner]).length() - 1.0).abs() < 1e-6);
        for (uv, set) in [(first[corner], 0), (second[corner], 1)] {
            let given = source.uvs[set][vertex];
            assert!(
                (0..2).all(|a| (uv[a] - given[a]).abs() <= 1.0 / 65536.0),
                "{uv:?} {given:?}"
            );
        }
    }
}

/// How far the texture coordinates of a level are off that lie within the unit, at most.
fn off(sample: &Sample) -> f32 {
    let given = &sample.primitives[0].uvs[0];
    let written = corners::<2>(&sample.glb(), 0, "TEXCOORD_0");
    let near = |uv: &[f32; 2]| {
        let far = |other: &[f32; 2]| (uv[0] - other[0]).abs().max((uv[1] - other[1]).abs());
        given.iter().map(far).fold(f32::INFINITY, f32::min)
    };
    let within = written.iter().filter(|uv| uv.iter().all(|x| x.abs() <= 1.0));
    within.map(near).fold(0.0, f32::max)
}

#[test]
fn texture_coordinates_are_as_fine_as_pictures_are_small() {
    for (scale, most) in [
        (1.0, 1.0 / 131_000.0),
        (16.0, 1.0 / 131_000.0),
        (200.0, 1.0 / (200.0 * 8192.0)),
    ] {
        let transform = json!({"scale": [1, scale], "rotation": 0.3});
        let mut sample = sheet_sample(sheet(40, 8.0));
        sample.primitives[0].uvs.truncate(1);
        sample.primitives[0].uvs[0]
            .iter_mut()
            .for_each(|uv| *uv = uv.map(|x| (0.37 * x).fract()));
        sample.primitives[0].material = Some(0);
        let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
        sample.materials = vec![material(json!({"emissiveTexture": texture}))];
        let off = off(&sample);
        assert!(off > 0.0 && off <= most, "{off} at {scale}");
    }
}

#[test]
fn a_stray_texture_coordinate_takes_nothing_from_the_others() {
    let mut sample = sheet_sample(sheet(40, 8.0));
    sample.primitives[0].uvs.truncate(1);
    sample.primitives[0].uvs[0]
        .iter_mut()
        .for_each(|uv| *uv = uv.map(|x| (0.37 * x).fract()));
    sample.primitives[0].uvs[0][5] = [1e6, -999.5];
    let off = off(&sample);
    assert!(off <= 1.0 / 131_072.0, "{off}");
    let written = corners::<2>(&sample.glb(), 0, "TEXCOORD_0");
    assert!(written.contains(&[1e6, -999.5]));
}

#[test]
fn a_level_takes_less_than_half_of_its_plain_form() {
    let sample = sheet_sample(sheet(40, 8.0));
    let glb = sample.glb();
    let whole = plain(&glb, "").unwrap();
    assert!(2 * glb.len() < whole.len(), "{} of {} bytes", glb.len(), whole.len());
    let json = json_of(&glb);
    assert_eq!(
        json["buffers"][1]["extensions"],
        json!({"EXT_meshopt_compression": {"fallback": true}})
    );
    let json = json_of(&whole);
    assert!(json.get("extensionsUsed").is_none() && json.get("extensionsRequired").is_none());
    assert_eq!(json["nodes"], json!([{"mesh": 0}]));
}

#[test]
fn halves_of_a_cut_mesh_meet_in_the_same_places() {
    let whole = sheet(40, 8.0);
    let (left, right) = whole.indices.split_at(whole.indices.len() / 2);
    let lattice = Lattice::of_size(8.0, 1.0);
    let edge = |indices: &[u32]| {
        let half = sheet_sample(whole.subset(indices.to_vec())).on(lattice).bytes;
        let on_cut = corners::<3>(&half, 0, "POSITION")
            .into_iter()
            .filter(|p| (p[0] - 4.0).abs() < 0.01);
        let places: BTreeSet<_> = on_cut.map(|p| p.map(f32::to_bits)).collect();
        assert_eq!(places.len(), 41);
        places
    };
    assert_eq!(edge(left), edge(right));
}

#[test]
fn what_is_too_long_for_16_bits_has_floats_on_the_same_lattice() {
    let far = sheet(20, 3000.0);
    let lattice = Lattice::of_size(3000.0, 1.0);
    assert_eq!(lattice.step(), LONGEST_STEP_M);
    let glb = sheet_sample(far).on(lattice);
    assert!(glb.rounding <= 0.5 * LONGEST_STEP_M * 3f64.sqrt());
    let json = json_of(&glb.bytes);
    assert_eq!(json["nodes"], json!([{"mesh": 0}]));
    assert_eq!(json["accessors"][0]["componentType"], 5126);
    let position = &json["accessors"][0];
    let least = corners::<3>(&glb.bytes, 0, "POSITION")
        .iter()
        .map(|p| p[1])
        .fold(f32::INFINITY, f32::min);
    assert_eq!(position["min"][1].as_f64(), Some(f64::from(least)));
    for place in corners::<3>(&glb.bytes, 0, "POSITION").as_flattened() {
        assert_eq!((f64::from(*place) / LONGEST_STEP_M).fract(), 0.0);
    }
}

#[test]
fn coarser_levels_stand_on_coarser_lattices_that_hold_fewer_places() {
    let lattice = Lattice::of_size(1.0, 1.0);
    assert_eq!(lattice.of_error(0.0), lattice);
    let coarse = lattice.of_error(0.1);
    assert!(coarse.step() <= 0.1 / 16.0 && coarse.step() > 0.1 / 32.0);
    // The larger an instance, the finer the lattice that it shares with all others.
    assert!(Lattice::of_size(1.0, 1000.0).step() * 1000.0 <= LONGEST_STEP_M);
    for nothing in [0.0, f64::NAN, f64::INFINITY] {
        assert!(Lattice::of_size(nothing, 1.0).step() <= LONGEST_STEP_M);
    }
}

#[test]
fn colours_take_the_bytes_that_they_need() {
    for (colour, component) in [
        ([0.0, 1.0, 51.0 / 255.0, 1.0], 5121),
        ([0.1234, 0.5, 1.0, 1.0], 5123),
        ([2.0, 0.5, 1.0, 1.0], 5126),
    ] {
        let mut sample = Sample::new();
        sample.primitives = vec![Primitive {
            colors: vec![colour; 3],
            ..triangle(None)
        }];
        let glb = sample.glb();
        let json = json_of(&glb);
        let accessor = &json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"];
        assert_eq!(
            json["accessors"][accessor.as_u64().unwrap() as usize]["componentType"],
            component
        );
        for written in corners::<4>(&glb, 0, "COLOR_0") {
            assert!(
                (0..4).all(|i| (written[i] - colour[i]).abs() <= 1.0 / 65536.0),
                "{written:?}"
            );
        }
    }
}

#[test]
fn lines_points_and_tangents_are_read_back() {
    let mut sample = Sample::new();
    sample.primitives[0].tangents = vec![[0.0, 0.0, 1.0, -1.0]; 3];
    let glb = sample.glb();
    assert_eq!(corners::<4>(&glb, 0, "TANGENT"), [[0.0, 0.0, 1.0, -1.0]; 3]);
    let lines = corners::<3>(&glb, 2, "POSITION");
    assert_eq!((lines.len(), lines[1], lines[2]), (4, [1.5, 0.0, 0.0], [1.5, 0.0, 0.0]));
    assert_eq!(corners::<3>(&glb, 3, "POSITION"), [[4.0, 5.0, 6.0]]);
}

#[test]
fn a_plain_level_finds_its_pictures_from_where_it_is_read() {
    let json = json_of(&plain(&Sample::new().glb(), "../o/").unwrap());
    assert_eq!(json["images"][0]["uri"], "../o/b.webp");
    let required = json["extensionsRequired"].as_array().unwrap();
    assert!(!required.contains(&json!(QUANTIZATION)), "{required:?}");
}

#[test]
fn what_is_no_level_is_refused_and_damage_never_panics() {
    let whole = sheet_sample(sheet(20, 8.0)).glb();
    for length in 0..whole.len() {
        assert!(plain(&whole[..length], "").is_err(), "{length} bytes");
    }
    for at in (0..whole.len()).step_by(7) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x55;
        let _ = plain(&damaged, "");
    }
}

#[test]
fn nothing_to_draw_is_still_a_scene() {
    let mut sample = Sample::new();
    sample.primitives = vec![Primitive::default()];
    let json = json_of(&sample.glb());
    assert!(json.get("meshes").is_none() && json.get("buffers").is_none());
}

#[test]
fn a_texture_that_does_not_exist_is_left_out() {
    let mut sample = Sample::new();
    sample.materials[3].gltf["emissiveTexture"]["index"] = json!(99);
    let json = json_of(&sample.glb());
    assert!(json["materials"][1].get("emissiveTexture").is_none());
}

#[test]
#[ignore = "writes a file for other validators: set GLB_OUT"]
fn write_a_sample_to_disk() {
    let out = std::env::var("GLB_OUT").unwrap();
    std::fs::write(out, Sample::new().glb()).unwrap();
}

#[test]
fn a_document_of_materials_lists_them_as_they_were_asked_for() {
    let sample = Sample::new();
    let input = GlbInput {
        primitives: &sample.primitives,
        materials: &sample.materials,
        textures: &sample.textures,
        image_uri: &|image| sample.uris[image].to_owned(),
    };
    let json: Value = serde_json::from_slice(&write_materials(&input, &[Some(3), None, Some(1)])).unwrap();
    let glb = json_of(&sample.glb());
    assert_eq!(json["materials"].as_array().unwrap().len(), 3);
    assert_eq!(json["materials"][0], glb["materials"][1]);
    assert_eq!(json["materials"][1], json!({}));
    for same in ["textures", "images", "samplers"] {
        assert_eq!(json[same], glb[same], "{same}");
    }
    let of_materials = |names: &Value| {
        let mut names = names.as_array().unwrap().clone();
        names.retain(|name| name != QUANTIZATION && name != meshopt_view::EXTENSION);
        names
    };
    for same in ["extensionsUsed", "extensionsRequired"] {
        assert_eq!(json[same], Value::Array(of_materials(&glb[same])), "{same}");
    }
    assert_eq!(json.get("meshes"), None);
}
