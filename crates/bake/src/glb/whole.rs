//! How does a whole scene become one plain file? Every object in its place, nothing quantised, nothing compressed.

use serde_json::{Map, Value, json};

use super::container;
use super::streams::FLOAT;
use crate::source::{Primitive, SourceScene, Topology};

const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes a GLB (glTF 2.0 without extensions, but for those of the materials) with a mesh for each model and a node for
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
            let matrix = object.world_from_object.to_cols_array();
            json!({"name": object.source_node, "mesh": object.model, "matrix": matrix})
        })
        .collect();
    let images: Vec<Value> = scene
        .images
        .iter()
        .map(|image| json!({"bufferView": buffer.view(&image.bytes, None), "mimeType": image.media_type}))
        .collect();
    let textures: Vec<Value> = scene
        .textures
        .iter()
        .map(|texture| json!({"source": texture.image}))
        .collect();
    let mut root = Map::new();
    root.insert("asset".into(), json!({"version": "2.0", "generator": "Belvedere"}));
    root.insert("scene".into(), json!(0));
    root.insert(
        "scenes".into(),
        json!([{"nodes": (0..nodes.len()).collect::<Vec<_>>()}]),
    );
    let materials = scene.materials.iter().map(|material| material.gltf.clone()).collect();
    let lists = [
        ("nodes", nodes),
        ("meshes", meshes),
        ("materials", materials),
        ("textures", textures),
        ("images", images),
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
