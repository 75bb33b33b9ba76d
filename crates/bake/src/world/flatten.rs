//! Which triangles and points is an object made of, where its scene places it?

use belvedere_scene::Bounds;
use glam::{DMat4, DVec3, Vec3};

use super::triangle::{Triangle, hides};
use crate::source::{Primitive, Role, SourceModel, SourceObject, SourceScene, Topology};

/// At most this many points stand for an object that has no triangles.
const MAX_SAMPLE_POINTS: usize = 256;

/// How triangles of a model come to where an object stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placing {
    world_from_object: DMat4,
    origin: DVec3,
    mirrored: bool,
    /// Sets are computed with all doors open; what a closed one hides is noted with the entries.
    open: bool,
    object: u32,
}

impl Placing {
    pub(super) fn of(object: &SourceObject, number: u32, origin: DVec3) -> Self {
        Self {
            world_from_object: object.world_from_object,
            origin,
            mirrored: object.world_from_object.determinant() < 0.0,
            open: object.role == Role::Door,
            object: number,
        }
    }

    /// A triangle of its model, relative to the origin.
    pub(super) fn place(&self, own: &Triangle) -> Triangle {
        let mut corners = own
            .corners
            .map(|p| (self.world_from_object.transform_point3(p.as_dvec3()) - self.origin).as_vec3());
        if self.mirrored {
            corners.swap(1, 2);
        }
        let placed = Triangle {
            corners,
            object: self.object,
            hides: own.hides,
        };
        if self.open { placed.opened() } else { placed }
    }

    /// The matrix to space relative to the origin.
    pub(super) fn matrix(&self) -> DMat4 {
        DMat4::from_translation(-self.origin) * self.world_from_object
    }

    pub(super) fn object(&self) -> u32 {
        self.object
    }

    pub(super) fn is_open(&self) -> bool {
        self.open
    }
}

/// The triangles of a model, in its own space.
pub(super) fn triangles<'s>(scene: &'s SourceScene, model: &'s SourceModel) -> impl Iterator<Item = Triangle> + 's {
    model.primitives.iter().flat_map(move |primitive| {
        let hides = hides(primitive.material.map(|material| &scene.materials[material]));
        primitive.triangles().map(move |corners| Triangle {
            corners: corners.map(Vec3::from),
            object: 0,
            hides,
        })
    })
}

/// Whether a model is drawn as more than triangles.
pub(super) fn has_lines_or_points(model: &SourceModel) -> bool {
    let mut drawn = model
        .primitives
        .iter()
        .filter(|primitive| !primitive.indices.is_empty());
    drawn.any(|primitive| primitive.topology != Topology::Triangles)
}

/// Indices of a primitive name vertices; vertices that no shape uses do not count.
pub(super) fn used_points(primitive: &Primitive) -> impl Iterator<Item = [f32; 3]> {
    primitive.indices.iter().map(|i| primitive.positions[*i as usize])
}

fn transformed(matrix: &DMat4, point: [f32; 3]) -> DVec3 {
    matrix.transform_point3(Vec3::from(point).as_dvec3())
}

/// The box around an object where its scene places it, empty without geometry.
pub(crate) fn bounds_of(scene: &SourceScene, object: &SourceObject) -> Bounds {
    let points = scene.models[object.model].primitives.iter().flat_map(used_points);
    Bounds::around(points.map(|p| transformed(&object.world_from_object, p).to_array()))
}

/// Points that stand for an object without triangles, relative to the origin.
pub(super) fn sample_points(scene: &SourceScene, object: &SourceObject, origin: DVec3) -> Vec<Vec3> {
    let place = |p: [f32; 3]| (transformed(&object.world_from_object, p) - origin).as_vec3();
    let mut points = Vec::new();
    for primitive in &scene.models[object.model].primitives {
        points.extend(used_points(primitive).map(place));
        if primitive.topology == Topology::Lines {
            let ends = primitive.indices.as_chunks::<2>().0;
            points.extend(ends.iter().map(|ends| {
                let [a, b] = ends.map(|i| place(primitive.positions[i as usize]));
                0.5 * (a + b)
            }));
        }
    }
    let step = points.len().div_ceil(MAX_SAMPLE_POINTS).max(1);
    points.into_iter().step_by(step).collect()
}
