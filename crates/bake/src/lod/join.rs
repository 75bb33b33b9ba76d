//! Which objects of a scene are fragments of one thing?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.4: converters write one thing as many small pieces in a row.
//! Simplified one by one they come apart, and none of them has enough triangles for a level. So pieces that follow each
//! other are joined where the scene allows it: they stand in one place with one transform, nobody else uses their
//! models, and none of them is a door. The pieces of one model need not be joined: levels are made of a model as a whole.

use crate::source::{Role, SourceObject, SourceScene};

/// Joins fragments that follow each other; the first one's name stays. Gives how many objects were joined to another.
pub fn join(scene: &mut SourceScene) -> usize {
    let mut uses = vec![0usize; scene.models.len()];
    for object in &scene.objects {
        uses[object.model] += 1;
    }
    let is_fragment = |object: &SourceObject| object.role == Role::Ordinary && uses[object.model] == 1;
    let before = scene.objects.len();
    let mut joined: Vec<SourceObject> = Vec::with_capacity(before);
    for object in std::mem::take(&mut scene.objects) {
        let whole = joined.last().filter(|last| {
            is_fragment(last) && is_fragment(&object) && last.world_from_object == object.world_from_object
        });
        if let Some(whole) = whole {
            let fragment = std::mem::take(&mut scene.models[object.model]);
            scene.models[whole.model].primitives.extend(fragment.primitives);
        } else {
            joined.push(object);
        }
    }
    let mut kept = vec![None; scene.models.len()];
    let mut models = Vec::new();
    for object in &mut joined {
        object.model = *kept[object.model].get_or_insert_with(|| {
            models.push(std::mem::take(&mut scene.models[object.model]));
            models.len() - 1
        });
    }
    scene.models = models;
    scene.objects = joined;
    before - scene.objects.len()
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DVec3};

    use super::*;
    use crate::source::{Primitive, SourceModel};

    #[test]
    fn fragments_in_a_row_become_one_and_nothing_else_does() {
        let triangle = Primitive {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        let object = |(model, x, role): (usize, f64, Role)| SourceObject {
            source_node: format!("node {model}"),
            part: 0,
            model,
            world_from_object: DMat4::from_translation(DVec3::new(x, 0.0, 0.0)),
            role,
        };
        let here = Role::Ordinary;
        let row = [
            (0, 0.0, here),
            (1, 0.0, here),
            (2, 0.0, here),
            (3, 1.0, here),
            (4, 1.0, Role::Door),
            (5, 1.0, here),
            (5, 1.0, here),
        ];
        let model = SourceModel {
            primitives: vec![triangle],
            ..SourceModel::default()
        };
        let mut scene = SourceScene {
            models: vec![model; 6],
            objects: row.map(object).to_vec(),
            ..SourceScene::default()
        };
        assert_eq!(join(&mut scene), 2);
        let triangles: Vec<usize> = scene
            .objects
            .iter()
            .map(|o| scene.models[o.model].triangle_count())
            .collect();
        assert_eq!(triangles, [3, 1, 1, 1, 1]);
        assert_eq!(scene.models.len(), 4);
        assert_eq!(scene.objects[3].model, scene.objects[4].model);
    }
}
