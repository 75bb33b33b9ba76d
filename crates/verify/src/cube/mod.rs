//! Which object shows at each pixel around an eye?
//!
//! An item buffer (Weghorst, Hooper and Greenberg 1984) on the six faces of a cube, with a z-buffer of its own. Pixels
//! are tested at their middles with inclusive edges in `f64`, so that nothing is seen between two faces that share an
//! edge; depth is one over the distance along the face's axis, from the plane of each triangle.
//!
//! Two passes. First all that hides, nearest pixel wins. Objects that are expected come first and a tie keeps what is
//! there, so two surfaces in one place never make an unexpected object out of an expected one. Then all that shows but
//! hides nothing (glass, open doors, lines, points): it shows wherever it stands before what hides, in any number of layers.
//!
//! Costs one transform of each vertex and at most one rasterisation of each triangle per face that it touches.

mod faces;
mod occlusion;
mod raster;

use belvedere_scene::Bounds;
use glam::{DVec3, Mat4, Vec3};

use crate::scene::{Patch, Scene};
pub use faces::FACES;
use faces::{face_of, touched};

/// Looking whether a triangle is hidden may cost so many pixels; drawing it costs about as much.
const EFFORT_A_TRIANGLE: usize = 64;
/// No object.
pub const NOTHING: u32 = u32::MAX;
/// The near plane lies at this share of the scene's diagonal.
const NEAR: f64 = 1e-8;

/// A pixel in which an object shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Sighting {
    /// The object.
    pub object: u32,
    /// Index into [`FACES`].
    pub face: u8,
    /// Column, from the left.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
}

/// The six pictures around an eye.
#[derive(Debug)]
pub struct Cube {
    size: usize,
    near: f32,
    /// How many pixels may be looked at for each triangle to find it hidden.
    effort: usize,
    /// One over the depth of what hides, 0 for nothing; face by face, row by row.
    inverse_depth: Vec<f32>,
    item: Vec<u32>,
    /// The object that showed last in each pixel in the second pass.
    layer: Vec<u32>,
    /// Pixels in which each object shows.
    pixels: Vec<u32>,
    unexpected: Vec<Sighting>,
    /// Vertices of the object that is being drawn, relative to the eye, each with the face through which it is seen.
    vertices: Vec<(Vec3, u8)>,
}

/// How something is drawn.
#[derive(Debug, Clone, Copy)]
struct Paint {
    object: u32,
    hides: bool,
    expected: bool,
}

impl Cube {
    /// A cube of faces of `size` × `size` pixels; takes 72 bytes for each of `size`².
    #[must_use]
    pub fn new(size: usize) -> Self {
        let all = 6 * size * size;
        Self {
            size,
            near: 0.0,
            effort: EFFORT_A_TRIANGLE,
            inverse_depth: vec![0.0; all],
            item: vec![NOTHING; all],
            layer: vec![NOTHING; all],
            pixels: Vec::new(),
            unexpected: Vec::new(),
            vertices: Vec::new(),
        }
    }

    /// Pixels along the side of a face.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Pixels in which each object shows, by object.
    #[must_use]
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Every pixel in which an object shows that was not expected, sorted.
    #[must_use]
    pub fn unexpected(&self) -> &[Sighting] {
        &self.unexpected
    }

    /// How many pixels show something.
    #[must_use]
    pub fn covered(&self) -> u64 {
        let shown = self.item.iter().zip(&self.layer);
        shown
            .filter(|(item, layer)| **item != NOTHING || **layer != NOTHING)
            .count() as u64
    }

    /// What shows at a pixel: the object that hides all behind it, or else one that hides nothing; and one over its
    /// depth, 0 when unknown.
    #[must_use]
    pub fn shown(&self, face: usize, x: usize, y: usize) -> (u32, f32) {
        let at = self.index(face, x, y);
        match self.item[at] {
            NOTHING => (self.layer[at], 0.0),
            item => (item, self.inverse_depth[at]),
        }
    }

    /// The direction through the middle of a pixel; its component along the face's axis is 1.
    #[must_use]
    pub fn direction(&self, face: usize, x: usize, y: usize) -> DVec3 {
        let at = |pixel: usize| (2.0 * pixel as f64 + 1.0) / self.size as f64 - 1.0;
        FACES[face].direction(at(x), -at(y))
    }

    /// The face, column and row of the pixel in a direction.
    #[must_use]
    pub fn pixel_towards(&self, direction: DVec3) -> Option<(usize, usize, usize)> {
        let pixel = |at: f64| ((0.5 * (at + 1.0) * self.size as f64) as usize).min(self.size - 1);
        FACES.iter().enumerate().find_map(|(face, about)| {
            about
                .point(direction)
                .map(|(right, up)| (face, pixel(right), pixel(-up)))
        })
    }

    /// Draws what an eye sees. `expected` says of each object whether it may be seen.
    pub fn draw(&mut self, scene: &Scene, eye: DVec3, expected: &[bool]) {
        self.near = (NEAR * scene.bounds().diagonal_m()) as f32;
        self.inverse_depth.fill(0.0);
        self.item.fill(NOTHING);
        self.layer.fill(NOTHING);
        self.pixels.clear();
        self.pixels.resize(scene.objects.len(), 0);
        self.unexpected.clear();
        let mut order: Vec<_> = (0..scene.objects.len())
            .filter(|o| !scene.bounds_of(*o).is_empty())
            .map(|o| (!expected[o], scene.bounds_of(o).distance_m(eye.to_array()), o))
            .collect();
        order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for hides in [true, false] {
            for (unexpected, _, object) in &order {
                let paint = Paint {
                    object: *object as u32,
                    hides,
                    expected: !unexpected,
                };
                self.draw_object(scene, eye, paint);
            }
        }
        self.count(expected);
    }

    fn count(&mut self, expected: &[bool]) {
        for (at, item) in self.item.iter().enumerate().filter(|(_, item)| **item != NOTHING) {
            self.pixels[*item as usize] += 1;
            if !expected[*item as usize] {
                self.unexpected.push(sighting(self.size, at, *item));
            }
        }
        self.unexpected.sort_unstable();
    }

    /// The part of an object that hides, or the part that does not.
    fn draw_object(&mut self, scene: &Scene, eye: DVec3, paint: Paint) {
        let object = &scene.objects[paint.object as usize];
        let model = scene.model_of(paint.object as usize);
        let open = scene.is_open(paint.object as usize);
        let wanted = |patch: &&Patch| (!patch.surface.see_through && !open) == paint.hides;
        let thin = !model.lines.is_empty() || !model.points.is_empty();
        let shapes = thin && !paint.hides;
        if !shapes && !model.patches.iter().any(|patch| wanted(&patch)) {
            return;
        }
        let Bounds { min, max } = scene.bounds_of(paint.object as usize);
        let effort = self.effort * model.triangle_count();
        if self.hides_box(DVec3::from(*min) - eye, DVec3::from(*max) - eye, effort) {
            return;
        }
        let exact = scene.eye_from_object(paint.object as usize, eye);
        let place: Mat4 = exact.as_mat4();
        let mut vertices = std::mem::take(&mut self.vertices);
        vertices.clear();
        vertices.extend(model.positions.iter().map(|p| {
            let vertex = place.transform_point3(*p);
            (vertex, face_of(vertex))
        }));
        let mirrored = object.mirrored();
        for patch in model.patches.iter().filter(wanted) {
            let (min, max) = patch.bounds(&exact);
            if self.hides_box(min, max, self.effort * patch.triangles.len()) {
                continue;
            }
            for triangle in &patch.triangles {
                let corners = triangle.map(|i| vertices[i as usize]);
                let [a, b, c] = corners.map(|(vertex, _)| vertex);
                let towards = (b - a).cross(c - a).dot(a) < 0.0;
                if patch.surface.double_sided || towards != mirrored {
                    self.draw_triangle(corners, paint);
                }
            }
        }
        if shapes {
            for ends in &model.lines {
                self.draw_line(ends.map(|i| vertices[i as usize]), paint);
            }
            for point in &model.points {
                self.draw_line([vertices[*point as usize]; 2], paint);
            }
        }
        self.vertices = vertices;
    }

    fn draw_triangle(&mut self, corners: [(Vec3, u8); 3], paint: Paint) {
        for face in touched(corners) {
            self.fill_triangle(face, corners.map(|(corner, _)| corner), paint);
        }
    }

    fn draw_line(&mut self, [a, b]: [(Vec3, u8); 2], paint: Paint) {
        for face in touched([a, b, b]) {
            self.trace_line(face, [a.0, b.0], paint);
        }
    }

    fn index(&self, face: usize, x: usize, y: usize) -> usize {
        (face * self.size + y) * self.size + x
    }

    /// Shows a pixel of something that hides nothing, at one over a depth.
    fn show(&mut self, at: usize, inverse_depth: f32, paint: Paint) {
        let hidden = inverse_depth <= self.inverse_depth[at];
        if !hidden && self.layer[at] != paint.object && self.item[at] != paint.object {
            self.layer[at] = paint.object;
            self.pixels[paint.object as usize] += 1;
            if !paint.expected {
                self.unexpected.push(sighting(self.size, at, paint.object));
            }
        }
    }
}

fn sighting(size: usize, at: usize, object: u32) -> Sighting {
    Sighting {
        object,
        face: (at / (size * size)) as u8,
        x: (at % size) as u16,
        y: (at / size % size) as u16,
    }
}

#[cfg(test)]
mod tests;
