//! Which way does a visitor go that nobody gave one? Made up from the scene's cells and the openings between them, from the
//! first viewpoint, at its height where there is room for it:
//!
//! * `wander`: at random, as somebody who looks around;
//! * `street_tour`: in order, to see as many cells as possible;
//! * `rooms`: where one can go on from a cell.

mod rooms;
mod street_tour;
mod wander;

use crate::{ByteSource, Error, Scene};

use super::script::Script;
use rooms::Rooms;

/// A made-up way passes through no more places.
const MOST_PLACES: usize = 100_000;

/// How a made-up way goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Manner {
    /// From cell to cell at random, never straight back unless there is no other way; at random within the only one.
    #[default]
    Wander,
    /// From each cell to the nearest that was not visited, along streets before into houses; when all are, home, and round
    /// again.
    StreetTour,
}

/// Ways through one scene.
pub struct Rambles<'s, S> {
    rooms: Rooms<'s, S>,
    start: [f64; 3],
    speed_mps: f64,
    duration_s: f64,
}

impl<'s, S: ByteSource> Rambles<'s, S> {
    /// Ways from the first viewpoint at this speed, metres a second, that take so many seconds.
    #[must_use]
    pub fn through(scene: &'s Scene<S>, speed_mps: f64, duration_s: f64) -> Self {
        let start = scene.pointer().viewpoints[0].position;
        Self {
            rooms: Rooms::of(scene, start[1]),
            start,
            speed_mps,
            duration_s,
        }
    }

    /// One of them; another seed is another way, and the same gives the same. From a cell whose record cannot be had it goes
    /// on next door, where both cells meet, and round what the index of a scene that is [giving up](Scene::giving_up) has lost.
    ///
    /// # Errors
    /// With [`Error::Uncharted`] when the index leads to no cell at all.
    pub async fn script(&mut self, manner: Manner, seed: u64) -> Result<Script, Error> {
        let (rooms, start, long_m) = (&mut self.rooms, self.start, self.speed_mps * self.duration_s);
        let places = match manner {
            Manner::Wander => wander::places(rooms, start, long_m, seed).await?,
            Manner::StreetTour => street_tour::places(rooms, start, long_m, seed).await?,
        };
        Ok(Script::through(&places, self.speed_mps).until(1000.0 * self.duration_s))
    }
}

/// The next of a row of random numbers (splitmix64).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}
