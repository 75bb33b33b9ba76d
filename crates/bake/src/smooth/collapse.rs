//! In what order is a mesh coarsened? The cluster tree, as passes of collapses that do not touch each other.
//!
//! Every collapse moves one vertex onto another (half-edge collapses, Hoppe 1996; as in Schmalstieg's cluster tree, §7.2,
//! the representative is one of the two) along the edge with the least quadric error (Garland & Heckbert 1997). A vertex
//! that has lost all its triangles joins its neighbour in Morton order, so that in the end one vertex is left.

use glam::DVec3;

use super::planes;
use super::quadric::Quadric;
use super::quantise::QuantisedMesh;
use crate::{morton, radix};

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
/// A triangle may not turn farther: cosine.
const MOST_TURN: f64 = 0.2;

/// Of more triangles around a vertex, so many are looked at, evenly spread.
const MOST_SAMPLED: usize = 256;
/// All passes together go over so many vertices and triangles for each that there is. Nearly all meshes need fewer than
/// ten; but where all hangs on few vertices, each pass makes few collapses.
const MOST_WORK: u64 = 128;

/// Collapses a mesh to one vertex. It must have one. `None` when it would take too long.
pub(super) fn cluster(mesh: &QuantisedMesh) -> Option<ClusterTree> {
    let mut work = Work::new(mesh);
    let mut passes = Vec::new();
    let mut left = MOST_WORK * work.size();
    while work.live.len() > 1 {
        left = left.checked_sub(work.size())?;
        let pass = work.pass();
        passes.push(pass);
    }
    Some(ClusterTree {
        passes,
        corners: work.moved,
        triangles: work.triangles,
        root: work.live[0],
    })
}

struct Work<'a> {
    mesh: &'a QuantisedMesh,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<u32>,
    live: Vec<u32>,
    /// Live vertices in Morton order, made when one has no triangles left.
    row: Vec<u32>,
    quadrics: Vec<Quadric>,
    /// Where in `corners` those of a live vertex begin and end, as of the beginning of the pass.
    stars: Vec<(u32, u32)>,
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

/// A triangle as seen from the corner that moves.
struct Facet {
    /// The other two corners, and where they are.
    others: [u32; 2],
    at: [DVec3; 2],
    /// Its normal, as long as twice its area.
    normal: DVec3,
}

impl Facet {
    /// How much of it turns over when its corner moves to a vertex.
    fn turned(&self, kept: u32, to: DVec3) -> f64 {
        if self.others.contains(&kept) {
            return 0.0;
        }
        let [b, c] = self.at;
        let after = (b - to).cross(c - to);
        let turn = self.normal.dot(after);
        let (large, larger) = (self.normal.length_squared(), after.length_squared());
        if turn < 0.0 || turn * turn < MOST_TURN * MOST_TURN * large * larger {
            large.sqrt() / 2.0
        } else {
            0.0
        }
    }
}

/// What is looked at again and again around one vertex.
#[derive(Default)]
struct Around {
    seen: Vec<u32>,
    facets: Vec<Facet>,
}

impl<'a> Work<'a> {
    fn new(mesh: &'a QuantisedMesh) -> Self {
        let count = mesh.positions.len();
        let at = |p: &[i32; 3]| DVec3::from_array(p.map(f64::from));
        let positions: Vec<DVec3> = mesh.positions.iter().map(at).collect();
        Self {
            mesh,
            quadrics: planes::quadrics(&positions, mesh),
            positions,
            triangles: mesh.triangles.clone(),
            alive: (0..mesh.triangles.len() as u32).collect(),
            live: (0..count as u32).collect(),
            row: Vec::new(),
            stars: vec![(0, 0); count],
            corners: Vec::new(),
            is_locked: vec![false; count],
            is_gone: vec![false; count],
            is_tired: vec![false; count],
            moved: Vec::new(),
        }
    }

    /// Vertices and triangles that are left.
    fn size(&self) -> u64 {
        (self.live.len() + self.alive.len()) as u64
    }

    fn pass(&mut self) -> Pass {
        self.gather_corners();
        let candidates = self.candidates();
        // Bits of numbers that are not negative rise with them.
        let mut order: Vec<(u64, u32)> = candidates.iter().map(|c| c.cost.to_bits()).zip(0..).collect();
        radix::sort(&mut order);
        let most = ((self.live.len() as f64 * SHARE) as usize).max(1);
        let mut pass = Pass::default();
        let mut deviations = Vec::new();
        // Many stand in each other's way. Those that cost more shall not get their turn because of that.
        order.truncate(((self.live.len() as f64 * CONSIDERED) as usize).max(1));
        let mut facets = Vec::new();
        for (_, candidate) in order {
            let Candidate { gone, kept, turns, .. } = candidates[candidate as usize];
            if pass.collapses.len() >= most {
                break;
            }
            if self.is_locked[gone as usize] || self.is_locked[kept as usize] {
                continue;
            }
            // What has happened around since may have made it worse.
            if !turns && self.has_changed_around(gone) {
                self.find_facets(gone, &mut facets);
                if self.turned_area(&facets, kept) > 0.0 {
                    continue;
                }
            }
            self.is_locked[gone as usize] = true;
            self.is_locked[kept as usize] = true;
            deviations.push(self.deviation(gone, kept));
            pass.collapses.push(self.collapse(gone, kept));
        }
        // Where many want to collapse onto the same few, others get their turn next time.
        let is_small = (pass.collapses.len() as f64) < self.live.len() as f64 * SMALL_PASS;
        self.live.iter().for_each(|&v| self.is_tired[v as usize] = false);
        for collapse in &pass.collapses {
            self.is_locked[collapse.kept as usize] = false;
            self.is_tired[collapse.kept as usize] = is_small;
        }
        self.live.retain(|&v| !self.is_gone[v as usize]);
        let triangles = &self.triangles;
        self.alive.retain(|&t| !is_degenerate(triangles[t as usize]));
        if !deviations.is_empty() {
            let nine_tenths = deviations.len() * 9 / 10;
            pass.deviation = *deviations.select_nth_unstable_by(nine_tenths, f64::total_cmp).1;
        }
        pass
    }

    /// Whether a triangle of a vertex has got another corner in this pass: then that one is locked.
    fn has_changed_around(&self, vertex: u32) -> bool {
        let mut corners = self.corners_of(vertex).iter();
        corners.any(|&corner| {
            let triangle = self.triangles[corner as usize / 3];
            triangle.iter().any(|&v| self.is_locked[v as usize])
        })
    }

    fn gather_corners(&mut self) {
        for &v in &self.live {
            self.stars[v as usize] = (0, 0);
        }
        for v in self.alive.iter().flat_map(|&t| self.triangles[t as usize]) {
            self.stars[v as usize].1 += 1;
        }
        let mut next = 0;
        for &v in &self.live {
            let (begin, end) = &mut self.stars[v as usize];
            let count = std::mem::replace(end, next);
            *begin = next;
            next += count;
        }
        self.corners.resize(3 * self.alive.len(), 0);
        for &t in &self.alive {
            for (side, v) in self.triangles[t as usize].into_iter().enumerate() {
                let place = &mut self.stars[v as usize].1;
                self.corners[*place as usize] = 3 * t + side as u32;
                *place += 1;
            }
        }
    }

    fn corners_of(&self, vertex: u32) -> &[u32] {
        let (begin, end) = self.stars[vertex as usize];
        &self.corners[begin as usize..end as usize]
    }

    /// The same, but of many only a few.
    fn sample_of(&self, vertex: u32) -> impl Iterator<Item = u32> {
        let corners = self.corners_of(vertex);
        let step = corners.len().div_ceil(MOST_SAMPLED).max(1);
        corners.iter().step_by(step).copied()
    }

    /// For each vertex the best collapse, by number of the vertex.
    fn candidates(&mut self) -> Vec<Candidate> {
        let mut candidates = Vec::with_capacity(self.live.len());
        let mut has_lone = false;
        let mut around = Around::default();
        for &gone in &self.live {
            if self.corners_of(gone).is_empty() {
                has_lone = true;
                continue;
            }
            self.find_facets(gone, &mut around.facets);
            let best = self
                .best(gone, &mut around, true)
                .or_else(|| self.best(gone, &mut around, false));
            candidates.extend(best);
        }
        if has_lone {
            self.add_lone(&mut candidates);
        }
        candidates
    }

    /// Where a vertex collapses to at the least cost; `rested` leaves out those that are tired.
    fn best(&self, gone: u32, around: &mut Around, rested: bool) -> Option<Candidate> {
        let Around { seen, facets } = around;
        seen.clear();
        let mut best: Option<Candidate> = None;
        let (own, from) = (&self.quadrics[gone as usize], self.positions[gone as usize]);
        for corner in self.sample_of(gone) {
            for kept in self.triangles[corner as usize / 3] {
                if kept == gone || rested && self.is_tired[kept as usize] || seen.contains(&kept) {
                    continue;
                }
                seen.push(kept);
                let to = self.positions[kept as usize];
                let (squared, own_cost) = (to.distance_squared(from), own.at(to));
                let length_cost = LENGTH_WEIGHT * squared;
                // The other's part is never negative, and not looked up in vain.
                if best.is_some_and(|best| own_cost + length_cost >= best.cost) {
                    continue;
                }
                let cost = own_cost + self.quadrics[kept as usize].at(to) + length_cost;
                if best.is_some_and(|best| cost >= best.cost) {
                    continue;
                }
                // What turns over is off by about the length of the edge.
                let turned = self.turned_area(facets, kept);
                let cost = cost + turned * squared;
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

    /// Vertices without triangles join the nearer of their neighbours in Morton order.
    fn add_lone(&mut self, candidates: &mut Vec<Candidate>) {
        if self.row.is_empty() {
            let code = |v: u32| morton::code(self.mesh.positions[v as usize].map(|x| x as u64));
            let mut row: Vec<(u64, u32)> = self.live.iter().map(|&v| (code(v), v)).collect();
            radix::sort(&mut row);
            self.row = row.into_iter().map(|(_, v)| v).collect();
        }
        self.row.retain(|&v| !self.is_gone[v as usize]);
        for (i, &gone) in self.row.iter().enumerate() {
            if !self.corners_of(gone).is_empty() {
                continue;
            }
            let near = [i.checked_sub(1), Some(i + 1)];
            let near = near.into_iter().flatten().filter_map(|i| self.row.get(i)).copied();
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
        candidates.sort_by_key(|candidate| candidate.gone);
    }

    /// Triangles around a vertex, as they are now.
    fn find_facets(&self, gone: u32, facets: &mut Vec<Facet>) {
        let from = self.positions[gone as usize];
        facets.clear();
        for corner in self.sample_of(gone) {
            let corners = self.triangles[corner as usize / 3];
            let side = corner as usize % 3;
            let (b, c) = (corners[(side + 1) % 3], corners[(side + 2) % 3]);
            if b != c && b != gone && c != gone {
                let at = [b, c].map(|v| self.positions[v as usize]);
                facets.push(Facet {
                    others: [b, c],
                    at,
                    normal: (at[0] - from).cross(at[1] - from),
                });
            }
        }
    }

    /// Area of the triangles that would turn over.
    fn turned_area(&self, facets: &[Facet], kept: u32) -> f64 {
        let to = self.positions[kept as usize];
        facets.iter().map(|facet| facet.turned(kept, to)).sum()
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
        let (begin, end) = self.stars[gone as usize];
        let first_corner = self.moved.len() as u32;
        for &corner in &self.corners[begin as usize..end as usize] {
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
            corners: end - begin,
        }
    }
}

/// Whether nothing is drawn of a triangle with these corners.
pub(super) fn is_degenerate([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}
