//! Which objects can be grown from their parameters alone, and where do they stand?

use std::collections::BTreeMap;

use belvedere_scene::{
    ModelId, ObjectId,
    object::{Model, ObjectEntry},
    population::{Member, POPULATION_OBJECTS, Population, Recipe, Rules},
};
use glam::DMat4;

use super::{
    pages::{self, Tree},
    sink::{Ledger, SinkError},
};

/// The extension of a population.
pub(super) const POP: &str = "pop";
/// A transform that is a move, a turn and a scale up to this share of its scale is one.
const ROUND: f64 = 1e-9;

/// The index of populations, when any object can be grown.
pub(super) fn write(entries: &[ObjectEntry], models: &[Model], ledger: &Ledger<'_>) -> Result<Option<Tree>, SinkError> {
    if models.iter().all(|model| model.procedural.is_none()) {
        return Ok(None);
    }
    let put = |row: &[ObjectEntry]| {
        let first = row.first().map_or(ObjectId(0), |entry| entry.object);
        ledger.put(POP, of(row, models).encode(first))
    };
    pages::write_tree(entries, POPULATION_OBJECTS, |entry| entry.bounds, put, ledger).map(Some)
}

/// Whether a population holds an object.
pub(super) fn is_member(entry: &ObjectEntry, model: &Model) -> bool {
    model.procedural.is_some() && placed(entry).is_some()
}

fn of(row: &[ObjectEntry], models: &[Model]) -> Population {
    let mut population = Population::default();
    let mut rules: BTreeMap<Rules, usize> = BTreeMap::new();
    let mut recipes: BTreeMap<ModelId, usize> = BTreeMap::new();
    for entry in row {
        let model = &models[entry.model.index()];
        let (Some(procedural), Some(placed)) = (&model.procedural, placed(entry)) else {
            continue;
        };
        let recipe = *recipes.entry(entry.model).or_insert_with(|| {
            let rules = *rules.entry(procedural.files()).or_insert_with_key(|files| {
                population.rules.push(files.clone());
                population.rules.len() - 1
            });
            population.recipes.push(Recipe {
                rules,
                part: procedural.part.clone(),
                parameters: procedural.parameters.clone(),
                seed: procedural.seed,
                model: entry.model,
                triangles: model.levels[0].triangles,
            });
            population.recipes.len() - 1
        });
        population.members.push(Member { recipe, ..placed });
    }
    population
}

/// Where an object stands, when a move, a turn and a scale say all of it.
fn placed(entry: &ObjectEntry) -> Option<Member> {
    let transform = DMat4::from_cols_array(&entry.transform);
    let (scale, rotation, position) = transform.to_scale_rotation_translation();
    let member = Member {
        object: entry.object,
        recipe: 0,
        position: position.to_array(),
        rotation: rotation.normalize().to_array(),
        scale: scale.x,
    };
    let again = DMat4::from_cols_array(&member.transform());
    let is_same = scale.x > 0.0 && transform.abs_diff_eq(again, ROUND * (scale.x + position.abs().max_element()));
    is_same.then_some(member)
}

#[cfg(test)]
mod tests {
    use belvedere_scene::Bounds;
    use glam::{DQuat, DVec3};

    use super::*;

    fn entry(transform: DMat4) -> ObjectEntry {
        ObjectEntry {
            object: ObjectId(4),
            source_node: String::new(),
            part: 0,
            bounds: Bounds::EMPTY,
            transform: transform.to_cols_array(),
            scale: 1.0,
            model: ModelId(0),
            mover: false,
            door: false,
        }
    }

    #[test]
    fn moves_turns_and_even_scales_are_placed_and_nothing_else() {
        let turn = DQuat::from_euler(glam::EulerRot::YXZ, 2.5, 0.3, -1.0);
        let at = DVec3::new(700.0, -3.0, 1e5);
        let placed_by = |scale: DVec3| placed(&entry(DMat4::from_scale_rotation_translation(scale, turn, at)));
        let member = placed_by(DVec3::splat(2.0)).expect("it is a move, a turn and a scale");
        assert!((member.scale - 2.0).abs() < 1e-12);
        assert_eq!(member.position, at.to_array());
        assert_eq!(placed_by(DVec3::new(2.0, 2.0, 2.1)), None);
        assert_eq!(placed_by(DVec3::splat(-1.0)), None);
        let sheared = DMat4::from_cols_array(&[1., 0., 0., 0., 0.5, 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
        assert_eq!(placed(&entry(sheared)), None);
    }
}
