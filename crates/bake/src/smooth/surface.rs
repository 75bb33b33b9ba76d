//! How far is a point from a surface?
//!
//! A bounding-volume tree over shapes in Morton order in which a node has four children. Their boxes lie side by side, so one look
//! at all four is a few vector instructions (Dammertz, Hanika, Keller, *Shallow bounding volume hierarchies for fast SIMD ray
//! tracing of incoherent rays*, 2008), and shapes are looked at like nodes: by their boxes first, the nearest first. It knows
//! points only; [`ShapeTree`](crate::lod::proximity::ShapeTree) tells what is near to all of a piece of surface.

use glam::DVec3;

use super::quantise::QuantisedMesh;
use crate::lod::{
    octree::morton_order,
    proximity::{Corners, bounds, point_distance_squared},
};

/// Children of a node.
const CHILDREN: usize = 4;
/// More entries than a search has at once: all but one child of each node on the way down to one of 2³² shapes, and that one's.
const STACK: usize = 64;

/// Shapes, mostly a mesh's triangles, from which distances are measured.
pub struct Surface {
    /// In the order in which they were given.
    pub(super) shapes: Vec<Corners>,
    /// The same in Morton order.
    order: Vec<u32>,
    /// Nodes; first those over shapes, last the root.
    levels: Vec<Vec<Node>>,
}

/// A shape and the square of its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    /// Index into [`Surface::shapes`].
    pub(super) shape: u32,
    pub(super) squared: f64,
}

impl Surface {
    /// Of a mesh that is given by twice its positions, in steps of the lattice.
    #[must_use]
    pub fn new(twice_positions: &[[i32; 3]], triangles: &[[u32; 3]]) -> Self {
        let corner = |v: u32| DVec3::from_array(twice_positions[v as usize].map(|x| 0.5 * f64::from(x)));
        Self::of_shapes(triangles.iter().map(|t| t.map(corner)).collect())
    }

    /// Of the whole mesh, in steps of the lattice.
    #[must_use]
    pub fn of(mesh: &QuantisedMesh) -> Self {
        Self::new(&mesh.twice_positions(), &mesh.triangles)
    }

    /// Of shapes one by one.
    pub(crate) fn of_shapes(shapes: Vec<Corners>) -> Self {
        let centers: Vec<DVec3> = shapes.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let order = morton_order(&centers);
        let mut boxes: Vec<(DVec3, DVec3)> = order.iter().map(|&shape| bounds(&shapes[shape as usize])).collect();
        let mut levels = Vec::new();
        while boxes.len() > 1 || levels.is_empty() {
            let nodes: Vec<Node> = boxes.chunks(CHILDREN).map(Node::over).collect();
            boxes = boxes.chunks(CHILDREN).map(around).collect();
            levels.push(nodes);
        }
        Self { shapes, order, levels }
    }

    /// Whether there is nothing to measure from.
    pub(crate) fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// The diagonal of its box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let corners = self.shapes.iter().map(bounds);
        let (min, max) = corners.fold(NOTHING, joined);
        (max - min).max(DVec3::ZERO).length()
    }

    /// What is nearest to a point; the search starts from a shape that may be near.
    pub(super) fn nearest(&self, point: DVec3, known: Option<u32>) -> Nearest {
        let mut best = known.map_or(
            Nearest {
                shape: 0,
                squared: f64::INFINITY,
            },
            |shape| self.distance(point, shape),
        );
        // What is to be looked at, nearest last: how far at least, how many levels above the shapes, which there.
        let mut stack = [(0.0, 0, 0); STACK];
        stack[0] = (0.0, self.levels.len(), 0);
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (squared, level, place) = stack[height];
            if squared >= best.squared {
                continue;
            }
            let Some(below) = level.checked_sub(1) else {
                let found = self.distance(point, self.order[place]);
                if found.squared < best.squared {
                    best = found;
                }
                continue;
            };
            let first = height;
            let children = self.levels[below]
                .get(place)
                .map_or([f64::INFINITY; CHILDREN], |node| node.squared_to(point));
            for (child, squared) in children.into_iter().enumerate() {
                if squared < best.squared {
                    let mut at = height;
                    while at > first && stack[at - 1].0 < squared {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = (squared, below, CHILDREN * place + child);
                    height += 1;
                }
            }
        }
        best
    }

    fn distance(&self, point: DVec3, shape: u32) -> Nearest {
        let squared = point_distance_squared(point, &self.shapes[shape as usize]);
        Nearest { shape, squared }
    }
}

/// The boxes of a node's children, axis by axis.
struct Node {
    low: [[f64; CHILDREN]; 3],
    high: [[f64; CHILDREN]; 3],
}

impl Node {
    /// Over up to four boxes; nothing is near to those that are missing.
    fn over(boxes: &[(DVec3, DVec3)]) -> Self {
        let side = |i: usize| boxes.get(i).copied().unwrap_or(NOTHING);
        Self {
            low: std::array::from_fn(|axis| std::array::from_fn(|i| side(i).0[axis])),
            high: std::array::from_fn(|axis| std::array::from_fn(|i| side(i).1[axis])),
        }
    }

    /// No shape in a child is nearer to a point than the root of this.
    #[inline(always)]
    fn squared_to(&self, point: DVec3) -> [f64; CHILDREN] {
        // Unlike `f64::max`, this is one instruction; nothing here is NaN.
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let mut squared = [0.0; CHILDREN];
        for axis in 0..3 {
            let (at, low, high) = (point[axis], &self.low[axis], &self.high[axis]);
            for i in 0..CHILDREN {
                let gap = larger(larger(low[i] - at, at - high[i]), 0.0);
                squared[i] += gap * gap;
            }
        }
        squared
    }
}

/// The box around nothing.
const NOTHING: (DVec3, DVec3) = (DVec3::INFINITY, DVec3::NEG_INFINITY);

fn joined(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

fn around(boxes: &[(DVec3, DVec3)]) -> (DVec3, DVec3) {
    boxes.iter().copied().fold(NOTHING, joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_that_of_looking_at_all() {
        let mut state = 1u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % below
        };
        for count in [1, 2, 4, 5, 17, 300] {
            let mut point = |below| DVec3::from_array([0; 3].map(|_| f64::from(random(below))));
            // Some without area.
            let shapes: Vec<Corners> = (0..count)
                .map(|_| {
                    let at = point(90);
                    [at, at + point(9), at + point(3)]
                })
                .collect();
            let surface = Surface::of_shapes(shapes.clone());
            for i in 0..100 {
                let point = point(100);
                let squared = shapes
                    .iter()
                    .map(|shape| point_distance_squared(point, shape))
                    .fold(f64::INFINITY, f64::min);
                for known in [None, Some(i % count)] {
                    let nearest = surface.nearest(point, known);
                    assert_eq!(nearest.squared, squared);
                    assert_eq!(point_distance_squared(point, &shapes[nearest.shape as usize]), squared);
                }
            }
        }
    }

    #[test]
    fn nothing_is_infinitely_far() {
        let nothing = Surface::of_shapes(Vec::new());
        assert_eq!(
            (nothing.nearest(DVec3::ZERO, None).squared, nothing.diagonal()),
            (f64::INFINITY, 0.0)
        );
    }
}
