//! What is left to say when all nodes were met? What is unused, what the scene is called, and why there may be nothing.

use serde_json::Value;

use super::ImportError;
use super::reader::{NO_BUFFER_FILE, Reader};
use crate::source::{Material, SourceScene};

/// How many defects a refusal lists.
const REASONS: usize = 5;
/// How many extensions are named.
const NAMED: usize = 16;

/// Removes models whose objects were all dropped.
pub(super) fn leave_out_unused_models(scene: &mut SourceScene) {
    let mut new_of_old = vec![None; scene.models.len()];
    for object in &scene.objects {
        new_of_old[object.model] = Some(0);
    }
    for (count, new) in new_of_old.iter_mut().flatten().enumerate() {
        *new = count;
    }
    let mut used = new_of_old.iter().map(Option::is_some);
    scene.models.retain(|_| used.next().unwrap_or(false));
    for object in &mut scene.objects {
        object.model = new_of_old[object.model].unwrap_or(0);
    }
}

/// The name of the scene that is shown.
pub(super) fn title(reader: &Reader) -> Option<String> {
    let scene = reader.root.index("scene").ok().flatten().unwrap_or(0);
    reader.root.listed("scenes", scene).ok()?.name().map(str::to_owned)
}

/// What is read and done with, so that nothing of it is lost; what materials say is kept as it is.
const HANDLED: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Names extensions of the source of which nothing is published.
pub(super) fn name_what_is_not_kept(reader: &mut Reader, scene: &SourceScene) {
    let used = reader.root.elements("extensionsUsed").unwrap_or_default();
    let is_kept = |name: &str| {
        let is_in_materials = name.starts_with("KHR_materials_") && name != "KHR_materials_variants";
        let is_named = |material: &Material| has_member(&material.gltf, name);
        is_in_materials || HANDLED.contains(&name) || scene.materials.iter().any(is_named)
    };
    let names = used.iter().filter_map(|name| name.value.as_str());
    let lost: Vec<&str> = names.filter(|name| !is_kept(name)).collect();
    reader.defects.note("extension not kept", lost.len() as u64, || {
        lost[..lost.len().min(NAMED)].join(", ")
    });
}

/// Whether anything in a document has that name.
fn has_member(value: &Value, name: &str) -> bool {
    match value {
        Value::Object(members) => members
            .iter()
            .any(|(key, member)| key == name || has_member(member, name)),
        Value::Array(items) => items.iter().any(|item| has_member(item, name)),
        _ => false,
    }
}

/// Why there is nothing.
pub(super) fn nothing_to_draw(reader: &Reader, scene: &SourceScene) -> ImportError {
    if let Some(missing) = reader.defects.iter().find(|defect| defect.kind == NO_BUFFER_FILE) {
        return ImportError::MissingFile { file: missing.first };
    }
    let reasons: Vec<String> = reader
        .defects
        .iter()
        .take(REASONS)
        .map(|d| match d.count {
            1 => format!("{} (once, at {})", d.kind, d.first),
            count => format!("{} ({count} times, first at {})", d.kind, d.first),
        })
        .collect();
    let authored = &scene.authored;
    let is_marked = [&authored.cells, &authored.portals, &authored.occluders];
    let reasons = if reasons.is_empty() && is_marked.iter().any(|shapes| !shapes.is_empty()) {
        "all nodes with a mesh are marked as cells, portals or occluders, which are not drawn: add what is to be seen"
            .to_owned()
    } else if reasons.is_empty() {
        "the scene has no node with a mesh".to_owned()
    } else {
        reasons.join("; ")
    };
    ImportError::NothingToDraw { reasons }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use crate::import::testing::Gltf;

    #[test]
    fn a_mesh_without_indices_in_its_list_is_named() {
        let mut gltf = Gltf::triangle();
        gltf.json["accessors"][1]["count"] = json!(0);
        let said = gltf.import().expect_err("nothing is left").to_string();
        let wanted = "primitive without indices in its list: dropped (once, at /meshes/0/primitives/0)";
        assert!(said.contains(wanted), "{said}");
    }

    #[test]
    fn extensions_that_are_not_kept_are_named() {
        let mut gltf = Gltf::triangle();
        gltf.json["extensionsUsed"] = json!([
            "KHR_lights_punctual",
            "KHR_materials_variants",
            "KHR_materials_ior",
            "EXT_x"
        ]);
        let imported = gltf.import().unwrap();
        let told = imported
            .defects
            .iter()
            .find(|defect| defect.kind == "extension not kept");
        let told = told.expect("it is told");
        assert_eq!(told.count, 3);
        assert_eq!(told.first, "KHR_lights_punctual, KHR_materials_variants, EXT_x");
    }
}
