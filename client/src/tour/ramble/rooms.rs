//! Where can one go on from a cell? Through the middles of its openings, at the height of one's eye where they reach there;
//! read once for all who walk.

use std::{collections::HashMap, sync::Arc};

use belvedere_scene::{
    Bounds, CellId,
    index::CellEntry,
    record::{CellRecord, Portal},
};

use super::random;
use crate::{ByteSource, Error, Scene, whereabouts::NOWHERE};

/// A cell as who walks needs it.
#[derive(Debug)]
pub(super) struct Room {
    pub(super) entry: CellEntry,
    /// Well inside, at the height of the eye where there is room for it.
    pub(super) middle: [f64; 3],
    /// Ways out of it.
    pub(super) openings: Vec<Opening>,
}

/// So many tries to find a place in a cell that is not its box.
const TRIES: usize = 64;

impl Room {
    /// A place in it at random, at the height of its middle.
    pub(super) fn somewhere(&self, state: &mut u64) -> [f64; 3] {
        let Bounds { min, max } = self.entry.bounds;
        let place = || {
            let mut between = |i: usize| min[i] + (max[i] - min[i]) * (random(state) as f64 / u64::MAX as f64);
            [between(0), self.middle[1], between(2)]
        };
        let mut tries = std::iter::repeat_with(place).take(TRIES);
        tries
            .find(|place| self.entry.holds_alone(*place))
            .unwrap_or(self.middle)
    }
}

/// A place where one cell leads to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Opening {
    pub(super) to: CellId,
    /// Its middle, at the height of the eye if it reaches there.
    pub(super) place: [f64; 3],
    /// How wide it is for who walks, metres.
    pub(super) width_m: f64,
    /// Whether one walks through it upright, without climbing or ducking.
    pub(super) is_upright: bool,
    /// Whether a door may close it.
    pub(super) has_door: bool,
}

/// All that were read of.
pub(super) struct Rooms<'s, S> {
    scene: &'s Scene<S>,
    height_m: f64,
    known: HashMap<CellId, Arc<Room>>,
}

impl<'s, S: ByteSource> Rooms<'s, S> {
    /// For eyes at a height, metres.
    pub(super) fn of(scene: &'s Scene<S>, height_m: f64) -> Self {
        Self {
            scene,
            height_m,
            known: HashMap::new(),
        }
    }

    /// The cell at a place, or the nearest that is known.
    pub(super) async fn at(&mut self, place: [f64; 3]) -> Result<Arc<Room>, Error> {
        let found = self.scene.whereabouts(None, place, false, false).await?;
        let entry = found.cell;
        if entry.cell == NOWHERE {
            let cause = match found.failures.into_iter().next() {
                Some(Error::Unmapped { cause }) => cause,
                _ => "no cell was found".to_owned(),
            };
            return Err(Error::Uncharted { cause });
        }
        match self.known.get(&entry.cell) {
            Some(room) => Ok(room.clone()),
            None => Ok(self.read(entry).await),
        }
    }

    /// A cell that another leads to.
    pub(super) async fn room(&mut self, cell: CellId) -> Result<Arc<Room>, Error> {
        match self.known.get(&cell) {
            Some(room) => Ok(room.clone()),
            None => {
                let entry = self.entry(cell).await.ok_or(Error::NoCell(cell))?;
                Ok(self.read(entry).await)
            }
        }
    }

    /// What the index knows of a cell, unless that is lost.
    async fn entry(&self, cell: CellId) -> Option<CellEntry> {
        self.scene.cell(cell).await.ok().flatten()
    }

    async fn read(&mut self, entry: CellEntry) -> Arc<Room> {
        let Bounds { min, max } = entry.bounds;
        let in_the_middle = |place| at_height(place, min[1], max[1], self.height_m);
        let known = self.scene.record(&entry).await.ok();
        let middle = match &known {
            Some(record) => mean(&record.hull.points),
            None => entry.bounds.center(),
        };
        let mut next_door = Vec::with_capacity(entry.adjacent.len());
        for next in &entry.adjacent {
            next_door.extend(self.entry(*next).await);
        }
        let mut openings = match &known {
            Some(record) => self.openings(record),
            None => next_door.iter().map(|there| self.between(&entry, there)).collect(),
        };
        // One does not go where the index no longer leads.
        openings.retain(|opening| next_door.iter().any(|there| there.cell == opening.to));
        let room = Room {
            middle: in_the_middle(middle),
            openings,
            entry,
        };
        let room = Arc::new(room);
        self.known.insert(room.entry.cell, room.clone());
        room
    }

    /// The openings of a cell that do not begin above one's eye, or all of them where all do.
    fn openings(&self, record: &CellRecord) -> Vec<Opening> {
        let low_enough = |portal: &&Portal| portal.polygon.iter().any(|p| p[1] <= self.height_m);
        let all = record.portals.iter().filter(|portal| !portal.polygon.is_empty());
        let mut ways: Vec<_> = all.clone().filter(low_enough).collect();
        if ways.is_empty() {
            ways = all.collect();
        }
        ways.into_iter().map(|portal| self.opening(portal)).collect()
    }

    fn opening(&self, portal: &Portal) -> Opening {
        let Bounds { min, max } = Bounds::around(portal.polygon.iter().copied());
        Opening {
            to: portal.to,
            place: at_height(mean(&portal.polygon), min[1], max[1], self.height_m),
            width_m: (max[0] - min[0]).hypot(max[2] - min[2]),
            is_upright: min[1] <= self.height_m && self.height_m <= max[1],
            has_door: portal.door.is_some(),
        }
    }

    /// The middle of where two cells meet, for who cannot read of the openings between them.
    fn between(&self, from: &CellEntry, to: &CellEntry) -> Opening {
        let [a, b] = [from.bounds, to.bounds];
        let shared = [0, 1, 2].map(|i| [a.min[i].max(b.min[i]), a.max[i].min(b.max[i])]);
        let middle = shared.map(|[low, high]| 0.5 * (low + high));
        let [x, y, z] = shared;
        Opening {
            to: to.cell,
            place: at_height(middle, y[0].min(y[1]), y[0].max(y[1]), self.height_m),
            width_m: (x[1] - x[0]).hypot(z[1] - z[0]),
            is_upright: y[0] <= self.height_m && self.height_m <= y[1],
            has_door: false,
        }
    }
}

fn mean(points: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / points.len() as f64)
}

fn at_height(mut place: [f64; 3], low: f64, high: f64, height_m: f64) -> [f64; 3] {
    place[1] = height_m.clamp(low, high);
    place
}
