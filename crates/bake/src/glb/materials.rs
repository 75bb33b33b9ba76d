//! Which materials, textures, samplers and pictures does a GLB need, and under which numbers?
//!
//! Materials are the scene's glTF objects with their texture numbers replaced. Nothing else in them is touched, so
//! extensions that Belvedere does not know survive.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use crate::glb::{GlbInput, drawn, used_textures};
use crate::source::{Material, Texture};

/// How a picture is written.
pub(super) struct Picture {
    /// Its glTF object.
    pub(super) gltf: Value,
    /// The ending that files of its kind have.
    pub(super) ext: String,
}

/// Some of a scene's materials.
pub(super) struct MaterialTable<'a> {
    all_materials: &'a [Material],
    all_textures: &'a [Texture],
    /// Rising indices into the scene's materials; or as they were listed, `None` for glTF's default.
    materials: Vec<Option<usize>>,
    /// Rising indices into the scene's textures.
    textures: Vec<usize>,
}

impl<'a> MaterialTable<'a> {
    /// What some primitives use.
    pub(super) fn new(input: &GlbInput<'a>) -> Self {
        let materials: BTreeSet<usize> = drawn(input.primitives)
            .filter_map(|p| p.material)
            .filter(|&m| m < input.materials.len())
            .collect();
        let textures = used_textures(input.primitives, input.materials);
        Self {
            all_materials: input.materials,
            all_textures: input.textures,
            materials: materials.into_iter().map(Some).collect(),
            textures: textures.into_iter().filter(|&t| t < input.textures.len()).collect(),
        }
    }

    /// Of just these materials, in this order.
    pub(super) fn listing(input: &GlbInput<'a>, materials: &[Option<usize>]) -> Self {
        Self {
            materials: materials.to_vec(),
            ..Self::new(input)
        }
    }

    /// All that a scene has, under the same numbers.
    pub(super) fn whole(materials: &'a [Material], textures: &'a [Texture]) -> Self {
        Self {
            all_materials: materials,
            all_textures: textures,
            materials: (0..materials.len()).map(Some).collect(),
            textures: (0..textures.len()).collect(),
        }
    }

    /// The number in the GLB of a material of the scene.
    pub(super) fn position(&self, material: usize) -> Option<usize> {
        self.materials.binary_search(&Some(material)).ok()
    }

    /// Writes materials, textures, samplers, images and the extensions that are used; `required` are those of the
    /// geometry, and `picture` tells how one of the scene's pictures is written.
    pub(super) fn write_into(
        &self,
        root: &mut Map<String, Value>,
        mut required: BTreeSet<&'static str>,
        picture: impl FnMut(usize) -> Picture,
    ) {
        let mut extensions: BTreeSet<String> = required.iter().map(|name| (*name).to_owned()).collect();
        let mut materials = Vec::new();
        for &material in &self.materials {
            let known = material.and_then(|material| self.all_materials.get(material));
            let mut gltf = known.map_or_else(|| json!({}), |material| material.gltf.clone());
            visit_textures(&mut gltf, &mut |texture| self.textures.binary_search(&texture).ok());
            collect_extensions(&gltf, &mut extensions);
            materials.push(gltf);
        }
        let mut images: Vec<usize> = self.textures.iter().map(|&t| self.all_textures[t].image).collect();
        images.sort_unstable();
        images.dedup();
        let pictures: Vec<Picture> = images.iter().copied().map(picture).collect();
        let mut samplers: Vec<Value> = Vec::new();
        let mut textures = Vec::new();
        for &texture in &self.textures {
            let texture = &self.all_textures[texture];
            let source = images.partition_point(|&image| image < texture.image);
            let mut json = Map::new();
            if let Some(sampler) = &texture.sampler {
                let known = samplers.iter().position(|s| s == sampler);
                let position = known.unwrap_or_else(|| {
                    collect_extensions(sampler, &mut extensions);
                    samplers.push(sampler.clone());
                    samplers.len() - 1
                });
                json.insert("sampler".into(), json!(position));
            }
            match picture_extension(&pictures[source].ext) {
                None => {
                    json.insert("source".into(), json!(source));
                }
                Some(extension) => {
                    // There is no fallback picture, so a reader has to know the extension.
                    json.insert("extensions".into(), json!({extension: {"source": source}}));
                    extensions.insert(extension.to_owned());
                    required.insert(extension);
                }
            }
            textures.push(Value::Object(json));
        }
        let images: Vec<Value> = pictures.into_iter().map(|picture| picture.gltf).collect();
        let extensions: Vec<Value> = extensions.into_iter().map(Value::from).collect();
        let required: Vec<Value> = required.into_iter().map(Value::from).collect();
        for (name, list) in [
            ("materials", materials),
            ("textures", textures),
            ("samplers", samplers),
            ("images", images),
            ("extensionsUsed", extensions),
            ("extensionsRequired", required),
        ] {
            if !list.is_empty() {
                root.insert(name.into(), Value::Array(list));
            }
        }
    }
}

/// The extension that lets a texture use a picture of this kind; `None` for PNG and JPEG.
fn picture_extension(ext: &str) -> Option<&'static str> {
    match ext {
        "webp" => Some("EXT_texture_webp"),
        "avif" => Some("EXT_texture_avif"),
        "ktx2" => Some("KHR_texture_basisu"),
        _ => None,
    }
}

/// Replaces the texture number in each member whose name ends in `Texture`, at any depth. Members whose texture becomes
/// `None` are removed.
pub(super) fn visit_textures(value: &mut Value, renumber: &mut dyn FnMut(usize) -> Option<usize>) {
    match value {
        Value::Object(members) => {
            members.retain(|name, member| {
                if name == "extras" {
                    return true;
                }
                visit_textures(member, renumber);
                let index = name
                    .ends_with("Texture")
                    .then(|| member.as_object_mut()?.get_mut("index"))
                    .flatten();
                let Some(index) = index else { return true };
                let new = index.as_u64().and_then(|old| renumber(usize::try_from(old).ok()?));
                new.is_some_and(|new| {
                    *index = json!(new);
                    true
                })
            });
        }
        Value::Array(items) => items.iter_mut().for_each(|item| visit_textures(item, renumber)),
        _ => {}
    }
}

/// Names of all extensions in a glTF object, at any depth.
fn collect_extensions(value: &Value, into: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) => {
            for (name, member) in members.iter().filter(|(name, _)| *name != "extras") {
                if let ("extensions", Some(extensions)) = (name.as_str(), member.as_object()) {
                    into.extend(extensions.keys().cloned());
                }
                collect_extensions(member, into);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| collect_extensions(item, into)),
        _ => {}
    }
}
