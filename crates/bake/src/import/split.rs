//! Which pieces of a mesh should be objects of their own? Big or sprawling meshes are cut spatially.
//!
//! Visibility and levels of detail are decided for each object, so an object should be of a bounded size and stand in
//! one place. A model is cut when
//!
//! * it has more than [`SplitSettings::max_shapes`] shapes, or
//! * it has more than [`SplitSettings::min_shapes`] and *sprawls*: in its largest instance the diagonal of its box is
//!   longer than [`SplitSettings::sprawl`] of the scene's extent (its size apart from outliers, see `extent`);
//!
//! and so is each of the two halves again. Cuts are k-d cuts (Bentley, *Multidimensional binary search trees used for
//! associative searching*, 1975): at the median of the shapes' centroids, along the longest axis of the box of these
//! centroids, in the world axes of the largest instance. Every triangle, line and point goes whole into exactly one
//! part. Inside a part shapes stay grouped by their source primitive, thus by material, in source order.
//!
//! Every object of a cut model becomes one object for each part, which share the parts' models as they shared the
//! whole. Doors stay whole: they move as one; so does what asks for an impostor, as much as that may be: pictures stand for
//! a thing as a whole. Guarantee: parts hold the same shapes with the same attributes as the
//! whole, and know where they were cut. Cost: O(n log n) in the shapes of cut models; memory for one more copy of them.

use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;

use super::extent::typical_extent_m;
use crate::defect::Defects;
use crate::growable::Tie;
use crate::source::{Role, SourceModel, SourceObject, SourceScene};

/// When to cut.
#[derive(Debug, Clone, PartialEq)]
pub struct SplitSettings {
    /// A model with more shapes than this is cut, however small it stands.
    pub max_shapes: usize,
    /// A model or part with at most this many shapes is not cut, however large it stands: parts keep enough of them for coarser
    /// levels and a smooth LOD to pay, since nothing along a cut can go.
    pub min_shapes: usize,
    /// How long the diagonal of an object may be, as a part of the extent of the scene.
    pub sprawl: f64,
    /// Models that would bring the scene over this many objects stay whole.
    pub max_objects: usize,
}

impl Default for SplitSettings {
    fn default() -> Self {
        Self {
            max_shapes: 4096,
            min_shapes: 1024,
            sprawl: 1.0 / 8.0,
            max_objects: 1_000_000,
        }
    }
}

/// A shape: its primitive, and its number in it.
type Shape = (u32, u32);

/// Cuts the models of a scene that are too big or sprawl; counts those that had to stay whole.
#[must_use]
pub fn split(mut scene: SourceScene, settings: &SplitSettings, defects: &mut Defects) -> SourceScene {
    let largest = largest_instances(&scene);
    let longest_m = settings.sprawl * typical_extent_m(&scene);
    let models = std::mem::take(&mut scene.models);
    let parts_of: Vec<Option<Vec<SourceModel>>> = models
        .par_iter()
        .zip(&largest)
        .map(|(model, world_from_model)| cut(model, (*world_from_model)?, settings, longest_m))
        .collect();
    let mut uses = vec![0usize; models.len()];
    for object in &scene.objects {
        uses[object.model] += 1;
    }
    // Where the parts of each model are in the new list.
    let mut numbers = Vec::with_capacity(models.len());
    let mut object_count = scene.objects.len();
    for (index, (model, parts)) in models.into_iter().zip(parts_of).enumerate() {
        let first = scene.models.len();
        let more = parts.as_ref().map_or(0, |p| uses[index].saturating_mul(p.len() - 1));
        match parts {
            Some(parts) if object_count.saturating_add(more) <= settings.max_objects => {
                object_count += more;
                scene.models.extend(parts);
            }
            Some(_) => {
                defects.note(
                    "mesh that sprawls, with too many instances to cut: left whole",
                    1,
                    || model.name.clone(),
                );
                scene.models.push(model);
            }
            None => scene.models.push(model),
        }
        numbers.push(first..scene.models.len());
    }
    let part = |object: &SourceObject| -> Vec<SourceObject> {
        let parts = numbers[object.model].clone().enumerate();
        parts
            .map(|(part, model)| SourceObject {
                part: part as u32,
                model,
                ..object.clone()
            })
            .collect()
    };
    scene.objects = scene.objects.iter().flat_map(part).collect();
    scene
}

/// The transform of each model's largest instance; `None` for a model that must stay whole or is not used.
fn largest_instances(scene: &SourceScene) -> Vec<Option<DMat4>> {
    let boxes: Vec<[DVec3; 2]> = scene.models.iter().map(model_box).collect();
    let mut found: Vec<Option<(f64, DMat4)>> = vec![None; boxes.len()];
    let mut whole = vec![false; boxes.len()];
    for object in &scene.objects {
        let diagonal = world_diagonal(boxes[object.model], object.world_from_object);
        let slot = &mut found[object.model];
        if slot.is_none_or(|(known, _)| diagonal > known) {
            *slot = Some((diagonal, object.world_from_object));
        }
        whole[object.model] |= object.role == Role::Door;
    }
    let largest = |(found, whole): (Option<(f64, DMat4)>, bool)| found.filter(|_| !whole).map(|(_, m)| m);
    found.into_iter().zip(whole).map(largest).collect()
}

fn model_box(model: &SourceModel) -> [DVec3; 2] {
    let positions = model.primitives.iter().flat_map(|p| &p.positions);
    positions.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
        let p = Vec3::from_array(*p).as_dvec3();
        [low.min(p), high.max(p)]
    })
}

/// The diagonal of a model's box where an object stands.
fn world_diagonal([low, high]: [DVec3; 2], world_from_object: DMat4) -> f64 {
    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
    let corners = (0..8).map(|i| world_from_object.transform_point3(corner(i)));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    (high - low).length()
}

/// Cuts one model; `None` when it can stay whole.
fn cut(
    model: &SourceModel,
    world_from_model: DMat4,
    settings: &SplitSettings,
    longest_m: f64,
) -> Option<Vec<SourceModel>> {
    let count: usize = model.primitives.iter().map(|p| p.count()).sum();
    if count <= settings.min_shapes || model.impostor.is_some() {
        return None;
    }
    let shapes = Shapes::new(model, world_from_model);
    let all: Vec<Shape> = model
        .primitives
        .iter()
        .enumerate()
        .flat_map(|(p, primitive)| (0..primitive.count()).map(move |s| (p as u32, s as u32)))
        .collect();
    let mut parts = Vec::new();
    let mut waiting = vec![all];
    while let Some(part) = waiting.pop() {
        let small = part.len() <= settings.max_shapes && f64::from(shapes.diagonal_m(&part)) <= longest_m;
        match (part.len() > settings.min_shapes && !small)
            .then(|| shapes.halves(&part))
            .flatten()
        {
            Some((lower, upper)) => waiting.extend([upper, lower]),
            None => parts.push(part),
        }
    }
    (parts.len() > 1).then(|| {
        let mut parts: Vec<SourceModel> = parts.into_iter().map(|part| extract(model, part)).collect();
        note_cuts(&mut parts);
        parts
    })
}

/// The shapes of a model, where its largest instance stands.
struct Shapes<'m> {
    model: &'m SourceModel,
    /// Vertices of each primitive in world axes, metres from the first vertex.
    positions: Vec<Vec<Vec3>>,
}

impl<'m> Shapes<'m> {
    fn new(model: &'m SourceModel, world_from_model: DMat4) -> Self {
        let world = |p: &[f32; 3]| world_from_model.transform_point3(Vec3::from_array(*p).as_dvec3());
        let mut vertices = model.primitives.iter().flat_map(|p| &p.positions);
        let origin = vertices.next().map_or(DVec3::ZERO, world);
        let local = |p: &[f32; 3]| (world(p) - origin).as_vec3();
        let positions = model
            .primitives
            .iter()
            .map(|p| p.positions.iter().map(local).collect())
            .collect();
        Self { model, positions }
    }

    fn corners(&self, (primitive, shape): Shape) -> impl ExactSizeIterator<Item = Vec3> {
        let source = &self.model.primitives[primitive as usize];
        let arity = source.topology.arity();
        let indices = &source.indices[shape as usize * arity..][..arity];
        indices
            .iter()
            .map(move |i| self.positions[primitive as usize][*i as usize])
    }

    fn centroid(&self, shape: Shape) -> Vec3 {
        let corners = self.corners(shape);
        let count = corners.len() as f32;
        corners.sum::<Vec3>() / count
    }

    /// The diagonal of the box around some shapes, in metres.
    fn diagonal_m(&self, part: &[Shape]) -> f32 {
        let corners = part.iter().flat_map(|shape| self.corners(*shape));
        let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        (high - low).length()
    }

    /// The two halves of a part, each in source order; `None` when all centroids are in one place.
    fn halves(&self, part: &[Shape]) -> Option<(Vec<Shape>, Vec<Shape>)> {
        let centroids: Vec<Vec3> = part.iter().map(|shape| self.centroid(*shape)).collect();
        let low = centroids.iter().copied().reduce(Vec3::min)?;
        let high = centroids.iter().copied().reduce(Vec3::max)?;
        let size = high - low;
        let axis = (0..3).fold(0, |best, a| if size[a] > size[best] { a } else { best });
        if size[axis] <= 0.0 {
            return None;
        }
        // Equal coordinates are told apart by source order, so that the cut is the same in every run.
        let mut order: Vec<(f32, u32)> = centroids.iter().zip(0..).map(|(c, i)| (c[axis], i)).collect();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let half = |order: &mut [(f32, u32)]| -> Vec<Shape> {
            order.sort_unstable_by_key(|(_, i)| *i);
            order.iter().map(|(_, i)| part[*i as usize]).collect()
        };
        let (lower, upper) = order.split_at_mut(middle);
        Some((half(lower), half(upper)))
    }
}

/// Notes in each part the positions that other parts have too.
fn note_cuts(parts: &mut [SourceModel]) {
    let mut places: Vec<([u32; 3], u32)> = Vec::new();
    for (part, number) in parts.iter().zip(0..) {
        let positions = part.primitives.iter().flat_map(|p| &p.positions);
        // −0 is 0.
        places.extend(positions.map(|p| (p.map(|x| (x + 0.0).to_bits()), number)));
    }
    places.par_sort_unstable();
    places.dedup();
    for here in places.chunk_by(|a, b| a.0 == b.0).filter(|here| here.len() > 1) {
        for &(bits, part) in here {
            parts[part as usize].cut_positions.push(bits.map(f32::from_bits));
        }
    }
}

/// The model of a part. Its shapes are in source order.
fn extract(model: &SourceModel, part: Vec<Shape>) -> SourceModel {
    let by_primitive = part.chunk_by(|a, b| a.0 == b.0);
    let primitives = by_primitive.map(|shapes| {
        let source = &model.primitives[shapes[0].0 as usize];
        let arity = source.topology.arity();
        let indices = shapes
            .iter()
            .flat_map(|(_, s)| &source.indices[*s as usize * arity..][..arity]);
        source.subset(indices.copied().collect())
    });
    SourceModel {
        name: model.name.clone(),
        primitives: primitives.collect(),
        tie: model.tie.or(model.recipe.as_ref().map(|_| Tie::Cut)),
        ..SourceModel::default()
    }
}

#[cfg(test)]
mod tests {
    use belvedere_scene::impostor::Wish;

    use super::*;
    use crate::source::{Primitive, Topology};

    /// A flat strip of `count` separate triangles along x, one metre apart.
    fn row(count: usize, material: Option<usize>) -> Primitive {
        let corner = |i: usize| {
            let (triangle, corner) = (i / 3, i % 3);
            [triangle as f32 + [0.0, 0.5, 0.0][corner], [0.0, 0.0, 0.5][corner], 0.0]
        };
        Primitive {
            material,
            positions: (0..3 * count).map(corner).collect(),
            uvs: vec![(0..3 * count).map(|i| [i as f32, 0.0]).collect()],
            indices: (0..3 * count as u32).collect(),
            ..Primitive::default()
        }
    }

    fn scene(primitives: Vec<Primitive>, places: &[(f64, Role)]) -> SourceScene {
        let object = |(x, role): &(f64, Role)| SourceObject {
            source_node: "node".into(),
            part: 0,
            model: 0,
            world_from_object: DMat4::from_translation(DVec3::new(*x, 0.0, 0.0)),
            role: *role,
        };
        SourceScene {
            models: vec![SourceModel {
                name: "mesh".into(),
                primitives,
                ..SourceModel::default()
            }],
            objects: places.iter().map(object).collect(),
            ..SourceScene::default()
        }
    }

    /// All corners with their attributes, sorted: what is drawn, whatever the grouping.
    fn drawn(scene: &SourceScene) -> Vec<(Option<usize>, String)> {
        let mut all = Vec::new();
        for object in &scene.objects {
            for p in &scene.models[object.model].primitives {
                for shape in p.indices.chunks(p.topology.arity()) {
                    let world = |i: &u32| {
                        let position = Vec3::from_array(p.positions[*i as usize]).as_dvec3();
                        let uv = p.uvs.first().map(|set| set[*i as usize]);
                        (object.world_from_object.transform_point3(position), uv)
                    };
                    all.push((p.material, format!("{:?}", shape.iter().map(world).collect::<Vec<_>>())));
                }
            }
        }
        all.sort();
        all
    }

    #[test]
    fn a_small_mesh_stays_whole_and_keeps_part_zero() {
        let whole = scene(vec![row(1024, None)], &[(0.0, Role::Ordinary)]);
        let after = split(whole.clone(), &SplitSettings::default(), &mut Defects::default());
        assert_eq!((after.objects.len(), after.objects[0].part), (1, 0));
        assert_eq!(drawn(&after), drawn(&whole));
    }

    #[test]
    fn a_sprawling_mesh_is_cut_into_parts_that_draw_the_same() {
        let points = Primitive {
            topology: Topology::Points,
            ..row(200, Some(3))
        };
        let whole = scene(
            vec![row(4000, Some(1)), row(4000, Some(2)), points],
            &[(5.0, Role::Ordinary)],
        );
        let after = split(whole.clone(), &SplitSettings::default(), &mut Defects::default());
        assert_eq!(drawn(&after), drawn(&whole));
        assert!(after.objects.len() > 8, "{} parts", after.objects.len());
        let numbers: Vec<u32> = after.objects.iter().map(|o| o.part).collect();
        assert_eq!(numbers, (0..after.objects.len() as u32).collect::<Vec<_>>());
        for model in &after.models {
            let xs = || model.primitives.iter().flat_map(|p| &p.positions).map(|p| p[0]);
            let length = xs().fold(0.0f32, f32::max) - xs().fold(f32::MAX, f32::min);
            assert!(length < 510.0 || model.primitives.iter().map(Primitive::count).sum::<usize>() <= 1024);
            assert!(model.primitives.iter().all(|p| p.uvs[0].len() == p.positions.len()));
        }
    }

    #[test]
    fn a_compact_mesh_is_cut_only_by_its_number_of_shapes() {
        let mut compact = scene(vec![row(1500, None)], &[(0.0, Role::Ordinary)]);
        compact.models.push(SourceModel {
            name: "far".into(),
            primitives: vec![row(1, None)],
            ..SourceModel::default()
        });
        for x in 0..200 {
            compact.objects.push(SourceObject {
                model: 1,
                world_from_object: DMat4::from_translation(DVec3::new(1e5 * f64::from(x), 0.0, 0.0)),
                ..compact.objects[0].clone()
            });
        }
        let count = |max_shapes| {
            let settings = SplitSettings {
                max_shapes,
                ..SplitSettings::default()
            };
            split(compact.clone(), &settings, &mut Defects::default()).objects.len()
        };
        assert_eq!(count(4096), 201);
        assert_eq!(count(1200), 202);
    }

    #[test]
    fn instances_share_the_parts_and_doors_stay_whole() {
        let places = [(0.0, Role::Ordinary), (5000.0, Role::Ordinary)];
        let settings = SplitSettings {
            max_shapes: 1200,
            ..SplitSettings::default()
        };
        let whole = scene(vec![row(1500, None)], &places);
        let after = split(whole.clone(), &settings, &mut Defects::default());
        assert_eq!((after.models.len(), after.objects.len()), (2, 4));
        assert_eq!(drawn(&after), drawn(&whole));
        let door = scene(vec![row(5000, None)], &[(0.0, Role::Door)]);
        assert_eq!(split(door, &settings, &mut Defects::default()).objects.len(), 1);
    }

    #[test]
    fn the_parts_are_the_same_for_any_number_of_threads() {
        let whole = scene(vec![row(3000, None), row(500, Some(1))], &[(0.0, Role::Ordinary)]);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let split = || split(whole.clone(), &SplitSettings::default(), &mut Defects::default());
            format!("{:?}", pool.install(split))
        };
        assert_eq!(with(1), with(4));
    }

    #[test]
    fn shapes_in_one_place_end_the_cutting() {
        let mut pile = row(1, None);
        pile.indices = [0, 1, 2].repeat(10_000);
        let after = split(
            scene(vec![pile], &[(0.0, Role::Ordinary)]),
            &SplitSettings::default(),
            &mut Defects::default(),
        );
        assert_eq!(after.objects.len(), 1);
    }

    #[test]
    fn what_pictures_stand_for_stays_whole() {
        let mut asks = scene(vec![row(70_000, None)], &[(0.0, Role::Ordinary)]);
        let objects = |scene: &SourceScene| {
            split(scene.clone(), &SplitSettings::default(), &mut Defects::default())
                .objects
                .len()
        };
        assert!(objects(&asks) > 1);
        asks.models[0].impostor = Some(Wish::DEFAULT);
        assert_eq!(objects(&asks), 1);
    }

    #[test]
    fn too_many_instances_leave_a_mesh_whole_and_counted() {
        let whole = scene(vec![row(4000, None)], &[(0.0, Role::Ordinary)]);
        let settings = SplitSettings {
            max_objects: 2,
            ..SplitSettings::default()
        };
        let mut defects = Defects::default();
        assert_eq!(split(whole, &settings, &mut defects).objects.len(), 1);
        assert_eq!(defects.iter().count(), 1);
    }
}
