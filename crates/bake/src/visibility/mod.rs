//! What can be seen from each cell?
//!
//! A method turns a [`World`] and its [`CellGraph`] into a [`CellVisibility`] for each cell. [`sampled`] may miss
//! something and says how much at most; conservative methods stand beside it under the same [`Method`].

pub mod sampled;

pub(crate) mod random;
mod sampler;
mod targets;

#[cfg(test)]
mod oracle;
#[cfg(test)]
mod tests;

use belvedere_scene::record::Guarantee;

use crate::{
    cells::CellGraph,
    progress::{Cancelled, Progress},
    world::World,
};
pub use sampled::SampledSettings;

/// How visible sets are computed.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// Rays from the cell: see [`sampled`].
    Sampled(SampledSettings),
}

/// What one cell sees. Object and cell numbers are indices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellVisibility {
    /// Objects that can be seen from somewhere in the cell, largest solid angle first, then by number.
    pub objects: Vec<SeenObject>,
    /// Other cells into which a sight line leads, and the adjacent ones, rising.
    pub cells: Vec<u32>,
    /// Upper bound, at 95 % confidence, of the chance that a random sight line from the cell ends on an object that is
    /// missing above; 0 when nothing can be missing.
    pub miss_bound: f64,
    /// Rays that were cast for this cell.
    pub rays: u64,
}

/// An object that can be seen from somewhere in a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenObject {
    /// Its number.
    pub object: u32,
    /// Estimated share of sight lines from the cell to its surface that nothing else blocks, in (0, 1].
    pub fraction: f32,
    /// Mean solid angle of what is visible of it over all eyes in the cell, in steradians, above 0.
    pub solid_angle: f32,
    /// Doors each of which hides it from the whole cell when it is closed, rising.
    pub doors: Vec<u32>,
}

impl Method {
    /// Its name in records and reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Sampled(_) => "sampled",
        }
    }

    /// What it promises.
    #[must_use]
    pub fn guarantee(&self) -> Guarantee {
        match self {
            Self::Sampled(_) => Guarantee::Sampled,
        }
    }

    /// Computes what each cell sees.
    ///
    /// # Errors
    /// When cancelled.
    pub fn compute(
        &self,
        world: &World,
        graph: &CellGraph,
        progress: &dyn Progress,
    ) -> Result<Vec<CellVisibility>, Cancelled> {
        match self {
            Self::Sampled(settings) => sampled::sampled(world, graph, settings, progress),
        }
    }
}
