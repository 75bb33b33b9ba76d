//! Which shape is near?
//!
//! A bounding-volume tree over triangles, lines and points in Morton order: a complete binary tree over leaves of four
//! shapes, so that it is one array without pointers. f64 throughout; distances are in model-space units.

use std::sync::OnceLock;

use glam::DVec3;

use crate::lod::octree::morton_order;
use crate::lod::patches::Patches;
use crate::source::Primitive;

/// Shapes in a leaf.
const LEAF_SHAPES: usize = 4;

/// A triangle; lines and points repeat a corner.
pub(crate) type Corners = [DVec3; 3];

/// Shapes that can be asked for the nearest one.
pub(crate) struct ShapeTree {
    /// In source order: all shapes of primitive 0, then of primitive 1, …
    pub(crate) shapes: Vec<Corners>,
    order: Vec<u32>,
    /// Node i has the children 2i + 1 and 2i + 2; the last `leaves` nodes are leaves.
    boxes: Vec<(DVec3, DVec3)>,
    leaves: usize,
    /// Made when they are first asked for.
    patches: OnceLock<Patches>,
}

/// A shape and how far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Near {
    /// Index into [`ShapeTree::shapes`].
    pub(crate) shape: u32,
    /// In model-space units.
    pub(crate) distance: f64,
}

/// All shapes of some primitives, in their order.
pub(crate) fn shapes_of<'a>(primitives: impl IntoIterator<Item = &'a Primitive>) -> Vec<Corners> {
    let mut shapes = Vec::new();
    for primitive in primitives {
        let arity = primitive.topology.arity();
        for shape in primitive.indices.chunks_exact(arity) {
            let corner = |i: usize| {
                let position = primitive.positions[shape[i.min(arity - 1)] as usize];
                DVec3::from_array(position.map(f64::from))
            };
            shapes.push([corner(0), corner(1), corner(2)]);
        }
    }
    shapes
}

impl ShapeTree {
    /// All shapes of some primitives.
    pub(crate) fn of<'a>(primitives: impl IntoIterator<Item = &'a Primitive>) -> Self {
        Self::new(shapes_of(primitives))
    }

    /// Of shapes one by one.
    pub(crate) fn new(shapes: Vec<Corners>) -> Self {
        let centers: Vec<DVec3> = shapes.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let order = morton_order(&centers);
        let leaves = shapes.len().div_ceil(LEAF_SHAPES).next_power_of_two();
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); 2 * leaves - 1];
        for (leaf, members) in order.chunks(LEAF_SHAPES).enumerate() {
            let corners = members.iter().flat_map(|&shape| shapes[shape as usize]);
            boxes[leaves - 1 + leaf] = corners.fold(boxes[leaves - 1 + leaf], |(min, max), p| (min.min(p), max.max(p)));
        }
        for node in (0..leaves - 1).rev() {
            let (a, b) = (boxes[2 * node + 1], boxes[2 * node + 2]);
            boxes[node] = (a.0.min(b.0), a.1.max(b.1));
        }
        Self {
            shapes,
            order,
            boxes,
            leaves,
            patches: OnceLock::new(),
        }
    }

    /// Its flat patches.
    pub(super) fn patches(&self) -> &Patches {
        self.patches.get_or_init(|| Patches::of(&self.shapes, self.diagonal()))
    }

    /// Length of the diagonal of the box around everything.
    pub(crate) fn diagonal(&self) -> f64 {
        let (min, max) = self.boxes[0];
        (max - min).max(DVec3::ZERO).length()
    }

    /// The one shape from which none of some points is far: the smallest, over all shapes, of the largest distance of
    /// a point from it. Starts from `known` and stops at the first shape within `enough`.
    pub(crate) fn nearest_to_all(&self, points: &[DVec3], known: Option<u32>, enough: f64) -> Near {
        // Squares throughout: the nearest is the same, and most shapes are given up without a root.
        let (mut best, mut best_squared) = match known {
            Some(shape) => (
                shape,
                squared_to_all(points, &self.shapes[shape as usize], f64::INFINITY),
            ),
            None => (0, f64::INFINITY),
        };
        let enough_squared = enough * enough;
        // Distance is convex: the middle of the points is not farther from a shape than the farthest of them.
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut stack = [(0usize, 0.0f64); 64];
        stack[0] = (0, self.squared_to_box(middle, 0));
        let mut height = 1;
        while height > 0 && best_squared > enough_squared {
            height -= 1;
            let (node, squared) = stack[height];
            if squared >= best_squared {
                continue;
            }
            if node >= self.leaves - 1 {
                let first = (node - (self.leaves - 1)) * LEAF_SHAPES;
                let end = (first + LEAF_SHAPES).min(self.order.len());
                for &shape in self.order.get(first..end).unwrap_or_default() {
                    let corners = &self.shapes[shape as usize];
                    // Most are far from what is nearest, which their boxes say at a fifth of the price.
                    if squared_to_bounds(middle, bounds(corners)) >= best_squared {
                        continue;
                    }
                    let squared = squared_to_all(points, corners, best_squared);
                    if squared < best_squared {
                        (best, best_squared) = (shape, squared);
                    }
                }
            } else {
                let (left, right) = (2 * node + 1, 2 * node + 2);
                let left = (left, self.squared_to_box(middle, left));
                let right = (right, self.squared_to_box(middle, right));
                // The nearer one is looked at first.
                let (near, far) = if left.1 < right.1 { (left, right) } else { (right, left) };
                for child in [far, near] {
                    if child.1 < best_squared {
                        stack[height] = child;
                        height += 1;
                    }
                }
            }
        }
        Near {
            shape: best,
            distance: best_squared.sqrt(),
        }
    }

    /// No shape in a node is nearer than the root of this.
    #[inline(always)]
    fn squared_to_box(&self, point: DVec3, node: usize) -> f64 {
        squared_to_bounds(point, self.boxes[node])
    }
}

/// The box around a shape.
pub(crate) fn bounds(&[a, b, c]: &Corners) -> (DVec3, DVec3) {
    (a.min(b).min(c), a.max(b).max(c))
}

#[inline(always)]
fn squared_to_bounds(point: DVec3, (min, max): (DVec3, DVec3)) -> f64 {
    (min - point).max(point - max).max(DVec3::ZERO).length_squared()
}

/// The largest squared distance of a point from a shape, or one that is not below `limit`.
fn squared_to_all(points: &[DVec3], shape: &Corners, limit: f64) -> f64 {
    let mut largest = 0.0;
    for point in points {
        largest = f64::max(largest, point_distance_squared(*point, shape));
        if largest >= limit {
            break;
        }
    }
    largest
}

/// Squared distance from a point to a triangle, line or point; never less than the true one but for rounding.
pub(crate) fn point_distance_squared(point: DVec3, &[a, b, c]: &Corners) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let normal = ab.cross(ac);
    let normal_squared = normal.length_squared();
    // Flatter than this, the normal is noise: the edges alone are as near as matters, and never too near.
    if normal_squared > 1e-20 * ab.length_squared() * ac.length_squared() {
        let v = ap.cross(ac).dot(normal);
        let w = ab.cross(ap).dot(normal);
        if v >= 0.0 && w >= 0.0 && v + w <= normal_squared {
            return ap.dot(normal).powi(2) / normal_squared;
        }
    }
    segment_distance_squared(point, a, b)
        .min(segment_distance_squared(point, b, c))
        .min(segment_distance_squared(point, c, a))
}

fn segment_distance_squared(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (ab, ap) = (b - a, point - a);
    let length_squared = ab.length_squared();
    if length_squared == 0.0 {
        return ap.length_squared();
    }
    let t = (ap.dot(ab) / length_squared).clamp(0.0, 1.0);
    (ap - ab * t).length_squared()
}
