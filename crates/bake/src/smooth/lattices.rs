//! On how fine a lattice does each pass stand? One a good deal finer than what its collapses deviate.
//!
//! A vertex is drawn in the middle of its cell of the lattice. Walls that lie along an axis move as a whole then, and by chance
//! a coarse lattice holds them better than the finer ones that follow: errors would rise where the lattice becomes finer.
//! So what a lattice gives is measured wherever that may be, and passes on one that was too lucky are moved to a finer
//! one. Nothing is measured where the finer lattice surely moves the surface less, as it does by half nearly everywhere.

use glam::DVec3;

use super::collapse::{ClusterTree, is_degenerate};
use super::error::{Ruler, Surface};
use super::quantise::QuantisedMesh;

/// The lattice of a pass is this much finer than what its collapses deviate.
const SHARE: f64 = 0.25;
/// A finer lattice that moves the surface by at most this part of what the coarser one does is no worse.
const SURELY: f64 = 0.7;
/// Errors may rise by this factor at most: less than what a stream may in all, since samples differ.
const RISE: f64 = 1.03;
/// What is less, in steps of the finest lattice, is noise of the samples.
const NOISE: f64 = 0.1;

/// Passes in a row on the same lattice.
struct Run {
    /// Bits that the lattice lacks.
    lacking: u32,
    passes: usize,
    /// The mesh at its beginning, corners as vertices of the source.
    triangles: Vec<[u32; 3]>,
    /// The least error that was measured up to its beginning, in steps of the finest lattice.
    least: f64,
}

/// How many bits the lattice of each pass lacks, finest pass first. `ruler` measures from the whole mesh.
pub(super) fn choose(mesh: &QuantisedMesh, tree: &ClusterTree, ruler: &Ruler<'_>) -> Vec<u32> {
    let wanted = by_deviation(tree, mesh.bits);
    let look = Look { mesh, ruler };
    let mut corners = tree.triangles.clone();
    let mut runs: Vec<Run> = Vec::new();
    for (pass, &lacking) in tree.passes.iter().zip(&wanted).rev() {
        if runs.last().is_none_or(|run| lacking < run.lacking) {
            let drawn = corners.iter().filter(|corners| !is_degenerate(**corners));
            let next = Run {
                lacking,
                passes: 0,
                triangles: drawn.copied().collect(),
                least: f64::INFINITY,
            };
            look.begin(&mut runs, next);
        }
        if let Some(run) = runs.last_mut() {
            run.passes += 1;
        }
        for collapse in &pass.collapses {
            for &corner in tree.corners(collapse) {
                corners[corner as usize / 3][corner as usize % 3] = collapse.gone;
            }
        }
    }
    let finest_first = runs.iter().rev();
    finest_first
        .flat_map(|run| std::iter::repeat_n(run.lacking, run.passes))
        .collect()
}

/// The coarsest lattices on which collapses are told apart well enough.
fn by_deviation(tree: &ClusterTree, bits: u32) -> Vec<u32> {
    let mut lacking = 0;
    let deviations = std::iter::once(0.0).chain(tree.passes.iter().map(|pass| pass.deviation));
    deviations
        .take(tree.passes.len())
        .map(|deviation| {
            let step = (deviation * SHARE).max(1.0);
            lacking = (step.log2() as u32).min(bits - 1).max(lacking);
            lacking
        })
        .collect()
}

/// Twice where a reader draws a coordinate on a lattice that lacks so many bits: in the middle of its cell.
pub(super) fn twice_drawn(coordinate: i32, lacking: u32) -> i32 {
    ((coordinate >> lacking) << (lacking + 1)) + (1 << lacking) - 1
}

/// What meshes look like on coarse lattices.
struct Look<'a> {
    mesh: &'a QuantisedMesh,
    ruler: &'a Ruler<'a>,
}

impl Look<'_> {
    /// Puts a run behind others. Those before it join it as long as its lattice would be worse than theirs.
    fn begin(&self, runs: &mut Vec<Run>, mut next: Run) {
        while let Some(before) = runs.pop() {
            if let Some(least) = self.least(&before, &next) {
                next.least = least;
                runs.push(before);
                break;
            }
            next = Run {
                lacking: next.lacking,
                passes: before.passes + next.passes,
                ..before
            };
        }
        runs.push(next);
    }

    /// The least error up to the beginning of `next`; `None` when it rises where its lattice becomes finer, bit by bit.
    fn least(&self, before: &Run, next: &Run) -> Option<f64> {
        let triangles = &next.triangles;
        let finer = || (next.lacking..before.lacking).rev();
        let mut moved = self.moved(triangles, before.lacking);
        let falls = |lacking| {
            let last = std::mem::replace(&mut moved, self.moved(triangles, lacking));
            moved <= SURELY * last
        };
        if triangles.is_empty() || finer().all(falls) {
            return Some(before.least);
        }
        let error = |lacking| self.ruler.rms(&Surface::new(&self.twice_drawn(lacking), triangles));
        let mut least = before.least.min(error(before.lacking));
        for lacking in finer() {
            let error = error(lacking);
            if error > (RISE * least).max(NOISE) {
                return None;
            }
            least = least.min(error);
        }
        Some(least)
    }

    /// Twice where a reader draws each vertex of the source on a lattice that lacks so many bits.
    fn twice_drawn(&self, lacking: u32) -> Vec<[i32; 3]> {
        let positions = self.mesh.positions.iter();
        positions.map(|at| at.map(|x| twice_drawn(x, lacking))).collect()
    }

    /// How far such a lattice moves a surface along its normals: the root of the mean square.
    fn moved(&self, triangles: &[[u32; 3]], lacking: u32) -> f64 {
        let half = (1 << lacking) - 1;
        let (mut sum, mut area) = (0.0, 0.0);
        for corners in triangles {
            let at = corners.map(|v| self.mesh.positions[v as usize]);
            let [p, q, r] = at.map(|at| DVec3::from_array(at.map(f64::from)));
            // Twice the way from each corner to the middle of its cell.
            let offs = at.map(|at| DVec3::from_array(at.map(|x| f64::from(half - 2 * (x & half)))));
            let normal = (q - p).cross(r - p);
            let length = normal.length();
            if length > 0.0 {
                let off = (offs[0] + offs[1] + offs[2]).dot(normal) / 6.0;
                sum += off * off / length;
                area += length;
            }
        }
        if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
    }
}
