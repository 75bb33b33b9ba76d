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
//! Models that stand in so many places that flattening takes too much are held once ([`copies`]).
//!
//! Cost: one traversal of a bounding volume hierarchy (crate `obvhs`) for each ray, two where models are held once; about 200
//! bytes for each triangle in memory.

use std::{borrow::Cow, ops::Range};

use belvedere_scene::Bounds;
use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use crate::{
    digest::{Digest, Digester},
    source::{Role, SourceScene},
};

mod cast;
mod copies;
mod flatten;
mod limits;
mod main_part;
mod mesh;
mod small;
#[cfg(test)]
mod tests;
mod tree;
mod triangle;

pub use cast::Hit;
use copies::{Copies, Once, Placed};
pub(crate) use flatten::bounds_of;
use flatten::{Placing, sample_points};
pub use limits::{MAX_PLACED_TRIANGLES, MAX_REACH_M, MAX_TRIANGLES, MIN_SIZE_M, WorldError};
use limits::{check_extent, check_reach, check_size};
pub(crate) use limits::{check_place, check_placed};
pub(crate) use main_part::MainPart;
use mesh::Mesh;
pub(crate) use tree::{each_near, tree_over};
pub use triangle::Triangle;

/// Beyond so many triangles models that stand in many places are held once.
const MAX_FLAT_TRIANGLES: usize = 12 << 20;
/// Faces are this share of their size larger than they are, so that no ray slips through a shared edge.
const SEAM: f32 = 1e-6;

/// The scene as rays see it.
pub struct World {
    origin: DVec3,
    scale_m: f32,
    small_m: f32,
    main_part: Option<MainPart>,
    bounds: Bounds,
    object_bounds: Vec<Bounds>,
    /// Objects that are doors, rising.
    doors: Vec<u32>,
    shapes: Vec<Shape>,
    /// What is flattened, grouped by object, in source order.
    flat: Mesh,
    /// What stands in many places and is held once.
    copies: Copies,
}

/// What an object is made of.
struct Shape {
    /// The numbers of its triangles, in source order.
    triangles: Range<u32>,
    held: Held,
    /// Whether it is drawn as lines or points, too.
    has_more: bool,
    points: Vec<Vec3>,
}

/// Where the triangles of an object are.
#[derive(Clone, Copy)]
enum Held {
    /// Among the flattened ones, from this place on.
    Flat(u32),
    /// In the space of its model, of which it is this copy.
    Once(u32),
}

impl World {
    /// Flattens a scene, as far as memory allows.
    ///
    /// # Errors
    /// When it has too many triangles or is too large.
    pub fn new(scene: &SourceScene) -> Result<Self, WorldError> {
        Self::flattening(scene, MAX_FLAT_TRIANGLES)
    }

    /// The same with no more flattened triangles than this where models stand in many places.
    fn flattening(scene: &SourceScene, most_flat: usize) -> Result<Self, WorldError> {
        let once = Once::of(scene, most_flat);
        check_size(scene, &once)?;
        let object_bounds: Vec<_> = scene.objects.par_iter().map(|o| bounds_of(scene, o)).collect();
        let bounds = object_bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
        check_extent(bounds)?;
        let (origin, scale_m) = frame(&bounds);
        check_reach(scene, &object_bounds, origin)?;
        let mut mesh_of = vec![None; scene.models.len()];
        let mut meshes = Vec::new();
        let mut placed = Vec::new();
        let mut flat: Vec<Triangle> = Vec::new();
        let mut shapes: Vec<Shape> = Vec::with_capacity(scene.objects.len());
        let mut numbered = 0u32;
        for (number, object) in (0u32..).zip(&scene.objects) {
            let placing = Placing::of(object, number, origin);
            let held = if once.places(object) {
                let mesh = *mesh_of[object.model].get_or_insert_with(|| {
                    meshes.push(copies::mesh_of(scene, object.model));
                    meshes.len() - 1
                });
                let bounds = &object_bounds[number as usize];
                let [min, max] = [bounds.min, bounds.max].map(|p| (DVec3::from(p) - origin).as_vec3a());
                placed.push((Placed::new(mesh, placing), Aabb::new(min, max)));
                Held::Once(placed.len() as u32 - 1)
            } else {
                let first = flat.len() as u32;
                flat.extend(flatten::triangles(scene, &scene.models[object.model]).map(|own| placing.place(&own)));
                Held::Flat(first)
            };
            let end = numbered + scene.models[object.model].triangle_count() as u32;
            let points = if numbered == end {
                sample_points(scene, object, origin)
            } else {
                Vec::new()
            };
            shapes.push(Shape {
                triangles: std::mem::replace(&mut numbered, end)..end,
                held,
                has_more: flatten::has_lines_or_points(&scene.models[object.model]),
                points,
            });
        }
        let is_door = |object: &u32| scene.objects[*object as usize].role == Role::Door;
        let doors = (0..scene.objects.len() as u32)
            .filter(|o| is_door(o) && !object_bounds[*o as usize].is_empty())
            .collect();
        let main_part = MainPart::of(&object_bounds);
        Ok(Self {
            origin,
            scale_m,
            small_m: small::small_m(scale_m, main_part.as_ref()),
            main_part,
            bounds,
            object_bounds,
            doors,
            shapes,
            flat: Mesh::of(flat),
            copies: Copies::new(meshes, placed),
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

    /// What is narrower than this hides next to nothing: a thousandth of the diagonal or, where a plain or a few things far out make
    /// that large beside what the scene is of, of the width of the rest.
    #[must_use]
    pub fn small_m(&self) -> f32 {
        self.small_m
    }

    /// What it is of; `None` where nothing is drawn.
    pub(crate) fn main_part(&self) -> Option<&MainPart> {
        self.main_part.as_ref()
    }

    /// Whether the scene is so wide that more than a share of its rest is small: nothing less is known exactly enough.
    #[must_use]
    pub fn is_too_wide(&self) -> bool {
        self.scale_m > 0.0 && self.small_m <= small::LEAST * self.scale_m
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

    /// How many triangles there are, all copies counted.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.shapes.last().map_or(0, |shape| shape.triangles.end as usize)
    }

    /// A triangle by its number.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn triangle(&self, number: u32) -> Triangle {
        if self.is_flat() {
            return self.flat.triangles[number as usize];
        }
        let object = self.shapes.partition_point(|shape| shape.triangles.end <= number);
        self.shape_triangle(&self.shapes[object], number - self.shapes[object].triangles.start)
    }

    /// All triangles by their numbers, grouped by object.
    pub fn triangles(&self) -> impl Iterator<Item = Triangle> + Clone + '_ {
        self.shapes.iter().flat_map(move |shape| {
            (0..shape.triangles.len() as u32).map(move |index| self.shape_triangle(shape, index))
        })
    }

    /// The triangles of one object.
    #[must_use]
    pub fn triangles_of(&self, object: u32) -> Cow<'_, [Triangle]> {
        let shape = &self.shapes[object as usize];
        match shape.held {
            Held::Flat(first) => Cow::Borrowed(&self.flat.triangles[first as usize..][..shape.triangles.len()]),
            Held::Once(copy) => {
                let Placed { mesh, placing, .. } = self.copies.placed(copy as usize);
                let own = &self.copies.meshes[*mesh].triangles;
                own.iter().map(|own| placing.place(own)).collect()
            }
        }
    }

    /// How many triangles an object has.
    #[must_use]
    pub fn triangle_count_of(&self, object: u32) -> usize {
        self.shapes[object as usize].triangles.len()
    }

    /// Whether an object has lines or points beside its triangles.
    #[must_use]
    pub fn has_lines_or_points(&self, object: u32) -> bool {
        self.shapes[object as usize].has_more
    }

    /// One of the triangles of an object.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn triangle_of(&self, object: u32, index: usize) -> Triangle {
        self.shape_triangle(&self.shapes[object as usize], index as u32)
    }

    fn shape_triangle(&self, shape: &Shape, index: u32) -> Triangle {
        match shape.held {
            Held::Flat(first) => self.flat.triangles[(first + index) as usize],
            Held::Once(copy) => {
                let Placed { mesh, placing, .. } = self.copies.placed(copy as usize);
                placing.place(&self.copies.meshes[*mesh].triangles[index as usize])
            }
        }
    }

    fn is_flat(&self) -> bool {
        self.flat.triangles.len() == self.triangle_count()
    }

    /// The number of a triangle of an object, of which its place in the mesh that holds it is known.
    fn number_of(&self, object: u32, index: u32) -> u32 {
        let shape = &self.shapes[object as usize];
        match shape.held {
            Held::Flat(first) => shape.triangles.start + (index - first),
            Held::Once(_) => shape.triangles.start + index,
        }
    }

    /// A digest of all that is known of one object but its number, relative to the origin.
    pub(crate) fn digest_of(&self, object: u32) -> Digest {
        let mut digester = Digester::default();
        let bounds = &self.object_bounds[object as usize];
        digester.doubles(&bounds.min).doubles(&bounds.max);
        digester.flag(self.doors.binary_search(&object).is_ok());
        digester.flag(self.has_lines_or_points(object));
        let triangles = self.triangles_of(object);
        digester.count(triangles.len());
        for triangle in &*triangles {
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

    /// A triangle of the object, picked by area in its model: `share` from 0 to 1 runs over its surface. `None` without
    /// triangles.
    #[must_use]
    pub fn triangle_at_share(&self, object: u32, share: f32) -> Option<Triangle> {
        let shape = &self.shapes[object as usize];
        let sums = match shape.held {
            Held::Flat(first) => &self.flat.area_sums[first as usize..][..shape.triangles.len()],
            Held::Once(copy) => &self.copies.meshes[self.copies.placed(copy as usize).mesh].area_sums[..],
        };
        let wanted = share * sums.last()?;
        let index = sums.partition_point(|sum| *sum < wanted).min(sums.len() - 1);
        Some(self.shape_triangle(shape, index as u32))
    }

    /// Calls with every triangle that meets a box, and with some beside it.
    pub fn near(&self, min: Vec3, max: Vec3, visit: &mut dyn FnMut(&Triangle)) {
        let around = Aabb::new(min.into(), max.into());
        self.flat.near(around, &mut |index| visit(&self.flat.triangles[index]));
        self.copies.near(around, &mut |placed, index| {
            let triangle = placed.placing.place(&self.copies.meshes[placed.mesh].triangles[index]);
            if mesh::padded_box(&triangle).intersect_aabb(&around) {
                visit(&triangle);
            }
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
