//! What does each cell see, at a glance? An estimate for choosing cells, from a few thousand rays each.
//!
//! Random rays find different small things from neighbouring cells that see the same. So each sight line of a neighbour
//! is tried from a few eyes of the cell itself, and what is found so is passed on in the next round. Few rays miss small
//! things, so everything that stands in a cell which is seen into counts: the cell-to-cell relation of Teller & Séquin,
//! *Visibility preprocessing for interactive walkthroughs* (1991).

use super::sampled::{SampledSettings, Survey};
use crate::{
    cells::CellGraph,
    progress::{Cancelled, Progress},
    world::World,
};

/// Random rays from each cell.
const RAYS: u32 = 3072;
/// Eyes that try a neighbour's sight line.
const TRIES: u32 = 8;
/// How far word of a thing travels, in cells.
const ROUNDS: u32 = 3;

/// For each cell objects that it sees or that stand near what it sees, rising.
///
/// # Errors
/// When cancelled.
pub fn glance(world: &World, graph: &CellGraph, progress: &dyn Progress) -> Result<Vec<Vec<u32>>, Cancelled> {
    let settings = SampledSettings::default();
    let mut survey = Survey::new(world, graph, &settings, 0.0, progress);
    survey.glance(RAYS, TRIES, ROUNDS)?;
    Ok(survey.seen_or_near_it())
}
