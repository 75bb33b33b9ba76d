//! What of a world can matter to one cell?
//!
//! Objects that a rough look proves hidden can neither be seen from a cell nor hide anything from it that is not
//! hidden without them (Cohen-Or & Zadicario, *Visibility streaming for network-based walkthroughs*, 1998: occluded
//! occluders are redundant). All questions about the cell are asked of what is left, and of nothing else: cost grows
//! with what is visible instead of with the world, and the answer can be used again in every world in which what is left
//! is the same, however much has changed behind it and however the rest of it is cut into cells.
//!
//! A cell as wide as a house has little behind that house: shadows are cast by what is left of bodies when they shrink by half the
//! extents of the eye. So the rough look is taken from parts of the cell (the paper's subcells, coarse to fine), of a size that
//! is found by trying, and what is hidden from each of them is hidden from the cell.

use std::sync::Arc;

use rayon::prelude::*;

use super::{
    conservative::{ConservativeSettings, Observer, Scenery},
    measure::LEAST_SR,
};
use crate::{
    cells::CellGraph,
    digest::{Digest, Digester},
    occluders::{Hiders, Region},
    progress::{Cancelled, Portion, Progress},
    world::World,
};

/// Rough looks are taken from parts of a cell that is halved at most so often, …
const MOST_HALVINGS: u32 = 6;
/// … so many times more or less often.
const STEP: u32 = 2;
/// A part is not too large while no more than so many times as much may be seen from it as from the next smaller one …
const MOST_GROWTH: usize = 2;
/// … or no more than so many objects.
const FEW: usize = 64;

/// Steps of progress of making a scenery of objects, of telling objects apart, and cells.
const SCENERY: u64 = 500;
const OBJECTS: u64 = 1000;
const CELLS: u64 = 200;

/// A world as its cells divide it up.
pub(super) struct Atlas<'a> {
    pub(super) hiders: &'a Hiders<'a>,
    /// Cells as regions.
    pub(super) eyes: Vec<Region>,
    /// Bodies, and the boxes of objects.
    all: Scenery,
    objects: Vec<Digest>,
    cells: Vec<Digest>,
}

/// What can matter to one cell.
pub(super) struct Surroundings {
    /// Objects, rising; their places here are their numbers in [`scenery`](Self::scenery).
    pub(super) objects: Vec<u32>,
    /// What hides here, and what it may hide.
    pub(super) scenery: Scenery,
    /// A digest of all this and of the cell.
    pub(super) digest: Digest,
}

impl Surroundings {
    /// The number of an object here.
    pub(super) fn number_of(&self, object: u32) -> Option<u32> {
        let found = self.objects.binary_search(&object);
        found.ok().map(|place| place as u32)
    }
}

impl<'a> Atlas<'a> {
    /// Steps of progress that making one takes.
    pub(super) const STEPS: u64 = SCENERY + OBJECTS + CELLS;

    pub(super) fn of(
        world: &World,
        graph: &CellGraph,
        hiders: &'a Hiders<'a>,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let eyes: Vec<_> = graph
            .cells
            .par_iter()
            .map(|cell| Region::of_cell(world, cell))
            .collect();
        let all = Scenery::new(hiders.found(), Scenery::targets_of(world));
        progress.advance(SCENERY);
        let portion = Portion::of(progress, OBJECTS, world.triangle_count() as u64);
        let digest_of = |object: u32| {
            if portion.cancelled() {
                return Err(Cancelled);
            }
            let digest = world.digest_of(object);
            portion.advance(world.triangle_count_of(object) as u64);
            Ok(digest)
        };
        let objects = (0..all.targets.len() as u32).into_par_iter().map(digest_of);
        let objects = objects.collect::<Result<Vec<_>, _>>()?;
        drop(portion);
        let cells = graph.cells.par_iter().map(|cell| cell.digest()).collect();
        progress.advance(CELLS);
        Ok(Self {
            hiders,
            eyes,
            all,
            objects,
            cells,
        })
    }

    /// Who takes rough looks at objects with these kinds of proof, from one cell after the other.
    pub(super) fn observer(&self, proofs: ConservativeSettings) -> Observer<'_> {
        Observer::new(&self.all, proofs.rough())
    }

    /// Bodies, and the boxes of objects, then of cells.
    pub(super) fn with_cells(&self) -> Scenery {
        let cells = self.eyes.iter().map(|eye| Some(Region::of_box(eye.min, eye.max)));
        let targets = self.all.targets.iter().cloned().chain(cells).collect();
        Scenery::behind(Arc::clone(&self.all.blocker), targets)
    }

    /// Objects and cells, itself among them, that a rough look from a cell cannot prove hidden, both rising. The observer is one
    /// of what is [`with_cells`](Self::with_cells).
    pub(super) fn not_hidden(&self, cell: usize, observer: &mut Observer<'_>) -> (Vec<u32>, Vec<u32>) {
        let mut objects = self.found_from_parts(cell, observer);
        let count = self.all.targets.len() as u32;
        let cells = objects.split_off(objects.partition_point(|number| *number < count));
        (objects, cells.into_iter().map(|number| number - count).collect())
    }

    /// What a rough look from some part of a cell cannot prove hidden, rising.
    fn found_from_parts(&self, cell: usize, observer: &mut Observer<'_>) -> Vec<u32> {
        // Other cells do not decide what is proved.
        observer.forget();
        from_parts(observer, &self.eyes[cell])
    }

    /// The solid angle of the box around an object from the middle of a cell, in steradians, above 0.
    pub(super) fn box_sr(&self, cell: usize, object: u32) -> f32 {
        let eye = self.eyes[cell].center();
        let target = self.all.targets[object as usize].as_ref();
        target.map_or(0.0, |target| target.solid_angle_sr(eye)).max(LEAST_SR)
    }

    /// The surroundings of a cell where only an [`observer`](Self::observer)'s kinds of proof count.
    pub(super) fn around(&self, cell: usize, observer: &mut Observer<'_>) -> Surroundings {
        let objects = self.found_from_parts(cell, observer);
        let mut digester = Digester::default();
        digester.add(self.cells[cell]).count(objects.len());
        for object in &objects {
            digester.add(self.objects[*object as usize]);
        }
        let occluders = self.hiders.among(&objects, &mut digester);
        let targets = objects.iter().map(|object| self.all.targets[*object as usize].clone());
        Surroundings {
            scenery: Scenery::new(occluders, targets.collect()),
            objects,
            digest: digester.finish(),
        }
    }
}

/// What may be seen from some part of a region, rising.
fn from_parts(observer: &mut Observer<'_>, eye: &Region) -> Vec<u32> {
    let from_all = observer.visible(eye, &[]);
    let halvings = halvings_that_pay(observer, eye, from_all.len());
    if halvings == 0 {
        return from_all;
    }
    let mut open = Vec::new();
    each_part(eye, halvings, &mut |part| {
        open = observer.visible(part, &open);
    });
    open
}

/// How often a region, from all of which so many objects may be seen, is halved for rough looks from its parts. Found from a small
/// part of it, near its middle, and larger and larger ones around that: as long as one sees about as much as what it is around of,
/// nothing is lost by looking from it. Where all of the region does, so does each between.
fn halvings_that_pay(observer: &mut Observer<'_>, eye: &Region, from_all: usize) -> u32 {
    if from_all <= FEW {
        return 0;
    }
    let mut parts = vec![eye.clone()];
    for halving in 0..MOST_HALVINGS {
        let [low, high] = parts[halving as usize].halves();
        parts.push(if halving % 2 == 0 { high } else { low });
    }
    let mut seen_from = |halvings: u32| observer.visible(&parts[halvings as usize], &[]).len();
    let mut halvings = MOST_HALVINGS;
    let mut open = seen_from(halvings);
    if from_all <= MOST_GROWTH * open {
        return 0;
    }
    while halvings > 0 {
        let wider = halvings - STEP;
        let found = if wider == 0 { from_all } else { seen_from(wider) };
        if found > FEW.max(MOST_GROWTH * open) {
            break;
        }
        (halvings, open) = (wider, found);
    }
    halvings
}

fn each_part(region: &Region, halvings: u32, look: &mut impl FnMut(&Region)) {
    if halvings == 0 {
        return look(region);
    }
    for half in region.halves() {
        each_part(&half, halvings - 1, look);
    }
}
