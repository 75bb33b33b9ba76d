//! Which models are too large for pictures that stand for a whole?
//!
//! What asks for an impostor stays one object, which is seen and fetched as one. Of a landscape or a town that would be
//! neither seen in parts nor ever hidden; and were it cut, each piece would have pictures of its own, which nobody asked for.
//! So the wish of such a model is dropped, and told.

use crate::defect::Defects;
use crate::source::{Primitive, SourceScene};

/// Most shapes of a model that stays one object for its pictures.
pub(super) const MOST_PICTURED: usize = 1 << 20;
const TOO_LARGE: &str = "`impostor` of a model of more than 1048576 triangles: no pictures, and cut into several objects; let \
    parts that it is made of ask for them";

/// Drops the wishes of models that are too large for pictures.
pub(super) fn drop_wishes(scene: &mut SourceScene, defects: &mut Defects) {
    for model in scene.models.iter_mut().filter(|model| model.impostor.is_some()) {
        if is_too_large(&model.primitives) {
            model.impostor = None;
            defects.note(TOO_LARGE, 1, || model.name.clone());
        }
    }
}

/// Whether that is too much for pictures.
pub(super) fn is_too_large(primitives: &[Primitive]) -> bool {
    shapes(primitives) > MOST_PICTURED
}

/// How many triangles, lines and points there are.
pub(super) fn shapes(primitives: &[Primitive]) -> usize {
    primitives.iter().map(Primitive::count).sum()
}

#[cfg(test)]
mod tests {
    use belvedere_scene::impostor::Wish;

    use super::*;
    use crate::source::SourceModel;

    #[test]
    fn what_is_too_large_gets_no_pictures_and_is_named() {
        let of = |triangles: usize| SourceModel {
            name: format!("of {triangles}"),
            primitives: vec![Primitive {
                indices: vec![0; 3 * triangles],
                ..Primitive::default()
            }],
            impostor: Some(Wish::DEFAULT),
            ..SourceModel::default()
        };
        let mut scene = SourceScene {
            models: vec![of(MOST_PICTURED), of(MOST_PICTURED + 1)],
            ..SourceScene::default()
        };
        let mut defects = Defects::default();
        drop_wishes(&mut scene, &mut defects);
        let asks: Vec<bool> = scene.models.iter().map(|model| model.impostor.is_some()).collect();
        assert_eq!(asks, [true, false]);
        let told: Vec<_> = defects.iter().map(|defect| defect.first).collect();
        assert_eq!(told, ["of 1048577"]);
    }
}
