//! Which materials, textures and pictures are used? Materials are kept whole; what cannot be shown is left out of them.
//!
//! Only used materials are kept, with the textures that they name anywhere (also inside extensions, known or not), and
//! the pictures of those. Variants are not: primitives keep their default material.

use std::collections::BTreeMap;

use serde_json::Value;

use super::ImportError;
use super::document::Item;
use super::error::{Read, flaw};
use super::reader::{Reader, shorten};
use crate::pictures::claims;
use crate::source::{Image, Material, SourceModel, SourceScene, Texture};

/// Extensions that give a texture another picture, in the order in which they are tried after the plain one.
const PICTURE_EXTENSIONS: [&str; 3] = ["EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif"];

/// Textures and pictures found so far: document index to scene index, or `None` when it cannot be shown.
#[derive(Default)]
struct Pictures {
    textures: Vec<Texture>,
    images: Vec<Image>,
    texture_of: BTreeMap<usize, Option<usize>>,
    image_of: BTreeMap<usize, Option<usize>>,
    /// Whose textures are being read, as defects name it.
    material: String,
}

/// Reads the materials that the models of a scene use and makes their indices point into the scene's list.
pub(super) fn read_used(reader: &mut Reader, scene: &mut SourceScene) -> Result<(), ImportError> {
    let mut pictures = Pictures::default();
    let mut material_of: BTreeMap<usize, Option<usize>> = BTreeMap::new();
    let primitives = |models: &[SourceModel]| -> Vec<usize> {
        models
            .iter()
            .flat_map(|m| &m.primitives)
            .filter_map(|p| p.material)
            .collect()
    };
    for index in primitives(&scene.models) {
        material_of.insert(index, None);
    }
    for (index, known) in &mut material_of {
        let listed = reader.root.listed("materials", *index);
        let Some(item) = reader.settle(listed)? else { continue };
        reader
            .budget
            .claim(approximate_bytes(item.value), 1, || item.place.clone())?;
        let mut gltf = item.value.clone();
        pictures.material = named(&item);
        remap_textures(reader, &mut pictures, &mut gltf, &item.place)?;
        *known = Some(scene.materials.len());
        scene.materials.push(Material {
            see_through: is_see_through(&gltf),
            double_sided: gltf.get("doubleSided").and_then(Value::as_bool).unwrap_or(false),
            gltf,
        });
    }
    for primitive in scene.models.iter_mut().flat_map(SourceModel::all_primitives_mut) {
        primitive.material = primitive.material.and_then(|m| material_of.get(&m).copied().flatten());
    }
    scene.textures = pictures.textures;
    scene.images = pictures.images;
    Ok(())
}

/// Whether light passes in places.
fn is_see_through(gltf: &Value) -> bool {
    let alpha = matches!(gltf.get("alphaMode").and_then(Value::as_str), Some("MASK" | "BLEND"));
    let transmission = gltf.pointer("/extensions/KHR_materials_transmission").is_some_and(|t| {
        t.get("transmissionFactor").and_then(Value::as_f64).unwrap_or(0.0) > 0.0
            || t.get("transmissionTexture").is_some()
    });
    alpha || transmission
}

/// Makes texture indices point into the scene's list; removes references that cannot be shown. The depth of the
/// document is bounded by its parser.
fn remap_textures(
    reader: &mut Reader,
    pictures: &mut Pictures,
    value: &mut Value,
    place: &str,
) -> Result<(), ImportError> {
    let members: Vec<String> = match value {
        // What an author notes beside it is nobody else's to change.
        Value::Object(object) => object.keys().filter(|key| *key != "extras").cloned().collect(),
        Value::Array(list) => (0..list.len()).map(|i| i.to_string()).collect(),
        _ => return Ok(()),
    };
    for key in members {
        let Some(member) = value.pointer_mut(&format!("/{}", key.replace('~', "~0").replace('/', "~1"))) else {
            continue;
        };
        let place = format!("{place}/{key}");
        if is_texture_reference(&key, member) {
            let found = texture_index(reader, pictures, member, &place)?;
            match (found, member.get_mut("index")) {
                (Some(index), Some(slot)) => *slot = index.into(),
                _ => {
                    value.as_object_mut().and_then(|object| object.remove(&key));
                    continue;
                }
            }
        }
        if let Some(member) = value.get_mut(&key) {
            remap_textures(reader, pictures, member, &place)?;
        } else if let Some(element) = key.parse().ok().and_then(|i: usize| value.get_mut(i)) {
            remap_textures(reader, pictures, element, &place)?;
        }
    }
    Ok(())
}

pub(super) fn is_texture_reference(key: &str, value: &Value) -> bool {
    key.ends_with("Texture") && value.as_object().is_some_and(|o| o.contains_key("index"))
}

fn texture_index(
    reader: &mut Reader,
    pictures: &mut Pictures,
    reference: &Value,
    place: &str,
) -> Result<Option<usize>, ImportError> {
    let item = Item {
        value: reference,
        place: place.to_owned(),
    };
    let index = item.needed("index").and_then(|i| i.as_index());
    let Some(index) = reader.settle(index)? else {
        return Ok(None);
    };
    if let Some(known) = pictures.texture_of.get(&index) {
        return Ok(*known);
    }
    let read = read_texture(reader, pictures, index);
    let texture = reader.settle(read)?.map(|texture| {
        pictures.textures.push(texture);
        pictures.textures.len() - 1
    });
    pictures.texture_of.insert(index, texture);
    Ok(texture)
}

fn read_texture(reader: &mut Reader, pictures: &mut Pictures, index: usize) -> Read<Texture> {
    let item = reader.root.listed("textures", index)?;
    let mut sources = vec![item.index("source")?];
    for name in PICTURE_EXTENSIONS {
        if let Some(extension) = item.extension(name) {
            sources.push(extension.index("source")?);
        }
    }
    let sampler = match item.index("sampler")? {
        Some(sampler) => {
            let listed = reader.root.listed("samplers", sampler);
            reader.settle(listed)?.map(|s| s.value.clone())
        }
        None => None,
    };
    for source in sources.into_iter().flatten() {
        let image = match pictures.image_of.get(&source) {
            Some(known) => *known,
            None => {
                let read = read_image(reader, source, &pictures.material);
                let image = reader.settle(read)?.map(|image| {
                    pictures.images.push(image);
                    pictures.images.len() - 1
                });
                pictures.image_of.insert(source, image);
                image
            }
        };
        if let Some(image) = image {
            return Ok(Texture { image, sampler });
        }
    }
    flaw("texture without a picture: left out of its material", item.place)
}

fn read_image(reader: &mut Reader, index: usize, material: &str) -> Read<Image> {
    let item = reader.root.listed("images", index)?;
    let bytes = match (item.index("bufferView")?, item.text("uri")?) {
        (Some(view), _) => {
            let (bytes, _) = reader.view(view)?;
            let bytes = bytes.as_slice();
            reader.budget.claim(bytes.len(), 1, || item.place.clone())?;
            bytes.to_vec()
        }
        (None, Some(uri)) => reader.load(uri, &item.place, "picture missing: left out of its materials")?,
        (None, None) => return flaw("picture without data: left out of its materials", item.place),
    };
    let place = || format!("{} of {material}", named(&item));
    let Some((ext, media_type)) = claims::kind(&bytes) else {
        return flaw("picture of unknown type: left out of its materials", place());
    };
    match claims::size_px(ext, &bytes, reader.budget.limit_bytes()) {
        Err(unfit) => return flaw(unfit.kind(), format!("{}: {unfit}", place())),
        Ok(size) if size.into_iter().any(|px| px > claims::LARGEST_PX) => reader.defects.note(
            "picture with a side of more than 8192 pixels: published smaller",
            1,
            || format!("{}: {} × {} pixels", place(), size[0], size[1]),
        ),
        Ok(_) => {}
    }
    Ok(Image { ext, media_type, bytes })
}

/// Where something stands, and what it is called there: its name, or of a picture its file.
fn named(item: &Item) -> String {
    let file = || item.text("uri").ok().flatten().filter(|uri| !uri.starts_with("data:"));
    match item.name().or_else(file) {
        Some(name) => format!("{} {:?}", item.place, shorten(name)),
        None => item.place.clone(),
    }
}

/// About the memory that a JSON value takes.
fn approximate_bytes(value: &Value) -> usize {
    match value {
        Value::Array(list) => 32 + list.iter().map(approximate_bytes).sum::<usize>(),
        Value::Object(object) => {
            640 + object
                .iter()
                .map(|(k, v)| k.len() + approximate_bytes(v))
                .sum::<usize>()
        }
        Value::String(text) => 32 + text.len(),
        _ => 32,
    }
}
