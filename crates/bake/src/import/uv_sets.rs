//! Has each primitive the texture coordinates that its material asks for? What is missing is zero, so that what is published
//! is valid: a reader of the source would find nothing there either.

use serde_json::{Map, Value};

use super::ImportError;
use super::materials::is_texture_reference;
use super::primitives::MAX_UV_SETS;
use super::reader::Reader;
use crate::source::{SourceModel, SourceScene};

/// Where a reference to a texture says which set it takes; the second is preferred by who knows it.
const SET_OF: [&str; 2] = ["/texCoord", "/extensions/KHR_texture_transform/texCoord"];

/// Adds sets of zeros where materials ask for sets that are not there, and says so.
pub(super) fn fill(reader: &mut Reader, scene: &mut SourceScene) -> Result<(), ImportError> {
    let SourceScene { materials, models, .. } = scene;
    for material in materials.iter_mut() {
        let beyond = bound(&mut material.gltf);
        let kind = "texture coordinate set beyond the eighth: the first taken";
        let name = material.gltf.get("name").and_then(Value::as_str).unwrap_or_default();
        reader.defects.note(kind, beyond, || format!("material \"{name}\""));
    }
    let wanted: Vec<usize> = materials.iter().map(|material| wanted(&material.gltf)).collect();
    for model in models {
        let name = model.name.clone();
        for (number, primitive) in SourceModel::all_primitives_mut(model).enumerate() {
            let place = || format!("mesh \"{name}\", primitive {number}");
            let wanted = primitive.material.map_or(0, |material| wanted[material]);
            let vertices = primitive.positions.len();
            let missing = wanted.saturating_sub(primitive.uvs.len());
            if missing == 0 {
                continue;
            }
            reader.budget.claim(vertices, 8 * missing, place)?;
            primitive.uvs.resize_with(wanted, || vec![[0.0; 2]; vertices]);
            reader
                .defects
                .note("texture coordinate set missing: zeros put there", 1, place);
        }
    }
    Ok(())
}

/// How many sets a material asks for, with those below the last.
fn wanted(value: &Value) -> usize {
    let of_member = |(key, member): (&String, &Value)| {
        let set = |pointer| member.pointer(pointer).and_then(Value::as_u64).unwrap_or(0);
        let own = if is_texture_reference(key, member) {
            1 + SET_OF.map(set).into_iter().max().unwrap_or(0) as usize
        } else {
            0
        };
        own.max(wanted(member))
    };
    match value {
        Value::Object(members) => own(members).map(of_member).max().unwrap_or(0),
        Value::Array(items) => items.iter().map(wanted).max().unwrap_or(0),
        _ => 0,
    }
}

/// Members of a glTF object but for what its author notes beside it.
fn own(members: &Map<String, Value>) -> impl Iterator<Item = (&String, &Value)> {
    members.iter().filter(|(key, _)| *key != "extras")
}

/// Makes references to sets that no primitive keeps ones to the first; how many there were.
fn bound(value: &mut Value) -> u64 {
    match value {
        Value::Object(members) => members
            .iter_mut()
            .filter(|(key, _)| *key != "extras")
            .map(|(key, member)| {
                let mut count = 0;
                if is_texture_reference(key, member) {
                    for set in SET_OF {
                        let set = member.pointer_mut(set);
                        let beyond = set.filter(|set| set.as_u64().is_none_or(|set| set >= MAX_UV_SETS as u64));
                        if let Some(set) = beyond {
                            *set = 0.into();
                            count += 1;
                        }
                    }
                }
                count + bound(member)
            })
            .sum(),
        Value::Array(items) => items.iter_mut().map(bound).sum(),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use crate::import::testing::{Gltf, picture};

    #[test]
    fn sets_that_materials_ask_for_are_there_and_missing_ones_told() {
        let kind = "texture coordinate set missing: zeros put there";
        let texture = json!({"index": 0, "texCoord": 2});
        let moved = json!({"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}});
        for (texture, sets, missing) in [(texture, 3, 1), (moved, 2, 1), (json!({"index": 0}), 1, 1)] {
            let mut gltf = Gltf::triangle();
            let picture = gltf.view(&picture());
            gltf.push("images", json!({"bufferView": picture, "mimeType": "image/png"}));
            gltf.push("textures", json!({"source": 0}));
            gltf.push(
                "materials",
                json!({"pbrMetallicRoughness": {"baseColorTexture": texture}}),
            );
            let gltf = gltf.with("/meshes/0/primitives/0/material", json!(0));
            let imported = gltf.import().unwrap();
            let primitive = &imported.scene.models[0].primitives[0];
            assert_eq!(imported.defects.count(kind), missing, "{:?}", imported.defects);
            assert_eq!(primitive.uvs, vec![vec![[0.0; 2]; 3]; sets]);
        }
    }

    #[test]
    fn what_authors_note_beside_a_material_is_left_alone() {
        let mut gltf = Gltf::triangle();
        let picture = gltf.view(&picture());
        gltf.push("images", json!({"bufferView": picture, "mimeType": "image/png"}));
        gltf.push("textures", json!({}));
        gltf.push("textures", json!({"source": 0}));
        let noted = json!({"badTexture": {"index": 77}, "lightTexture": {"index": 1, "texCoord": 9}});
        let texture = json!({"index": 1, "extras": noted});
        gltf.push("materials", json!({"emissiveTexture": texture, "extras": noted}));
        let gltf = gltf.with("/meshes/0/primitives/0/material", json!(0));
        let imported = gltf.import().unwrap();
        let material = &imported.scene.materials[0].gltf;
        assert_eq!(material["extras"], noted);
        assert_eq!(material["emissiveTexture"], json!({"index": 0, "extras": noted}));
        assert_eq!(imported.scene.models[0].primitives[0].uvs.len(), 1);
        let told: Vec<_> = imported.defects.iter().map(|defect| defect.to_string()).collect();
        assert_eq!(told.len(), 1, "{told:?}");
    }

    #[test]
    fn a_set_beyond_all_takes_no_memory() {
        let mut gltf = Gltf::triangle();
        let picture = gltf.view(&picture());
        gltf.push("images", json!({"bufferView": picture, "mimeType": "image/png"}));
        gltf.push("textures", json!({"source": 0}));
        let texture = json!({"index": 0, "texCoord": 4_000_000_000u32});
        gltf.push("materials", json!({"emissiveTexture": texture}));
        let gltf = gltf.with("/meshes/0/primitives/0/material", json!(0));
        let imported = gltf.import().unwrap();
        assert_eq!(imported.scene.models[0].primitives[0].uvs.len(), 1);
        let kind = "texture coordinate set beyond the eighth: the first taken";
        assert_eq!(imported.defects.count(kind), 1);
    }
}
