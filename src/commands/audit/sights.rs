//! Does one see from here to there? By geometry alone, with doors open or closed; what cells see of each other is looked at once.

use std::{
    collections::{BTreeMap, BTreeSet},
    iter::Sum,
};

use belvedere_scene::{Bounds, CellId, ObjectId};
use belvedere_verify::between::{Between, Effort, Sight};
use glam::DVec3;

/// A closed door fills its doorway: gaps around its box of up to this share of its longest edge are closed, as for visible
/// sets.
const DOOR_GAP: f64 = 0.03;

/// How much was looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Looked {
    /// Cells that were looked around from.
    pub(super) cells: usize,
    /// Pairs of cells between which sight lines were aimed.
    pub(super) pairs: usize,
    /// Those of them between which they were hunted.
    pub(super) hunted: usize,
}

impl Sum for Looked {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| Self {
            cells: sum.cells + one.cells,
            pairs: sum.pairs + one.pairs,
            hunted: sum.hunted + one.hunted,
        })
    }
}

/// What can be seen in a revision.
pub(super) struct Sights {
    between: Between,
    /// Sets of closed doors that occurred; a pair names one by its place.
    closed: Vec<BTreeSet<ObjectId>>,
    /// What was seen around a cell, by cell.
    around: BTreeMap<(usize, CellId), Vec<bool>>,
    known: BTreeMap<Pair, (Effort, Sight)>,
    hunts_left: usize,
}

type Pair = (usize, CellId, CellId);

impl Sights {
    /// Sight lines between at most so many pairs of cells are hunted.
    pub(super) fn new(between: Between, hunts: usize) -> Self {
        Self {
            between,
            closed: Vec::new(),
            around: BTreeMap::new(),
            known: BTreeMap::new(),
            hunts_left: hunts,
        }
    }

    /// How much has been looked at.
    pub(super) fn looked(&self) -> Looked {
        let hunted = self.known.values().filter(|(effort, _)| *effort == Effort::Hunt);
        Looked {
            cells: self.around.len(),
            pairs: self.known.len(),
            hunted: hunted.count(),
        }
    }

    /// Whether a sight line leads from any of some cells into any of others. Rays look around
    /// from all before any pair is aimed at, and all are before any is hunted.
    pub(super) fn any_sees_any(&mut self, from: &[CellId], to: &[CellId], closed: &BTreeSet<ObjectId>) -> Sight {
        let doors = self.number_of(closed);
        // Light goes both ways.
        let pairs: BTreeSet<Pair> = from
            .iter()
            .flat_map(|from| to.iter().map(move |to| (doors, *from.min(to), *from.max(to))))
            .collect();
        let seen =
            |pair: &Pair| pair.1 == pair.2 || self.known.get(pair).is_some_and(|(_, sight)| *sight == Sight::Seen);
        if pairs.iter().any(seen) {
            return Sight::Seen;
        }
        let mut ways = from.iter().map(|from| (from, to)).chain(to.iter().map(|to| (to, from)));
        if ways.any(|(from, to)| self.looks_around(*from, to, doors)) {
            return Sight::Seen;
        }
        for effort in Effort::ALL {
            for pair in &pairs {
                if self.look(*pair, effort) == Sight::Seen {
                    return Sight::Seen;
                }
            }
        }
        let hidden = |pair: &Pair| self.known.get(pair).is_some_and(|(_, sight)| *sight == Sight::Hidden);
        if pairs.iter().all(hidden) {
            Sight::Hidden
        } else {
            Sight::NotFound
        }
    }

    /// Whether rays that look around from a cell get into any of others.
    fn looks_around(&mut self, from: CellId, to: &[CellId], doors: usize) -> bool {
        let (between, closed) = (&self.between, &self.closed[doors]);
        let seen = self
            .around
            .entry((doors, from))
            .or_insert_with(|| between.around(from.index(), closed));
        to.iter().any(|to| seen.get(to.index()).is_some_and(|seen| *seen))
    }

    fn look(&mut self, pair @ (doors, from, to): Pair, effort: Effort) -> Sight {
        if let Some((looked, sight)) = self.known.get(&pair)
            && *looked >= effort
        {
            return *sight;
        }
        if effort == Effort::Hunt {
            if self.hunts_left == 0 {
                return Sight::NotFound;
            }
            self.hunts_left -= 1;
        }
        let sight = self.between.look(from.index(), to.index(), &self.closed[doors], effort);
        self.known.insert(pair, (effort, sight));
        sight
    }

    fn number_of(&mut self, closed: &BTreeSet<ObjectId>) -> usize {
        let known = self.closed.iter().position(|other| other == closed);
        known.unwrap_or_else(|| {
            self.closed.push(closed.clone());
            self.closed.len() - 1
        })
    }

    /// Whether a small thing is in plain view of an eye: not just its middle but what is around it, from neither side through
    /// the back of a face, and beside all closed doors.
    pub(super) fn in_plain_view(&self, eye: [f64; 3], thing: [f64; 3], size_m: f64, closed: &[Bounds]) -> bool {
        let (eye, thing) = (DVec3::from(eye), DVec3::from(thing));
        let (no_doors, blockade) = (BTreeSet::new(), self.between.blockade());
        let clear = |point: DVec3| {
            let doors_open = closed.iter().all(|door| !passes(door, eye, point));
            doors_open && blockade.sees(eye, point, &no_doors) && blockade.sees(point, eye, &no_doors)
        };
        let around = DVec3::AXES.into_iter().flat_map(|axis| [size_m * axis, -size_m * axis]);
        clear(thing) && around.into_iter().all(|off| clear(thing + off))
    }
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
