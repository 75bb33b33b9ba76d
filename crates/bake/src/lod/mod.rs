//! What does a model look like from afar?
//!
//! A [`LodChain`] is a row of ever coarser meshes of one model. Level 0 is the source itself, triangle for triangle and
//! bit for bit. Every other level states a *true* error: no point of the source surface is farther from the level's
//! surface, nor the reverse (an upper bound of the two-sided Hausdorff distance, in model-space units, see [`mod@error`]).
//! From the error, `belvedere_scene::object::switch_distance_m` makes a switching distance.
//!
//! * `octree`: Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2: which vertices fall together. Robust on
//!   anything: soup, doublets, non-manifold edges, points and lines.
//! * `collapse`: from clusters to a mesh; what becomes of triangles, lines, points and of the corners' attributes.
//! * `error` over `proximity`: how far the result is from the source.
//!
//! Another generator only has to say which vertices fall together, or bring primitives of its own: the choice of levels
//! below and the error measure do not know how a level was made.

mod collapse;
pub mod error;
mod octree;
pub(crate) mod proximity;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use crate::lod::error::{HausdorffLimits, hausdorff_bound};
use crate::lod::octree::Octree;
use crate::lod::proximity::ShapeTree;
use crate::source::{Primitive, SourceModel, Topology};

/// Ever coarser meshes of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct LodChain {
    /// Finest first; never empty. Errors never fall and bytes always fall from one to the next.
    pub levels: Vec<LodLevel>,
}

/// One mesh of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct LodLevel {
    /// Its geometry; materials as in the source. Triangles that collapsed to lines stand in primitives of their own.
    pub primitives: Vec<Primitive>,
    /// Upper bound of the two-sided Hausdorff distance to the source, in model-space units; 0 for level 0.
    pub geometric_error: f64,
    /// Triangles in it.
    pub triangles: u64,
    /// Lines in it.
    pub lines: u64,
}

/// How many levels, and how fine a measure.
#[derive(Debug, Clone, PartialEq)]
pub struct LodSettings {
    /// Most levels, level 0 included.
    pub max_levels: usize,
    /// Models with fewer triangles, lines and points than this get level 0 only.
    pub min_shapes: usize,
    /// A level is worth having when it has at most this share of the bytes of the one before.
    pub worthwhile_share: f64,
    /// No coarser level is made of one with so few triangles, lines and points.
    pub coarsest_shapes: usize,
    /// Materials that are drawn from both sides: of two triangles with the same corners and opposite winding one is
    /// enough.
    pub double_sided: BTreeSet<usize>,
    /// When the error measure is content.
    pub error_limits: HausdorffLimits,
}

impl Default for LodSettings {
    fn default() -> Self {
        Self {
            max_levels: 7,
            min_shapes: 24,
            worthwhile_share: 0.6,
            coarsest_shapes: 100,
            double_sided: BTreeSet::new(),
            error_limits: HausdorffLimits::default(),
        }
    }
}

/// Makes the levels of a model.
///
/// Cost: O(n log n) for n triangles, plus the error measure, whose work is limited to a multiple of n by
/// [`LodSettings::error_limits`]. Deterministic whatever the thread count.
#[must_use]
pub fn chain(model: &SourceModel, settings: &LodSettings) -> LodChain {
    let mut levels = vec![LodLevel::new(model.primitives.clone(), 0.0)];
    if shape_count(&model.primitives) >= settings.min_shapes && settings.max_levels > 1 {
        let coarser = coarser_meshes(model, settings);
        if !coarser.is_empty() {
            let source = ShapeTree::of(&model.primitives);
            let mut worst = 0.0f64;
            for mesh in coarser {
                let level = ShapeTree::of(&mesh.primitives);
                worst = worst.max(hausdorff_bound(&source, &level, &mesh.origins, settings.error_limits));
                levels.push(LodLevel::new(mesh.primitives, worst));
            }
        }
    }
    LodChain {
        levels: without_dominated(levels),
    }
}

/// Leaves out levels whose error is hardly smaller than that of a coarser one: nobody would choose them.
fn without_dominated(levels: Vec<LodLevel>) -> Vec<LodLevel> {
    let mut kept: Vec<LodLevel> = Vec::with_capacity(levels.len());
    for level in levels {
        while kept.len() > 1
            && kept
                .last()
                .is_some_and(|finer| level.geometric_error <= 1.1 * finer.geometric_error)
        {
            kept.pop();
        }
        kept.push(level);
    }
    kept
}

/// The meshes that are worth having, finest first, none of them empty.
fn coarser_meshes(model: &SourceModel, settings: &LodSettings) -> Vec<collapse::Collapsed> {
    let octree = Octree::new(&model.primitives);
    let shapes = collapse::SourceShapes::new(&model.primitives, &settings.double_sided);
    let has_triangles = model.triangle_count() > 0;
    let source_bytes = geometry_bytes(&model.primitives) as f64;
    let mut last_bytes = source_bytes;
    let mut kept = Vec::new();
    for depth in (0..=octree.deepest_useful(settings.worthwhile_share)).rev() {
        let mesh = shapes.collapse(&octree.clusters(depth));
        let count = shape_count(&mesh.primitives);
        let vanished = has_triangles && mesh.primitives.iter().all(|p| p.topology != Topology::Triangles);
        if count == 0 || vanished {
            break;
        }
        let bytes = geometry_bytes(&mesh.primitives) as f64;
        if bytes <= settings.worthwhile_share * last_bytes {
            last_bytes = bytes;
            kept.push((bytes, mesh));
            if count <= settings.coarsest_shapes {
                break;
            }
        }
    }
    while kept.len() > settings.max_levels - 1 {
        kept.remove(least_missed(source_bytes, &kept));
    }
    kept.into_iter().map(|(_, mesh)| mesh).collect()
}

/// The mesh whose two neighbours are nearest to each other in bytes. The coarsest always stays: it is fetched first.
fn least_missed(source_bytes: f64, kept: &[(f64, collapse::Collapsed)]) -> usize {
    let gap = |i: usize| {
        let finer = if i == 0 { source_bytes } else { kept[i - 1].0 };
        kept.get(i + 1).map_or(f64::INFINITY, |coarser| finer / coarser.0)
    };
    (0..kept.len())
        .min_by(|&a, &b| gap(a).total_cmp(&gap(b)))
        .unwrap_or_default()
}

impl LodLevel {
    fn new(primitives: Vec<Primitive>, geometric_error: f64) -> Self {
        let count = |topology| {
            let of_topology = primitives.iter().filter(|p| p.topology == topology);
            of_topology.map(|p| p.count() as u64).sum()
        };
        Self {
            geometric_error,
            triangles: count(Topology::Triangles),
            lines: count(Topology::Lines),
            primitives,
        }
    }
}

fn shape_count(primitives: &[Primitive]) -> usize {
    primitives.iter().map(Primitive::count).sum()
}

/// Bytes of vertices and indices as a plain GLB holds them.
pub(crate) fn geometry_bytes(primitives: &[Primitive]) -> usize {
    let bytes = |p: &Primitive| {
        let floats = 3 * p.positions.len()
            + 3 * p.normals.len()
            + 4 * p.tangents.len()
            + 4 * p.colors.len()
            + p.uvs.iter().map(|set| 2 * set.len()).sum::<usize>();
        let index_bytes = if p.positions.len() <= usize::from(u16::MAX) {
            2
        } else {
            4
        };
        4 * floats + index_bytes * p.indices.len()
    };
    primitives.iter().map(bytes).sum()
}
