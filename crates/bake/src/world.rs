//! What does a sight line meet?
//!
//! The scene flattened for geometry queries: all triangles in world space (of the frame that it was turned into,
//! [`crate::frame`]) as `f32` relative to an `f64` origin near the
//! middle of the scene, so that a world at 10⁷ m keeps its millimetres. Positions given to and taken from [`World`] as
//! [`Vec3`] are relative to [`World::origin`], in metres.
//!
//! What hides: a face hides what is behind it unless its material lets light through, or it is seen from the back and
//! a renderer would cull that back. A ray *sees* every object up to and including its first hiding hit. Objects of
//! faces that hide nothing count as seen too, so the answer is a superset for every renderer.
//!
//! Cost: one traversal of a bounding volume hierarchy (crate `obvhs`) for each ray; about 200 bytes per triangle.

use std::{ops::Range, time::Duration};

use belvedere_scene::Bounds;
use glam::{DMat4, DVec3, Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

use crate::{
    digest::{Digest, Digester},
    source::{Material, Primitive, Role, SourceObject, SourceScene, Topology},
};

mod cast;
#[cfg(test)]
mod tests;

use cast::Facet;
pub use cast::Hit;

/// The largest number of triangles, all instances counted: at about 200 bytes each, what a large machine holds.
pub const MAX_TRIANGLES: usize = 64 << 20;
/// The largest distance of a vertex from the middle of the scene. Beyond it `f32` could not tell walls apart.
pub const MAX_REACH_M: f64 = 1e9;
/// At most this many points stand for an object that has no triangles.
const MAX_SAMPLE_POINTS: usize = 256;
/// Faces are this share of their size larger than they are, so that no ray slips through a shared edge.
const SEAM: f32 = 1e-6;

const FRONT_HIDES: u8 = 1;
const BACK_HIDES: u8 = 2;

/// Why a scene cannot be asked for visibility.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// No usual memory would suffice.
    #[error(
        "the scene has {count} triangles with all its instances, at most {MAX_TRIANGLES} are possible: bake it in parts"
    )]
    TooManyTriangles {
        /// How many there are.
        count: usize,
    },
    /// Coordinates would lose all precision.
    #[error(
        "object {object} (`{node}`) reaches {reach_m:e} m from the middle of the scene, at most {MAX_REACH_M:e} m are possible"
    )]
    TooLarge {
        /// Index of the object.
        object: usize,
        /// The name of its node.
        node: String,
        /// How far it reaches.
        reach_m: f64,
    },
}

/// The scene as rays see it.
pub struct World {
    origin: DVec3,
    scale_m: f32,
    bounds: Bounds,
    object_bounds: Vec<Bounds>,
    /// Objects that are doors, rising.
    doors: Vec<u32>,
    shapes: Vec<Shape>,
    /// Grouped by object, in source order.
    triangles: Vec<Triangle>,
    /// Sum of the areas of the object's triangles up to and including this one, m².
    area_sums: Vec<f32>,
    /// The triangles again, in the order of the hierarchy.
    facets: Vec<Facet>,
    hierarchy: Bvh2,
}

/// A triangle in space relative to [`World::origin`], counter-clockwise seen from its front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// The object it belongs to.
    pub object: u32,
    hides: u8,
}

struct Shape {
    triangles: Range<u32>,
    points: Vec<Vec3>,
}

struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Triangle {
    /// One that hides from its front.
    #[cfg(test)]
    pub(crate) fn opaque(corners: [Vec3; 3], object: u32) -> Self {
        Self {
            corners,
            object,
            hides: FRONT_HIDES,
        }
    }

    /// Whether it hides anything from at least one side.
    #[must_use]
    pub fn hides(&self) -> bool {
        self.hides != 0
    }

    /// Whether its side that faces a point hides what is behind it.
    #[must_use]
    pub fn hides_from(&self, eye: Vec3) -> bool {
        let [a, b, c] = self.corners;
        let side = if (b - a).cross(c - a).dot(eye - a) > 0.0 {
            FRONT_HIDES
        } else {
            BACK_HIDES
        };
        self.hides & side != 0
    }

    /// Whether it hides what is behind it when seen from its front.
    #[must_use]
    pub fn hides_from_front(&self) -> bool {
        self.hides & FRONT_HIDES != 0
    }

    /// Whether it hides what is before it when seen from its back.
    #[must_use]
    pub fn hides_from_back(&self) -> bool {
        self.hides & BACK_HIDES != 0
    }

    /// Its area in m².
    #[must_use]
    pub fn area_m2(&self) -> f32 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
    }

    fn facet(&self, triangle: u32) -> Facet {
        let [a, b, c] = self.corners;
        Facet {
            corner: a,
            edges: [b - a, c - a],
            triangle,
            object: self.object,
            hides: self.hides,
        }
    }

    fn padded_box(&self) -> PaddedBox {
        let mut bounds = Aabb::from_points(&self.corners.map(Vec3A::from));
        let pad = Vec3A::splat(2.0 * SEAM * bounds.diagonal().max_element() + f32::MIN_POSITIVE);
        let rounding = bounds.min.abs().max(bounds.max.abs()) * f32::EPSILON;
        bounds.min -= pad + rounding;
        bounds.max += pad + rounding;
        PaddedBox(bounds)
    }
}

impl World {
    /// Flattens a scene.
    ///
    /// # Errors
    /// When it has too many triangles or is too large.
    pub fn new(scene: &SourceScene) -> Result<Self, WorldError> {
        let count = scene
            .objects
            .iter()
            .map(|o| scene.models[o.model].triangle_count())
            .sum();
        if count > MAX_TRIANGLES {
            return Err(WorldError::TooManyTriangles { count });
        }
        let object_bounds: Vec<_> = scene.objects.iter().map(|o| bounds_of(scene, o)).collect();
        let bounds = object_bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
        let (origin, scale_m) = frame(&bounds);
        for (object, b) in object_bounds.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
            let reach_m = b
                .corners()
                .map(|c| (DVec3::from(c) - origin).length())
                .into_iter()
                .fold(0.0, f64::max);
            if !reach_m.is_finite() || reach_m > MAX_REACH_M {
                return Err(WorldError::TooLarge {
                    object,
                    node: scene.objects[object].source_node.clone(),
                    reach_m,
                });
            }
        }
        let mut triangles = Vec::with_capacity(count);
        let mut area_sums = Vec::with_capacity(count);
        let mut shapes = Vec::with_capacity(scene.objects.len());
        for (index, object) in scene.objects.iter().enumerate() {
            let first = triangles.len();
            flatten(scene, object, index as u32, origin, &mut triangles);
            let mut sum = 0.0;
            area_sums.extend(triangles[first..].iter().map(|t| {
                sum += t.area_m2();
                sum
            }));
            let points = if first == triangles.len() {
                sample_points(scene, object, origin)
            } else {
                Vec::new()
            };
            shapes.push(Shape {
                triangles: first as u32..triangles.len() as u32,
                points,
            });
        }
        let is_door = |object: &u32| scene.objects[*object as usize].role == Role::Door;
        let doors = (0..scene.objects.len() as u32)
            .filter(|o| is_door(o) && !object_bounds[*o as usize].is_empty())
            .collect();
        let hierarchy = hierarchy_over(triangles.iter().map(Triangle::padded_box).collect());
        let facets = hierarchy
            .primitive_indices
            .iter()
            .map(|i| triangles[*i as usize].facet(*i))
            .collect();
        Ok(Self {
            origin,
            scale_m,
            bounds,
            object_bounds,
            doors,
            shapes,
            triangles,
            area_sums,
            facets,
            hierarchy,
        })
    }

    /// What positions relative to this world are relative to, in world space.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The diagonal of the box around everything, rounded up: what tolerances are shares of.
    #[must_use]
    pub fn scale_m(&self) -> f32 {
        self.scale_m
    }

    /// A point in world space, relative to the origin.
    #[must_use]
    pub fn relative(&self, point: [f64; 3]) -> Vec3 {
        (DVec3::from(point) - self.origin).as_vec3()
    }

    /// A relative point, in world space.
    #[must_use]
    pub fn absolute(&self, point: Vec3) -> [f64; 3] {
        (point.as_dvec3() + self.origin).to_array()
    }

    /// The box around everything in world space, empty when there is nothing.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The box around each object in world space, empty for an object without geometry.
    #[must_use]
    pub fn object_bounds(&self) -> &[Bounds] {
        &self.object_bounds
    }

    /// Objects that are doors and have geometry, rising.
    #[must_use]
    pub fn doors(&self) -> &[u32] {
        &self.doors
    }

    /// All triangles, grouped by object.
    #[must_use]
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// The triangles of one object.
    #[must_use]
    pub fn triangles_of(&self, object: u32) -> &[Triangle] {
        let Range { start, end } = self.shapes[object as usize].triangles;
        &self.triangles[start as usize..end as usize]
    }

    /// A digest of all that is known of one object but its number, relative to the origin.
    pub(crate) fn digest_of(&self, object: u32) -> Digest {
        let mut digester = Digester::default();
        let bounds = &self.object_bounds[object as usize];
        digester.doubles(&bounds.min).doubles(&bounds.max);
        digester.flag(self.doors.binary_search(&object).is_ok());
        let triangles = self.triangles_of(object);
        digester.count(triangles.len());
        for triangle in triangles {
            triangle.corners.iter().for_each(|corner| _ = digester.point(*corner));
            digester.count(usize::from(triangle.hides));
        }
        let points = self.points_of(object);
        digester.count(points.len());
        points.iter().for_each(|point| _ = digester.point(*point));
        digester.finish()
    }

    /// Points that stand for an object that has no triangles; nothing for all others.
    #[must_use]
    pub fn points_of(&self, object: u32) -> &[Vec3] {
        &self.shapes[object as usize].points
    }

    /// A triangle of the object, picked by area: `share` from 0 to 1 runs over its surface. `None` without triangles.
    #[must_use]
    pub fn triangle_at_share(&self, object: u32, share: f32) -> Option<&Triangle> {
        let Range { start, end } = self.shapes[object as usize].triangles;
        let sums = &self.area_sums[start as usize..end as usize];
        let wanted = share * sums.last()?;
        let index = sums.partition_point(|sum| *sum < wanted).min(sums.len() - 1);
        self.triangles.get(start as usize + index)
    }

    /// Calls with every triangle whose box meets a box.
    pub fn near(&self, min: Vec3, max: Vec3, visit: &mut dyn FnMut(&Triangle)) {
        if self.facets.is_empty() {
            return;
        }
        let around = Aabb::new(min.into(), max.into());
        self.hierarchy.aabb_traverse(around, |hierarchy, leaf| {
            let leaf = &hierarchy.nodes[leaf as usize];
            let first = leaf.first_index as usize;
            for index in &hierarchy.primitive_indices[first..first + leaf.prim_count as usize] {
                let triangle = &self.triangles[*index as usize];
                if triangle.padded_box().0.intersect_aabb(&around) {
                    visit(triangle);
                }
            }
            true
        });
    }
}

/// What positions are relative to, and what tolerances are shares of: both rounded, so that a house that moves at the
/// edge of a town hardly ever changes them.
fn frame(bounds: &Bounds) -> (DVec3, f32) {
    const STEPS: f64 = 8.0;
    if bounds.is_empty() {
        return (DVec3::ZERO, 0.0);
    }
    let (center, diagonal_m) = (DVec3::from(bounds.center()), bounds.diagonal_m());
    let step_m = diagonal_m.log2().floor().exp2() / STEPS;
    let origin = (center / step_m).round() * step_m;
    if origin.is_finite() {
        (origin, ((diagonal_m / step_m).ceil() * step_m) as f32)
    } else {
        // All in one point, or nearly.
        (center, diagonal_m as f32)
    }
}

/// A hierarchy over boxes; empty for none.
fn hierarchy_over(boxes: Vec<PaddedBox>) -> Bvh2 {
    if boxes.is_empty() {
        Bvh2::default()
    } else {
        build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default())
    }
}

fn transformed(matrix: &DMat4, point: [f32; 3]) -> DVec3 {
    matrix.transform_point3(Vec3::from(point).as_dvec3())
}

/// Indices of a primitive name vertices; vertices that no shape uses do not count.
fn used_points(primitive: &Primitive) -> impl Iterator<Item = [f32; 3]> {
    primitive.indices.iter().map(|i| primitive.positions[*i as usize])
}

/// The box around an object where its scene places it, empty without geometry.
pub(crate) fn bounds_of(scene: &SourceScene, object: &SourceObject) -> Bounds {
    let points = scene.models[object.model].primitives.iter().flat_map(used_points);
    Bounds::around(points.map(|p| transformed(&object.world_from_object, p).to_array()))
}

fn flatten(scene: &SourceScene, object: &SourceObject, index: u32, origin: DVec3, out: &mut Vec<Triangle>) {
    let matrix = &object.world_from_object;
    let mirrored = matrix.determinant() < 0.0;
    for primitive in &scene.models[object.model].primitives {
        // Sets are computed with all doors open; what a closed one hides is noted with the entries.
        let hides = match object.role {
            Role::Door => 0,
            Role::Ordinary => hides(primitive.material.map(|m| &scene.materials[m])),
        };
        out.extend(primitive.triangles().map(|corners| {
            let mut corners = corners.map(|p| (transformed(matrix, p) - origin).as_vec3());
            if mirrored {
                corners.swap(1, 2);
            }
            Triangle {
                corners,
                object: index,
                hides,
            }
        }));
    }
}

/// From which sides a face of this material hides; glTF's default material is opaque and has a front only.
fn hides(material: Option<&Material>) -> u8 {
    match material {
        Some(m) if m.see_through => 0,
        Some(m) if m.double_sided => FRONT_HIDES | BACK_HIDES,
        _ => FRONT_HIDES,
    }
}

fn sample_points(scene: &SourceScene, object: &SourceObject, origin: DVec3) -> Vec<Vec3> {
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
