//! How long is a texel on a model, and what do the pictures of its materials mean?

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use serde_json::Value;

use super::{Content, LARGEST_PX, transform::Transform};
use crate::source::{Material, Primitive, Texture, Topology};

/// A member of a glTF material that names a texture.
struct Use {
    texture: usize,
    transform: Transform,
    content: Content,
}

/// What each picture of a scene shows: where materials read it differently, what asks least; data where none reads it.
#[must_use]
pub fn contents(materials: &[Material], textures: &[Texture], images: usize) -> Vec<Content> {
    let mut contents = vec![None; images];
    for found in materials.iter().flat_map(uses) {
        let texture = textures.get(found.texture);
        if let Some(content) = texture.and_then(|texture| contents.get_mut(texture.image)) {
            *content = (*content).max(Some(found.content));
        }
    }
    contents
        .into_iter()
        .map(|content| content.unwrap_or(Content::Data))
        .collect()
}

/// What the base colours of a material are: only where it is masked or blended does their alpha say what is there.
pub(crate) fn base_content(gltf: &Value) -> Content {
    match gltf.get("alphaMode").and_then(Value::as_str) {
        Some("MASK" | "BLEND") => Content::Cutout,
        _ => Content::Color,
    }
}

/// For each picture that a mesh shows, the lengths in model units that its width and its height cover where they are
/// stretched most: means over the area of a primitive, of the primitive with the longest. A texel is as long as these over the
/// pixels along them.
#[must_use]
pub fn covered(primitives: &[Primitive], materials: &[Material], textures: &[Texture]) -> BTreeMap<usize, DVec2> {
    let mut longest: BTreeMap<usize, DVec2> = BTreeMap::new();
    for primitive in primitives.iter().filter(|p| p.topology == Topology::Triangles) {
        let material = primitive.material.and_then(|m| materials.get(m));
        for found in material.into_iter().flat_map(uses) {
            let lengths = textures.get(found.texture).zip(mean_lengths(primitive, &found));
            if let Some((texture, lengths)) = lengths {
                let known = longest.entry(texture.image).or_default();
                *known = known.max(lengths);
            }
        }
    }
    longest
}

/// The means over a primitive's area of the lengths that the sides of a picture cover; `None` where it covers none.
fn mean_lengths(primitive: &Primitive, found: &Use) -> Option<DVec2> {
    let uvs = primitive.uvs.get(found.transform.set)?;
    let (mut areas, mut lengths) = (DVec2::ZERO, DVec2::ZERO);
    for corners in primitive.indices.as_chunks::<3>().0 {
        let corners = corners.map(|i| i as usize);
        let on_model = corners.map(|i| DVec3::from(primitive.positions[i].map(f64::from)));
        let of = |i: usize| {
            uvs.get(i)
                .map(|uv| found.transform.linear * DVec2::from(uv.map(f64::from)))
        };
        let [Some(p), Some(q), Some(r)] = corners.map(of) else {
            continue;
        };
        let [a, b, c] = on_model;
        let area = (b - a).cross(c - a).length();
        for axis in 0..2 {
            if let Some(length) = length_along(axis, on_model, [p, q, r]) {
                areas[axis] += area;
                lengths[axis] += area * length;
            }
        }
    }
    let means = lengths / areas;
    (areas.max_element() > 0.0).then(|| DVec2::select(areas.cmpgt(DVec2::ZERO), means, DVec2::ZERO))
}

/// The length that a side of a picture covers on a triangle: how far a point moves there that moves along that side only. `None`
/// where the triangle shows less than a texel of the widest picture along it: one colour needs no pixels.
fn length_along(axis: usize, [a, b, c]: [DVec3; 3], [p, q, r]: [DVec2; 3]) -> Option<f64> {
    let shown = p.max(q).max(r)[axis] - p.min(q).min(r)[axis];
    if shown < 1.0 / f64::from(LARGEST_PX) {
        return None;
    }
    let (across, up) = (q - p, r - p);
    let other = 1 - axis;
    let along = ((b - a) * up[other] - (c - a) * across[other]).length() / across.perp_dot(up).abs();
    // Where a picture is sheared, that way leads out of the triangle: no texel is seen for longer than it.
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a)) / shown;
    let length = along.min(longest);
    length.is_finite().then_some(length)
}

/// How many pictures of a material lie along a unit of a set of texture coordinates, of that of which there are most; at least 1.
pub(crate) fn pictures_a_unit(material: Option<&Material>, set: usize) -> f64 {
    let of_set = material
        .into_iter()
        .flat_map(uses)
        .filter(|found| found.transform.set == set);
    let scale = |found: Use| {
        let linear = found.transform.linear;
        linear.x_axis.length().max(linear.y_axis.length())
    };
    of_set.map(scale).fold(1.0, f64::max)
}

/// By which set of texture coordinates a material shows its first picture, and how many of it lie along a unit of these; `None`
/// where it shows none.
pub(crate) fn shown_by(material: &Material) -> Option<(usize, f64)> {
    let Transform { set, linear, .. } = uses(material).into_iter().next()?.transform;
    Some((set, linear.determinant().abs().sqrt()))
}

/// The textures that a material names, at any depth.
fn uses(material: &Material) -> Vec<Use> {
    let mut found = Vec::new();
    collect(&material.gltf, base_content(&material.gltf), &mut found);
    found
}

fn collect(value: &Value, base: Content, into: &mut Vec<Use>) {
    match value {
        Value::Object(members) => {
            for (name, member) in members.iter().filter(|(name, _)| *name != "extras") {
                if name.ends_with("Texture") {
                    into.extend(named(name, member, base));
                }
                collect(member, base, into);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| collect(item, base, into)),
        _ => {}
    }
}

fn named(name: &str, member: &Value, base: Content) -> Option<Use> {
    let content = match name {
        "baseColorTexture" | "diffuseTexture" => base,
        "emissiveTexture"
        | "specularGlossinessTexture"
        | "specularColorTexture"
        | "sheenColorTexture"
        | "diffuseTransmissionColorTexture" => Content::Color,
        _ => Content::Data,
    };
    Some(Use {
        texture: usize::try_from(member.get("index")?.as_u64()?).ok()?,
        transform: Transform::of(member),
        content,
    })
}
