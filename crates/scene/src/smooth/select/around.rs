//! How far is the surface off without one split? At a few points, the distance between the triangles around the old vertex
//! before it and those around both vertices after it, the larger of both ways: a Hausdorff distance in small.
//!
//! The points are the new vertex; of the triangles around it the middles, and those of the edges that lead to it; and the
//! middles of the same triangles before. Where many triangles meet, not all are looked at, so a split takes a
//! bounded time beside that of looking at each triangle once.

use super::distance::{length, minus, square_to_triangle};
use super::front::Front;
use super::tree::ClusterTree;

/// Of so many triangles there are points …
const MOST_SHAPES: usize = 16;
/// … and to so many their distance is found.
const MOST_NEAR: usize = 128;

/// Triangles around the vertices of a split.
#[derive(Debug, Default)]
pub(super) struct Around {
    before: Vec<[u32; 3]>,
    new: Vec<[u32; 3]>,
    after: Vec<[u32; 3]>,
}

impl Around {
    /// Before the split: what is around the vertex that will be split.
    pub(super) fn read_before(&mut self, front: &Front, old: u32) {
        self.before.clear();
        front.around(old, |triangle| self.before.push(triangle));
    }

    /// After it: how far apart both shapes are. At most as far as the two vertices.
    pub(super) fn difference(&mut self, front: &Front, tree: &ClusterTree, new: u32) -> f64 {
        let old = tree.parent[new as usize];
        self.new.clear();
        front.around(new, |triangle| self.new.push(triangle));
        self.after.clear();
        self.after.extend(self.new.iter().take(MOST_NEAR));
        front.around(old, |triangle| {
            if self.after.len() < 2 * MOST_NEAR {
                self.after.push(triangle);
            }
        });
        let at = |vertex: u32| tree.positions[vertex as usize];
        // Nothing moves farther than the vertex does.
        let way = minus(at(new), at(old));
        let most = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        let square = |point: [f64; 3], to: &[[u32; 3]]| {
            to.iter().fold(most, |least, triangle| {
                let square = square_to_triangle(point, triangle.map(at));
                if square < least { square } else { least }
            })
        };
        let near = &self.before[..self.before.len().min(MOST_NEAR)];
        let middle = |triangle: [u32; 3]| {
            let [a, b, c] = triangle.map(at);
            [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
        };
        let mut worst = square(at(new), &self.before);
        for &triangle in self.new.iter().take(MOST_SHAPES) {
            worst = worst.max(square(middle(triangle), near));
            let [a, b, c] = triangle;
            let next = if a == new {
                b
            } else if b == new {
                c
            } else {
                a
            };
            let (p, q) = (at(new), at(next));
            worst = worst.max(square([0, 1, 2].map(|axis| (p[axis] + q[axis]) / 2.0), near));
            if a != old && b != old && c != old {
                let was = triangle.map(|vertex| if vertex == new { old } else { vertex });
                worst = worst.max(square(middle(was), &self.after));
            }
        }
        worst.sqrt().min(length(way))
    }
}
