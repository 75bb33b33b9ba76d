//! How long is a texel on a model, and what do the pictures of its materials mean?

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use serde_json::Value;

use super::Content;
use crate::source::{Material, Primitive, Texture, Topology};

/// A member of a glTF material that names a texture.
struct Use {
    texture: usize,
    /// Which set of texture coordinates.
    set: usize,
    /// By how much the material's own transform stretches an area of the picture.
    stretch: f64,
    content: Content,
}

/// What each picture of a scene shows; data where a material reads it as such and as colours.
#[must_use]
pub fn contents(materials: &[Material], textures: &[Texture], images: usize) -> Vec<Content> {
    let mut colors = vec![false; images];
    let mut data = vec![false; images];
    for found in materials.iter().flat_map(uses) {
        let Some(texture) = textures.get(found.texture) else {
            continue;
        };
        let list = if found.content == Content::Color {
            &mut colors
        } else {
            &mut data
        };
        if let Some(slot) = list.get_mut(texture.image) {
            *slot = true;
        }
    }
    let content = |(color, data): (bool, bool)| if color && !data { Content::Color } else { Content::Data };
    colors.into_iter().zip(data).map(content).collect()
}

/// For each picture that a mesh shows, the length in model units that its side covers where it is stretched most: the
/// mean over the area of a primitive, of the primitive with the longest. A texel is as long as this over the
/// pixels of the side; of a picture that is no square, over the root of their number.
#[must_use]
pub fn covered(primitives: &[Primitive], materials: &[Material], textures: &[Texture]) -> BTreeMap<usize, f64> {
    let mut longest: BTreeMap<usize, f64> = BTreeMap::new();
    for primitive in primitives.iter().filter(|p| p.topology == Topology::Triangles) {
        let material = primitive.material.and_then(|m| materials.get(m));
        for found in material.into_iter().flat_map(uses) {
            let length = textures.get(found.texture).zip(mean_length(primitive, &found));
            if let Some((texture, length)) = length {
                let known = longest.entry(texture.image).or_default();
                *known = known.max(length);
            }
        }
    }
    longest
}

/// The mean over a primitive's area of the length that the side of a picture covers; `None` where it covers none.
fn mean_length(primitive: &Primitive, found: &Use) -> Option<f64> {
    let uvs = primitive.uvs.get(found.set)?;
    let (mut area, mut lengths) = (0.0, 0.0);
    for corners in primitive.indices.as_chunks::<3>().0 {
        let corners = corners.map(|i| i as usize);
        let [a, b, c] = corners.map(|i| DVec3::from(primitive.positions[i].map(f64::from)));
        let of = |i: usize| uvs.get(i).map(|uv| DVec2::from(uv.map(f64::from)));
        let [Some(p), Some(q), Some(r)] = corners.map(of) else {
            continue;
        };
        let on_model = (b - a).cross(c - a).length();
        let on_picture = (q - p).perp_dot(r - p).abs() * found.stretch;
        let length = (on_model / on_picture).sqrt();
        // One colour on a whole triangle needs no pixels.
        if length.is_finite() {
            area += on_model;
            lengths += on_model * length;
        }
    }
    (area > 0.0).then(|| lengths / area)
}

/// The textures that a material names, at any depth.
fn uses(material: &Material) -> Vec<Use> {
    let mut found = Vec::new();
    collect(&material.gltf, &mut found);
    found
}

fn collect(value: &Value, into: &mut Vec<Use>) {
    match value {
        Value::Object(members) => {
            for (name, member) in members.iter().filter(|(name, _)| *name != "extras") {
                if name.ends_with("Texture") {
                    into.extend(named(name, member));
                }
                collect(member, into);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| collect(item, into)),
        _ => {}
    }
}

fn named(name: &str, member: &Value) -> Option<Use> {
    let number = |value: &Value| usize::try_from(value.as_u64()?).ok();
    let transform = member.pointer("/extensions/KHR_texture_transform");
    let set = transform.and_then(|t| t.get("texCoord")).or(member.get("texCoord"));
    let scale = |axis: usize| {
        transform
            .and_then(|t| t.get("scale")?.get(axis)?.as_f64())
            .unwrap_or(1.0)
    };
    let content = match name {
        "baseColorTexture"
        | "emissiveTexture"
        | "diffuseTexture"
        | "specularGlossinessTexture"
        | "specularColorTexture"
        | "sheenColorTexture"
        | "diffuseTransmissionColorTexture" => Content::Color,
        _ => Content::Data,
    };
    Some(Use {
        texture: number(member.get("index")?)?,
        set: set.and_then(number).unwrap_or(0),
        stretch: (scale(0) * scale(1)).abs(),
        content,
    })
}
