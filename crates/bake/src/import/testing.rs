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

/// A picture of one pixel.
pub(super) fn picture() -> Vec<u8> {
    crate::pictures::png([1, 1], &[127], image::ExtendedColorType::L8)
}

/// A document with most of what is read: attributes, material, texture, skin, morph, instances, camera, sparse.
pub(super) fn rich() -> Gltf {
    let mut gltf = Gltf::triangle();
    let normals = gltf.floats("VEC3", &[[0.0, 0.0, 1.0]; 3]);
    let tangents = gltf.floats("VEC4", &[[1.0, 0.0, 0.0, 1.0]; 3]);
    let uvs = gltf.floats("VEC2", &[[0.5, 0.5]; 3]);
    let colors = gltf.accessor("VEC4", 5121, (3, &[255; 12]));
    let joints = gltf.accessor("VEC4", 5121, (3, &[0; 12]));
    let weights = gltf.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 3]);
    let offsets = gltf.floats("VEC3", &[[0.0, 0.0, 1.0]; 3]);
    let scales = gltf.floats("VEC3", &[[2.0; 3], [3.0; 3]]);
    let matrices = gltf.floats("MAT4", &[glam::Mat4::IDENTITY.to_cols_array()]);
    let png = gltf.view(&picture());
    let indices = gltf.view(&[1, 0, 0, 0]);
    let values = gltf.view(&[0; 12]);
    gltf.json["accessors"][normals]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    gltf.json["meshes"][0] = json!({"name": "m", "weights": [0.5], "primitives": [{
        "attributes": {"POSITION": 0, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs, "COLOR_0": colors,
            "JOINTS_0": joints, "WEIGHTS_0": weights},
        "indices": 1, "material": 0, "mode": 4, "targets": [{"POSITION": offsets}]}]});
    gltf.json["materials"] = json!([{"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "extensions": {"VENDOR_any": {"glowTexture": {"index": 0}, "factor": 2}}}]);
    gltf.json["textures"] = json!([{"sampler": 0, "source": 0}]);
    gltf.json["samplers"] = json!([{"wrapS": 10497}]);
    gltf.json["images"] = json!([{"bufferView": png, "mimeType": "image/png"}]);
    gltf.json["skins"] = json!([{"joints": [1], "inverseBindMatrices": matrices}]);
    gltf.json["cameras"] = json!([{"type": "perspective", "name": "c"}]);
    gltf.json["nodes"] = json!([
        {"mesh": 0, "name": "n", "children": [1, 2, 3]},
        {"translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "camera": 0},
        {"mesh": 0, "skin": 0, "weights": [1.0]},
        {"mesh": 0, "matrix": glam::Mat4::IDENTITY.to_cols_array(),
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": scales}}}},
    ]);
    gltf
}
