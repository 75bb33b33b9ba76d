//! What does a partly decoded smooth LOD hold? Vertices on a lattice, triangles, and which triangles meet where.
//!
//! Any triangles at all: no edge or vertex need be manifold. The list of a vertex's triangles is kept in fan order as far
//! as there is one ([`super::fan`]).

use super::stars::{List, Stars};

/// No vertex.
pub(super) const NONE: u32 = u32::MAX;

/// A mesh while it grows.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    pub(super) points: Vec<Point>,
    /// By vertex, too; looked at seldom.
    pub(super) births: Vec<Birth>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) stars: Stars,
}

/// A vertex. Every split looks at a dozen of them, so they are small: half a line of a cache.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
pub(super) struct Point {
    /// Sum of the other two corners over all its triangles: twice that of its neighbours where the mesh is closed.
    pub(super) around: [i32; 3],
    /// Its triangles.
    pub(super) star: List,
    at: [u16; 3],
    /// Mean distance to its neighbours when it last took part in a split, as [`super::geometry::size_class`].
    pub(super) size: u8,
    /// The pass in which it came or was split last, modulo 256.
    pub(super) pass: u8,
}

/// How a vertex came.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Birth {
    /// The vertex that it was split from.
    pub(super) parent: u32,
    /// How many triangles there were before it came.
    pub(super) triangles: u32,
    /// Which of its coordinates were those of vertices nearby: x in bit 0, y, z.
    pub(super) shared: u8,
}

impl Point {
    /// On the present lattice.
    #[inline(always)]
    pub(super) fn at(&self) -> [i32; 3] {
        self.at.map(i32::from)
    }
}

impl Mesh {
    /// One vertex.
    pub(super) fn new() -> Self {
        let mut mesh = Self::default();
        mesh.push([0; 3], Birth::default());
        mesh
    }

    /// Makes room for so many vertices and triangles in all.
    pub(super) fn reserve(&mut self, vertices: usize, triangles: usize) {
        self.points.reserve(vertices.saturating_sub(self.points.len()));
        self.births.reserve(vertices.saturating_sub(self.births.len()));
        self.triangles.reserve(triangles.saturating_sub(self.triangles.len()));
        self.stars.reserve(vertices);
    }

    /// Another vertex, without triangles; its coordinates have up to 16 bits.
    #[inline(always)]
    pub(super) fn push(&mut self, at: [i32; 3], birth: Birth) -> &mut Point {
        let star = self.stars.empty();
        self.births.push(birth);
        let index = self.points.len();
        self.points.push(Point {
            at: at.map(|x| x as u16),
            star,
            ..Point::default()
        });
        &mut self.points[index]
    }

    /// How many triangles meet at a vertex.
    #[inline(always)]
    pub(super) fn valence(&self, vertex: u32) -> usize {
        self.points[vertex as usize].star.length()
    }

    /// The other corners of a triangle, in its sense of rotation after `vertex`, which is a corner.
    #[inline(always)]
    pub(super) fn others(&self, triangle: u32, vertex: u32) -> (u32, u32) {
        let [a, b, c] = self.triangles[triangle as usize];
        // Nobody can guess which it is: chosen without branches.
        let (is_a, is_b) = (a == vertex, b == vertex);
        let from = if is_b { c } else { a };
        let to = if is_b { a } else { b };
        (if is_a { b } else { from }, if is_a { c } else { to })
    }

    /// Halves the step of the lattice. `bits` has the new lowest bits of a vertex: x in bit 0, y, z.
    pub(super) fn refine(&mut self, vertex: u32, bits: usize) {
        let point = &mut self.points[vertex as usize];
        for (axis, at) in point.at.iter_mut().enumerate() {
            *at = *at << 1 | (bits >> axis & 1) as u16;
        }
    }

    /// Adds up the neighbours of all vertices anew, after the lattice became finer.
    pub(super) fn add_up(&mut self) {
        for point in &mut self.points {
            point.around = [0; 3];
        }
        for i in 0..self.triangles.len() {
            let [a, b, c] = self.triangles[i];
            let [p, q, r] = [a, b, c].map(|v| self.points[v as usize].at());
            for (vertex, one, other) in [(a, q, r), (b, r, p), (c, p, q)] {
                let around = &mut self.points[vertex as usize].around;
                add(around, one);
                add(around, other);
            }
        }
    }
}

/// Adds to a sum; damaged streams may wrap around.
#[inline(always)]
pub(super) fn add(sum: &mut [i32; 3], more: [i32; 3]) {
    for axis in 0..3 {
        sum[axis] = sum[axis].wrapping_add(more[axis]);
    }
}
