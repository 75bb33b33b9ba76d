//! How many cells must be closed to leave so many shapes?
//!
//! Closing cells only ever takes shapes away, so the number is found by bisection: each guess is a cut of the octree and
//! a look at the shapes that the level before had left. From level to level this is a fixed share of the work.

use rayon::prelude::*;

use crate::lod::octree::{Clusters, Octree};
use crate::source::{Primitive, Topology};

/// Close enough to what was asked for.
const TOLERANCE: f64 = 0.02;
/// Most guesses for one level.
const GUESSES: usize = 12;

/// Cuts of an octree, finest first.
pub(super) struct Reduction {
    octree: Octree,
    /// Points of the shapes that are left; short ones repeat the last.
    left: Vec<[u32; 3]>,
    closed: usize,
}

impl Reduction {
    pub(super) fn new(octree: Octree, primitives: &[Primitive]) -> Self {
        let mut left = Vec::new();
        for (p, primitive) in primitives.iter().enumerate() {
            let points = octree.points_of(p);
            let arity = primitive.topology.arity();
            let shape = |shape: &[u32]| [0, 1, 2].map(|corner: usize| points[shape[corner.min(arity - 1)] as usize]);
            left.extend(primitive.indices.chunks_exact(arity).map(shape));
            if primitive.topology == Topology::Points {
                left.sort_unstable();
                left.dedup();
            }
        }
        Self {
            octree,
            left,
            closed: 0,
        }
    }

    /// The clusters that leave at most so many shapes, or as few as can be. To be asked for ever fewer.
    pub(super) fn clusters_for(&mut self, target: usize) -> Clusters {
        self.close_for(target);
        self.octree.clusters(self.closed)
    }

    fn close_for(&mut self, target: usize) {
        let (mut enough, mut too_few) = (self.octree.cell_count(), self.closed);
        let mut clusters = self.octree.point_count() as f64;
        let mut per_cluster = self.left.len() as f64 / clusters.max(1.0);
        for guess in 0..GUESSES {
            clusters = target as f64 / per_cluster.max(f64::MIN_POSITIVE);
            let mut closed = self.octree.closed_for(clusters as usize);
            if guess >= GUESSES / 2 || closed <= too_few || closed >= enough {
                closed = too_few.midpoint(enough);
            }
            if closed == too_few {
                break;
            }
            let shapes = self.shapes_left(closed);
            if shapes <= target {
                enough = closed;
                if shapes as f64 >= (1.0 - TOLERANCE) * target as f64 {
                    break;
                }
            } else {
                too_few = closed;
            }
            per_cluster = shapes.max(1) as f64 / self.octree.clusters_after(closed).max(1) as f64;
        }
        self.closed = enough;
        let (of_point, _) = self.octree.cut(enough);
        self.left.retain(|shape| is_left(&of_point, *shape));
    }

    /// Triangles that keep their corners apart, and lines and points that differ.
    fn shapes_left(&self, closed: usize) -> usize {
        let (of_point, _) = self.octree.cut(closed);
        let shapes = self.left.par_iter().with_min_len(1 << 12);
        let left = shapes.filter(|shape| is_left(&of_point, **shape));
        let triangles = left.clone().filter(|shape| !is_thin(**shape)).count();
        let ends = |[a, _, b]: &[u32; 3]| [*a, *b].map(|point| of_point[point as usize]);
        let mut thin: Vec<_> = left.filter(|shape| is_thin(**shape)).map(ends).collect();
        thin.par_iter_mut().for_each(|ends| ends.sort_unstable());
        thin.par_sort_unstable();
        thin.dedup();
        triangles + thin.len()
    }
}

/// Whether a shape is a line or a point.
fn is_thin(shape: [u32; 3]) -> bool {
    shape[1] == shape[2]
}

/// Whether a shape is still what it was: all its corners in different clusters.
fn is_left(of_point: &[u32], shape: [u32; 3]) -> bool {
    let [a, b, c] = shape;
    let [ca, cb, cc] = shape.map(|point| of_point[point as usize]);
    (ca != cb || a == b) && (cb != cc || b == c) && (cc != ca || c == a)
}
