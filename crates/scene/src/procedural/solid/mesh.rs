//! Where do triangles go? Into one mesh for each material of a part, placed by the turtle's frame.

use super::polygon::Ears;
use super::round::Circles;
use crate::procedural::affine::{Affine, unit};

/// What is kept from solid to solid: circles that were asked for, and room for the points of a mesh and the corners of a face.
#[derive(Debug, Default)]
pub(crate) struct Tools {
    pub(super) circles: Circles,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) corners: Vec<[f64; 3]>,
    pub(super) flattened: Vec<[f64; 2]>,
    pub(super) ears: Ears,
}

/// Triangles of one material, in the space of their part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Index into [`Grown::materials`](crate::procedural::Grown::materials).
    pub material: usize,
    /// One for each vertex.
    pub positions: Vec<[f32; 3]>,
    /// Of length one, one for each vertex.
    pub normals: Vec<[f32; 3]>,
    /// Three for each triangle, counter-clockwise from the front.
    pub indices: Vec<u32>,
}

#[inline]
fn single([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, y as f32, z as f32]
}

/// Adds vertices and triangles to a mesh as they lie in a frame. Numbers are rounded to single precision here, last.
#[derive(Debug)]
pub(crate) struct Writer<'m> {
    mesh: &'m mut Mesh,
    frame: Affine,
    normals: Affine,
    mirrored: bool,
}

impl<'m> Writer<'m> {
    pub(crate) fn new(mesh: &'m mut Mesh, frame: &Affine) -> Self {
        Self {
            mesh,
            frame: *frame,
            normals: frame.normals(),
            mirrored: frame.mirrors(),
        }
    }

    /// Makes room.
    pub(super) fn reserve(&mut self, vertices: usize, triangles: usize) {
        self.mesh.positions.reserve(vertices);
        self.mesh.normals.reserve(vertices);
        self.mesh.indices.reserve(3 * triangles);
    }

    /// A position as it is written.
    #[inline]
    pub(super) fn position(&self, position: [f64; 3]) -> [f32; 3] {
        single(self.frame.point(position))
    }

    /// A normal as it is written.
    #[inline]
    pub(super) fn normal(&self, normal: [f64; 3]) -> [f32; 3] {
        single(unit(self.normals.direction(normal)))
    }

    /// The index of the next vertex.
    pub(super) fn next(&self) -> u32 {
        self.mesh.positions.len() as u32
    }

    /// Adds a triangle that is counter-clockwise before the frame.
    #[inline]
    pub(super) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let corners = if self.mirrored { [a, c, b] } else { [a, b, c] };
        self.mesh.indices.extend(corners);
    }

    /// Adds vertices, whose normals are added too.
    #[inline]
    pub(super) fn positions(&mut self, positions: impl ExactSizeIterator<Item = [f64; 3]>) {
        let frame = self.frame;
        self.mesh
            .positions
            .extend(positions.map(|position| single(frame.point(position))));
    }

    /// Adds so many vertices where the first lies, if they all lie there.
    #[inline]
    pub(super) fn same_positions(&mut self, count: usize, first: [f64; 3]) -> bool {
        let point = self.frame.point(first);
        // What differs in the sign of a zero alone adds up to the same, if that is not zero.
        let is_same = point.iter().all(|&along| along != 0.0);
        if is_same {
            let positions = &mut self.mesh.positions;
            positions.resize(positions.len() + count, single(point));
        }
        is_same
    }

    /// Adds normals, of any length.
    #[inline]
    pub(super) fn normals(&mut self, normals: impl ExactSizeIterator<Item = [f64; 3]>) {
        let frame = self.normals;
        self.mesh
            .normals
            .extend(normals.map(|normal| single(unit(frame.direction(normal)))));
    }

    /// Adds the normals of so many vertices once more.
    pub(super) fn same_normals(&mut self, first: u32, count: u32) {
        let first = first as usize;
        self.mesh.normals.extend_from_within(first..first + count as usize);
    }

    /// Adds vertices with one normal, as it is written.
    #[inline]
    pub(super) fn flat(&mut self, positions: impl ExactSizeIterator<Item = [f64; 3]>, normal: [f32; 3]) {
        let count = positions.len();
        self.positions(positions);
        self.mesh.normals.resize(self.mesh.normals.len() + count, normal);
    }

    /// Adds `T` triangles for each of so many places, counter-clockwise before the frame.
    #[inline]
    pub(super) fn triangles<const T: usize>(&mut self, places: u32, corners: impl Fn(u32) -> [[u32; 3]; T]) {
        let before = self.mesh.indices.len();
        self.mesh.indices.resize(before + 3 * T * places as usize, 0);
        let triangles = self.mesh.indices[before..].as_chunks_mut::<3>().0;
        for (place, written) in triangles.chunks_exact_mut(T).enumerate() {
            for (written, [a, b, c]) in written.iter_mut().zip(corners(place as u32)) {
                *written = if self.mirrored { [a, c, b] } else { [a, b, c] };
            }
        }
    }

    /// Adds vertices as they were written to a list before, with one normal.
    #[inline]
    pub(super) fn written(&mut self, positions: impl ExactSizeIterator<Item = [f32; 3]>, normal: [f32; 3]) {
        let count = positions.len();
        self.mesh.positions.extend(positions);
        self.mesh.normals.resize(self.mesh.normals.len() + count, normal);
    }

    /// Adds a flat quadrangle with corners in order, as positions are written.
    #[inline]
    pub(super) fn quad(&mut self, corners: [[f32; 3]; 4], normal: [f64; 3]) {
        let a = self.next();
        self.mesh.positions.extend_from_slice(&corners);
        self.mesh.normals.extend_from_slice(&[self.normal(normal); 4]);
        self.triangle(a, a + 1, a + 2);
        self.triangle(a, a + 2, a + 3);
    }
}
