//! How does a whole scene become one plain file? Every object in its place, nothing quantised, nothing compressed.

use std::collections::BTreeSet;

use glam::DMat4;
use serde_json::{Map, Value, json};

use super::container;
use super::materials::{MaterialTable, Picture};
use super::streams::FLOAT;
use crate::source::{Primitive, SourceScene, Topology};

const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes a GLB (glTF 2.0 without extensions, but for those of materials and pictures) with a mesh for each model and a node for
/// each object. Pictures are embedded.
#[must_use]
pub fn write_whole(scene: &SourceScene) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let meshes: Vec<Value> = scene
        .models
        .iter()
        .map(|model| {
            let primitives: Vec<Value> = model.primitives.iter().map(|p| buffer.primitive(p)).collect();
            json!({"name": model.name, "primitives": primitives})
        })
        .collect();
    let nodes: Vec<Value> = scene
        .objects
        .iter()
        .map(|object| {
            let mut node = json!({"name": object.source_node, "mesh": object.model});
            if object.world_from_object != DMat4::IDENTITY {
                node["matrix"] = json!(object.world_from_object.to_cols_array());
            }
            node
        })
        .collect();
    let mut root = Map::new();
    root.insert("asset".into(), json!({"version": "2.0", "generator": "Belvedere"}));
    root.insert("scene".into(), json!(0));
    root.insert(
        "scenes".into(),
        json!([{"nodes": (0..nodes.len()).collect::<Vec<_>>()}]),
    );
    MaterialTable::whole(&scene.materials, &scene.textures).write_into(&mut root, BTreeSet::new(), |image| {
        let image = &scene.images[image];
        Picture {
            gltf: json!({"bufferView": buffer.view(&image.bytes, None), "mimeType": image.media_type}),
            ext: image.ext.to_owned(),
        }
    });
    let lists = [
        ("nodes", nodes),
        ("meshes", meshes),
        ("accessors", buffer.accessors),
        ("bufferViews", buffer.views),
    ];
    for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
        root.insert(name.into(), Value::Array(list));
    }
    if !buffer.bytes.is_empty() {
        root.insert("buffers".into(), json!([{"byteLength": buffer.bytes.len()}]));
    }
    container(&Value::Object(root), &buffer.bytes)
}

#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn primitive(&mut self, primitive: &Primitive) -> Value {
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), json!(self.rows("VEC3", &primitive.positions, true)));
        let mut optional = |name: String, rows: Option<usize>| rows.map(|index| attributes.insert(name, json!(index)));
        optional("NORMAL".into(), self.optional("VEC3", &primitive.normals));
        optional("TANGENT".into(), self.optional("VEC4", &primitive.tangents));
        optional("COLOR_0".into(), self.optional("VEC4", &primitive.colors));
        for (set, uvs) in primitive.uvs.iter().enumerate() {
            optional(format!("TEXCOORD_{set}"), self.optional("VEC2", uvs));
        }
        let indices: Vec<u8> = primitive.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&indices, Some(ELEMENT_ARRAY_BUFFER));
        let count = primitive.indices.len();
        self.accessors
            .push(json!({"bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR"}));
        let mode = match primitive.topology {
            Topology::Points => 0,
            Topology::Lines => 1,
            Topology::Triangles => 4,
        };
        let mut json = json!({"attributes": attributes, "indices": self.accessors.len() - 1, "mode": mode});
        if let Some(material) = primitive.material {
            json["material"] = json!(material);
        }
        json
    }

    fn optional<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]]) -> Option<usize> {
        (!rows.is_empty()).then(|| self.rows(kind, rows, false))
    }

    fn rows<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]], bounded: bool) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let mut accessor = json!({"bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind});
        if bounded {
            let pick = |pick: fn(f32, f32) -> f32| {
                rows.iter()
                    .copied()
                    .reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i])))
                    .map(|row| row.to_vec())
            };
            accessor["min"] = json!(pick(f32::min));
            accessor["max"] = json!(pick(f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::source::{Image, Material, Role, SourceModel, SourceObject, Texture};

    #[test]
    fn what_stands_where_it_was_made_says_no_matrix() {
        let at = |x: f64| SourceObject {
            source_node: "n".to_owned(),
            part: 0,
            model: 0,
            world_from_object: DMat4::from_translation(DVec3::new(x, 0.0, 0.0)),
            role: Role::default(),
        };
        let scene = SourceScene {
            models: vec![SourceModel::default()],
            objects: vec![at(0.0), at(2.0)],
            ..SourceScene::default()
        };
        let glb = write_whole(&scene);
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let root: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
        assert!(root["nodes"][0].get("matrix").is_none(), "{}", root["nodes"]);
        assert_eq!(root["nodes"][1]["matrix"][12], 2.0);
    }

    #[test]
    fn extensions_samplers_and_kinds_of_pictures_are_told() {
        let texture = |index: usize| {
            let transform = json!({"KHR_texture_transform": {"scale": [2, 2]}});
            json!({"baseColorTexture": {"index": index, "extensions": transform}})
        };
        let material = |index: usize| Material {
            gltf: json!({"pbrMetallicRoughness": texture(index), "extensions": {"KHR_materials_unlit": {}}}),
            see_through: false,
            double_sided: false,
        };
        let image = |ext, media_type| Image {
            ext,
            media_type,
            bytes: vec![7; 5],
        };
        let primitive = Primitive {
            material: Some(1),
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        let scene = SourceScene {
            models: vec![SourceModel {
                primitives: vec![primitive],
                ..SourceModel::default()
            }],
            materials: vec![material(0), material(1)],
            textures: [Some(json!({"wrapS": 33071})), None]
                .into_iter()
                .enumerate()
                .map(|(image, sampler)| Texture { image, sampler })
                .collect(),
            images: vec![image("webp", "image/webp"), image("png", "image/png")],
            ..SourceScene::default()
        };
        let glb = write_whole(&scene);
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let root: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
        assert_eq!(
            root["extensionsUsed"],
            json!(["EXT_texture_webp", "KHR_materials_unlit", "KHR_texture_transform"])
        );
        assert_eq!(root["extensionsRequired"], json!(["EXT_texture_webp"]));
        assert_eq!(
            root["textures"],
            json!([{"sampler": 0, "extensions": {"EXT_texture_webp": {"source": 0}}}, {"source": 1}])
        );
        assert_eq!(root["samplers"], json!([{"wrapS": 33071}]));
        assert_eq!(root["meshes"][0]["primitives"][0]["material"], 1);
        assert_eq!(root["materials"][1], scene.materials[1].gltf);
        for (i, kind) in ["image/webp", "image/png"].into_iter().enumerate() {
            let view = &root["bufferViews"][root["images"][i]["bufferView"].as_u64().unwrap() as usize];
            assert_eq!(
                (&root["images"][i]["mimeType"], &view["byteLength"]),
                (&json!(kind), &json!(5))
            );
        }
    }
}
