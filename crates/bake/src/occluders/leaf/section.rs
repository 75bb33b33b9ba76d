//! What does a plane cut out of the closed parts of a door?
//!
//! The curves in which it meets their faces, with the inside to their left. A sight line that crosses the plane inside has come in
//! through a face, from its front.

use glam::{DVec2, DVec3};

use super::super::parts::Part;

/// A closed part of a door whose faces hide from outside.
pub(super) struct Solid {
    /// In the frame of the door.
    faces: Vec<[DVec3; 3]>,
    /// −1 where its faces look inwards, and hide from both sides.
    sign: i32,
    /// The box around it: across the door along z.
    min: DVec3,
    max: DVec3,
}

impl Solid {
    /// `None` for a part that is open, or seen through, or seen into from behind its faces.
    pub(super) fn of(part: &Part<'_>, place: impl Fn(glam::Vec3) -> DVec3) -> Option<Self> {
        let sign = part.encloses()?;
        let faces: Vec<_> = part.triangles.iter().map(|face| face.corners.map(&place)).collect();
        let corners = || faces.iter().flatten().copied();
        let min = corners().fold(DVec3::INFINITY, DVec3::min);
        let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        Some(Self { faces, sign, min, max })
    }

    /// Whether the box around it and that around another lie in each other by more than this.
    pub(super) fn meets(&self, other: &Self, by_m: f64) -> bool {
        let common = self.max.min(other.max) - self.min.max(other.min);
        common.min_element() > by_m
    }

    /// How far out its corners lie.
    pub(super) fn corner_depths(&self) -> impl Iterator<Item = f64> + '_ {
        self.faces.iter().flatten().map(|corner| corner.z)
    }

    /// What a plane at this depth cuts out of it.
    pub(super) fn section(&self, depth: f64) -> Section {
        let cut = |[a, b, c]: &[DVec3; 3]| {
            let (mut up, mut down) = (None, None);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let at = || from.lerp(*to, (depth - from.z) / (to.z - from.z)).truncate();
                match (from.z > depth, to.z > depth) {
                    (false, true) => up = Some(at()),
                    (true, false) => down = Some(at()),
                    _ => {}
                }
            }
            Some([down?, up?])
        };
        let is_outside = depth < self.min.z || self.max.z <= depth;
        let mut edges: Vec<_> = if is_outside {
            Vec::new()
        } else {
            self.faces.iter().filter_map(cut).collect()
        };
        if self.sign < 0 {
            edges.iter_mut().for_each(|edge| edge.reverse());
        }
        Section { edges }
    }
}

/// Edges of areas, which lie to their left.
pub(super) struct Section {
    pub(super) edges: Vec<[DVec2; 2]>,
}

impl Section {
    pub(super) fn area_m2(&self) -> f64 {
        self.edges.iter().map(|[a, b]| 0.5 * a.perp_dot(*b)).sum()
    }

    /// Marks the squares of a grid that lie inside, but for a border of this width: rows of them along the first axis.
    pub(super) fn fill(&self, lines: &[Vec<f32>; 2], border_m: f64, squares: &mut [bool]) {
        let columns = lines[0].len() - 1;
        let ends = |axis: usize, at: usize| [lines[axis][at], lines[axis][at + 1]].map(f64::from);
        let mut is_cut = vec![false; squares.len()];
        for edge in &self.edges {
            let [low, high] = [edge[0].min(edge[1]), edge[0].max(edge[1])].map(|corner| corner.to_array());
            let [u, v] = [0, 1].map(|axis| {
                let first = lines[axis].partition_point(|line| f64::from(*line) < low[axis]);
                let end = lines[axis].partition_point(|line| f64::from(*line) <= high[axis]);
                first.saturating_sub(1)..end.min(lines[axis].len() - 1)
            });
            for j in v {
                for i in u.clone() {
                    is_cut[j * columns + i] |= meets(edge, [ends(0, i), ends(1, j)], border_m);
                }
            }
        }
        for (j, row) in squares.chunks_mut(columns).enumerate() {
            let [low, high] = ends(1, j);
            let crossings = self.crossings(0.5 * (low + high));
            for (i, square) in row.iter_mut().enumerate() {
                let [low, high] = ends(0, i);
                let beyond = crossings.iter().filter(|(at, _)| *at > 0.5 * (low + high));
                *square |= !is_cut[j * columns + i] && beyond.map(|(_, turn)| turn).sum::<i32>() > 0;
            }
        }
    }

    /// Where edges cross a row, and whether the inside is before or behind.
    fn crossings(&self, v: f64) -> Vec<(f64, i32)> {
        let crossing = |[a, b]: &[DVec2; 2]| {
            let turn = match (a.y > v, b.y > v) {
                (false, true) => 1,
                (true, false) => -1,
                _ => return None,
            };
            Some((a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x), turn))
        };
        self.edges.iter().filter_map(crossing).collect()
    }
}

/// Whether an edge comes into a rectangle further than its border (Liang & Barsky, *A new concept and method for line clipping*,
/// 1984).
fn meets([a, b]: &[DVec2; 2], rectangle: [[f64; 2]; 2], border_m: f64) -> bool {
    let (mut enters, mut leaves) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let [low, high] = [rectangle[axis][0] + border_m, rectangle[axis][1] - border_m];
        let (from, along) = (a[axis], b[axis] - a[axis]);
        if along == 0.0 {
            if from <= low || high <= from {
                return false;
            }
            continue;
        }
        let [first, last] = [(low - from) / along, (high - from) / along];
        enters = enters.max(first.min(last));
        leaves = leaves.min(first.max(last));
    }
    enters < leaves
}
