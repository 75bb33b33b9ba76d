//! What does a closed door hide?
//!
//! Sets are computed with all doors open. An entry depends on a door when, with that door alone closed, the object can
//! be proved hidden from the whole cell. Then every sight line to it passes the door, so one known sight line that does
//! not answers the question without a proof. Two doors neither of which hides an object alone, but which do together,
//! are not noted: whoever asks with both closed may get an object too many, never one too few.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{
    CellVisibility,
    conservative::Scenery,
    prover::{Proofs, Prover},
    sampler::Sighting,
};
use crate::{
    cells::CellGraph,
    occluders::Region,
    progress::{Cancelled, Progress},
    world::World,
};

/// Notes with each entry the doors that hide it. `sightings` are known sight lines of each cell.
pub(super) fn mark(
    world: &World,
    graph: &CellGraph,
    scenery: &Scenery,
    sightings: &[Vec<Sighting>],
    cells: &mut [CellVisibility],
    progress: &dyn Progress,
) -> Result<(), Cancelled> {
    let blocker = &scenery.blocker;
    let doors = blocker.doors();
    if doors.is_empty() {
        progress.advance(cells.len() as u64);
        return Ok(());
    }
    let proofs = Proofs {
        bodies: true,
        walls: true,
    };
    cells
        .par_iter_mut()
        .enumerate()
        .map_init(
            || Prover::new(blocker, proofs),
            |prover, (index, cell)| {
                if progress.cancelled() {
                    return Err(Cancelled);
                }
                let eye = Region::of_cell(world, &graph.cells[index]);
                let known: BTreeMap<u32, &Sighting> = sightings[index].iter().map(|s| (s.object, s)).collect();
                for entry in &mut cell.objects {
                    let Some(target) = &scenery.targets[entry.object as usize] else {
                        continue;
                    };
                    let [from, to] = known
                        .get(&entry.object)
                        .map_or([eye.center(), target.center()], |s| [s.eye, s.target]);
                    for door in &doors {
                        if *door != entry.object && blocker.door_is_on(*door, from, to) {
                            prover.close(&[*door]);
                            if prover.hides(&eye, target).is_some() {
                                entry.doors.push(*door);
                            }
                        }
                    }
                }
                prover.close(&[]);
                progress.advance(1);
                Ok(())
            },
        )
        .collect()
}
