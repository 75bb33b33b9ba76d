//! What is left to say when all nodes were met? What is unused, what the scene is called, and why there may be nothing.

use super::ImportError;
use super::reader::Reader;
use crate::source::SourceScene;

/// How many defects a refusal lists.
const REASONS: usize = 5;

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

/// Why there is nothing.
pub(super) fn nothing_to_draw(reader: &Reader, scene: &SourceScene) -> ImportError {
    let reasons: Vec<String> = reader
        .defects
        .iter()
        .take(REASONS)
        .map(|d| format!("{} ({} times, first at {})", d.kind, d.count, d.first))
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
