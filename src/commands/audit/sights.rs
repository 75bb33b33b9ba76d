//! Does one see from here to there? By geometry alone, with doors open or closed; what cells see of each other is looked at once.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{Bounds, CellId, ObjectId};
use belvedere_verify::{blockade::Blockade, check::Cell};
use glam::DVec3;
use rayon::prelude::*;

/// So many rays look from a cell into another before it counts as hidden.
const RAYS: u64 = 1 << 15;
/// So many at once.
const AT_ONCE: u64 = 1 << 10;
/// A closed door fills its doorway: gaps around its box of up to this share of its longest edge are closed, as for visible
/// sets.
const DOOR_GAP: f64 = 0.03;

/// What can be seen in a revision.
pub(super) struct Sights {
    blockade: Blockade,
    cells: Vec<Cell>,
    error_m: f64,
    known: BTreeMap<(CellId, CellId, BTreeSet<ObjectId>), bool>,
}

impl Sights {
    pub(super) fn new(blockade: Blockade, cells: Vec<Cell>, error_m: f64) -> Self {
        Self {
            blockade,
            cells,
            error_m,
            known: BTreeMap::new(),
        }
    }

    /// How many pairs of cells have been looked at.
    pub(super) fn pairs(&self) -> usize {
        self.known.len()
    }

    /// Whether any ray gets from one of some cells into one of others.
    pub(super) fn any_sees_any(&mut self, from: &[CellId], to: &[CellId], closed: &BTreeSet<ObjectId>) -> bool {
        // What is settled already may spare a look.
        let pairs = || from.iter().flat_map(|from| to.iter().map(|to| (*from, *to)));
        pairs().any(|(from, to)| from == to || self.known.get(&key(from, to, closed)) == Some(&true))
            || pairs().any(|(from, to)| self.sees(from, to, closed))
    }

    fn sees(&mut self, from: CellId, to: CellId, closed: &BTreeSet<ObjectId>) -> bool {
        let key = key(from, to, closed);
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let seen = self.looks(key.0, key.1, closed);
        self.known.insert(key, seen);
        seen
    }

    fn looks(&self, from: CellId, to: CellId, closed: &BTreeSet<ObjectId>) -> bool {
        let (Some(here), Some(there)) = (self.cells.get(from.index()), self.cells.get(to.index())) else {
            return false;
        };
        let ray = |number: u64| {
            let [a, b] = [(here, 1), (there, 2)].map(|(cell, seed)| {
                // Kinds of places take turns; those of the one cell slower, so that all meet all.
                let number = if seed == 1 {
                    number
                } else {
                    number / 7 + 7 * (number % 7)
                };
                cell.room.eye(seed, cell.id.0, number, self.error_m).position
            });
            self.blockade.sees(a, b, closed) || self.blockade.sees(b, a, closed)
        };
        let mut begins = (0..RAYS).step_by(AT_ONCE as usize);
        begins.any(|begin| (begin..begin + AT_ONCE).into_par_iter().any(ray))
    }

    /// Whether a small thing is in plain view of an eye: not just its middle but what is around it, from neither side through
    /// the back of a face, and beside all closed doors.
    pub(super) fn in_plain_view(&self, eye: [f64; 3], thing: [f64; 3], size_m: f64, closed: &[Bounds]) -> bool {
        let (eye, thing) = (DVec3::from(eye), DVec3::from(thing));
        let no_doors = BTreeSet::new();
        let clear = |point: DVec3| {
            let doors_open = closed.iter().all(|door| !passes(door, eye, point));
            doors_open && self.blockade.sees(eye, point, &no_doors) && self.blockade.sees(point, eye, &no_doors)
        };
        let around = DVec3::AXES.into_iter().flat_map(|axis| [size_m * axis, -size_m * axis]);
        clear(thing) && around.into_iter().all(|off| clear(thing + off))
    }
}

/// Light goes both ways.
fn key(from: CellId, to: CellId, closed: &BTreeSet<ObjectId>) -> (CellId, CellId, BTreeSet<ObjectId>) {
    (from.min(to), from.max(to), closed.clone())
}

/// Whether a straight way passes a closed door, gaps included.
fn passes(door: &Bounds, from: DVec3, to: DVec3) -> bool {
    let gap_m = DOOR_GAP * door.size_m().into_iter().fold(0.0, f64::max);
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..3 {
        let (a, way) = (from[axis], to[axis] - from[axis]);
        let (low, high) = (door.min[axis] - gap_m - a, door.max[axis] + gap_m - a);
        if way == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        enter = enter.max((low / way).min(high / way));
        leave = leave.min((low / way).max(high / way));
    }
    enter <= leave
}
