//! What does a model look like from afar?
//!
//! A [`LodChain`] is a row of ever coarser meshes of one model. Level 0 is the source itself, triangle for triangle and
//! bit for bit. Every other level states a *true* error: no point of the source surface is farther from the level's
//! surface, nor the reverse (an upper bound of the two-sided Hausdorff distance, in model-space units, see [`mod@error`]). It is larger
//! where materials, pictures or colours are farther off than that ([`looks`]).
//! From the error, `belvedere_scene::object::switch_distance_m` makes a switching distance.
//!
//! * `octree` over `representative` and `ancestry`, and `reduction`: Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2: which
//!   vertices fall together. Robust on anything: soup, doublets, non-manifold edges, points and lines.
//! * `collapse` over `equal`: from clusters to a mesh; what becomes of triangles, lines, points and of the corners' attributes.
//! * `quadric` over `attributes`: edge collapses along the surface, finer where surfaces are whole; vertices move.
//! * `cube`: the box of a model, for both.
//! * `generate`: a mesh for each number of shapes, by one of the two or by whichever is nearer to the source. What an
//!   author made coarser is measured like these, and taken where nothing that takes fewer bytes is as near.
//! * `error` over `proximity`: how far the result is from the source; `looks`: how far off is what is painted on it.
//! * `rounding`: what is drawn of it on the lattice on which it is published.
//! * `join` and `clean`: what to do before (thesis, §6.4) and instead (§6.5).

mod ancestry;
mod attributes;
mod clean;
mod collapse;
mod cube;
mod equal;
pub mod error;
pub mod generate;
pub mod join;
pub(crate) mod looks;
#[cfg(test)]
mod method_tests;
pub(crate) mod octree;
mod patches;
pub(crate) mod proximity;
mod quadric;
#[cfg(test)]
mod quadric_tests;
mod reduction;
mod representative;
mod rounding;
#[cfg(test)]
mod tests;

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use crate::lod::error::HausdorffLimits;
use crate::lod::generate::Generator;
use crate::pictures::texels;
use crate::source::{Material, Primitive, SourceModel, Topology};

pub use crate::lod::clean::clean;
pub use crate::lod::octree::{OctreeSettings, Order};
pub use crate::lod::representative::Measures;
pub use crate::lod::rounding::rounded;

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
    /// Upper bound of the two-sided Hausdorff distance to the source or, where that is more, how far off is what is painted on it, in
    /// model-space units; 0 for level 0.
    pub geometric_error: f64,
    /// Triangles in it.
    pub triangles: u64,
    /// Lines in it.
    pub lines: u64,
}

/// Who makes the levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Vertex clustering in an octree.
    Octree,
    /// Edge collapses by quadric error, and the octree where these cannot go on.
    Quadric,
    /// For each level the one of the two whose error is smaller.
    #[default]
    Best,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Octree => "octree",
            Self::Quadric => "quadric",
            Self::Best => "best",
        })
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        [Self::Octree, Self::Quadric, Self::Best]
            .into_iter()
            .find(|method| method.to_string() == name)
            .ok_or_else(|| format!("`{name}` is none of octree, quadric and best"))
    }
}

/// How many levels, and how fine a measure.
#[derive(Debug, Clone, PartialEq)]
pub struct LodSettings {
    /// Who makes them.
    pub method: Method,
    /// How the octree works.
    pub octree: OctreeSettings,
    /// Most levels, level 0 included.
    pub max_levels: usize,
    /// Models with fewer triangles, lines and points than this get level 0 only.
    pub min_shapes: usize,
    /// A level has about this share of the shapes of the one before; less when there would be too many levels.
    pub usual_share: f64,
    /// A level is worth having when it has at most this share of the bytes of the one before.
    pub worthwhile_share: f64,
    /// A level is left out when the next coarser one's error is at most so many times as large.
    pub dominated: f64,
    /// The coarsest level has about so many triangles, lines and points.
    pub coarsest_shapes: usize,
    /// Materials that are drawn from both sides: of two triangles with the same corners and opposite winding one is
    /// enough.
    pub double_sided: BTreeSet<usize>,
    /// For each material that shows a picture, by which set of texture coordinates it does, and how many pictures lie along a unit of
    /// these.
    pub pictured: BTreeMap<usize, (usize, f64)>,
    /// When the error measure is content.
    pub error_limits: HausdorffLimits,
}

impl LodSettings {
    /// The same for a scene of these materials.
    #[must_use]
    pub fn for_materials(self, materials: &[Material]) -> Self {
        let numbered = || materials.iter().enumerate();
        let double_sided = numbered().filter(|(_, material)| material.double_sided);
        let pictured = numbered().filter_map(|(index, material)| Some((index, texels::shown_by(material)?)));
        Self {
            double_sided: double_sided.map(|(index, _)| index).collect(),
            pictured: pictured.collect(),
            ..self
        }
    }
}

impl Default for LodSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            octree: OctreeSettings::default(),
            max_levels: 7,
            min_shapes: 24,
            usual_share: 0.32,
            worthwhile_share: 0.6,
            dominated: 1.1,
            coarsest_shapes: 50,
            double_sided: BTreeSet::new(),
            pictured: BTreeMap::new(),
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
    let shapes = shape_count(&model.primitives);
    if shapes >= settings.min_shapes && settings.max_levels > 1 {
        let mut generator = Generator::new(model, settings);
        let mut last_bytes = geometry_bytes(&model.primitives) as f64;
        let mut worst = 0.0f64;
        for target in targets(shapes, settings) {
            let Some(mut level) = generator.level(target) else {
                break;
            };
            let bytes = geometry_bytes(&level.primitives) as f64;
            if saves(bytes, last_bytes, settings.worthwhile_share) {
                last_bytes = bytes;
                worst = worst.max(level.geometric_error);
                level.geometric_error = worst;
                levels.push(level);
            }
        }
        levels.extend(generator.authors());
        // The source stays the first.
        levels[1..].sort_by_key(|level| Reverse(geometry_bytes(&level.primitives)));
    }
    LodChain {
        levels: worthwhile(without_dominated(levels, settings.dominated), settings.worthwhile_share),
    }
}

/// How many shapes the coarser levels have, finest first: each about the same share of the one before, and the last as
/// few as are wanted.
fn targets(shapes: usize, settings: &LodSettings) -> Vec<usize> {
    let shares = (settings.coarsest_shapes.max(1) as f64 / shapes as f64).min(settings.usual_share);
    let steps = shares.ln() / settings.usual_share.ln();
    let count = (steps.round().max(1.0) as usize).min(settings.max_levels - 1);
    let target = |level: usize| (shapes as f64 * shares.powf(level as f64 / count as f64)).round() as usize;
    (1..=count).map(target).filter(|&target| target > 0).collect()
}

/// Leaves out levels whose error is hardly smaller than that of a coarser one: nobody would choose them.
fn without_dominated(levels: Vec<LodLevel>, dominated: f64) -> Vec<LodLevel> {
    let mut kept: Vec<LodLevel> = Vec::with_capacity(levels.len());
    for level in levels {
        while kept.len() > 1
            && kept
                .last()
                .is_some_and(|finer| level.geometric_error <= dominated * finer.geometric_error)
        {
            kept.pop();
        }
        kept.push(level);
    }
    kept
}

/// Leaves out levels that save too little beside the one before, or that have more to draw.
fn worthwhile(mut levels: Vec<LodLevel>, share: f64) -> Vec<LodLevel> {
    let mut last = (f64::INFINITY, usize::MAX);
    levels.retain(|level| {
        let bytes = geometry_bytes(&level.primitives) as f64;
        let shapes = shape_count(&level.primitives);
        let is_kept = saves(bytes, last.0, share) && shapes <= last.1;
        if is_kept {
            last = (bytes, shapes);
        }
        is_kept
    });
    levels
}

/// Whether a level of these bytes saves enough beside one of those: some bytes in any case.
fn saves(bytes: f64, last_bytes: f64, share: f64) -> bool {
    bytes < last_bytes && bytes <= share * last_bytes
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
