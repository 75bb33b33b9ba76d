//! What is drawn, and which sides of it show and hide?
//!
//! The semantics of visibility, stated once: a face *shows* on the sides that a glTF renderer draws, its front and, if
//! its material is double-sided, its back. It *hides* what is behind it on the sides where it shows, unless its material
//! lets light through (`MASK`, `BLEND`, transmission) or it belongs to a door that is open. Lines and points show and hide
//! nothing. A transform that mirrors swaps front and back, as glTF 2.0 §3.7.4 says.

use std::sync::Arc;

use belvedere_scene::{Bounds, ObjectId};
use glam::{DMat4, DVec3, Vec3};

use crate::block::Block;

/// At most so many triangles make a patch: few enough that its box is tight, enough that testing it pays.
const PATCH_TRIANGLES: usize = 64;
/// What is published may be elsewhere than it stood, so a place counts as clear of a face from so many times the face's error on.
pub(crate) const ERRORS: f64 = 2.0;

/// How a material shows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Surface {
    /// Whether its back is drawn too.
    pub double_sided: bool,
    /// Whether light passes in places, so that it hides nothing.
    pub see_through: bool,
}

/// Neighbouring triangles of one surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Indices into [`Model::positions`], counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// How they show.
    pub surface: Surface,
    /// The box around them in model space.
    min: Vec3,
    max: Vec3,
}

/// Geometry in model space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Model {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Faces.
    pub patches: Vec<Patch>,
    /// Lines by the indices of their ends.
    pub lines: Vec<[u32; 2]>,
    /// Points by their indices.
    pub points: Vec<u32>,
}

/// A placed model.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its id in the revision.
    pub id: ObjectId,
    /// Index into [`Scene::models`].
    pub model: usize,
    /// Where it stands.
    pub world_from_object: DMat4,
    /// Whether it is a door, which hides nothing while it is open.
    pub door: bool,
    /// No point of it is farther than this from where the source has it, in world space: the error that its level 0
    /// states.
    pub error_m: f64,
}

/// Everything there is to see, and which doors are closed.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Unique geometries.
    pub models: Arc<[Model]>,
    /// Objects; their position in this list is their id.
    pub objects: Arc<[Object]>,
    /// The box around each object in world space, empty for one without geometry.
    bounds: Arc<[Bounds]>,
    /// The box around everything.
    all: Bounds,
    /// Doors that hide, rising.
    closed: Vec<ObjectId>,
}

impl Model {
    /// Adds triangles of one surface.
    pub fn add_triangles(&mut self, triangles: &[[u32; 3]], surface: Surface) {
        for part in triangles.chunks(PATCH_TRIANGLES) {
            let points = part.iter().flatten().map(|i| self.positions[*i as usize]);
            let (min, max) = points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            });
            self.patches.push(Patch {
                triangles: part.to_vec(),
                surface,
                min,
                max,
            });
        }
    }

    /// How many triangles it has.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.patches.iter().map(|p| p.triangles.len()).sum()
    }

    /// A vertex in double precision.
    #[must_use]
    pub fn position(&self, index: u32) -> DVec3 {
        self.positions[index as usize].as_dvec3()
    }

    fn used(&self) -> impl Iterator<Item = u32> {
        let corners = self.patches.iter().flat_map(|p| p.triangles.iter().flatten());
        let ends = self.lines.iter().flatten();
        corners.chain(ends).chain(&self.points).copied()
    }
}

impl Patch {
    /// The box around it after a transform.
    #[must_use]
    pub fn bounds(&self, transform: &DMat4) -> (DVec3, DVec3) {
        let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        let middle = transform.transform_point3(0.5 * (min + max));
        let half = 0.5 * (max - min);
        let reach = transform.x_axis.truncate().abs() * half.x
            + transform.y_axis.truncate().abs() * half.y
            + transform.z_axis.truncate().abs() * half.z;
        (middle - reach, middle + reach)
    }
}

impl Object {
    /// Whether its transform swaps front and back.
    #[must_use]
    pub fn mirrored(&self) -> bool {
        self.world_from_object.determinant() < 0.0
    }
}

impl Scene {
    /// Puts a scene together, all doors open; objects must stand at the position of their id and name models that are there.
    #[must_use]
    pub fn new(models: Vec<Model>, objects: Vec<Object>) -> Self {
        let around = |object: &Object| {
            let model = &models[object.model];
            let place = |i| object.world_from_object.transform_point3(model.position(i)).to_array();
            Bounds::around(model.used().map(place))
        };
        let bounds: Vec<_> = objects.iter().map(around).collect();
        let all = bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
        Self {
            models: models.into(),
            objects: objects.into(),
            bounds: bounds.into(),
            all,
            closed: Vec::new(),
        }
    }

    /// The same scene with these doors closed, and all others open.
    #[must_use]
    pub fn with_closed(&self, doors: &[ObjectId]) -> Self {
        let mut closed = doors.to_vec();
        closed.sort_unstable();
        Self { closed, ..self.clone() }
    }

    /// The doors that are closed, rising.
    #[must_use]
    pub fn closed(&self) -> &[ObjectId] {
        &self.closed
    }

    /// Whether it is a door that is open, so that it hides nothing.
    #[must_use]
    pub fn is_open(&self, object: usize) -> bool {
        let Object { door, id, .. } = self.objects[object];
        door && self.closed.binary_search(&id).is_err()
    }

    /// The model of an object.
    #[must_use]
    pub fn model_of(&self, object: usize) -> &Model {
        &self.models[self.objects[object].model]
    }

    /// The box around an object in world space.
    #[must_use]
    pub fn bounds_of(&self, object: usize) -> &Bounds {
        &self.bounds[object]
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> &Bounds {
        &self.all
    }

    /// No point of anything is farther than this from where the source has it.
    #[must_use]
    pub fn largest_error_m(&self) -> f64 {
        self.objects.iter().map(|object| object.error_m).fold(0.0, f64::max)
    }

    /// No face that may stand in a box in the source is farther than this from there: the largest error of those objects that have a
    /// face no farther from the box than [`ERRORS`] times their error.
    pub(crate) fn error_near_m(&self, around: &Block) -> f64 {
        let is_near = |number: usize, object: &Object| {
            let reach_m = ERRORS * object.error_m;
            let wide = Block {
                min: around.min - reach_m,
                max: around.max + reach_m,
            };
            let Bounds { min, max } = self.bounds[number];
            let [min, max] = [min, max].map(DVec3::from);
            wide.meets(&Block { min, max })
                && self.models[object.model].patches.iter().any(|patch| {
                    let (min, max) = patch.bounds(&object.world_from_object);
                    wide.meets(&Block { min, max })
                })
        };
        let mut largest_m = 0.0;
        for (number, object) in self.objects.iter().enumerate() {
            if object.error_m > largest_m && is_near(number, object) {
                largest_m = object.error_m;
            }
        }
        largest_m
    }

    /// The triangles of an object in world space; none when there is no such object.
    #[must_use]
    pub fn triangles_of(&self, object: usize) -> Vec<[DVec3; 3]> {
        let Some(placed) = self.objects.get(object) else {
            return Vec::new();
        };
        let model = self.model_of(object);
        let triangles = model.patches.iter().flat_map(|patch| &patch.triangles);
        let place = |i: u32| placed.world_from_object.transform_point3(model.position(i));
        triangles.map(|corners| corners.map(place)).collect()
    }

    /// How many triangles are drawn, instances counted.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        (0..self.objects.len()).map(|o| self.model_of(o).triangle_count()).sum()
    }

    /// An object's transform into the space around an eye.
    #[must_use]
    pub fn eye_from_object(&self, object: usize, eye: DVec3) -> DMat4 {
        let mut matrix = self.objects[object].world_from_object;
        matrix.w_axis -= eye.extend(0.0);
        matrix
    }
}
