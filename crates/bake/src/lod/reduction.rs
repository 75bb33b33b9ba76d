//! How many cells must be closed to leave so many shapes?
//!
//! A triangle is one until two of its corners fall together, which is known of all triangles at once
//! ([`super::ancestry`]): so how many are left is a table. Lines and points count once wherever several fall together, so
//! how many of those are left is found by looking.

use crate::lod::octree::{Clusters, Octree};
use crate::source::Primitive;

/// Close enough to what was asked for, where there are lines or points.
const TOLERANCE: f64 = 0.02;

/// Cuts of an octree, finest first.
pub(super) struct Reduction {
    octree: Octree,
    /// For each number of closed cells, how many triangles have their corners apart.
    triangles_left: Vec<u32>,
    /// Ends of the lines that are left; points have one place twice.
    thin: Vec<[u32; 2]>,
    closed: usize,
}

impl Reduction {
    pub(super) fn new(octree: Octree, primitives: &[Primitive]) -> Self {
        let ancestry = octree.ancestry();
        let mut thin = Vec::new();
        // How many triangles are lost when a cell is closed; the last place counts those that never are.
        let mut lost = vec![0u32; octree.cell_count() + 1];
        for (p, primitive) in primitives.iter().enumerate() {
            let points = octree.points_of(p);
            let arity = primitive.topology.arity();
            for shape in primitive.indices.chunks_exact(arity) {
                let mut corners = [0, 1, 2].map(|corner: usize| points[shape[corner.min(arity - 1)] as usize]);
                if corners[1] == corners[2] {
                    thin.push([corners[0], corners[1]]);
                    continue;
                }
                // Of three in a row the outer two fall together last.
                corners.sort_unstable();
                let [a, b, c] = corners;
                let until = [(a, b), (b, c)]
                    .into_iter()
                    .filter(|(from, to)| from != to)
                    .filter_map(|(from, to)| ancestry.apart_until(from, to));
                lost[until.min().map_or(octree.cell_count(), |rank| rank as usize)] += 1;
            }
        }
        let mut left = 0;
        for lost in lost.iter_mut().rev() {
            left += *lost;
            *lost = left;
        }
        Self {
            octree,
            triangles_left: lost,
            thin,
            closed: 0,
        }
    }

    /// The clusters that leave at most so many shapes, or as few as can be. To be asked for ever fewer.
    pub(super) fn clusters_for(&mut self, target: usize) -> Clusters {
        let enough = self.triangles_left.partition_point(|&left| left as usize > target);
        self.closed = enough.clamp(self.closed, self.octree.cell_count());
        if !self.thin.is_empty() {
            self.close_for(target);
        }
        self.octree.clusters(self.closed)
    }

    /// Closes more cells until lines and points are few enough, too.
    fn close_for(&mut self, target: usize) {
        let (mut too_few, mut enough) = (self.closed, self.octree.cell_count());
        let mut closed = too_few;
        while too_few < enough {
            let shapes = self.triangles_left[closed] as usize + self.thin_left(closed);
            if shapes > target {
                too_few = closed + 1;
            } else {
                enough = closed;
                if shapes as f64 >= (1.0 - TOLERANCE) * target as f64 {
                    break;
                }
            }
            closed = too_few.midpoint(enough);
        }
        self.closed = enough;
        let (of_point, _) = self.octree.cut(enough);
        self.thin.retain(|ends| is_left(&of_point, *ends));
    }

    /// Lines and points that differ.
    fn thin_left(&self, closed: usize) -> usize {
        let (of_point, _) = self.octree.cut(closed);
        let left = self.thin.iter().filter(|ends| is_left(&of_point, **ends));
        let mut ends: Vec<[u32; 2]> = left.map(|ends| ends.map(|point| of_point[point as usize])).collect();
        ends.iter_mut().for_each(|ends| ends.sort_unstable());
        ends.sort_unstable();
        ends.dedup();
        ends.len()
    }
}

/// Whether a line is still one, or was always a point.
fn is_left(of_point: &[u32], [a, b]: [u32; 2]) -> bool {
    a == b || of_point[a as usize] != of_point[b as usize]
}
