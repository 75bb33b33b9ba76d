//! What does each cell see, at a glance? An estimate for choosing cells, from a few thousand rays each.
//!
//! Random rays find different small things from neighbouring cells that see the same. So each sight line of a neighbour
//! is tried from a few eyes of the cell itself, and what is found so is passed on in the next round. Few rays miss small
//! things, so everything that stands in a cell which is seen into counts: the cell-to-cell relation of Teller & Séquin,
//! *Visibility preprocessing for interactive walkthroughs* (1991). Of that, only what the cheapest proofs do not hide from a few
//! eyes counts: the air over a town is seen into from every street, but not all that stands under it is seen.

use belvedere_scene::Bounds;
use glam::Vec3;
use rayon::prelude::*;

use super::{
    Method,
    conservative::{Observer, Scenery},
    random::Random,
    sampler::{CellState, Sampler, Scratch, Sighting},
    segment,
    sights::Sights,
    targets::Lookout,
};
use crate::{
    cells::CellGraph,
    occluders::Region,
    progress::{Cancelled, Progress, Stage},
    world::World,
};

/// Random rays from each cell.
const RAYS: u32 = 3072;
/// Eyes that try a neighbour's sight line.
const TRIES: u32 = 8;
/// Eyes from which proofs are tried in a cell …
const EYES: usize = 6;
/// … and in all of many cells together: each of them is small.
const ALL_EYES: usize = 2048 * EYES;
/// … but not fewer than this in each.
const LEAST_EYES: usize = 2;
/// How far word of a thing travels, in cells.
const ROUNDS: u32 = 3;
/// Where random streams start.
const SEED: u64 = 0x61A9_CE00;

/// For each cell objects that it sees or that stand near what it sees, rising. `scenery` is the world's.
///
/// # Errors
/// When cancelled.
pub fn glance(
    world: &World,
    scenery: &Scenery,
    graph: &CellGraph,
    progress: &dyn Progress,
) -> Result<Vec<Vec<u32>>, Cancelled> {
    let count = graph.cells.len();
    progress.start(Stage::Glance, count as u64 * u64::from(1 + ROUNDS + 1));
    let sights = Sights::of(world, graph);
    // By place, so that a cell more elsewhere changes nothing here.
    let stream = |cell: usize| Random::stream(SEED, graph.cells[cell].digest_of_shape().number());
    let mut states: Vec<_> = (0..count)
        .map(|cell| CellState::with_cells(cell, stream(cell)))
        .collect();
    // Cells reach into things, and who is inside sees out through all of them.
    let may_be = |eye: Vec3| !scenery.blocker.holds(eye);
    run(&sights, &mut states, progress, |_, sampler| {
        sampler.glance(RAYS, &may_be)
    })?;
    // Objects that were tried on a neighbour's word, rising.
    let mut tried: Vec<Vec<u32>> = vec![Vec::new(); count];
    for _ in 0..ROUNDS {
        let news = news(graph, &states, &tried);
        run(&sights, &mut states, progress, |cell, sampler| {
            for sighting in &news[cell] {
                sampler.try_from_here(sighting, TRIES, &may_be);
            }
        })?;
        for (tried, news) in tried.iter_mut().zip(&news) {
            tried.extend(news.iter().map(|sighting| sighting.object));
            tried.sort_unstable();
        }
    }
    let objects_in = objects_in(&sights);
    let eyes = (ALL_EYES / count.max(1)).clamp(LEAST_EYES, EYES);
    let seen = states.par_iter_mut().enumerate().map(|(cell, state)| {
        if progress.cancelled() {
            return Err(Cancelled);
        }
        let into = state.cells.iter();
        let near = into.flat_map(|cell| objects_in[*cell as usize].iter().copied());
        let mut near: Vec<u32> = near.collect();
        near.sort_unstable();
        near.dedup();
        let mut observer = Observer::new(scenery, Method::Conservative.proofs().rough());
        // What one eye has seen or may see is no question for the next.
        let mut open: Vec<u32> = state.seen.iter().map(|sighting| sighting.object).collect();
        open.sort_unstable();
        for _ in 0..eyes {
            let eye = sights.lookouts[cell].uniform(&mut state.random);
            if may_be(eye) && !near.iter().all(|object| open.binary_search(object).is_ok()) {
                open = observer.visible(&Region::rounded(eye, eye), &open);
            }
        }
        near.extend(state.seen.iter().map(|sighting| sighting.object));
        near.sort_unstable();
        near.dedup();
        near.retain(|object| open.binary_search(object).is_ok());
        progress.advance(1);
        Ok(near)
    });
    seen.collect()
}

/// Works on all cells, in parallel.
fn run(
    sights: &Sights<'_>,
    states: &mut [CellState],
    progress: &dyn Progress,
    work: impl Fn(usize, &mut Sampler<'_>) + Sync,
) -> Result<(), Cancelled> {
    states.par_iter_mut().enumerate().try_for_each_init(
        || Scratch::new(sights),
        |scratch, (cell, state)| {
            if progress.cancelled() {
                return Err(Cancelled);
            }
            work(cell, &mut Sampler::new(sights, cell, state, scratch));
            progress.advance(1);
            Ok(())
        },
    )
}

/// For each cell a sight line of a neighbour to every object that it has neither seen nor tried.
fn news(graph: &CellGraph, states: &[CellState], tried: &[Vec<u32>]) -> Vec<Vec<Sighting>> {
    let of = |cell: usize| {
        let mut known: Vec<_> = states[cell]
            .seen
            .iter()
            .map(|s| s.object)
            .chain(tried[cell].iter().copied())
            .collect();
        known.sort_unstable();
        let adjacent = graph.cells[cell].adjacent.iter();
        let mut news: Vec<_> = adjacent
            .flat_map(|other| &states[*other as usize].seen)
            .filter(|s| known.binary_search(&s.object).is_err())
            .copied()
            .collect();
        news.sort_by_key(|s| s.object);
        news.dedup_by_key(|s| s.object);
        news
    };
    (0..states.len()).into_par_iter().map(of).collect()
}

/// Objects whose boxes meet each cell, or meet none and this is the nearest, rising.
fn objects_in(sights: &Sights<'_>) -> Vec<Vec<u32>> {
    let (world, lookouts) = (sights.world, &sights.lookouts);
    let around = |l: &Lookout| {
        let margin = 0.01 * (l.max - l.min);
        [l.min - margin, l.max + margin]
    };
    let tree = segment::tree(lookouts.iter().map(around), 0.0);
    // What meets no cell, in a niche or in the air, stands near whoever is nearest.
    let nearest = |min: Vec3, max: Vec3| {
        let away_m = |l: &Lookout| (l.min - max).max(min - l.max).max(Vec3::ZERO).length();
        (0..lookouts.len()).min_by(|a, b| away_m(&lookouts[*a]).total_cmp(&away_m(&lookouts[*b])))
    };
    let cells_of = |bounds: &Bounds| {
        let mut cells = Vec::new();
        if bounds.is_empty() {
            return cells;
        }
        let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
        segment::each_in(&tree, &Region::of_box(min, max), |cell| {
            let [low, high] = around(&lookouts[cell as usize]);
            if min.cmple(high).all() && max.cmpge(low).all() {
                cells.push(cell as usize);
            }
        });
        if cells.is_empty() {
            cells.extend(nearest(min, max));
        }
        cells
    };
    let cells_of: Vec<Vec<usize>> = world.object_bounds().par_iter().map(cells_of).collect();
    let mut objects_in: Vec<Vec<u32>> = vec![Vec::new(); lookouts.len()];
    for (object, cells) in (0u32..).zip(cells_of) {
        cells.into_iter().for_each(|cell| objects_in[cell].push(object));
    }
    objects_in
}
