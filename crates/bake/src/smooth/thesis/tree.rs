//! Which two clusters are joined next? The two whose representatives are closest (Schmalstieg 1997, §7.2).
//!
//! One of the two representatives stands for both: that of the cluster of more vertices, so the set of representatives
//! only shrinks, and a k-d tree over all vertices that skips those that are gone finds the nearest (Bentley 1975).
//! Cost: about n log n.

use std::{cmp::Reverse, collections::BinaryHeap};

/// All joints, from vertices to the root.
pub(super) struct ClusterTree {
    pub(super) joints: Vec<Joint>,
    /// The vertex that is left.
    pub(super) root: u32,
}

/// Two clusters become one.
pub(super) struct Joint {
    /// The representative that stands for both.
    pub(super) kept: u32,
    /// The other.
    pub(super) gone: u32,
    /// Triangles that have `kept` where they had `gone`, rising.
    pub(super) updated: Vec<u32>,
    /// Triangles that had both.
    pub(super) collapsed: Vec<Collapsed>,
}

/// A triangle that became a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collapsed {
    pub(super) triangle: u32,
    /// Its corner that is neither of the two, at that time.
    pub(super) third: u32,
    /// Whether it goes from `kept` to `gone` to the third; else from `gone` to `kept`.
    pub(super) turned: bool,
}

impl ClusterTree {
    /// The tree of vertices, of which there must be one.
    pub(super) fn of(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let mut living = Living::of(positions);
        let mut events = Events::of(positions.len(), triangles);
        let mut size = vec![1u32; positions.len()];
        // Distances are not negative, so their bits are in order.
        let mut closest: BinaryHeap<Reverse<(u64, u32, u32)>> = BinaryHeap::new();
        closest.extend((0..positions.len() as u32).filter_map(|v| living.nearest(v).map(Reverse)));
        let mut joints = Vec::with_capacity(positions.len().saturating_sub(1));
        while let Some(Reverse((_, a, b))) = closest.pop() {
            if living.is_gone(a) {
                continue;
            }
            if !living.is_gone(b) {
                let [kept, gone] = if size[b as usize] > size[a as usize] {
                    [b, a]
                } else {
                    [a, b]
                };
                size[kept as usize] += size[gone as usize];
                living.remove(gone);
                joints.push(events.join(kept, gone));
                if gone == a {
                    continue;
                }
            }
            closest.extend(living.nearest(a).map(Reverse));
        }
        let root = joints.last().map_or(0, |joint: &Joint| joint.kept);
        Self { joints, root }
    }
}

/// What happens to triangles.
struct Events {
    triangles: Vec<[u32; 3]>,
    collapsed: Vec<bool>,
    around: Vec<Vec<u32>>,
}

impl Events {
    fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut around = vec![Vec::new(); vertices];
        for (number, corners) in (0u32..).zip(triangles) {
            corners.iter().for_each(|v| around[*v as usize].push(number));
        }
        Self {
            triangles: triangles.to_vec(),
            collapsed: vec![false; triangles.len()],
            around,
        }
    }

    fn join(&mut self, kept: u32, gone: u32) -> Joint {
        let mut joint = Joint {
            kept,
            gone,
            updated: Vec::new(),
            collapsed: Vec::new(),
        };
        for triangle in std::mem::take(&mut self.around[gone as usize]) {
            if self.collapsed[triangle as usize] {
                continue;
            }
            let corners = &mut self.triangles[triangle as usize];
            let at = |v: u32, corners: &[u32; 3]| corners.iter().position(|corner| *corner == v);
            match (at(gone, corners), at(kept, corners)) {
                (Some(from), Some(to)) => {
                    self.collapsed[triangle as usize] = true;
                    joint.collapsed.push(Collapsed {
                        triangle,
                        third: corners[3 - from - to],
                        turned: (to + 1) % 3 == from,
                    });
                }
                (Some(from), None) => {
                    corners[from] = kept;
                    self.around[kept as usize].push(triangle);
                    joint.updated.push(triangle);
                }
                _ => {}
            }
        }
        joint.updated.sort_unstable();
        joint
    }
}

/// Vertices of which some are gone, in a k-d tree: the middle of each range splits it.
struct Living<'a> {
    positions: &'a [[f32; 3]],
    order: Vec<u32>,
    /// Where each vertex stands in `order`.
    place: Vec<u32>,
    /// By place: how many of the range that it splits live.
    living: Vec<u32>,
    gone: Vec<bool>,
}

impl<'a> Living<'a> {
    fn of(positions: &'a [[f32; 3]]) -> Self {
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        let mut living = vec![0; positions.len()];
        sort(&mut order, &mut living, positions, 0);
        let mut place = vec![0; positions.len()];
        (0u32..).zip(&order).for_each(|(at, v)| place[*v as usize] = at);
        Self {
            positions,
            order,
            place,
            living,
            gone: vec![false; positions.len()],
        }
    }

    fn is_gone(&self, vertex: u32) -> bool {
        self.gone[vertex as usize]
    }

    fn remove(&mut self, vertex: u32) {
        self.gone[vertex as usize] = true;
        let target = self.place[vertex as usize] as usize;
        let (mut from, mut to) = (0usize, self.order.len());
        loop {
            let middle = from.midpoint(to);
            self.living[middle] -= 1;
            match target.cmp(&middle) {
                std::cmp::Ordering::Less => to = middle,
                std::cmp::Ordering::Greater => from = middle + 1,
                std::cmp::Ordering::Equal => return,
            }
        }
    }

    /// The squared distance (its bits), the vertex, and the nearest other one; `None` when there is no other.
    fn nearest(&self, vertex: u32) -> Option<(u64, u32, u32)> {
        let mut best: Option<(u64, u32)> = None;
        self.search(vertex, 0, self.order.len(), 0, &mut best);
        best.map(|(bits, other)| (bits, vertex, other))
    }

    fn search(&self, vertex: u32, from: usize, to: usize, axis: usize, best: &mut Option<(u64, u32)>) {
        let middle = from.midpoint(to);
        if from >= to || self.living[middle] == 0 {
            return;
        }
        let at = self.positions[vertex as usize];
        let here = self.order[middle];
        let split = self.positions[here as usize];
        if here != vertex && !self.gone[here as usize] {
            let found = (distance2(at, split).to_bits(), here);
            if best.is_none_or(|best| found < best) {
                *best = Some(found);
            }
        }
        let off = f64::from(at[axis]) - f64::from(split[axis]);
        let (low, high) = ((from, middle), (middle + 1, to));
        let (near, far) = if off < 0.0 { (low, high) } else { (high, low) };
        let next = (axis + 1) % 3;
        self.search(vertex, near.0, near.1, next, best);
        if best.is_none_or(|best| (off * off).to_bits() <= best.0) {
            self.search(vertex, far.0, far.1, next, best);
        }
    }
}

fn sort(order: &mut [u32], living: &mut [u32], positions: &[[f32; 3]], axis: usize) {
    if order.is_empty() {
        return;
    }
    let middle = order.len() / 2;
    let by = |a: &u32, b: &u32| {
        let [x, y] = [*a, *b].map(|v| positions[v as usize][axis]);
        x.total_cmp(&y).then(a.cmp(b))
    };
    order.select_nth_unstable_by(middle, by);
    living[middle] = order.len() as u32;
    let next = (axis + 1) % 3;
    let ((low, high), (low_living, high_living)) = (order.split_at_mut(middle), living.split_at_mut(middle));
    sort(low, low_living, positions, next);
    sort(&mut high[1..], &mut high_living[1..], positions, next);
}

fn distance2(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_are_joined_first_and_the_larger_cluster_stands_for_both() {
        let positions = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [10.0, 3.0, 0.0]];
        let tree = ClusterTree::of(&positions, &[[0, 1, 2], [3, 2, 1], [0, 2, 3]]);
        let pairs: Vec<_> = tree.joints.iter().map(|j| (j.kept, j.gone)).collect();
        assert_eq!(pairs, [(1, 2), (1, 3), (1, 0)]);
        assert_eq!(tree.root, 1);
        let first = &tree.joints[0];
        assert_eq!(first.updated, [2]);
        let collapsed: Vec<_> = first
            .collapsed
            .iter()
            .map(|c| (c.triangle, c.third, c.turned))
            .collect();
        assert_eq!(collapsed, [(0, 0, true), (1, 3, false)]);
    }

    #[test]
    fn many_places_at_once_are_no_trouble() {
        let positions = vec![[1.0, 2.0, 3.0]; 2000];
        assert_eq!(ClusterTree::of(&positions, &[]).joints.len(), 1999);
    }
}
