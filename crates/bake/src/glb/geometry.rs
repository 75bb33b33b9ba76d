//! How do vertices and indices lie in a glTF buffer? (glTF 2.0 §3.6, §3.7)
//!
//! One buffer view for each attribute of each primitive and one for its indices, all starting at multiples of four.

use serde_json::{Map, Value, json};

use crate::source::{Primitive, Topology};

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Collects the binary chunk and what describes it.
#[derive(Default)]
pub(super) struct BufferWriter {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl BufferWriter {
    /// Writes a primitive's data and returns its JSON, without material.
    pub(super) fn primitive(&mut self, primitive: &Primitive) -> Map<String, Value> {
        let mut attributes = Map::new();
        let position = self.floats(&primitive.positions, "VEC3");
        let (min, max) = extent(&primitive.positions);
        self.accessors[position]["min"] = json!(min);
        self.accessors[position]["max"] = json!(max);
        attributes.insert("POSITION".into(), json!(position));
        if !primitive.normals.is_empty() {
            attributes.insert("NORMAL".into(), json!(self.floats(&primitive.normals, "VEC3")));
            // glTF has no tangents without normals, and tangents shade surfaces only.
            if !primitive.tangents.is_empty() && primitive.topology == Topology::Triangles {
                attributes.insert("TANGENT".into(), json!(self.floats(&primitive.tangents, "VEC4")));
            }
        }
        for (set, uvs) in primitive.uvs.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty()) {
            attributes.insert(format!("TEXCOORD_{set}"), json!(self.floats(uvs, "VEC2")));
        }
        if !primitive.colors.is_empty() {
            attributes.insert("COLOR_0".into(), json!(self.floats(&primitive.colors, "VEC4")));
        }
        let mode = match primitive.topology {
            Topology::Points => 0,
            Topology::Lines => 1,
            Topology::Triangles => 4,
        };
        let mut json = Map::new();
        json.insert("attributes".into(), Value::Object(attributes));
        let indices = self.indices(&primitive.indices, primitive.positions.len());
        json.insert("indices".into(), json!(indices));
        json.insert("mode".into(), json!(mode));
        json
    }

    /// Describes everything that was written and hands over the binary chunk, padded to a multiple of four.
    pub(super) fn write_into(self, root: &mut Map<String, Value>) -> Vec<u8> {
        if !self.bytes.is_empty() {
            root.insert("accessors".into(), Value::Array(self.accessors));
            root.insert("bufferViews".into(), Value::Array(self.views));
            root.insert("buffers".into(), json!([{"byteLength": self.bytes.len()}]));
        }
        self.bytes
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]], shape: &str) -> usize {
        let bytes = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        let view = self.view(bytes, ARRAY_BUFFER);
        self.accessors
            .push(json!({"bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": shape}));
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32], vertices: usize) -> usize {
        // The largest index of a width is reserved: it restarts a strip.
        let (component, view) = if vertices <= usize::from(u16::MAX) {
            let bytes = indices.iter().flat_map(|&i| (i as u16).to_le_bytes());
            (UNSIGNED_SHORT, self.view(bytes, ELEMENT_ARRAY_BUFFER))
        } else {
            let bytes = indices.iter().flat_map(|i| i.to_le_bytes());
            (UNSIGNED_INT, self.view(bytes, ELEMENT_ARRAY_BUFFER))
        };
        self.accessors
            .push(json!({"bufferView": view, "componentType": component, "count": indices.len(), "type": "SCALAR"}));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: u32) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views
            .push(json!({"buffer": 0, "byteOffset": start, "byteLength": length, "target": target}));
        self.views.len() - 1
    }
}

/// Smallest and largest coordinates. As f64, so that the JSON says exactly what the f32 is.
fn extent(positions: &[[f32; 3]]) -> ([f64; 3], [f64; 3]) {
    let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    positions.iter().fold(start, |(min, max), p| {
        let p = p.map(f64::from);
        (
            std::array::from_fn(|a| min[a].min(p[a])),
            std::array::from_fn(|a| max[a].max(p[a])),
        )
    })
}
