//! What does a published level 0 hold?
//!
//! Reads the GLBs that `docs/FORMAT.md` describes (glTF 2.0 §3.6, §3.7, §4.4): one mesh whose node leads into model space,
//! positions as u16 or f32, triangles, lines and points, in views that may be compressed (`unfolded`). Written from the
//! format's description, apart from the bake's own code, and without trust: whatever is out of range is an error that
//! says where.

mod unfolded;

use std::{borrow::Cow, cell::Cell};

use glam::{DMat4, DQuat, DVec3, Vec3};
use serde_json::Value;

use crate::scene::{Model, Surface};

const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;
const UNSIGNED_SHORT: u64 = 5123;
const FLOAT: u64 = 5126;
/// More bytes than this are not unfolded for one level.
const MOST_BYTES: usize = 1 << 30;

/// Why bytes are not a level that can be drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not a level of detail of this format: {0}")]
pub struct GlbError(String);

fn wrong<T>(what: impl Into<String>) -> Result<T, GlbError> {
    Err(GlbError(what.into()))
}

/// Reads a level of detail.
///
/// # Errors
/// When the bytes are not a GLB of the published format.
pub fn read(bytes: &[u8]) -> Result<Model, GlbError> {
    let (json, binary) = chunks(bytes)?;
    let root: Value = serde_json::from_slice(json).map_err(|e| GlbError(e.to_string()))?;
    let document = Document {
        root: &root,
        binary,
        model_from_mesh: placement(&root),
        left_bytes: Cell::new(MOST_BYTES),
    };
    let mut model = Model::default();
    let meshes = root.get("meshes").and_then(Value::as_array);
    for primitive in meshes
        .into_iter()
        .flatten()
        .filter_map(|mesh| mesh.get("primitives")?.as_array())
        .flatten()
    {
        document.add_primitive(primitive, &mut model)?;
    }
    Ok(model)
}

/// The JSON and the binary chunk.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), GlbError> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)) };
    if bytes.get(..4) != Some(b"glTF") || word(4) != Some(2) {
        return wrong("it does not start as a GLB of version 2");
    }
    let (mut json, mut binary) = (None, &[][..]);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = at.saturating_add(8).saturating_add(length as usize);
        let Some(chunk) = bytes.get(at + 8..end) else {
            return wrong("a chunk reaches beyond the end");
        };
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BINARY_CHUNK => binary = chunk,
            _ => {}
        }
        at = end;
    }
    json.map_or_else(|| wrong("it has no JSON chunk"), |json| Ok((json, binary)))
}

struct Document<'a> {
    root: &'a Value,
    binary: &'a [u8],
    model_from_mesh: DMat4,
    /// What compressed views may still unfold into.
    left_bytes: Cell<usize>,
}

/// The transform of the one node that shows the mesh.
fn placement(root: &Value) -> DMat4 {
    let node = |name: &str| root.get("nodes")?.get(0)?.get(name)?.as_array();
    let vector = |name: &str, otherwise: f64| {
        let of = |axis: usize| {
            node(name)
                .and_then(|list| list.get(axis)?.as_f64())
                .unwrap_or(otherwise)
        };
        DVec3::new(of(0), of(1), of(2))
    };
    DMat4::from_scale_rotation_translation(vector("scale", 1.0), DQuat::IDENTITY, vector("translation", 0.0))
}

/// Elements of an accessor.
struct Elements<'a> {
    bytes: Cow<'a, [u8]>,
    component: u64,
    count: usize,
    stride: usize,
}

impl<'a> Document<'a> {
    fn add_primitive(&self, primitive: &Value, model: &mut Model) -> Result<(), GlbError> {
        let Some(position) = primitive.pointer("/attributes/POSITION").and_then(Value::as_u64) else {
            return wrong("a primitive has no positions");
        };
        let first = model.positions.len() as u32;
        model.positions.extend(self.positions(position)?);
        let count = model.positions.len() as u32 - first;
        let indices = match primitive.get("indices").and_then(Value::as_u64) {
            Some(accessor) => self.indices(accessor)?,
            None => (0..count).collect(),
        };
        if let Some(index) = indices.iter().find(|i| **i >= count) {
            return wrong(format!("index {index} of {count} vertices"));
        }
        let indices: Vec<u32> = indices.into_iter().map(|i| first + i).collect();
        match primitive.get("mode").and_then(Value::as_u64).unwrap_or(4) {
            0 => model.points.extend(indices),
            1 => model.lines.extend(indices.as_chunks().0),
            4 => model.add_triangles(indices.as_chunks().0, self.surface(primitive)),
            mode => return wrong(format!("a primitive of mode {mode}")),
        }
        Ok(())
    }

    fn positions(&self, accessor: u64) -> Result<Vec<Vec3>, GlbError> {
        let elements = self.elements(accessor, 3)?;
        let number: fn(&[u8], usize) -> f64 = match elements.component {
            FLOAT => |b, i| f32::from_le_bytes(std::array::from_fn(|k| b[4 * i + k])).into(),
            UNSIGNED_SHORT => |b, i| u16::from_le_bytes([b[2 * i], b[2 * i + 1]]).into(),
            other => return wrong(format!("positions of component type {other}")),
        };
        let points = elements.iter().map(|b| DVec3::from([0, 1, 2].map(|i| number(b, i))));
        let points: Vec<_> = points
            .map(|p| self.model_from_mesh.transform_point3(p).as_vec3())
            .collect();
        if points.iter().any(|p| !p.is_finite()) {
            return wrong("a position is not finite");
        }
        Ok(points)
    }

    fn indices(&self, accessor: u64) -> Result<Vec<u32>, GlbError> {
        let elements = self.elements(accessor, 1)?;
        let read: fn(&[u8]) -> u32 = match elements.component {
            5121 => |b| u32::from(b[0]),
            UNSIGNED_SHORT => |b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            5125 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            other => return wrong(format!("indices of component type {other}")),
        };
        Ok(elements.iter().map(read).collect())
    }

    /// The bytes of an accessor whose elements have `width` components.
    fn elements(&self, accessor: u64, width: usize) -> Result<Elements<'a>, GlbError> {
        let place = format!("accessor {accessor}");
        let item = |list: &str, index: u64| self.root.get(list)?.get(usize::try_from(index).ok()?);
        let number = |value: &Value, name: &str| value.get(name).and_then(Value::as_u64);
        let found = || {
            let about = item("accessors", accessor)?;
            let view = item("bufferViews", number(about, "bufferView")?)?;
            let component = number(about, "componentType")?;
            let size = match component {
                5120 | 5121 => 1,
                5122 | 5123 => 2,
                _ => 4,
            } * width;
            let count = usize::try_from(number(about, "count")?).ok()?;
            let stride = number(view, "byteStride").map_or(Some(size), |s| usize::try_from(s).ok())?;
            let (bytes, start) = self.view(view)?;
            let start = start.checked_add(usize::try_from(number(about, "byteOffset").unwrap_or(0)).ok()?)?;
            let reach = match count.checked_sub(1) {
                Some(last) => last.checked_mul(stride)?.checked_add(size)?,
                None => 0,
            };
            let place = start..start.checked_add(reach)?;
            let bytes = match bytes {
                Cow::Borrowed(bytes) => Cow::Borrowed(bytes.get(place)?),
                Cow::Owned(bytes) => Cow::Owned(bytes.get(place)?.to_vec()),
            };
            (stride >= size).then_some(Elements {
                bytes,
                component,
                count,
                stride,
            })
        };
        found().map_or_else(|| wrong(format!("{place} does not lie in the binary chunk")), Ok)
    }

    /// The bytes that a view lies in, and where it starts in them.
    fn view(&self, view: &Value) -> Option<(Cow<'a, [u8]>, usize)> {
        let start = usize::try_from(view.get("byteOffset").and_then(Value::as_u64).unwrap_or(0)).ok()?;
        let Some(compression) = view.pointer("/extensions/EXT_meshopt_compression") else {
            return Some((Cow::Borrowed(self.binary), start));
        };
        let bytes = unfolded::unfold(compression, self.binary, self.left_bytes.get())?;
        self.left_bytes.set(self.left_bytes.get() - bytes.len());
        Some((Cow::Owned(bytes), 0))
    }

    /// How a primitive's material shows; glTF's default is opaque and has a front only.
    fn surface(&self, primitive: &Value) -> Surface {
        let material = || {
            let index = primitive.get("material")?.as_u64()?;
            self.root.get("materials")?.get(usize::try_from(index).ok()?)
        };
        let Some(material) = material() else {
            return Surface::default();
        };
        let alpha = material.get("alphaMode").and_then(Value::as_str);
        let transmits = material
            .pointer("/extensions/KHR_materials_transmission")
            .is_some_and(|glass| {
                let factor = glass.get("transmissionFactor").and_then(Value::as_f64);
                factor.unwrap_or(0.0) > 0.0 || glass.get("transmissionTexture").is_some()
            });
        Surface {
            double_sided: material.get("doubleSided").and_then(Value::as_bool).unwrap_or(false),
            see_through: transmits || matches!(alpha, Some("MASK" | "BLEND")),
        }
    }
}

impl Elements<'_> {
    fn iter(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).map(|i| &self.bytes[i * self.stride..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::glb;

    const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},
        "materials":[{"alphaMode":"BLEND","doubleSided":true},{}],
        "meshes":[{"primitives":[
            {"attributes":{"POSITION":0},"indices":1,"material":0},
            {"attributes":{"POSITION":0},"indices":1},
            {"attributes":{"POSITION":0},"mode":0}]}],
        "accessors":[
            {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
            {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
        "buffers":[{"byteLength":44}]}"#;

    fn binary(indices: [u16; 3]) -> Vec<u8> {
        let floats = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        bytes.extend([0, 0]);
        bytes
    }

    #[test]
    fn faces_points_and_materials_are_read() {
        let model = read(&glb(TRIANGLE, &binary([0, 1, 2]))).unwrap();
        assert_eq!(model.positions.len(), 9);
        assert_eq!(model.positions[1], Vec3::X);
        assert_eq!(model.patches[0].triangles, [[0, 1, 2]]);
        assert_eq!(
            model.patches[0].surface,
            Surface {
                double_sided: true,
                see_through: true
            }
        );
        assert_eq!(model.patches[1].surface, Surface::default());
        assert_eq!(model.points, [6, 7, 8]);
    }

    /// A compressed triangle in u16, which the node scales and moves.
    fn compressed(filter: &str) -> Vec<u8> {
        let positions = meshopt::encode_vertex_buffer(&[[0u16, 0, 0, 0], [500, 0, 0, 0], [0, 500, 0, 0]]).unwrap();
        let indices = meshopt::encode_index_buffer(&[0, 1, 2], 3).unwrap();
        let view = |start: usize, length: usize, mode: &str, stride: u32| {
            format!(
                r#"{{"buffer":1,"byteLength":24,"byteStride":8,"extensions":{{"EXT_meshopt_compression":{{"buffer":0,
                "byteOffset":{start},"byteLength":{length},"byteStride":{stride},"count":3,"mode":"{mode}"{filter}}}}}}}"#
            )
        };
        let json = format!(
            r#"{{"nodes":[{{"mesh":0,"scale":[0.002,0.002,0.002],"translation":[1,0,-3]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5123,"count":3,"type":"VEC3"}},
                {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
            "bufferViews":[{},{}]}}"#,
            view(0, positions.len(), "ATTRIBUTES", 8),
            view(positions.len(), indices.len(), "TRIANGLES", 2).replace(r#""byteStride":8,"ext"#, r#""ext"#),
        );
        glb(&json, &[positions, indices].concat())
    }

    #[test]
    fn quantised_and_compressed_positions_come_back_where_the_node_puts_them() {
        let model = read(&compressed("")).unwrap();
        assert_eq!(
            model.positions,
            [[1.0, 0.0, -3.0], [2.0, 0.0, -3.0], [1.0, 1.0, -3.0]].map(Vec3::from)
        );
        assert_eq!(model.patches[0].triangles, [[0, 1, 2]]);
        assert!(read(&compressed(r#","filter":"OCTAHEDRAL""#)).is_err());
        let whole = compressed("");
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x55;
            let _ = read(&damaged);
        }
    }

    #[test]
    fn damaged_bytes_are_refused_with_a_reason() {
        let whole = glb(TRIANGLE, &binary([0, 1, 2]));
        for length in 0..whole.len() {
            assert!(read(&whole[..length]).is_err(), "{length} bytes");
        }
        let outside = read(&glb(TRIANGLE, &binary([0, 1, 3]))).unwrap_err();
        assert!(outside.to_string().contains("index 3 of 3"), "{outside}");
        let strip = TRIANGLE.replace("\"mode\":0", "\"mode\":5");
        assert!(read(&glb(&strip, &binary([0, 1, 2]))).is_err());
    }
}
