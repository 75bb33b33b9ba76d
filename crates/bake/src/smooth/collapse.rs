//! In what order is a mesh coarsened? The cluster tree, as passes of collapses that do not touch each other.
//!
//! Every collapse moves one vertex onto another (half-edge collapses, Hoppe 1996; as in Schmalstieg's cluster tree, §7.2,
//! the representative is one of the two) along the edge with the least quadric error (Garland & Heckbert 1997). A vertex
//! that has lost all its triangles joins its neighbour in Morton order, so that in the end one vertex is left.

use glam::DVec3;

use super::quadric::Quadric;
use super::quantise::QuantisedMesh;
use crate::morton;

/// One collapse.
#[derive(Debug, Clone)]
pub(super) struct Collapse {
    /// The vertex that vanishes.
    pub(super) gone: u32,
    /// The one that it moves onto.
    pub(super) kept: u32,
    /// Where in [`ClusterTree::corners`] the corners are (three times the triangle, plus which) that move.
    first_corner: u32,
    corners: u32,
}

/// Collapses that can be undone in any order.
#[derive(Debug, Clone, Default)]
pub(super) struct Pass {
    pub(super) collapses: Vec<Collapse>,
    /// Nine in ten of its collapses deviate less, in steps of the lattice.
    pub(super) deviation: f64,
}

/// All collapses, finest first.
#[derive(Debug)]
pub(super) struct ClusterTree {
    pub(super) passes: Vec<Pass>,
    corners: Vec<u32>,
    /// Corners of triangles when all is collapsed.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The last vertex.
    pub(super) root: u32,
}

impl ClusterTree {
    /// Corners that a collapse moved.
    pub(super) fn corners(&self, collapse: &Collapse) -> &[u32] {
        &self.corners[collapse.first_corner as usize..][..collapse.corners as usize]
    }
}

/// At most this share of the vertices vanishes in one pass.
const SHARE: f64 = 0.42;
/// A pass with fewer of the vertices is small.
const SMALL_PASS: f64 = 0.05;
/// Only the cheapest are considered: so many of the vertices.
const CONSIDERED: f64 = 0.7;
/// Quadric error is blind along planes: a little of the squared distance keeps collapses short.
const LENGTH_WEIGHT: f64 = 1e-3;
/// Unit vectors point to the same side when their mean is as long.
const SAME_SIDE: f64 = 0.9;
/// A triangle may not turn farther: cosine.
const MOST_TURN: f64 = 0.2;

/// Collapses a mesh to one vertex. It must have one.
pub(super) fn cluster(mesh: &QuantisedMesh) -> ClusterTree {
    let mut work = Work::new(mesh);
    let mut passes = Vec::new();
    while work.live.len() > 1 {
        let pass = work.pass();
        passes.push(pass);
    }
    ClusterTree {
        passes,
        corners: work.moved,
        triangles: work.triangles,
        root: work.live[0],
    }
}

struct Work<'a> {
    mesh: &'a QuantisedMesh,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<u32>,
    live: Vec<u32>,
    quadrics: Vec<Quadric>,
    /// Corners of vertex v: `corners[first[v]..first[v + 1]]`, as of the beginning of the pass.
    first: Vec<u32>,
    corners: Vec<u32>,
    is_locked: Vec<bool>,
    is_gone: Vec<bool>,
    is_tired: Vec<bool>,
    moved: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Candidate {
    cost: f64,
    gone: u32,
    kept: u32,
    /// Whether triangles turn over.
    turns: bool,
}

impl<'a> Work<'a> {
    fn new(mesh: &'a QuantisedMesh) -> Self {
        let count = mesh.positions.len();
        let mut work = Self {
            mesh,
            positions: mesh
                .positions
                .iter()
                .map(|p| DVec3::from_array(p.map(f64::from)))
                .collect(),
            triangles: mesh.triangles.clone(),
            alive: (0..mesh.triangles.len() as u32).collect(),
            live: (0..count as u32).collect(),
            quadrics: vec![Quadric::default(); count],
            first: vec![0; count + 1],
            corners: Vec::new(),
            is_locked: vec![false; count],
            is_gone: vec![false; count],
            is_tired: vec![false; count],
            moved: Vec::new(),
        };
        work.add_planes();
        work
    }

    /// Planes of triangles, and upright ones along edges that only one triangle has.
    fn add_planes(&mut self) {
        let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * self.triangles.len());
        for (t, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (side, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
                edges.push((
                    u64::from(from.min(to)) << 32 | u64::from(from.max(to)),
                    3 * t as u32 + side as u32,
                ));
            }
            let Some((normal, area)) = unit(self.normal([a, b, c])) else {
                continue;
            };
            let quadric = Quadric::plane(normal, self.positions[a as usize], area / 2.0);
            for vertex in [a, b, c] {
                self.quadrics[vertex as usize].add(&quadric);
            }
        }
        edges.sort_unstable();
        for same in edges.chunk_by(|a, b| a.0 == b.0) {
            self.add_border(same);
        }
    }

    /// Upright planes along an edge where the surface ends: all its triangles, be it one or a double layer, lie to the
    /// same side of it. Without them what is flat would shrink for nothing.
    fn add_border(&mut self, same: &[(u64, u32)]) {
        let (mut inwards, mut count) = (DVec3::ZERO, 0.0);
        let mut planes = Vec::new();
        for &(_, corner) in same {
            let corners = self.triangles[corner as usize / 3];
            let (from, to) = (corners[corner as usize % 3], corners[(corner as usize + 1) % 3]);
            let Some((normal, _)) = unit(self.normal(corners)) else {
                continue;
            };
            let along = self.positions[to as usize] - self.positions[from as usize];
            let Some((upright, length)) = unit(normal.cross(along)) else {
                continue;
            };
            inwards += upright;
            count += 1.0;
            planes.push((
                Quadric::plane(upright, self.positions[from as usize], length * length),
                from,
                to,
            ));
        }
        if inwards.length_squared() < (SAME_SIDE * count) * (SAME_SIDE * count) {
            return;
        }
        for (quadric, from, to) in planes {
            for vertex in [from, to] {
                self.quadrics[vertex as usize].add(&quadric);
            }
        }
    }

    fn pass(&mut self) -> Pass {
        self.gather_corners();
        let mut candidates = self.candidates();
        candidates.sort_unstable_by(|a, b| a.cost.total_cmp(&b.cost).then(a.gone.cmp(&b.gone)));
        let most = ((self.live.len() as f64 * SHARE) as usize).max(1);
        let mut pass = Pass::default();
        let mut deviations = Vec::new();
        // Many stand in each other's way. Those that cost more shall not get their turn because of that.
        candidates.truncate(((self.live.len() as f64 * CONSIDERED) as usize).max(1));
        for Candidate { gone, kept, turns, .. } in candidates {
            if pass.collapses.len() >= most {
                break;
            }
            if self.is_locked[gone as usize] || self.is_locked[kept as usize] {
                continue;
            }
            // What has happened around since may have made it worse.
            if !turns && !pass.collapses.is_empty() && self.turned_area(gone, kept) > 0.0 {
                continue;
            }
            self.is_locked[gone as usize] = true;
            self.is_locked[kept as usize] = true;
            deviations.push(self.deviation(gone, kept));
            pass.collapses.push(self.collapse(gone, kept));
        }
        // Where many want to collapse onto the same few, others get their turn next time.
        let is_small = (pass.collapses.len() as f64) < self.live.len() as f64 * SMALL_PASS;
        self.is_tired.fill(false);
        for collapse in &pass.collapses {
            self.is_locked[collapse.kept as usize] = false;
            self.is_tired[collapse.kept as usize] = is_small;
        }
        self.live.retain(|&v| !self.is_gone[v as usize]);
        let triangles = &self.triangles;
        self.alive.retain(|&t| !is_degenerate(triangles[t as usize]));
        deviations.sort_unstable_by(f64::total_cmp);
        pass.deviation = deviations.get(deviations.len() * 9 / 10).copied().unwrap_or_default();
        pass
    }

    fn gather_corners(&mut self) {
        self.first.fill(0);
        for &t in &self.alive {
            for v in self.triangles[t as usize] {
                self.first[v as usize + 1] += 1;
            }
        }
        for v in 0..self.first.len() - 1 {
            self.first[v + 1] += self.first[v];
        }
        self.corners.resize(3 * self.alive.len(), 0);
        // Each start moves to its list's end, which is the next one's start: shift back afterwards.
        for &t in &self.alive {
            for (side, v) in self.triangles[t as usize].into_iter().enumerate() {
                let place = &mut self.first[v as usize];
                self.corners[*place as usize] = 3 * t + side as u32;
                *place += 1;
            }
        }
        let last = self.first.len() - 1;
        self.first.copy_within(..last, 1);
        self.first[0] = 0;
    }

    fn corners_of(&self, vertex: u32) -> &[u32] {
        &self.corners[self.first[vertex as usize] as usize..self.first[vertex as usize + 1] as usize]
    }

    fn candidates(&self) -> Vec<Candidate> {
        let mut candidates = Vec::with_capacity(self.live.len());
        let mut lone = Vec::new();
        let mut seen = Vec::new();
        for &gone in &self.live {
            if self.corners_of(gone).is_empty() {
                lone.push(gone);
                continue;
            }
            let best = self
                .best(gone, &mut seen, true)
                .or_else(|| self.best(gone, &mut seen, false));
            candidates.extend(best);
        }
        self.add_lone(&lone, &mut candidates);
        candidates
    }

    /// Where a vertex collapses to at the least cost; `rested` leaves out those that are tired.
    fn best(&self, gone: u32, seen: &mut Vec<u32>, rested: bool) -> Option<Candidate> {
        seen.clear();
        let mut best: Option<Candidate> = None;
        for &corner in self.corners_of(gone) {
            for kept in self.triangles[corner as usize / 3] {
                if kept == gone || rested && self.is_tired[kept as usize] || seen.contains(&kept) {
                    continue;
                }
                seen.push(kept);
                let cost = self.cost(gone, kept);
                if best.is_some_and(|best| cost >= best.cost) {
                    continue;
                }
                // What turns over is off by about the length of the edge.
                let turned = self.turned_area(gone, kept);
                let along = self.positions[gone as usize] - self.positions[kept as usize];
                let cost = cost + turned * along.length_squared();
                if best.is_none_or(|best| cost < best.cost) {
                    let turns = turned > 0.0;
                    best = Some(Candidate {
                        cost,
                        gone,
                        kept,
                        turns,
                    });
                }
            }
        }
        best
    }

    fn cost(&self, gone: u32, kept: u32) -> f64 {
        let at = self.positions[kept as usize];
        self.quadrics[gone as usize].at(at)
            + self.quadrics[kept as usize].at(at)
            + LENGTH_WEIGHT * at.distance_squared(self.positions[gone as usize])
    }

    /// Vertices without triangles join the nearer of their neighbours in Morton order.
    fn add_lone(&self, lone: &[u32], candidates: &mut Vec<Candidate>) {
        if lone.is_empty() {
            return;
        }
        let code = |v: u32| morton::code(self.mesh.positions[v as usize].map(|x| x as u64));
        let mut row: Vec<(u64, u32)> = self.live.iter().map(|&v| (code(v), v)).collect();
        row.sort_unstable();
        for &gone in lone {
            let key = (code(gone), gone);
            let Ok(i) = row.binary_search(&key) else { continue };
            let near = [i.checked_sub(1), Some(i + 1)];
            let near = near.into_iter().flatten().filter_map(|i| row.get(i)).map(|&(_, v)| v);
            let distance = |v: u32| self.positions[v as usize].distance_squared(self.positions[gone as usize]);
            if let Some(kept) = near.min_by(|&a, &b| distance(a).total_cmp(&distance(b))) {
                candidates.push(Candidate {
                    cost: 0.0,
                    gone,
                    kept,
                    turns: true,
                });
            }
        }
    }

    /// Area of the triangles that would turn over.
    fn turned_area(&self, gone: u32, kept: u32) -> f64 {
        let to = self.positions[kept as usize];
        let turned = self.corners_of(gone).iter().map(|&corner| {
            let corners = self.triangles[corner as usize / 3];
            let side = corner as usize % 3;
            let (b, c) = (corners[(side + 1) % 3], corners[(side + 2) % 3]);
            if b == kept || c == kept || b == c || b == gone || c == gone {
                return 0.0;
            }
            let [b, c] = [b, c].map(|v| self.positions[v as usize]);
            let from = self.positions[gone as usize];
            let before = (b - from).cross(c - from);
            let after = (b - to).cross(c - to);
            let turn = before.dot(after);
            let (large, larger) = (before.length_squared(), after.length_squared());
            if turn < 0.0 || turn * turn < MOST_TURN * MOST_TURN * large * larger {
                large.sqrt() / 2.0
            } else {
                0.0
            }
        });
        turned.sum()
    }

    fn deviation(&self, gone: u32, kept: u32) -> f64 {
        let (a, b) = (&self.quadrics[gone as usize], &self.quadrics[kept as usize]);
        let at = self.positions[kept as usize];
        let weight = a.weight + b.weight;
        if weight > 0.0 {
            ((a.at(at) + b.at(at)) / weight).sqrt()
        } else {
            0.0
        }
    }

    fn collapse(&mut self, gone: u32, kept: u32) -> Collapse {
        let corners = self.first[gone as usize] as usize..self.first[gone as usize + 1] as usize;
        let first_corner = self.moved.len() as u32;
        for &corner in &self.corners[corners.clone()] {
            self.triangles[corner as usize / 3][corner as usize % 3] = kept;
            self.moved.push(corner);
        }
        let quadric = self.quadrics[gone as usize];
        self.quadrics[kept as usize].add(&quadric);
        self.is_gone[gone as usize] = true;
        Collapse {
            gone,
            kept,
            first_corner,
            corners: corners.len() as u32,
        }
    }

    fn normal(&self, corners: [u32; 3]) -> DVec3 {
        let [a, b, c] = corners.map(|v| self.positions[v as usize]);
        (b - a).cross(c - a)
    }
}

/// A direction without its length, and that; `None` when there is none.
fn unit(direction: DVec3) -> Option<(DVec3, f64)> {
    let length = direction.length();
    (length > 0.0).then(|| (direction / length, length))
}

fn is_degenerate([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}
