//! What can be seen from each cell?
//!
//! Two answers bracket the truth. Rays ([`sampler`]) say what surely is visible, and how much may be missing.
//! [`conservative`] keeps what cannot be proved hidden: nothing is missing, something may be too much. Both are found for
//! each cell by itself ([`mod@look`]), from what can matter to it ([`surroundings`]). Then the [`Method`] decides which of the
//! two is published.

pub mod blocker;
pub mod conservative;
pub mod epsilon;
pub mod fusion;
pub mod narrow;
pub mod prover;
pub mod screen;
pub mod surface;

mod chase;
mod crossing;
mod doors;
mod glance;
mod hunt;
mod kept;
mod look;
mod measure;
mod method;
mod preview;
pub(crate) mod random;
mod sampler;
mod segment;
mod sights;
mod solid;
mod stops;
mod surroundings;
mod targets;
pub(crate) mod vouched;
mod within;

#[cfg(test)]
mod conservative_tests;
#[cfg(test)]
mod far_tests;
#[cfg(test)]
mod gap_tests;
#[cfg(test)]
mod memory_tests;
#[cfg(test)]
mod oracle;
#[cfg(test)]
mod screen_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod views_tests;
#[cfg(test)]
mod within_tests;

use std::cmp::Ordering;

use belvedere_scene::record::Guarantee;
use rayon::prelude::*;

use crate::{
    cells::CellGraph,
    memory::Memory,
    occluders::Hiders,
    progress::{Cancelled, Progress, Silent, Stage},
    random::GOLDEN,
    world::World,
};
use conservative::ConservativeSettings;
pub use glance::glance;
use look::{Found, Looker};
pub use method::{Method, UnknownMethod};
pub use preview::{Rough, preview, rough};
use sampler::Scratch;
use sights::Sights;
use surroundings::Atlas;

/// Everything that decides visible sets besides world and cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VisibilitySettings {
    /// What is published.
    pub method: Method,
    /// How hard rays look; by default as hard as the number of cells allows.
    pub sampled: Option<SampledSettings>,
}

/// How hard rays look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampledSettings {
    /// At most so many uniform rays for each cell; they end earlier where they find nothing new.
    pub rays_per_cell: u32,
    /// Where random streams start.
    pub seed: u64,
}

impl Default for SampledSettings {
    fn default() -> Self {
        Self {
            rays_per_cell: 1 << 17,
            seed: 0x0B5E_55ED,
        }
    }
}

impl SampledSettings {
    /// Settings for many cells: as hard as possible while all cells together cast no more than about 64 million uniform
    /// rays, but never less than 2¹⁴ nor more than 2²⁰ for each.
    #[must_use]
    pub fn for_cells(cells: usize) -> Self {
        Self {
            rays_per_cell: rays_of_a_look(cells),
            ..Self::default()
        }
    }
}

/// How many rays, and how many tests of walls, each of so many cells may take: a power of two, so that a cell more changes
/// nothing.
#[must_use]
pub fn rays_of_a_look(cells: usize) -> u32 {
    const ALL: usize = 64 << 20;
    let each = (ALL / cells.max(1)).clamp(1 << 14, 1 << 20);
    1 << each.ilog2()
}

/// Each cell may take so many times as many tests of walls as rays, …
const STEPS: u32 = 16;
/// … and cut regions and objects into parts once for so many rays.
const RAYS_PER_CUT: u32 = 12;

/// Conservative sets that hold at most so many times as many objects as rays have seen are published: who never misses
/// anything may fetch a few things too many, last of all.
pub const WORTH: f64 = 6.0;
/// An object that no ray has seen is taken to be visible along this share of sight lines.
const UNSEEN_FRACTION: f32 = 1.0 / 64.0;

/// What all cells see, and how that came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// One for each cell.
    pub cells: Vec<CellVisibility>,
    /// Which method's sets these are; never [`Method::Auto`].
    pub method: Method,
    /// What they promise.
    pub guarantee: Guarantee,
    /// Mean number of objects in a cell's set that rays have seen, a lower bound of the truth.
    pub mean_seen: f64,
    /// Mean number of objects in a cell's set that cannot be proved hidden, an upper bound of the truth.
    pub mean_not_hidden: f64,
    /// Why this method, for people.
    pub reason: String,
    /// Cells that an earlier bake had looked from already.
    pub remembered: u32,
}

/// What one cell sees. Object and cell numbers are indices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellVisibility {
    /// Objects that can be seen from somewhere in the cell, largest solid angle first, then by number.
    pub objects: Vec<SeenObject>,
    /// Other cells into which a sight line leads, and the adjacent ones, rising.
    pub cells: Vec<u32>,
    /// Upper bound, at 95 % confidence, of the chance that a random sight line from the cell ends on an object that is
    /// missing above (Good & Turing's estimate); 0 when nothing can be missing.
    pub miss_bound: f64,
    /// Rays that were cast for the objects that this cell sees.
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

impl SeenObject {
    /// Largest solid angle first, then by number.
    fn order(&self, other: &Self) -> Ordering {
        other
            .solid_angle
            .total_cmp(&self.solid_angle)
            .then(self.object.cmp(&other.object))
    }
}

/// A world and its cells, ready for questions.
pub struct Views<'a> {
    graph: &'a CellGraph,
    atlas: Atlas<'a>,
    sights: Sights<'a>,
}

impl<'a> Views<'a> {
    /// Prepares a world, its cells and what hides.
    ///
    /// # Panics
    /// Never: nobody cancels it.
    #[must_use]
    pub fn of(world: &'a World, graph: &'a CellGraph, hiders: &'a Hiders<'a>) -> Self {
        Self::told(world, graph, hiders, (Stage::Cells, &Silent)).expect("nobody cancels it")
    }

    /// The same, with somebody who hears how far it is with it, in the stage that wants it.
    ///
    /// # Errors
    /// When cancelled.
    pub fn told(
        world: &'a World,
        graph: &'a CellGraph,
        hiders: &'a Hiders<'a>,
        (stage, progress): (Stage, &dyn Progress),
    ) -> Result<Self, Cancelled> {
        /// Steps of finding which cells a sight line passes.
        const SIGHTS: u64 = 500;
        progress.start(stage, Atlas::STEPS + SIGHTS);
        let atlas = Atlas::of(world, graph, hiders, progress)?;
        let sights = Sights::of(world, graph);
        progress.advance(SIGHTS);
        Ok(Self { graph, atlas, sights })
    }

    /// The cells.
    #[must_use]
    pub fn graph(&self) -> &CellGraph {
        self.graph
    }
}

/// Computes what each cell sees.
///
/// # Errors
/// When cancelled.
pub fn compute(
    views: &Views<'_>,
    settings: &VisibilitySettings,
    memory: &dyn Memory,
    progress: &dyn Progress,
) -> Result<Visibility, Cancelled> {
    let count = views.graph.cells.len();
    progress.start(Stage::Visibility, count as u64);
    let mut looker = looker(views, settings, memory);
    let mut found = look(&looker, &in_rows(count), progress)?;
    let mut ratio = tightness(&found);
    if settings.method == Method::Auto && ratio > WORTH {
        // Nothing but rays will do: they look once more, harder.
        progress.start(Stage::Visibility, count as u64);
        looker.thorough = true;
        found = look(&looker, &in_rows(count), progress)?;
        ratio = tightness(&found);
    }
    Ok(published(views.graph, found, decide(settings.method, ratio)))
}

fn looker<'a>(views: &'a Views<'_>, settings: &VisibilitySettings, memory: &'a dyn Memory) -> Looker<'a> {
    let count = views.graph.cells.len();
    Looker {
        atlas: &views.atlas,
        sights: &views.sights,
        proofs: ConservativeSettings {
            steps: STEPS * rays_of_a_look(count),
            cuts: rays_of_a_look(count) / RAYS_PER_CUT,
            ..settings.method.proofs()
        },
        sampled: settings.sampled.unwrap_or_else(|| SampledSettings::for_cells(count)),
        thorough: settings.method == Method::Sampled,
        memory,
    }
}

/// What would be published for some cells, as far as they tell how: objects, rising.
///
/// # Errors
/// When cancelled.
pub fn of_some(
    views: &Views<'_>,
    cells: &[usize],
    settings: &VisibilitySettings,
    memory: &dyn Memory,
    progress: &dyn Progress,
) -> Result<Vec<Vec<u32>>, Cancelled> {
    progress.start(Stage::Trial, cells.len() as u64);
    let found = look(&looker(views, settings, memory), cells, progress)?;
    let (method, _) = decide(settings.method, tightness(&found));
    let set = |cell: Found| {
        let open = cell.open.iter().map(|(object, _)| *object);
        let open = open.filter(|_| method != Method::Sampled);
        let mut set: Vec<u32> = cell.seen.objects.iter().map(|seen| seen.object).chain(open).collect();
        set.sort_unstable();
        set
    };
    Ok(found.into_iter().map(set).collect())
}

/// What was found, as it is published.
fn published(graph: &CellGraph, found: Vec<Found>, (method, reason): (Method, String)) -> Visibility {
    let mean = |total: usize| total as f64 / found.len().max(1) as f64;
    let mean_seen = mean(found.iter().map(|cell| cell.seen.objects.len()).sum());
    let mean_not_hidden = mean_seen + mean(found.iter().map(|cell| cell.open.len()).sum());
    let remembered = found.iter().filter(|cell| cell.remembered).count() as u32;
    let guarantee = if method == Method::Sampled {
        Guarantee::Sampled
    } else {
        Guarantee::Conservative
    };
    let what_counts = |cell: Found| match guarantee {
        Guarantee::Sampled => cell.seen,
        Guarantee::Conservative => completed(cell),
    };
    let mut cells: Vec<_> = found.into_iter().map(what_counts).collect();
    join_both_ends(graph, &mut cells);
    Visibility {
        cells,
        method,
        guarantee,
        mean_seen,
        mean_not_hidden,
        reason,
        remembered,
    }
}

/// So many cells in a row stay beside each other: neighbours share walls, which are made once for both.
const ROW: usize = 16;

/// All of so many cells, rows of them in no order of space, so that the first tenth is like all the others.
fn in_rows(count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|cell| ((cell / ROW) as u64).wrapping_mul(GOLDEN));
    order
}

/// Looks from cells in this order, in parallel; what each sees, rising by cell.
fn look(looker: &Looker<'_>, order: &[usize], progress: &dyn Progress) -> Result<Vec<Found>, Cancelled> {
    let mut found: Vec<(usize, Found)> = order
        .par_iter()
        .map_init(
            || (looker.atlas.observer(looker.proofs), Scratch::new(looker.sights)),
            |(observer, scratch), cell| {
                if progress.cancelled() {
                    return Err(Cancelled);
                }
                let found = looker.see(*cell, (observer, scratch));
                progress.advance(1);
                Ok((*cell, found))
            },
        )
        .collect::<Result<_, _>>()?;
    found.sort_by_key(|(cell, _)| *cell);
    Ok(found.into_iter().map(|(_, found)| found).collect())
}

/// How many times as many objects cannot be proved hidden as rays have seen.
fn tightness(found: &[Found]) -> f64 {
    let seen: usize = found.iter().map(|cell| cell.seen.objects.len()).sum();
    let open: usize = found.iter().map(|cell| cell.open.len()).sum();
    (seen + open) as f64 / seen.max(1) as f64
}

fn decide(wanted: Method, ratio: f64) -> (Method, String) {
    match wanted {
        Method::Auto if ratio <= WORTH => (
            Method::Conservative,
            format!("sets that are proved complete hold {ratio:.2} times what rays have seen"),
        ),
        Method::Auto => (
            Method::Sampled,
            format!("sets that are proved complete would hold {ratio:.2} times what rays have seen, more than {WORTH}"),
        ),
        Method::Sampled => (
            wanted,
            format!("asked for; sets that are proved complete would hold {ratio:.2} times what rays have seen"),
        ),
        wanted => (wanted, format!("asked for; {ratio:.2} times what rays have seen")),
    }
}

/// What rays saw, completed with what nobody can prove hidden.
fn completed(cell: Found) -> CellVisibility {
    let mut seen = cell.seen;
    let open = cell.open.into_iter().map(|(object, doors)| SeenObject {
        object,
        fraction: UNSEEN_FRACTION,
        // Last of all.
        solid_angle: measure::LEAST_SR,
        doors,
    });
    seen.objects.extend(open);
    seen.objects.sort_by(SeenObject::order);
    seen.miss_bound = 0.0;
    seen
}

/// Sight lines have two ends: what sees a cell is seen from it. Adjacent cells see each other.
fn join_both_ends(graph: &CellGraph, cells: &mut [CellVisibility]) {
    let mut seen_from: Vec<Vec<u32>> = vec![Vec::new(); cells.len()];
    for (number, cell) in (0u32..).zip(cells.iter()) {
        for other in &cell.cells {
            seen_from[*other as usize].push(number);
        }
    }
    for (number, (cell, others)) in (0u32..).zip(cells.iter_mut().zip(seen_from)) {
        cell.cells.extend(others);
        cell.cells.extend(&graph.cells[number as usize].adjacent);
        cell.cells.sort_unstable();
        cell.cells.dedup();
        cell.cells.retain(|other| *other != number);
    }
}
