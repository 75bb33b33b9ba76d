//! How does one scene become part of another?

use serde_json::Value;

use crate::source::{SourceObject, SourceScene};

/// Adds the models, materials, textures and pictures of `inner`; its objects, which now refer to them and are not placed
/// yet. Its viewpoints and authored shapes belong to it as a scene and are left out; whoever wants them takes them before.
pub(super) fn absorb(outer: &mut SourceScene, inner: SourceScene) -> Vec<SourceObject> {
    let (models, materials) = (outer.models.len(), outer.materials.len());
    let (textures, images) = (outer.textures.len(), outer.images.len());
    outer.images.extend(inner.images);
    outer.textures.extend(inner.textures.into_iter().map(|mut texture| {
        texture.image += images;
        texture
    }));
    outer.materials.extend(inner.materials.into_iter().map(|mut material| {
        shift_textures(&mut material.gltf, textures as u64);
        material
    }));
    outer.models.extend(inner.models.into_iter().map(|mut model| {
        for primitive in model.all_primitives_mut() {
            primitive.material = primitive.material.map(|material| material + materials);
        }
        model
    }));
    let shifted = inner.objects.into_iter().map(|object| SourceObject {
        model: object.model + models,
        ..object
    });
    shifted.collect()
}

/// Adds to every `index` inside a `…Texture` member. The depth of the value is bounded by its parser.
fn shift_textures(value: &mut Value, by: u64) {
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                let index = member.get("index").and_then(Value::as_u64);
                if let (true, Some(index)) = (key.ends_with("Texture"), index) {
                    member["index"] = (index + by).into();
                }
                shift_textures(member, by);
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| shift_textures(item, by)),
        _ => {}
    }
}
