//! What is a published level to a reader that knows glTF 2.0 and neither quantised nor compressed geometry?
//!
//! Undoes `EXT_meshopt_compression` and `KHR_mesh_quantization` in what [`write`](super::write) has written: positions
//! become floats in model space and the node loses its transform, normals and tangents become floats of unit length.
//! Texture coordinates and colours that are u8 or u16 stay so: glTF has always allowed these. Pictures are looked for
//! elsewhere, because the answer is read at another address. All else is left alone.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use crate::glb::streams::{BYTE, FLOAT, UNSIGNED_SHORT};
use crate::glb::{QUANTIZATION, container};
use crate::meshopt_view;

/// More bytes than this no level holds.
const MOST_BYTES: usize = 1 << 30;

/// Why bytes are not a level that was published.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("not a published level of detail: {0}")]
pub struct NoLevel(&'static str);

/// The same level without extensions for geometry; `pictures` is put before the names of its pictures, so that they
/// lead from where the level is read to `/o/`.
///
/// # Errors
/// When the bytes are not a GLB as the bake writes it. Memory is at most a few times what the views claim, and they may
/// claim a gigabyte.
pub fn plain(glb: &[u8], pictures: &str) -> Result<Vec<u8>, NoLevel> {
    let (json, binary) = chunks(glb).ok_or(NoLevel("no GLB"))?;
    let mut root: Map<String, Value> = serde_json::from_slice(json).map_err(|_| NoLevel("its JSON is damaged"))?;
    let views = views(&root, binary).ok_or(NoLevel("a view does not lie in its buffer, or cannot be decoded"))?;
    let place = Place::take(&mut root);
    let names = names(&root);
    let mut binary = Vec::new();
    let accessors = root.get_mut("accessors").and_then(Value::as_array_mut);
    let mut written = Vec::new();
    for (index, accessor) in accessors.into_iter().flatten().enumerate() {
        let name = names.get(&index).map_or("", String::as_str);
        let view = index_of(accessor, "bufferView").and_then(|view| views.get(view));
        let view = view.ok_or(NoLevel("an accessor has no view"))?;
        let (bytes, stride) = floats(name, accessor, view, &place).unwrap_or_else(|| (view.bytes.clone(), view.stride));
        accessor["bufferView"] = json!(written.len());
        let mut json =
            json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len(), "target": view.target});
        if let Some(stride) = stride {
            json["byteStride"] = json!(stride);
        }
        written.push(json);
        binary.extend(bytes);
        binary.resize(binary.len().next_multiple_of(4), 0);
    }
    if !written.is_empty() {
        root.insert("bufferViews".into(), Value::Array(written));
        root.insert("buffers".into(), json!([{"byteLength": binary.len()}]));
    }
    for image in root
        .get_mut("images")
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
    {
        if let Some(Value::String(uri)) = image.get_mut("uri") {
            uri.insert_str(0, pictures);
        }
    }
    for list in ["extensionsUsed", "extensionsRequired"] {
        if let Some(Value::Array(mut names)) = root.remove(list) {
            names.retain(|name| name != QUANTIZATION && name != meshopt_view::EXTENSION);
            if !names.is_empty() {
                root.insert(list.into(), Value::Array(names));
            }
        }
    }
    Ok(container(&Value::Object(root), &binary))
}

/// A buffer view, decoded.
struct View {
    bytes: Vec<u8>,
    stride: Option<usize>,
    target: Value,
}

/// Where the node puts the mesh.
struct Place {
    scale: f64,
    translation: [f64; 3],
}

impl Place {
    /// Takes the transform away from the node.
    fn take(root: &mut Map<String, Value>) -> Self {
        let node = root
            .get_mut("nodes")
            .and_then(|nodes| nodes.get_mut(0)?.as_object_mut());
        let (scale, translation) = node.map_or((None, None), |node| (node.remove("scale"), node.remove("translation")));
        let number = |list: &Option<Value>, axis: usize| list.as_ref()?.get(axis)?.as_f64();
        Self {
            scale: number(&scale, 0).unwrap_or(1.0),
            translation: std::array::from_fn(|axis| number(&translation, axis).unwrap_or(0.0)),
        }
    }
}

fn index_of(value: &Value, name: &str) -> Option<usize> {
    usize::try_from(value.get(name)?.as_u64()?).ok()
}

/// The JSON and the binary chunk.
fn chunks(glb: &[u8]) -> Option<(&[u8], &[u8])> {
    let word = |at: usize| Some(u32::from_le_bytes(*glb.get(at..)?.first_chunk()?) as usize);
    let chunk = |at: usize| glb.get(at + 8..)?.get(..word(at)?);
    if glb.get(..4) != Some(b"glTF") || glb.get(16..20) != Some(b"JSON") {
        return None;
    }
    let json = chunk(12)?;
    Some((json, chunk(20 + json.len()).unwrap_or_default()))
}

fn views(root: &Map<String, Value>, binary: &[u8]) -> Option<Vec<View>> {
    let mut left = MOST_BYTES;
    let part = |value: &Value| {
        let start = index_of(value, "byteOffset").unwrap_or(0);
        binary.get(start..)?.get(..index_of(value, "byteLength")?)
    };
    let views = root.get("bufferViews").and_then(Value::as_array);
    let read = |view: &Value| {
        let compression = view.get("extensions").and_then(|e| e.get(meshopt_view::EXTENSION));
        let bytes = match compression {
            None => part(view)?.to_vec(),
            Some(compression) => {
                let (count, stride) = (index_of(compression, "count")?, index_of(compression, "byteStride")?);
                left = left.checked_sub(count.checked_mul(stride)?)?;
                let text = |name: &str| compression.get(name).and_then(Value::as_str);
                let filter = text("filter").unwrap_or("NONE");
                meshopt_view::decode(text("mode")?, filter, part(compression)?, count, stride)?
            }
        };
        Some(View {
            bytes,
            stride: index_of(view, "byteStride"),
            target: view.get("target")?.clone(),
        })
    };
    views.into_iter().flatten().map(read).collect()
}

/// What each accessor is to the primitives.
fn names(root: &Map<String, Value>) -> BTreeMap<usize, String> {
    let meshes = root.get("meshes").and_then(Value::as_array).into_iter().flatten();
    let primitives = meshes.filter_map(|mesh| mesh.get("primitives")?.as_array()).flatten();
    primitives
        .filter_map(|primitive| primitive.get("attributes")?.as_object())
        .flatten()
        .filter_map(|(name, accessor)| Some((usize::try_from(accessor.as_u64()?).ok()?, name.clone())))
        .collect()
}

/// Rows of an attribute as floats with their stride; `None` when they may stay as they are.
fn floats(name: &str, accessor: &mut Value, view: &View, place: &Place) -> Option<(Vec<u8>, Option<usize>)> {
    let component = accessor.get("componentType")?.as_u64()?;
    // What is no row that the bake writes stays as it is.
    let rows = |bytes: usize| Some(view.bytes.chunks_exact(view.stride.filter(|stride| *stride >= bytes)?));
    let values: Vec<Vec<f32>> = if name == "POSITION" && component == u64::from(UNSIGNED_SHORT) {
        let coordinate = |row: &[u8], a: usize| f64::from(u16::from_le_bytes([row[2 * a], row[2 * a + 1]]));
        let place = |a: usize, x: f64| (x * place.scale + place.translation[a]) as f32;
        let rows = rows(6)?;
        for end in ["min", "max"] {
            for (a, x) in accessor.get_mut(end)?.as_array_mut()?.iter_mut().enumerate() {
                *x = json!(f64::from(place(a, x.as_f64()?)));
            }
        }
        let row = |row: &[u8]| (0..3).map(|a| place(a, coordinate(row, a))).collect();
        rows.map(row).collect()
    } else if matches!(name, "NORMAL" | "TANGENT") && component == u64::from(BYTE) {
        let width = if name == "NORMAL" { 3 } else { 4 };
        rows(4)?.map(|row| unit(row, width)).collect()
    } else {
        return None;
    };
    let stride = 4 * values.first()?.len();
    accessor["componentType"] = json!(FLOAT);
    accessor.as_object_mut()?.remove("normalized");
    let bytes = values.into_iter().flatten().flat_map(f32::to_le_bytes);
    Some((bytes.collect(), Some(stride)))
}

/// A vector of unit length, with the sign that stands in its fourth component.
fn unit(row: &[u8], width: usize) -> Vec<f32> {
    let vector = [0, 1, 2].map(|a| f32::from(row[a] as i8));
    let length = vector.iter().map(|x| x * x).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
    let sign = if (row[3] as i8) < 0 { -1.0 } else { 1.0 };
    let values = vector.map(|x| x / length).into_iter().chain([sign]);
    values.take(width).collect()
}
