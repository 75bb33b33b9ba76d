//! What does one cell see?
//!
//! 1. Uniform rays look around ([`Sampler::look_around`]).
//! 2. What no ray has seen is proved hidden, where that can be proved, and looked for where not ([`Observer::visible_or_found`],
//!    [`hunt()`]), harder where rays are all there is ([`chase()`]). What is left is neither seen nor hidden.
//! 3. Doors are closed one by one ([`doors`]), and what was seen is measured ([`measure`]).
//! 4. Which other cells it sees into is found last, along the sight lines that are known by then ([`Sampler::retrace`]).
//!
//! All but the last is a function of the cell's [`Surroundings`] and the settings alone, so it can be remembered under their digest.
//! Looking into other cells takes a quarter of the rays that looked around and some for each object, and is done anew each time: they may
//! be cut otherwise.

use std::collections::BTreeMap;

use super::{
    CellVisibility, SampledSettings, SeenObject,
    chase::chase,
    conservative::{ConservativeSettings, Observer},
    doors,
    hunt::{hunt, look_between},
    kept,
    measure::measure,
    narrow::Scout,
    random::Random,
    sampler::{CellState, Sampler, Scratch, Sighting},
    sights::Sights,
    surface::Surface,
    surroundings::{Atlas, Surroundings},
};
use crate::{
    digest::{Digest, Digester},
    memory::Memory,
    occluders::Region,
};

/// Changes whenever the same surroundings would give another answer.
const VERSION: usize = 24;

/// Rays at an object before anybody tries to prove it hidden.
const FIRST_LOOK: u32 = 48;
/// Rays between two parts of a cell and an object that no proof separates.
const LOOK: u32 = 4;
/// One ray looks for other cells for so many that have looked around.
const FOR_CELLS: u32 = 4;
/// Added to the seed of rays that look for other cells.
const CELLS_SEED: u64 = 0xCE11;

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

/// What was found for one cell but for the cells that it sees into, and how.
pub(super) struct Looked {
    /// As in [`Found`].
    pub(super) seen: CellVisibility,
    /// Likewise.
    pub(super) open: Vec<(u32, Vec<u32>)>,
    /// A sight line to each object that rays have seen, in order of discovery.
    pub(super) sightings: Vec<Sighting>,
    /// How many uniform rays it took.
    pub(super) uniform_rays: u32,
}

/// Finds what each cell sees.
pub(super) struct Looker<'a> {
    pub(super) atlas: &'a Atlas<'a>,
    pub(super) sights: &'a Sights<'a>,
    pub(super) proofs: ConservativeSettings,
    pub(super) sampled: SampledSettings,
    /// Whether rays are all there is, so that they look harder.
    pub(super) thorough: bool,
    pub(super) memory: &'a dyn Memory,
}

impl Looker<'_> {
    /// What one cell sees.
    pub(super) fn see(&self, cell: usize, (observer, scratch): (&mut Observer<'_>, &mut Scratch)) -> Found {
        let surroundings = self.atlas.around(cell, observer);
        let key = self.key(&surroundings);
        scratch.meet_only(&surroundings.objects);
        let kept = self.memory.recall(&key);
        let known = kept.and_then(|text| kept::decode(&text, &surroundings));
        let remembered = known.is_some() && !self.memory.is_of_this_bake(&key);
        let looked = known.unwrap_or_else(|| {
            let random = Random::stream(self.sampled.seed, key.number());
            let looked = self.look(cell, &surroundings, random, scratch);
            if let Some(text) = kept::encode(&looked, &surroundings) {
                self.memory.keep(&key, &text);
            }
            looked
        });
        let random = Random::stream(self.sampled.seed.wrapping_add(CELLS_SEED), key.number());
        let cells = self.cells_seen(cell, &looked, random, scratch);
        Found {
            seen: CellVisibility { cells, ..looked.seen },
            open: looked.open,
            remembered,
        }
    }

    /// The cells that a cell sees into, rising, itself among them.
    fn cells_seen(&self, cell: usize, looked: &Looked, random: Random, scratch: &mut Scratch) -> Vec<u32> {
        let mut state = CellState::with_cells(cell, random);
        let mut sampler = Sampler::new(self.sights, cell, &mut state, scratch);
        sampler.retrace(looked.uniform_rays / FOR_CELLS, &looked.sightings);
        drop(sampler);
        state.cells_passed()
    }

    /// A digest of all that decides the answer.
    fn key(&self, surroundings: &Surroundings) -> Digest {
        let mut digester = Digester::default();
        let settings = format!("{:?} {:?} {}", self.proofs, self.sampled, self.thorough);
        digester.count(VERSION).text(&settings);
        digester.add(surroundings.digest);
        digester.finish()
    }

    /// Looks from it; rays meet what is in the surroundings.
    fn look(&self, cell: usize, surroundings: &Surroundings, random: Random, scratch: &mut Scratch) -> Looked {
        let eye = &self.atlas.eyes[cell];
        let mut state = CellState::new(random);
        let mut sampler = Sampler::new(self.sights, cell, &mut state, scratch);
        let uniform = sampler.look_around(self.sampled.rays_per_cell);
        let known: Vec<u32> = sampler
            .seen()
            .filter_map(|object| surroundings.number_of(object))
            .collect();
        let mut observer = Observer::new(&surroundings.scenery, self.proofs);
        let mut hunter = Hunter {
            surroundings,
            sampler: &mut sampler,
        };
        let not_hidden = observer.visible_or_found(eye, &known, &mut hunter);
        if self.thorough {
            let numbers = not_hidden.iter();
            let open = numbers.map(|number| (*number, surroundings.objects[*number as usize]));
            let open: Vec<_> = open.filter(|(_, object)| !sampler.knows(*object)).collect();
            chase(&mut sampler, &mut observer, eye, open, self.sampled.rays_per_cell);
        }
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
        Looked {
            open: open.map(|object| (object, marker.doors_of(object, None))).collect(),
            seen: CellVisibility {
                objects,
                cells: Vec::new(),
                miss_bound: uniform.miss_bound,
                rays: state.rays,
            },
            sightings: state.seen,
            uniform_rays: uniform.rays,
        }
    }
}

/// Looks with rays.
struct Hunter<'h, 'a> {
    surroundings: &'h Surroundings,
    sampler: &'h mut Sampler<'a>,
}

impl Scout for Hunter<'_, '_> {
    fn glances(&mut self, number: u32, eye: &Region) -> bool {
        let object = self.surroundings.objects[number as usize];
        hunt(self.sampler, eye, object, &[], FIRST_LOOK)
    }

    fn surface(&self, number: u32) -> Option<Surface> {
        Surface::of(self.sampler.sights.world, self.surroundings.objects[number as usize])
    }

    fn looks(&mut self, number: u32, eye: &Region, part: &Surface, ways: &[Region]) -> bool {
        look_between(
            self.sampler,
            self.surroundings.objects[number as usize],
            eye,
            part,
            ways,
            LOOK,
        )
    }
}
