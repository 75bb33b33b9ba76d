//! What does each cell see, as far as rays can tell?
//!
//! Follows Wonka et al., *Guided visibility sampling* (2006): random rays, then rays guided by what was found. Added
//! here, because random rays alone miss what shows through narrow openings:
//!
//! 1. random rays from the cell until Good & Turing's estimate says that few objects are unseen;
//! 2. rays through the openings of every cell that is seen into, and on into the next;
//! 3. for every object that reaches into such a cell and was not seen: sight lines to points of it, most of them from
//!    the cell's own openings ([`super::targets`] says why these suffice);
//! 4. after each discovery: sight lines around it;
//! 5. what a neighbour sees and this cell does not is searched for again, and so is what lies in cells that see this
//!    one, until a round finds nothing new.
//!
//! Input and output: a world, its cells; for each cell the objects with their visible fraction and solid angle (sr).
//!
//! Guarantee: none, but a measured bound: fresh uniform rays count what was missing before they were cast. With n rays
//! and k surprises the chance of a surprise is below (k + 3) / n or so at 95 %; surprises are added to the set.
//! Everything in the set was seen by a ray. Cost: about [`SampledSettings::rays_per_cell`] rays for each cell at most.
//! Results are the same for any number of threads: each cell has its own random stream and rounds end together.

use rayon::prelude::*;

use super::{
    CellVisibility, SeenObject,
    random::Random,
    sampler::{CellState, Sampler, Scenery, Scratch, Sighting},
    targets::Lookout,
};
use crate::{
    cells::CellGraph,
    progress::{Cancelled, Progress, Silent, Stage},
    world::World,
};

/// How hard to look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampledSettings {
    /// About how many rays each cell may cast.
    pub rays_per_cell: u32,
    /// At most this many rounds in which cells learn from their neighbours.
    pub rounds: u32,
    /// Where random streams start.
    pub seed: u64,
}

impl Default for SampledSettings {
    fn default() -> Self {
        Self {
            rays_per_cell: 400_000,
            rounds: 5,
            seed: 0x0B5E_55ED,
        }
    }
}

impl SampledSettings {
    /// Settings for many cells: as hard as possible while all cells together cast no more than about 100 million
    /// rays, but never less than 40,000 nor more than 2,000,000 for each.
    #[must_use]
    pub fn for_cells(cells: usize) -> Self {
        const ALL_RAYS: usize = 100_000_000;
        let each = (ALL_RAYS / cells.max(1)).clamp(40_000, 2_000_000);
        Self {
            rays_per_cell: each as u32,
            ..Self::default()
        }
    }

    /// How many steps of progress sampling so many cells takes: a first look, the rounds, and measuring.
    pub(super) fn steps(&self, cells: usize) -> u64 {
        (u64::from(self.rounds) + 2) * cells as u64
    }
}

/// Samples what each cell of the graph sees.
///
/// # Errors
/// When cancelled.
pub fn sampled(
    world: &World,
    graph: &CellGraph,
    settings: &SampledSettings,
    progress: &dyn Progress,
) -> Result<Vec<CellVisibility>, Cancelled> {
    progress.start(Stage::Visibility, settings.steps(graph.cells.len()));
    let mut survey = Survey::new(world, graph, settings, graph.voxel_m as f32, progress);
    survey.look()?;
    survey.measured()
}

/// Sampling in steps, so that others can say where to look.
pub(super) struct Survey<'a> {
    graph: &'a CellGraph,
    scenery: Scenery<'a>,
    settings: &'a SampledSettings,
    progress: &'a dyn Progress,
    states: Vec<CellState>,
}

impl<'a> Survey<'a> {
    /// Eyes in openings stand up to `guard_m` beyond them.
    pub(super) fn new(
        world: &'a World,
        graph: &'a CellGraph,
        settings: &'a SampledSettings,
        guard_m: f32,
        progress: &'a dyn Progress,
    ) -> Self {
        let count = graph.cells.len();
        let states = (0..count)
            .map(|cell| CellState {
                random: Random::stream(settings.seed, cell as u64),
                seen: Vec::new(),
                cells: (0..count).map(|other| other == cell).collect(),
                searched: vec![false; count],
                tried: Vec::new(),
                rays: 0,
            })
            .collect();
        Self {
            graph,
            scenery: Scenery::new(world, Lookout::all(world, graph, guard_m)),
            settings,
            progress,
            states,
        }
    }

    fn share(&self, part: u32) -> u32 {
        self.settings.rays_per_cell / 8 * part
    }

    /// Looks around from every cell, then lets cells learn from each other.
    pub(super) fn look(&mut self) -> Result<(), Cancelled> {
        let [one, two] = [1, 2].map(|part| self.share(part));
        self.run(|_, mut sampler| {
            sampler.look_around(one);
            sampler.search_cells(two, two);
        })?;
        for done in 0..self.settings.rounds {
            let lessons = lessons(self.graph, &self.states);
            let before: Vec<_> = self.states.iter().map(|s| s.seen.len()).collect();
            if !lessons.iter().all(Lesson::is_empty) {
                self.run(|cell, mut sampler| {
                    lessons[cell].learn(&mut sampler, two);
                    sampler.search_cells(one / 4, one / 4);
                })?;
            }
            if self
                .states
                .iter()
                .zip(before)
                .all(|(state, before)| state.seen.len() == before)
            {
                let left = u64::from(self.settings.rounds - done - u32::from(!lessons.iter().all(Lesson::is_empty)));
                self.progress.advance(left * self.states.len() as u64);
                break;
            }
        }
        Ok(())
    }

    /// Casts a few random rays from every cell, then lets cells try what their neighbours have seen. Reports no progress.
    pub(super) fn glance(&mut self, rays: u32, tries: u32, rounds: u32) -> Result<(), Cancelled> {
        let progress = std::mem::replace(&mut self.progress, &Silent);
        self.run(|_, mut sampler| sampler.glance(rays))?;
        for _ in 0..rounds {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            let lessons = lessons(self.graph, &self.states);
            self.run(|cell, mut sampler| {
                for sightings in lessons[cell].sightings.chunk_by(|a, b| a.object == b.object) {
                    sampler.try_from_here(&sightings[0], tries);
                    sampler.state.tried.push(sightings[0].object);
                }
                sampler.state.tried.sort_unstable();
            })?;
        }
        Ok(())
    }

    /// Objects that each cell has seen, and all that stand in cells which it sees into, rising.
    pub(super) fn seen_or_near_it(&self) -> Vec<Vec<u32>> {
        self.states
            .par_iter()
            .map(|state| {
                let into = (0..state.cells.len()).filter(|cell| state.cells[*cell]);
                let near = into.flat_map(|cell| self.scenery.objects_in[cell].iter().copied());
                let mut all: Vec<u32> = state.seen.iter().map(|s| s.object).chain(near).collect();
                all.sort_unstable();
                all.dedup();
                all
            })
            .collect()
    }

    /// How many objects each cell has seen so far.
    pub(super) fn seen_counts(&self) -> impl Iterator<Item = usize> {
        self.states.iter().map(|state| state.seen.len())
    }

    /// Known sight lines of each cell, one for each object that it has seen.
    pub(super) fn sightings(&self) -> Vec<Vec<Sighting>> {
        self.states.iter().map(|state| state.seen.clone()).collect()
    }

    /// Lets somebody who knows where to look search from every cell.
    pub(super) fn search<T: Send>(
        &mut self,
        search: impl Fn(usize, &mut Sampler) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        self.run(|cell, mut sampler| {
            let result = search(cell, &mut sampler);
            sampler.follow();
            result
        })
    }

    /// Measures what was seen.
    pub(super) fn measured(mut self) -> Result<Vec<CellVisibility>, Cancelled> {
        let measure_rays = self.share(1).max(1024);
        let measured = self.run(|_, mut sampler| sampler.measure(measure_rays))?;
        let states = &self.states;
        Ok((0..states.len())
            .map(|cell| {
                let mut objects: Vec<_> = states[cell]
                    .seen
                    .iter()
                    .zip(&measured[cell].seen)
                    .map(|(sighting, [fraction, solid_angle])| SeenObject {
                        object: sighting.object,
                        fraction: *fraction,
                        solid_angle: *solid_angle,
                        doors: Vec::new(),
                    })
                    .collect();
                objects.sort_by(|a, b| b.solid_angle.total_cmp(&a.solid_angle).then(a.object.cmp(&b.object)));
                CellVisibility {
                    objects,
                    cells: visible_cells(self.graph, states, cell),
                    miss_bound: (poisson_bound(measured[cell].surprises) / f64::from(measure_rays)).min(1.0),
                    rays: states[cell].rays,
                }
            })
            .collect())
    }

    /// Works on all cells, in parallel.
    fn run<T: Send>(&mut self, work: impl Fn(usize, Sampler) -> T + Sync) -> Result<Vec<T>, Cancelled> {
        let objects = self.scenery.world.object_bounds().len();
        let (scenery, progress) = (&self.scenery, self.progress);
        self.states
            .par_iter_mut()
            .enumerate()
            .map_init(
                || Scratch::new(objects),
                |scratch, (cell, state)| {
                    if progress.cancelled() {
                        return Err(Cancelled);
                    }
                    let result = work(cell, Sampler::new(scenery, cell, state, scratch));
                    progress.advance(1);
                    Ok(result)
                },
            )
            .collect()
    }
}

/// The largest mean that is still 95 % sure to give more than this count: Wilson and Hilferty's approximation of the
/// chi-square quantile (1931), within 1 %; 3.0 for a count of 0.
fn poisson_bound(count: u32) -> f64 {
    const QUANTILE_95: f64 = 1.645;
    let n = f64::from(count) + 1.0;
    n * (1.0 - 1.0 / (9.0 * n) + QUANTILE_95 / (3.0 * n.sqrt())).powi(3)
}

/// Sight lines have two ends: what sees this cell is seen from it.
fn visible_cells(graph: &CellGraph, states: &[CellState], cell: usize) -> Vec<u32> {
    let adjacent = &graph.cells[cell].adjacent;
    (0..states.len() as u32)
        .filter(|other| *other != cell as u32)
        .filter(|other| {
            let index = *other as usize;
            states[cell].cells[index] || states[index].cells[cell] || adjacent.binary_search(other).is_ok()
        })
        .collect()
}

/// What a cell can learn from others before a round.
struct Lesson {
    /// Sight lines of neighbours to objects that this cell has not seen, by object.
    sightings: Vec<Sighting>,
    /// Cells that see this one but that it does not see.
    cells: Vec<usize>,
}

impl Lesson {
    fn is_empty(&self) -> bool {
        self.sightings.is_empty() && self.cells.is_empty()
    }

    fn learn(&self, sampler: &mut Sampler, budget: u32) {
        for cell in &self.cells {
            sampler.state.cells[*cell] = true;
        }
        let by_object = || self.sightings.chunk_by(|a, b| a.object == b.object);
        let each = (budget / by_object().count().max(1) as u32).clamp(128, 4096);
        for sightings in by_object() {
            for sighting in sightings {
                sampler.search_beside(sighting, each / 2 / sightings.len() as u32);
            }
            sampler.search_for(sightings[0].object, each / 2);
            sampler.state.tried.push(sightings[0].object);
        }
        sampler.state.tried.sort_unstable();
    }
}

fn lessons(graph: &CellGraph, states: &[CellState]) -> Vec<Lesson> {
    let known: Vec<Vec<u32>> = states
        .par_iter()
        .map(|state| {
            let mut known: Vec<_> = state
                .seen
                .iter()
                .map(|s| s.object)
                .chain(state.tried.iter().copied())
                .collect();
            known.sort_unstable();
            known
        })
        .collect();
    (0..states.len())
        .into_par_iter()
        .map(|cell| {
            let news = |s: &&Sighting| known[cell].binary_search(&s.object).is_err();
            let adjacent = &graph.cells[cell].adjacent;
            let mut sightings: Vec<_> = adjacent
                .iter()
                .flat_map(|other| states[*other as usize].seen.iter().filter(news))
                .copied()
                .collect();
            sightings.sort_by_key(|s| s.object);
            Lesson {
                sightings,
                cells: (0..states.len())
                    .filter(|other| states[*other].cells[cell] && !states[cell].cells[*other])
                    .collect(),
            }
        })
        .collect()
}
