//! What does a partly decoded smooth LOD hold? Vertices on a lattice, triangles, and which triangles meet where.
//!
//! Any triangles at all: no edge or vertex need be manifold. The list of a vertex's triangles is kept in fan order as far
//! as there is one ([`super::fan`]).

use super::stars::{List, Stars};

/// No vertex.
pub(super) const NONE: u32 = u32::MAX;

/// A mesh while it grows.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub(super) points: Vec<Point>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) stars: Stars,
}

/// A vertex.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Point {
    /// On the present lattice.
    pub(super) at: [i32; 3],
    /// Sum of the other two corners over all its triangles: twice that of its neighbours where the mesh is closed.
    pub(super) around: [i32; 3],
    /// Its triangles.
    pub(super) star: List,
    /// The vertex that it was split from.
    pub(super) parent: u32,
    /// The vertex after it in the order of the tree, in which parents come right before their children, latest first:
    /// what is near in space is mostly near in this order, and therefore in memory. [`NONE`] after the last.
    pub(super) next: u32,
    /// Mean distance to its neighbours when it last took part in a split, as [`super::geometry::size_class`].
    pub(super) size: u8,
    /// Which of its coordinates were those of vertices nearby: x in bit 0, y, z.
    pub(super) shared: u8,
    /// The pass in which it came or was split last, modulo 256.
    pub(super) pass: u8,
    /// How many triangles there were before it came.
    pub(super) born: u32,
}

impl Mesh {
    /// One vertex.
    pub(super) fn new() -> Self {
        let mut mesh = Self::default();
        mesh.push(Point {
            next: NONE,
            ..Point::default()
        });
        mesh
    }

    pub(super) fn push(&mut self, point: Point) {
        let star = self.stars.empty();
        self.points.push(Point { star, ..point });
    }

    /// How many triangles meet at a vertex.
    #[inline(always)]
    pub(super) fn valence(&self, vertex: u32) -> usize {
        self.points[vertex as usize].star.length as usize
    }

    /// The other corners of a triangle, in its sense of rotation after `vertex`, which is a corner.
    #[inline(always)]
    pub(super) fn others(&self, triangle: u32, vertex: u32) -> (u32, u32) {
        let [a, b, c] = self.triangles[triangle as usize];
        if a == vertex {
            (b, c)
        } else if b == vertex {
            (c, a)
        } else {
            (a, b)
        }
    }

    /// Halves the step of the lattice. `bits` has the new lowest bits of a vertex: x in bit 0, y, z.
    pub(super) fn refine(&mut self, vertex: u32, bits: usize) {
        let point = &mut self.points[vertex as usize];
        for (axis, at) in point.at.iter_mut().enumerate() {
            *at = *at << 1 | (bits >> axis & 1) as i32;
        }
    }

    /// Adds up the neighbours of all vertices anew, after the lattice became finer.
    pub(super) fn add_up(&mut self) {
        for point in &mut self.points {
            point.around = [0; 3];
        }
        for i in 0..self.triangles.len() {
            let [a, b, c] = self.triangles[i];
            let [p, q, r] = [a, b, c].map(|v| self.points[v as usize].at);
            for (vertex, one, other) in [(a, q, r), (b, r, p), (c, p, q)] {
                self.add_around(vertex, std::array::from_fn(|axis| one[axis] + other[axis]));
            }
        }
    }

    #[inline(always)]
    pub(super) fn add_around(&mut self, vertex: u32, difference: [i32; 3]) {
        let around = &mut self.points[vertex as usize].around;
        for axis in 0..3 {
            around[axis] = around[axis].wrapping_add(difference[axis]);
        }
    }
}
