//! How does the author of a part want it to look from afar? As it grows with less `detail`: by fewer levels of recursion, fewer
//! and larger leaves (Schmalstieg 1997, §8.4: levels of detail by the depth of the recursion).

use belvedere_scene::procedural::{Part, Recipe};

use super::alone::Alone;
use crate::defect::Defects;
use crate::source::{Primitive, SourceScene};

/// What a part looks like with ever less detail, as long as that takes fewer triangles; nothing for one that cannot be grown
/// alone.
pub(super) fn coarser(
    (part, recipe): (&Part, Option<&Recipe>),
    alone: &mut Alone<'_>,
    scene: &mut SourceScene,
    defects: &mut Defects,
) -> Vec<Vec<Primitive>> {
    let Some(recipe) = recipe else {
        return Vec::new();
    };
    let mut least = part.meshes.iter().map(|mesh| mesh.indices.len()).sum::<usize>();
    let mut coarser = Vec::new();
    for detail in (0..alone.settings.detail).rev() {
        let Ok(primitives) = alone.coarser(recipe, detail, scene) else {
            let kind = "part that grows with all its `detail` and not with less: levels made of the former";
            defects.note(kind, 1, || format!("{}, detail {detail}", part.name));
            continue;
        };
        let indices = primitives
            .iter()
            .map(|primitive| primitive.indices.len())
            .sum::<usize>();
        if (1..least).contains(&indices) {
            least = indices;
            coarser.push(primitives);
        }
    }
    coarser
}
