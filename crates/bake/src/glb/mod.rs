//! How does geometry become a file that any glTF viewer opens?
//!
//! Writes binary glTF 2.0 (GLB): one mesh, one node, one scene. The node's transform leads from the numbers that stand for
//! positions into model space; where an object stands is in its object info. Pictures are external: their URIs are
//! relative to the GLB itself, so that levels and models share them.
//!
//! * [`lattice`]: where vertices may stand, and so how far rounding moves them.
//! * `streams`: attributes as rows of few bytes (`KHR_mesh_quantization`).
//! * `geometry`: their order, accessors and buffer views, compressed where that saves bytes
//!   (`EXT_meshopt_compression`). Indices are u16 when they fit, else u32; never u8, which many GPUs widen anyway.
//! * `materials`: the glTF materials that are used, with their textures.
//! * [`write_whole`]: a whole scene in one file, plainly.
//! * [`plain()`]: the same level without the two extensions.
//!
//! Guarantee: the same input gives the same bytes; nothing that is not referred to is written.

mod geometry;
pub mod lattice;
mod materials;
mod plain;
mod streams;
#[cfg(test)]
mod tests;
mod whole;

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use crate::glb::geometry::BufferWriter;
use crate::glb::lattice::{Frame, Lattice};
use crate::glb::materials::{MaterialTable, Picture};
pub use crate::glb::plain::{NoLevel, plain};
pub use crate::glb::whole::write_whole;
use crate::meshopt_view;
use crate::source::{Material, Primitive, Texture};

/// What goes into a GLB.
#[derive(Clone, Copy)]
pub struct GlbInput<'a> {
    /// Geometry in model space. Empty primitives are left out.
    pub primitives: &'a [Primitive],
    /// All materials of the scene, indexed by [`Primitive::material`].
    pub materials: &'a [Material],
    /// All textures of the scene, indexed by the materials.
    pub textures: &'a [Texture],
    /// The URI of each picture of the scene, relative to the GLB, indexed by [`Texture::image`]; its extension tells
    /// what it is: `{hash}.webp`.
    pub image_uri: &'a dyn Fn(usize) -> String,
}

/// A GLB and what it cost to write it.
#[derive(Debug, Clone, PartialEq)]
pub struct Glb {
    /// The file.
    pub bytes: Vec<u8>,
    /// No vertex moved farther than this, in model units. So no point of a surface is farther from where it was.
    pub rounding: f64,
}

const QUANTIZATION: &str = "KHR_mesh_quantization";

/// Writes a GLB whose vertices stand on a lattice.
///
/// Materials and textures that are out of range count as none, as glTF's defaults are a picture too. Costs
/// O(n log n) in the vertices.
#[must_use]
pub fn write(input: &GlbInput, lattice: Lattice) -> Glb {
    let mut buffer = BufferWriter::default();
    let materials = MaterialTable::new(input);
    let frame = Frame::of(drawn(input.primitives), lattice);
    let primitives: Vec<Value> = drawn(input.primitives)
        .map(|primitive| {
            let material = primitive.material.and_then(|m| input.materials.get(m));
            let mut json = buffer.primitive(primitive, &frame, material);
            if let Some(material) = primitive.material.and_then(|m| materials.position(m)) {
                json.insert("material".into(), json!(material));
            }
            Value::Object(json)
        })
        .collect();

    let mut root = Map::new();
    root.insert("asset".into(), json!({"version": "2.0", "generator": "Belvedere"}));
    root.insert("scene".into(), json!(0));
    if primitives.is_empty() {
        // glTF has no empty mesh; a node without one is valid and shows nothing.
        root.insert("nodes".into(), json!([{}]));
    } else {
        root.insert("nodes".into(), json!([node(&frame)]));
        root.insert("meshes".into(), json!([{"primitives": primitives}]));
    }
    root.insert("scenes".into(), json!([{"nodes": [0]}]));
    let mut required = BTreeSet::new();
    // Bytes that stand for normals need it too, so nearly every level does.
    if !primitives.is_empty() {
        required.insert(QUANTIZATION);
    }
    if buffer.is_compressed() {
        required.insert(meshopt_view::EXTENSION);
    }
    materials.write_into(&mut root, required, beside(input));
    let binary = buffer.write_into(&mut root);
    Glb {
        bytes: container(&Value::Object(root), &binary),
        rounding: frame.rounding(drawn(input.primitives)),
    }
}

/// Pictures as files of their own.
fn beside(input: &GlbInput) -> impl Fn(usize) -> Picture {
    |image| {
        let uri = (input.image_uri)(image);
        Picture {
            ext: uri.rsplit_once('.').map_or("", |(_, ext)| ext).to_owned(),
            gltf: json!({"uri": uri}),
        }
    }
}

/// The node that leads from what stands for positions into model space.
fn node(frame: &Frame) -> Value {
    match frame {
        Frame::Floats { .. } => json!({"mesh": 0}),
        Frame::Words { lattice, corner } => {
            let step = lattice.step();
            json!({"mesh": 0, "scale": [step, step, step], "translation": corner.map(|x| x * step)})
        }
    }
}

/// Writes a glTF document (JSON) without meshes: its material *i* is the *i*-th of `listed`, `None` glTF's default.
/// `input` must have a primitive with each of them. Costs no pass over the geometry.
#[must_use]
pub fn write_materials(input: &GlbInput, listed: &[Option<usize>]) -> Vec<u8> {
    let mut root = Map::new();
    root.insert("asset".into(), json!({"version": "2.0", "generator": "Belvedere"}));
    MaterialTable::listing(input, listed).write_into(&mut root, BTreeSet::new(), beside(input));
    Value::Object(root).to_string().into_bytes()
}

/// The textures that some primitives refer to through their materials, as indices into the scene's textures.
#[must_use]
pub fn used_textures(primitives: &[Primitive], materials: &[Material]) -> BTreeSet<usize> {
    let used: BTreeSet<usize> = drawn(primitives).filter_map(|p| p.material).collect();
    let mut textures = BTreeSet::new();
    for material in used.iter().filter_map(|&m| materials.get(m)) {
        materials::visit_textures(&mut material.gltf.clone(), &mut |texture| {
            textures.insert(texture);
            Some(texture)
        });
    }
    textures
}

/// Primitives that hold something.
fn drawn(primitives: &[Primitive]) -> impl Iterator<Item = &Primitive> + Clone {
    primitives.iter().filter(|p| !p.indices.is_empty())
}

/// Joins the JSON and the binary chunk (glTF 2.0 §4.4).
fn container(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let binary_chunk_bytes = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let total = 12 + 8 + text.len() + binary_chunk_bytes;
    let mut glb = Vec::with_capacity(total);
    let word = |glb: &mut Vec<u8>, value: usize| glb.extend_from_slice(&(value as u32).to_le_bytes());
    glb.extend_from_slice(b"glTF");
    word(&mut glb, 2);
    word(&mut glb, total);
    word(&mut glb, text.len());
    glb.extend_from_slice(b"JSON");
    glb.extend_from_slice(&text);
    if !binary.is_empty() {
        word(&mut glb, binary.len());
        glb.extend_from_slice(b"BIN\0");
        glb.extend_from_slice(binary);
    }
    glb
}
