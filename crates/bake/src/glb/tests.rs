use serde_json::{Value, json};

use super::*;
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
        write(&GlbInput {
            primitives: &self.primitives,
            materials: &self.materials,
            textures: &self.textures,
            image_uri: &|image| self.uris[image].to_owned(),
        })
    }
}

fn word(glb: &[u8], at: usize) -> usize {
    u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize
}

fn json_of(glb: &[u8]) -> Value {
    serde_json::from_slice(&glb[20..20 + word(glb, 12)]).unwrap()
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
            "KHR_texture_basisu",
            "KHR_texture_transform"
        ])
    );
    assert_eq!(
        json["extensionsRequired"],
        json!(["EXT_texture_webp", "KHR_texture_basisu"])
    );
}

#[test]
fn used_textures_are_those_that_the_glb_refers_to() {
    let sample = Sample::new();
    let used = used_textures(&sample.primitives, &sample.materials);
    assert_eq!(used.into_iter().collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn bounds_of_positions_are_exactly_those_of_the_floats() {
    let json = json_of(&Sample::new().glb());
    let position = &json["accessors"][0];
    assert_eq!(position["min"], json!([0.0, 0.0, -2.0]));
    assert_eq!(position["max"][1].as_f64(), Some(f64::from(0.1f32)));
}

#[test]
fn indices_take_two_bytes_while_they_fit_and_four_beyond() {
    for (vertices, component) in [(65_535, 5123), (65_536, 5125)] {
        let mut sample = Sample::new();
        sample.primitives = vec![Primitive {
            topology: Topology::Points,
            positions: vec![[1.0; 3]; vertices],
            indices: (0..vertices as u32).collect(),
            ..Primitive::default()
        }];
        assert_eq!(json_of(&sample.glb())["accessors"][1]["componentType"], component);
    }
}

#[test]
fn geometry_stands_in_the_buffer_as_it_was_given() {
    let sample = Sample::new();
    let glb = sample.glb();
    let json = json_of(&glb);
    let binary = &glb[28 + word(&glb, 12)..];
    for (primitive, written) in sample
        .primitives
        .iter()
        .zip(json["meshes"][0]["primitives"].as_array().unwrap())
    {
        let read = |accessor: &Value| {
            let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
            let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let start = view["byteOffset"].as_u64().unwrap() as usize;
            assert_eq!(start % 4, 0);
            &binary[start..][..view["byteLength"].as_u64().unwrap() as usize]
        };
        let floats: Vec<u8> = primitive
            .positions
            .as_flattened()
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        assert_eq!(read(&written["attributes"]["POSITION"]), floats);
        let indices: Vec<u8> = primitive
            .indices
            .iter()
            .flat_map(|&i| (i as u16).to_le_bytes())
            .collect();
        assert_eq!(read(&written["indices"]), indices);
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
