//! Where rays are all there is: what else is visible of what neither rays have seen nor proofs hide?
//!
//! Objects are hunted ([`hunt()`]) from the cell and, coarse to fine, from those parts of it from which no proof hides them, in
//! rounds, each with twice as many rays as the one before, as far as [`MOST_RAYS`] and [`LEAST_RAYS`] allow. What a round finds
//! shows along about as small a share of sight lines as its rays could just meet; so as long as rounds find something, there
//! are likely more such things, and where two in a row find nothing, few (the argument of Good, *The population frequencies of
//! species and the estimation of population parameters*, 1953).
//!
//! Guarantee: whatever is found was seen by a ray. Cost: about twelve times as many rays as looking around may take where nothing is
//! found, sixty times at most, but in each round no fewer than [`LEAST_RAYS`] for an object.

use super::{conservative::Observer, hunt::hunt, sampler::Sampler};
use crate::occluders::Region;

/// The first round casts so many times as many rays as looking around may take, all objects together, …
const FIRST: u32 = 4;
/// … and the last so many.
const MOST: u32 = 32;
/// Rounds end after so many that found nothing.
const QUIET: u32 = 2;
/// Rays at one object from one part of the cell: no fewer …
const LEAST_RAYS: u32 = 24;
/// … and no more.
const MOST_RAYS: u32 = 4096;
/// The cell is halved so often.
const HALVINGS: u32 = 4;

/// How one object is hunted in one round.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Rays from each part of the cell.
    rays: u32,
    /// From at most so many parts.
    parts: u32,
}

impl Effort {
    fn of(rays: u32) -> Self {
        let each = (rays >> HALVINGS).clamp(LEAST_RAYS, MOST_RAYS);
        Self {
            rays: each,
            parts: rays / each + 1,
        }
    }
}

/// Hunts objects, of each of which its number in the surroundings is known too. `rays` is what looking around may take.
pub(super) fn chase(
    sampler: &mut Sampler<'_>,
    observer: &mut Observer<'_>,
    eye: &Region,
    mut prey: Vec<(u32, u32)>,
    rays: u32,
) {
    let (mut times, mut quiet) = (FIRST, 0);
    while times <= MOST && quiet < QUIET && !prey.is_empty() {
        let effort = Effort::of(rays.saturating_mul(times) / prey.len() as u32);
        let before = prey.len();
        for one in &prey {
            search(sampler, observer, (eye, HALVINGS), *one, &mut effort.clone());
        }
        // Others may have been found on the way.
        sampler.follow();
        prey.retain(|(_, object)| !sampler.knows(*object));
        quiet = if prey.len() == before { quiet + 1 } else { 0 };
        times *= 2;
    }
}

/// Hunts an object from a part of the cell, unless it is hidden from there, then from its halves, which may be halved once less.
fn search(
    sampler: &mut Sampler<'_>,
    observer: &mut Observer<'_>,
    (part, halvings): (&Region, u32),
    prey @ (number, object): (u32, u32),
    effort: &mut Effort,
) -> bool {
    if effort.parts == 0 {
        return false;
    }
    let Some(ways) = observer.ways_to(part, number) else {
        return false;
    };
    effort.parts -= 1;
    hunt(sampler, part, object, &ways, effort.rays)
        || (halvings > 0
            && part
                .halves()
                .iter()
                .any(|half| search(sampler, observer, (half, halvings - 1), prey, effort)))
}
