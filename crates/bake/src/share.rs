//! Which models are the same but for where they stand?
//!
//! Authoring tools often write a copy of a chair for each place where it stands, with the place worked into its vertices.
//! Such models become one, and their objects move by what was worked in, so that everything after is made, stored and
//! fetched once. Models are the same when all but their positions agree, and these do after a translation, within what
//! single precision has lost: [`ROUNDINGS`] of their largest coordinate, and never more than [`LEAST_DETAIL`] of their size.

use std::collections::BTreeMap;

use glam::{DMat4, DVec3};

use crate::{
    digest::{Digest, Digester},
    import::impostor,
    source::{Primitive, SourceModel, SourceScene},
};

/// Positions agree that are no further apart than so many roundings of the largest coordinate …
const ROUNDINGS: f32 = 2.0;
/// … and than this share of the largest edge of the model's box: what is further from zero than that has lost its shape.
const LEAST_DETAIL: f32 = 1e-3;
/// Normals and tangents agree that differ by no more than this in any coordinate.
const DIRECTIONS: f32 = 1e-4;

/// Lets objects with the same geometry share one model.
#[must_use]
pub(crate) fn share(mut scene: SourceScene) -> SourceScene {
    share_materials(&mut scene);
    let mut alike: BTreeMap<(Digest, i32), Vec<usize>> = BTreeMap::new();
    let mut kept: Vec<SourceModel> = Vec::with_capacity(scene.models.len());
    let places: Vec<(usize, DVec3)> = std::mem::take(&mut scene.models)
        .into_iter()
        .map(|model| {
            let (digest, size) = (digest_of(&model), size_class(&model));
            let near = [size - 1, size, size + 1].into_iter();
            let mut candidates = near.filter_map(|size| alike.get(&(digest, size))).flatten();
            let found = candidates.find_map(|number| Some((*number, translation(&kept[*number], &model)?)));
            if let Some((number, _)) = found {
                kept[number].impostor = impostor::joined(kept[number].impostor, model.impostor);
            }
            found.unwrap_or_else(|| {
                alike.entry((digest, size)).or_default().push(kept.len());
                kept.push(model);
                (kept.len() - 1, DVec3::ZERO)
            })
        })
        .collect();
    scene.models = kept;
    for object in &mut scene.objects {
        let (model, moved) = places[object.model];
        object.model = model;
        if moved != DVec3::ZERO {
            object.world_from_object *= DMat4::from_translation(moved);
        }
    }
    scene
}

/// Lets primitives with the same material use one number for it.
fn share_materials(scene: &mut SourceScene) {
    let mut known: BTreeMap<(String, bool, bool), usize> = BTreeMap::new();
    let numbered = scene.materials.iter().enumerate();
    let first = numbered.map(|(number, material)| {
        let key = (material.gltf.to_string(), material.see_through, material.double_sided);
        *known.entry(key).or_insert(number)
    });
    let first: Vec<usize> = first.collect();
    for primitive in scene.models.iter_mut().flat_map(SourceModel::all_primitives_mut) {
        primitive.material = primitive.material.map(|material| first[material]);
    }
}

/// Models that are the same have sizes in the same class or in the next: one is a hundredth of the size wide.
fn size_class(model: &SourceModel) -> i32 {
    (largest_edge(model).clamp(f32::MIN_POSITIVE, f32::MAX).ln() * 100.0).floor() as i32
}

/// A digest of all that must agree to the bit.
fn digest_of(model: &SourceModel) -> Digest {
    let mut digester = Digester::default();
    digester.count(model.primitives.len()).count(model.cut_positions.len());
    for primitive in &model.primitives {
        digester
            .count(primitive.topology.arity())
            .count(primitive.material.map_or(0, |material| material + 1));
        for count in [
            primitive.positions.len(),
            primitive.normals.len(),
            primitive.tangents.len(),
            primitive.colors.len(),
            primitive.uvs.len(),
            primitive.indices.len(),
        ] {
            digester.count(count);
        }
        primitive.indices.iter().for_each(|i| _ = digester.count(*i as usize));
        primitive.colors.iter().for_each(|color| _ = digester.floats(color));
        for uvs in &primitive.uvs {
            digester.count(uvs.len());
            uvs.iter().for_each(|uv| _ = digester.floats(uv));
        }
    }
    digester.finish()
}

/// How the first of two models with one digest has to be moved to be the second.
fn translation(first: &SourceModel, second: &SourceModel) -> Option<DVec3> {
    // Cuts lie where they lie, equal rules share a model already, and what rests alike may move unlike.
    let is_own = |model: &SourceModel| model.recipe.is_some() || model.pose_count() > 1;
    if !first.cut_positions.is_empty() || is_own(first) || is_own(second) {
        return None;
    }
    let pairs = || first.primitives.iter().zip(&second.primitives);
    let start = |model: &SourceModel| model.primitives.iter().find_map(|p| p.positions.first().copied());
    let moved = DVec3::from(start(second)?.map(f64::from)) - DVec3::from(start(first)?.map(f64::from));
    let largest = |primitive: &Primitive| {
        primitive
            .positions
            .iter()
            .flatten()
            .fold(0.0, |m: f32, x| m.max(x.abs()))
    };
    let reach = pairs().map(|(a, b)| largest(a).max(largest(b))).fold(0.0, f32::max);
    let most = f64::from((ROUNDINGS * f32::EPSILON * reach).min(LEAST_DETAIL * largest_edge(first)));
    let agree = |(a, b): (&Primitive, &Primitive)| {
        let places = a.positions.iter().zip(&b.positions);
        let near = |(a, b): (&[f32; 3], &[f32; 3])| {
            (0..3).all(|i| (f64::from(a[i]) + moved[i] - f64::from(b[i])).abs() <= most)
        };
        places.into_iter().all(near) && parallel(&a.normals, &b.normals) && parallel(&a.tangents, &b.tangents)
    };
    pairs().all(agree).then_some(moved)
}

fn largest_edge(model: &SourceModel) -> f32 {
    let positions = || model.primitives.iter().flat_map(|p| &p.positions);
    let edge = |axis: usize| {
        let ordinates = positions().map(|p| p[axis]);
        let [low, high] = ordinates.fold([f32::INFINITY, f32::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
        high - low
    };
    [0, 1, 2].map(edge).into_iter().fold(0.0, f32::max)
}

fn parallel<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> bool {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.into_iter().all(|(a, b)| (a - b).abs() <= DIRECTIONS)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::source::{Material, Role, SourceObject};

    fn scene(models: Vec<SourceModel>) -> SourceScene {
        let objects = (0..models.len()).map(|model| SourceObject {
            source_node: format!("chair {model}"),
            part: 0,
            model,
            world_from_object: DMat4::from_scale(DVec3::splat(2.0)),
            role: Role::Ordinary,
        });
        let material = || Material {
            gltf: json!({"pbrMetallicRoughness": {"roughnessFactor": 0.5}}),
            see_through: false,
            double_sided: false,
        };
        SourceScene {
            objects: objects.collect(),
            models,
            materials: vec![material(), material()],
            ..SourceScene::default()
        }
    }

    fn chair(material: usize, at: [f32; 3], seat: f32) -> SourceModel {
        let corners = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.1], [0.4, seat, 0.3], [0.0, 0.9, 0.2]];
        SourceModel {
            primitives: vec![Primitive {
                material: Some(material),
                positions: corners.map(|p| [0, 1, 2].map(|i| p[i] + at[i])).to_vec(),
                indices: vec![0, 1, 2, 0, 2, 3],
                ..Primitive::default()
            }],
            ..SourceModel::default()
        }
    }

    #[test]
    fn copies_with_their_places_worked_in_become_one_model_and_stand_where_they_stood() {
        let before = scene(vec![
            chair(0, [0.0; 3], 0.45),
            chair(1, [731.3, 0.2, -18.7], 0.45),
            chair(0, [3.0, 0.0, 0.0], 0.46),
        ]);
        let after = share(before.clone());
        assert_eq!(after.models.len(), 2);
        assert_eq!(after.objects.iter().map(|o| o.model).collect::<Vec<_>>(), [0, 0, 1]);
        for (before_object, object) in before.objects.iter().zip(&after.objects) {
            let places = |scene: &SourceScene, object: &SourceObject| -> Vec<DVec3> {
                let positions = &scene.models[object.model].primitives[0].positions;
                let place = |p: &[f32; 3]| object.world_from_object.transform_point3(DVec3::from(p.map(f64::from)));
                positions.iter().map(place).collect()
            };
            for (was, is) in places(&before, before_object).iter().zip(places(&after, object)) {
                assert!(was.distance(is) < 1e-3, "{was} {is}");
            }
        }
    }

    /// Their box is longer than a number of 32 bits can be, and what is a metre further is within its roundings.
    #[test]
    fn models_without_measure_have_a_size_too() {
        let vast = |z: f32| {
            let mut chair = chair(0, [0.0; 3], 0.45);
            chair.primitives[0].positions[0] = [f32::MAX, 0.0, z];
            chair.primitives[0].positions[1] = [f32::MIN, 0.0, z];
            chair
        };
        assert_eq!(share(scene(vec![vast(0.0), vast(0.0), vast(1.0)])).models.len(), 1);
    }

    #[test]
    fn what_differs_in_anything_stays_apart() {
        let mut other = chair(0, [1.0, 0.0, 0.0], 0.45);
        other.primitives[0].indices = vec![0, 2, 1, 0, 2, 3];
        let mut tinted = chair(0, [1.0, 0.0, 0.0], 0.45);
        tinted.primitives[0].colors = vec![[1.0; 4]; 4];
        let mut cut = chair(0, [0.0; 3], 0.45);
        cut.cut_positions = vec![[0.0; 3]];
        let models = vec![chair(0, [0.0; 3], 0.45), other, tinted, cut.clone(), cut];
        assert_eq!(share(scene(models)).models.len(), 5);
    }
}
