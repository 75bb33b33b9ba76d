//! Which occluders does a ray come near? A uniform grid, walked from cell to cell (Amanatides & Woo 1987, *A fast voxel
//! traversal algorithm for ray tracing*).

use glam::Vec3;

use crate::occluders::Body;

/// About so many cells for each body.
const CELLS_PER_BODY: f32 = 8.0;
/// Never more cells than this along an axis.
const MOST: f32 = 256.0;

/// Bodies by the cells of a grid that their boxes meet.
pub(super) struct Grid {
    min: Vec3,
    cell_m: Vec3,
    counts: [usize; 3],
    bodies: Vec<Vec<u32>>,
}

impl Grid {
    pub(super) fn new(all: &[Body]) -> Self {
        // What a body stands on is as good as the body.
        let lower = |body: &Body| body.min.min(body.min.with_y(body.stands_m));
        let min = all.iter().fold(Vec3::INFINITY, |min, b| min.min(lower(b)));
        let max = all.iter().fold(Vec3::NEG_INFINITY, |max, b| max.max(b.max));
        let size = if all.is_empty() { Vec3::ONE } else { max - min };
        let size = size.max(Vec3::splat(1e-3 * size.max_element().max(f32::MIN_POSITIVE)));
        let edge_m = (size.element_product() / (CELLS_PER_BODY * all.len().max(1) as f32)).cbrt();
        let counts = (size / edge_m).ceil().clamp(Vec3::ONE, Vec3::splat(MOST));
        let mut grid = Self {
            min: if all.is_empty() { Vec3::ZERO } else { min },
            cell_m: size / counts,
            counts: counts.to_array().map(|n| n as usize),
            bodies: vec![Vec::new(); counts.element_product() as usize],
        };
        for (index, body) in all.iter().enumerate() {
            let [from, to] = [lower(body), body.max].map(|p| grid.cell(p));
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    for x in from[0]..=to[0] {
                        let at = grid.index([x, y, z]);
                        grid.bodies[at].push(index as u32);
                    }
                }
            }
        }
        grid
    }

    fn cell(&self, point: Vec3) -> [usize; 3] {
        let at = (point - self.min) / self.cell_m;
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.counts[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Visits each active body in the cells that a segment passes, once.
    pub(super) fn along(&self, [from, to]: [Vec3; 2], active: &[bool], visit: &mut dyn FnMut(u32)) {
        let along = to - from;
        let end = self.min + self.cell_m * Vec3::from(self.counts.map(|n| n as f32));
        let (mut enter, mut leave) = (0.0f32, 1.0f32);
        for axis in 0..3 {
            let [a, b] = [self.min[axis], end[axis]].map(|side| (side - from[axis]) / along[axis]);
            if along[axis] != 0.0 {
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            } else if from[axis] < self.min[axis] || from[axis] > end[axis] {
                return;
            }
        }
        if enter > leave {
            return;
        }
        let mut cell = self.cell(from + enter * along);
        let mut seen: Vec<u32> = Vec::new();
        // Where the segment leaves the cell along each axis, and how far it is from there to the next.
        let mut next = [f32::INFINITY; 3];
        let mut step = [f32::INFINITY; 3];
        for axis in (0..3).filter(|axis| along[*axis] != 0.0) {
            let side = cell[axis] + usize::from(along[axis] > 0.0);
            next[axis] = (self.min[axis] + side as f32 * self.cell_m[axis] - from[axis]) / along[axis];
            step[axis] = (self.cell_m[axis] / along[axis]).abs();
        }
        loop {
            for body in &self.bodies[self.index(cell)] {
                if active[*body as usize] && !seen.contains(body) {
                    seen.push(*body);
                    visit(*body);
                }
            }
            let axis = Vec3::from(next).min_position();
            if next[axis] > leave {
                return;
            }
            next[axis] += step[axis];
            let moved = if along[axis] > 0.0 {
                Some(cell[axis] + 1).filter(|at| *at < self.counts[axis])
            } else {
                cell[axis].checked_sub(1)
            };
            match moved {
                Some(at) => cell[axis] = at,
                None => return,
            }
        }
    }
}
