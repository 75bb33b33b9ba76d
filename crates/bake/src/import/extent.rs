//! How large is a scene, apart from its outliers? A sky dome or a ground plane of a few triangles is much larger than
//! what people look at.
//!
//! The extent is the diagonal of the box between the 5 % and 95 % quantiles of the shapes' centroids on each axis,
//! widened to what an even spread would have in full. It is taken from samples: each object gives a few shapes at even
//! distances in source order, weighted by how many they stand for. Deterministic; cost O(s log s) in the samples.

use glam::{DVec3, Vec3};

use crate::source::{SourceModel, SourceScene};

/// Shapes that the whole scene is sampled at, at most (or one for each object).
const SAMPLES: usize = 1 << 19;
/// Shapes that one object is sampled at, at most.
const SAMPLES_PER_OBJECT: usize = 4096;
/// Shapes that count as outliers at each end of each axis.
const OUTLIERS: f64 = 0.05;

/// The extent of a scene in metres; zero for a scene of one shape or none.
pub(super) fn typical_extent_m(scene: &SourceScene) -> f64 {
    let per_object = (SAMPLES / scene.objects.len().max(1)).clamp(1, SAMPLES_PER_OBJECT);
    let mut samples: Vec<(DVec3, f64)> = Vec::new();
    for object in &scene.objects {
        let world =
            |(centroid, weight): (Vec3, f64)| (object.world_from_object.transform_point3(centroid.as_dvec3()), weight);
        samples.extend(sampled(&scene.models[object.model], per_object).map(world));
    }
    let size = DVec3::from_array(std::array::from_fn(|axis| spread(&mut samples, axis)));
    size.length() / (1.0 - 2.0 * OUTLIERS)
}

/// The distance between the outer quantiles on one axis.
fn spread(samples: &mut [(DVec3, f64)], axis: usize) -> f64 {
    samples.sort_unstable_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
    let all: f64 = samples.iter().map(|(_, weight)| weight).sum();
    let quantile = |part: f64| {
        let mut below = 0.0;
        let reached = |(_, weight): &&(DVec3, f64)| {
            below += weight;
            below >= part * all
        };
        samples.iter().find(reached).map_or(0.0, |(p, _)| p[axis])
    };
    quantile(1.0 - OUTLIERS) - quantile(OUTLIERS)
}

/// Centroids of some shapes of a model, with how many shapes each stands for.
fn sampled(model: &SourceModel, at_most: usize) -> impl Iterator<Item = (Vec3, f64)> {
    let shapes: usize = model.primitives.iter().map(|p| p.count()).sum();
    let every = shapes.div_ceil(at_most).max(1);
    let centroid = |indices: &[u32], positions: &[[f32; 3]]| {
        let sum: Vec3 = indices.iter().map(|i| Vec3::from_array(positions[*i as usize])).sum();
        sum / indices.len() as f32
    };
    model.primitives.iter().flat_map(move |p| {
        let arity = p.topology.arity();
        let taken = p.indices.chunks_exact(arity).step_by(every).enumerate();
        taken.map(move |(i, indices)| {
            let stands_for = every.min(p.count() - i * every);
            (centroid(indices, &p.positions), stands_for as f64)
        })
    })
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::source::{Primitive, Role, SourceObject, Topology};

    #[test]
    fn a_few_far_shapes_do_not_count() {
        let points = |positions: Vec<[f32; 3]>| SourceModel {
            name: "points".into(),
            primitives: vec![Primitive {
                topology: Topology::Points,
                indices: (0..positions.len() as u32).collect(),
                positions,
                ..Primitive::default()
            }],
            ..SourceModel::default()
        };
        let row = (0..10_001).map(|i| [i as f32 * 0.001, 0.0, 0.0]).collect();
        let far = vec![[0.0, 0.0, 0.0], [0.0, 1e6, 0.0]];
        let object = |model| SourceObject {
            source_node: String::new(),
            part: 0,
            model,
            world_from_object: DMat4::from_scale(DVec3::splat(2.0)),
            role: Role::Ordinary,
        };
        let scene = SourceScene {
            models: vec![points(row), points(far)],
            objects: vec![object(0), object(1)],
            ..SourceScene::default()
        };
        let extent = typical_extent_m(&scene);
        assert!((extent - 20.0).abs() < 0.1, "{extent}");
        assert_eq!(typical_extent_m(&SourceScene::default()), 0.0);
    }
}
