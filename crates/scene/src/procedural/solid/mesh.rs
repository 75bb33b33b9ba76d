//! Where do triangles go? Into one mesh for each material of a part, placed by the turtle's frame.

use crate::procedural::affine::{Affine, unit};

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

    /// A normal as it is written.
    pub(super) fn normal(&self, normal: [f64; 3]) -> [f32; 3] {
        unit(self.normals.direction(normal)).map(|v| v as f32)
    }

    /// Adds a vertex; its index.
    pub(super) fn vertex(&mut self, position: [f64; 3], normal: [f32; 3]) -> u32 {
        self.mesh.positions.push(self.frame.point(position).map(|v| v as f32));
        self.mesh.normals.push(normal);
        self.mesh.positions.len() as u32 - 1
    }

    /// Adds a triangle that is counter-clockwise before the frame.
    pub(super) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let corners = if self.mirrored { [a, c, b] } else { [a, b, c] };
        self.mesh.indices.extend(corners);
    }

    /// Adds a flat quadrangle with corners in order.
    pub(super) fn quad(&mut self, corners: [[f64; 3]; 4], normal: [f64; 3]) {
        let normal = self.normal(normal);
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner, normal));
        self.triangle(a, b, c);
        self.triangle(a, c, d);
    }
}
