//! Which vertices fall together?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2: vertices are entered into an octree over the model's box
//! and those in one cell become one cluster. Doublets merge (the thesis's case 2). The octree is kept as a sorted row of
//! Morton codes: a cell of depth k is a run of points whose codes share their first 3k bits, so that every depth is
//! there at once, no depth needs more than a scan, and no input makes it deep.
//!
//! Departures: all cells of one depth are merged at once instead of the deepest first, and the representative is the
//! thesis's *weighted mean*, with the area of the adjacent triangles as weight. As there, it is a vertex of the source
//! and not the mean itself, so a level never leaves the source's box and keeps the source's exact coordinates.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    morton,
    source::{Primitive, Topology},
};

/// Finest depth: 3 × 21 bits fill a code.
pub(super) const MAX_DEPTH: u32 = 21;
/// Stands for "this vertex is used by no shape".
const UNUSED: u32 = u32::MAX;

/// The distinct positions of a model in Morton order.
pub(super) struct Octree {
    points: Vec<DVec3>,
    codes: Vec<u64>,
    /// Area of adjacent triangles, model-space units squared.
    weights: Vec<f64>,
    /// For each primitive, for each vertex, the index of its point.
    point_of_vertex: Vec<Vec<u32>>,
}

/// All cells of one depth.
pub(super) struct Clusters {
    /// For each primitive, for each vertex, its cluster. Meaningless for vertices that no shape uses.
    pub(super) of_vertex: Vec<Vec<u32>>,
    /// For each cluster, the position that stands for it: one of the source's.
    pub(super) representatives: Vec<[f32; 3]>,
}

impl Octree {
    /// Enters every vertex that a shape uses.
    pub(super) fn new(primitives: &[Primitive]) -> Self {
        let mut corners: Vec<(u64, [u32; 3], u32, u32)> = Vec::new();
        for (p, primitive) in primitives.iter().enumerate() {
            let mut used = vec![false; primitive.positions.len()];
            primitive.indices.iter().for_each(|&i| used[i as usize] = true);
            let in_use = (0..primitive.positions.len()).filter(|&v| used[v]);
            corners.extend(in_use.map(|v| (0, position_bits(primitive.positions[v]), p as u32, v as u32)));
        }
        let root = RootCube::around(corners.iter().map(|c| position_from_bits(c.1)));
        corners
            .par_iter_mut()
            .for_each(|c| c.0 = root.code(position_from_bits(c.1)));
        corners.par_sort_unstable();

        let mut octree = Self {
            points: Vec::new(),
            codes: Vec::new(),
            weights: Vec::new(),
            point_of_vertex: primitives.iter().map(|p| vec![UNUSED; p.positions.len()]).collect(),
        };
        let mut last = None;
        for (code, bits, p, v) in corners {
            if last != Some(bits) {
                last = Some(bits);
                octree.points.push(position_from_bits(bits));
                octree.codes.push(code);
            }
            octree.point_of_vertex[p as usize][v as usize] = octree.points.len() as u32 - 1;
        }
        octree.weigh(primitives);
        octree
    }

    fn weigh(&mut self, primitives: &[Primitive]) {
        self.weights = vec![0.0; self.points.len()];
        for (primitive, points) in primitives.iter().zip(&self.point_of_vertex) {
            if primitive.topology == Topology::Triangles {
                for triangle in primitive.indices.as_chunks::<3>().0 {
                    let corners = triangle.map(|v| points[v as usize] as usize);
                    let [a, b, c] = corners.map(|point| self.points[point]);
                    let area = 0.5 * (b - a).cross(c - a).length();
                    corners.iter().for_each(|&point| self.weights[point] += area);
                }
            }
        }
    }

    /// The deepest depth at which the share of clusters among points has fallen to `share`: nothing deeper is worth a
    /// try.
    pub(super) fn deepest_useful(&self, share: f64) -> u32 {
        let mut clusters = [1usize; MAX_DEPTH as usize + 1];
        for pair in self.codes.windows(2) {
            let differs = pair[0] ^ pair[1];
            // Codes that differ first in the digit of depth d lie in different cells from depth d on.
            let first = if differs == 0 {
                MAX_DEPTH + 1
            } else {
                MAX_DEPTH - (63 - differs.leading_zeros()) / 3
            };
            clusters[first as usize..].iter_mut().for_each(|count| *count += 1);
        }
        let most = share * self.points.len() as f64;
        (0..=MAX_DEPTH)
            .rev()
            .find(|&depth| clusters[depth as usize] as f64 <= most)
            .unwrap_or(0)
    }

    /// The cells of a depth; depth 0 is a single cell.
    pub(super) fn clusters(&self, depth: u32) -> Clusters {
        let shift = 3 * (MAX_DEPTH - depth);
        let mut of_point = Vec::with_capacity(self.points.len());
        let mut representatives = Vec::new();
        let mut start = 0;
        while start < self.points.len() {
            let cell = self.codes[start] >> shift;
            let run = self.codes[start..].partition_point(|code| code >> shift == cell);
            of_point.resize(start + run, representatives.len() as u32);
            let position = self.points[self.representative(start..start + run)];
            representatives.push(position.as_vec3().to_array());
            start += run;
        }
        let of_vertex = self.point_of_vertex.iter().map(|points| {
            let cluster = |&point: &u32| of_point.get(point as usize).copied().unwrap_or(UNUSED);
            points.iter().map(cluster).collect()
        });
        Clusters {
            of_vertex: of_vertex.collect(),
            representatives,
        }
    }

    /// The point nearest to the weighted mean of a run, the first of several.
    fn representative(&self, run: std::ops::Range<usize>) -> usize {
        let total: f64 = self.weights[run.clone()].iter().sum();
        let weight = |point: usize| if total > 0.0 { self.weights[point] } else { 1.0 };
        let sum: f64 = run.clone().map(weight).sum();
        let mean = run
            .clone()
            .map(|point| self.points[point] * (weight(point) / sum))
            .sum::<DVec3>();
        let nearer = |a: &usize, b: &usize| {
            let distance = |point: usize| self.points[point].distance_squared(mean);
            distance(*a).total_cmp(&distance(*b))
        };
        run.clone().min_by(nearer).unwrap_or(run.start)
    }
}

/// The cube at the octree's root.
struct RootCube {
    min: DVec3,
    side: f64,
}

impl RootCube {
    fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let (min, max) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p), max.max(p))
        });
        let side = (max - min).max_element().max(0.0);
        Self { min, side }
    }

    /// The Morton code of the cell of depth [`MAX_DEPTH`] that holds a point; x is the lowest bit of each digit.
    fn code(&self, point: DVec3) -> u64 {
        let cells = f64::from(1u32 << MAX_DEPTH);
        let scale = if self.side > 0.0 { cells / self.side } else { 0.0 };
        let cell = ((point - self.min) * scale).min(DVec3::splat(cells - 1.0));
        morton::code(cell.to_array().map(|x| x as u64))
    }
}

/// Bits that are equal exactly when the positions are; −0 is 0.
fn position_bits(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

fn position_from_bits(bits: [u32; 3]) -> DVec3 {
    DVec3::from_array(bits.map(|x| f64::from(f32::from_bits(x))))
}

/// A Morton order for things with centres: the order in which to put them.
pub(super) fn morton_order(centers: &[DVec3]) -> Vec<u32> {
    let root = RootCube::around(centers.iter().copied());
    let mut order: Vec<(u64, u32)> = centers
        .par_iter()
        .zip(0..centers.len() as u32)
        .map(|(c, i)| (root.code(*c), i))
        .collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}
