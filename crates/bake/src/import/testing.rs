//! Small glTF documents for tests.

use serde_json::{Value, json};

use super::{ImportError, Imported, Limits, NoFiles, import};
use crate::progress::Silent;

/// A document with one binary buffer.
#[derive(Clone)]
pub(super) struct Gltf {
    pub(super) json: Value,
    pub(super) bin: Vec<u8>,
}

/// Imports without files beside it, within small limits.
pub(super) fn import_bytes(name: &str, bytes: Vec<u8>) -> Result<Imported, ImportError> {
    let limits = Limits {
        memory_bytes: 64 << 20,
        max_objects: 1000,
    };
    import(name, bytes, &NoFiles, &limits, &Silent)
}

impl Gltf {
    /// The positions of [`Gltf::triangle`].
    pub(super) const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

    /// One node "n" with one triangle: view and accessor 0 are its positions, 1 its indices (u16).
    pub(super) fn triangle() -> Self {
        let mut gltf = Self {
            json: json!({
                "asset": {"version": "2.0"},
                "scene": 0,
                "scenes": [{"nodes": [0], "name": "title"}],
                "nodes": [{"mesh": 0, "name": "n"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "buffers": [{"byteLength": 0}],
                "bufferViews": [],
                "accessors": [],
            }),
            bin: Vec::new(),
        };
        gltf.floats("VEC3", &Self::CORNERS);
        let indices: Vec<u8> = [0u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()).collect();
        gltf.accessor("SCALAR", 5123, (3, &indices));
        gltf
    }

    /// Adds a buffer view.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.json["buffers"][0]["byteLength"] = self.bin.len().into();
        self.push(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}),
        )
    }

    /// Adds an accessor with a view of its own.
    pub(super) fn accessor(&mut self, kind: &str, component: u32, (count, bytes): (usize, &[u8])) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    /// Adds an accessor of floats.
    pub(super) fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|f| f.to_le_bytes()).collect();
        self.accessor(kind, 5126, (values.len(), &bytes))
    }

    /// Adds an element to a list of the document.
    pub(super) fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json.get(list).is_none() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Changes the document.
    pub(super) fn with(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match self.json.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            parent => parent[key] = value,
        }
        self
    }

    /// As a GLB.
    pub(super) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.bin.len();
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((total as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bin)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    /// As a `.gltf` that names its buffer as a file.
    pub(super) fn with_file(mut self, uri: &str) -> (Vec<u8>, Vec<u8>) {
        self.json["buffers"][0]["uri"] = uri.into();
        (self.json.to_string().into_bytes(), self.bin)
    }

    /// Imports it.
    pub(super) fn import(&self) -> Result<Imported, ImportError> {
        import_bytes("x.glb", self.glb())
    }

    /// The message with which it is refused.
    pub(super) fn refusal(&self) -> String {
        self.import().map(|_| ()).unwrap_err().to_string()
    }
}
