//! Does one see from here to there? By geometry alone, with doors open or closed; what cells see of each other is looked at once.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{Bounds, CellId, ObjectId};
use belvedere_verify::{blockade::Blockade, check::Cell};
use glam::DVec3;
use rayon::prelude::*;

/// So many rays look from a cell into another …
const RAYS: u64 = 1 << 12;
/// … after so few, one by one …
const GLANCES: u64 = 64;
/// … and so many of those that got furthest are changed a little …
const KEPT: usize = 64;
/// … in so many ways each …
const WAYS: u64 = 8;
/// … so often, before the other cell counts as hidden.
const ROUNDS: u32 = 24;
/// By so much of the way to another place in the cell at first, and each time so much less.
const STEP: f64 = 0.5;
const STEP_SHRINKS: f64 = 0.8;
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
        let place = |cell: &Cell, seed: u64, number: u64| cell.room.eye(seed, cell.id.0, number, self.error_m).position;
        let line = |a: DVec3, b: DVec3| {
            let [ahead, back] = [(a, b), (b, a)].map(|(from, to)| self.blockade.reach(from, to, closed));
            let clear = ahead == 1.0 || back == 1.0;
            (if clear { f64::INFINITY } else { ahead + back }, [a, b])
        };
        // Kinds of places take turns; those of the one cell slower, so that all meet all.
        let first = |n: u64| line(place(here, 1, n), place(there, 2, n / 7 + 7 * (n % 7)));
        // Most cells that see each other do so plainly.
        if (0..GLANCES).any(|n| first(n).0 == f64::INFINITY) {
            return true;
        }
        let mut best: Vec<_> = (0..RAYS).into_par_iter().map(first).collect();
        let mut step = STEP;
        for round in 0..ROUNDS {
            best.sort_by(|(a, _), (b, _)| b.total_cmp(a));
            best.truncate(KEPT);
            if best.first().is_none_or(|(reach, _)| *reach == f64::INFINITY) {
                break;
            }
            let changed = |n: u64| {
                let (_, [a, b]) = best[n as usize % best.len()];
                let n = u64::from(round) * KEPT as u64 * WAYS + n;
                // Each end by itself, and both.
                let [at_a, at_b] = [[step, 0.0], [0.0, step], [step, step]][n as usize % 3];
                line(a.lerp(place(here, 3, n), at_a), b.lerp(place(there, 4, n), at_b))
            };
            let more: Vec<_> = (0..KEPT as u64 * WAYS).into_par_iter().map(changed).collect();
            best.extend(more);
            step *= STEP_SHRINKS;
        }
        best.iter().any(|(reach, _)| *reach == f64::INFINITY)
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
