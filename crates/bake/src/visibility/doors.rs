//! What does a closed door hide?
//!
//! Sets are computed with all doors open. An entry depends on a door when, with that door alone closed, the object can
//! be proved hidden from the whole cell. Then every sight line to it passes the door, so one known sight line that does
//! not answers the question without a proof. Two doors neither of which hides an object alone, but which do together,
//! are not noted: whoever asks with both closed may get an object too many, never one too few.

use super::{
    prover::{Proofs, Prover},
    sampler::Sighting,
    surroundings::Surroundings,
};
use crate::occluders::Region;

/// Finds the doors that hide objects from one cell.
pub(super) struct Marker<'a> {
    surroundings: &'a Surroundings,
    eye: &'a Region,
    /// In numbers of the surroundings.
    doors: Vec<u32>,
    prover: Prover<'a>,
}

impl<'a> Marker<'a> {
    pub(super) fn new(surroundings: &'a Surroundings, eye: &'a Region) -> Self {
        let blocker = &surroundings.scenery.blocker;
        let proofs = Proofs {
            bodies: true,
            walls: true,
        };
        Self {
            surroundings,
            eye,
            doors: blocker.doors(),
            prover: Prover::new(blocker, proofs),
        }
    }

    /// Doors each of which hides an object when it is closed, rising. `known` is a sight line to it.
    pub(super) fn doors_of(&mut self, object: u32, known: Option<&Sighting>) -> Vec<u32> {
        if self.doors.is_empty() {
            return Vec::new();
        }
        let Some(number) = self.surroundings.number_of(object) else {
            return Vec::new();
        };
        let Some(target) = &self.surroundings.scenery.targets[number as usize] else {
            return Vec::new();
        };
        let [from, to] = known.map_or([self.eye.center(), target.center()], |s| [s.eye, s.target]);
        let blocker = &self.surroundings.scenery.blocker;
        let (eye, prover) = (self.eye, &mut self.prover);
        let hides = |door: &&u32| {
            **door != number && blocker.door_is_on(**door, from, to) && {
                prover.close(&[**door]);
                prover.hides(eye, target).is_some()
            }
        };
        let doors = self.doors.iter().filter(hides);
        doors.map(|door| self.surroundings.objects[*door as usize]).collect()
    }
}
