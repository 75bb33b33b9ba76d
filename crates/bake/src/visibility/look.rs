//! What does one cell see?
//!
//! 1. Uniform rays look around ([`Sampler::look_around`]).
//! 2. What no ray has seen is proved hidden, where that can be proved ([`Observer::visible_or_found`]), and hunted where
//!    not ([`hunt`]). What is left is neither seen nor hidden.
//! 3. Doors are closed one by one ([`doors`]), and what was seen is measured ([`measure`]).
//!
//! The answer is a function of the cell's [`Surroundings`] and the settings alone, so it can be remembered under their digest.

use std::collections::BTreeMap;

use super::{
    CellVisibility, SampledSettings, SeenObject,
    conservative::{ConservativeSettings, Observer},
    doors,
    hunt::hunt,
    kept,
    measure::measure,
    random::Random,
    sampler::{CellState, Sampler, Scratch},
    sights::Sights,
    surroundings::{Atlas, Surroundings},
};
use crate::{
    digest::{Digest, Digester},
    memory::Memory,
    occluders::Region,
};

/// Changes whenever the same surroundings would give another answer.
const VERSION: usize = 1;

/// Rays at an object before anybody tries to prove it hidden.
const FIRST_LOOK: u32 = 96;
/// What was found for one cell.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Found {
    /// What rays have seen.
    pub(super) seen: CellVisibility,
    /// Objects that neither rays have seen nor proofs hide, rising, with the doors that hide them.
    pub(super) open: Vec<(u32, Vec<u32>)>,
    /// Whether it was found by an earlier bake.
    pub(super) remembered: bool,
}

/// Finds what each cell sees.
pub(super) struct Looker<'a> {
    pub(super) atlas: &'a Atlas<'a>,
    pub(super) sights: &'a Sights<'a>,
    pub(super) proofs: ConservativeSettings,
    pub(super) sampled: SampledSettings,
    pub(super) effort: Effort,
    pub(super) memory: &'a dyn Memory,
}

/// How hard rays look for what nobody can prove hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Not at all.
    None,
    /// From the cell as a whole.
    Usual,
    /// From its parts too, because rays are all there is.
    Thorough,
}

impl Effort {
    /// How many rays look for each object from each part of the cell, and how often that is halved; `None` for who does
    /// not look at all.
    fn hunt(self) -> Option<[u32; 2]> {
        match self {
            Self::None => None,
            Self::Usual => Some([256, 0]),
            Self::Thorough => Some([512, 4]),
        }
    }
}

impl Looker<'_> {
    /// What one cell sees.
    pub(super) fn see(&self, cell: usize, scratch: &mut Scratch) -> Found {
        let surroundings = self.atlas.around(cell);
        let key = self.key(&surroundings);
        if let Some(found) = self
            .memory
            .recall(&key)
            .and_then(|text| kept::decode(&text, &surroundings))
        {
            return found;
        }
        let found = self.look(
            cell,
            &surroundings,
            Random::stream(self.sampled.seed, key.number()),
            scratch,
        );
        if let Some(text) = kept::encode(&found, &surroundings) {
            self.memory.keep(&key, &text);
        }
        found
    }

    /// A digest of all that decides the answer.
    fn key(&self, surroundings: &Surroundings) -> Digest {
        let mut digester = Digester::default();
        let settings = format!("{:?} {:?} {:?}", self.proofs, self.sampled, self.effort);
        digester.count(VERSION).text(&settings);
        digester.add(surroundings.digest);
        digester.finish()
    }

    fn look(&self, cell: usize, surroundings: &Surroundings, random: Random, scratch: &mut Scratch) -> Found {
        let eye = &self.atlas.eyes[cell];
        scratch.meet_only(&surroundings.objects);
        let mut state = CellState::new(cell, self.sights.lookouts.len(), random);
        let mut sampler = Sampler::new(self.sights, cell, &mut state, scratch);
        let uniform = sampler.look_around(self.sampled.rays_per_cell);
        let known: Vec<u32> = sampler
            .seen()
            .filter_map(|object| surroundings.number_of(object))
            .collect();
        let mut observer = Observer::new(&surroundings.scenery, self.proofs);
        let not_hidden = match self.effort.hunt() {
            None => observer.visible(eye, &known),
            Some([rays, halvings]) => {
                let not_hidden = observer.visible_or_found(eye, &known, &mut |number| {
                    hunt(
                        &mut sampler,
                        eye,
                        surroundings.objects[number as usize],
                        &[],
                        FIRST_LOOK,
                    )
                });
                for number in &not_hidden {
                    let prey = Prey {
                        number: *number,
                        object: surroundings.objects[*number as usize],
                        rays,
                    };
                    search(&mut sampler, &mut observer, eye, &prey, halvings);
                }
                not_hidden
            }
        };
        sampler.follow();
        let measured = measure(&mut sampler, &uniform);
        let sightings: BTreeMap<u32, _> = sampler.state.seen.iter().map(|s| (s.object, *s)).collect();
        drop(sampler);

        let mut marker = doors::Marker::new(surroundings, eye);
        let mut objects: Vec<_> = measured
            .iter()
            .map(|measured| SeenObject {
                object: measured.object,
                fraction: measured.fraction,
                solid_angle: measured.solid_angle_sr,
                doors: marker.doors_of(measured.object, sightings.get(&measured.object)),
            })
            .collect();
        objects.sort_by(SeenObject::order);
        let not_hidden = not_hidden.iter().map(|number| surroundings.objects[*number as usize]);
        let open = not_hidden.filter(|object| !sightings.contains_key(object));
        let cells = (0u32..).zip(&state.cells).filter(|(_, passed)| **passed);
        Found {
            open: open.map(|object| (object, marker.doors_of(object, None))).collect(),
            seen: CellVisibility {
                objects,
                cells: cells.map(|(cell, _)| cell).collect(),
                miss_bound: uniform.miss_bound,
                rays: state.rays,
            },
            remembered: false,
        }
    }
}

/// Who is hunted.
struct Prey {
    /// Its number in the surroundings.
    number: u32,
    object: u32,
    /// As many for each part of the cell.
    rays: u32,
}

/// Hunts from a part of the cell, unless it is hidden from there, then from its halves, and so on.
fn search(sampler: &mut Sampler<'_>, observer: &mut Observer<'_>, part: &Region, prey: &Prey, halvings: u32) -> bool {
    let Some(ways) = observer.ways_to(part, prey.number) else {
        return false;
    };
    hunt(sampler, part, prey.object, &ways, prey.rays)
        || (halvings > 0
            && part
                .halves()
                .iter()
                .any(|half| search(sampler, observer, half, prey, halvings - 1)))
}
