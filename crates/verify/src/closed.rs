//! What do eyes see while doors are closed that the records then leave out?
//!
//! A record says of each of its entries which doors hide it, each alone ([`Cell::listed`]). So each door that some record names is
//! closed, and eyes look from cells that name it, half of them from as near to the border of its leaf as the cell comes: past its hinge and
//! its lock, and through the gaps above and below it. Now and then a second door that the cell names is closed as well: then
//! what either hides is left out.
//!
//! A closed door hides where its faces do ([`crate::scene`]). Where the format says otherwise, the oracle does too: gaps between a leaf and
//! its frame count as closed ([`crate::leaf`]), and no eye stands within what a door encloses, since a closed door is solid.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::ObjectId;

use crate::{
    block::Block,
    check::{Cell, Outcome, Settings, Situation, eyes_in, look_from},
    eyes::{Eye, Place},
    leaf::Leaf,
    random::Random,
    scene::Scene,
};

/// So many eyes look at a door from one cell, if there are as many for all doors and cells.
const EYES_A_CELL: u64 = 4;
/// A second door is closed in one of so many cells.
const TWO_DOORS: usize = 8;
/// Eyes stand beside a leaf by up to this share of its width or height.
const BESIDE: f64 = 0.02;
/// An eye that stands within a closed door is moved so often.
const TRIES: u64 = 8;

/// Which doors are closed, and from where one looks then.
#[derive(Debug)]
pub struct Closed<'a> {
    situations: Vec<Situation<'a>>,
    doors: usize,
}

impl<'a> Closed<'a> {
    /// Every door that the record of one of these cells names, from as many of the cells that name it as there are eyes for.
    #[must_use]
    pub fn of(scene: &Scene, cells: &'a [Cell], settings: &Settings) -> Self {
        let named: Vec<BTreeSet<ObjectId>> = cells.iter().map(Cell::doors).collect();
        let mut naming: BTreeMap<ObjectId, Vec<usize>> = BTreeMap::new();
        for (cell, doors) in named.iter().enumerate() {
            for door in doors.iter().filter(|door| scene.objects.get(door.0 as usize).is_some()) {
                naming.entry(*door).or_default().push(cell);
            }
        }
        let doors = naming.len();
        let all: usize = naming.values().map(Vec::len).sum();
        let wanted = ((settings.eyes / EYES_A_CELL) as usize).max(doors).min(all);
        let queues: Vec<_> = naming
            .iter()
            .map(|(door, from)| (*door, in_turns(scene, cells, *door, from, settings.seed)))
            .collect();
        let rounds = 0..queues.iter().map(|(_, queue)| queue.len()).max().unwrap_or(0);
        let pairs = rounds.flat_map(|round| {
            let some = queues
                .iter()
                .filter_map(move |(door, queue)| Some((round, *door, *queue.get(round)?)));
            some.collect::<Vec<_>>()
        });
        let chosen = pairs.take(wanted).enumerate();
        let situations = chosen.map(|(number, (round, door, cell))| {
            let mut closed = BTreeSet::from([door]);
            if number % TWO_DOORS == TWO_DOORS - 1 {
                let others: Vec<_> = named[cell].iter().filter(|other| **other != door).collect();
                let random = &mut Random::of([settings.seed, u64::from(door.0), cell as u64]);
                closed.extend((!others.is_empty()).then(|| *others[random.below(others.len())]));
            }
            let count = eyes_in(number, wanted, settings.eyes);
            Situation {
                cell: &cells[cell],
                eyes: eyes(
                    scene,
                    &cells[cell],
                    (door, &closed),
                    settings.seed,
                    // So that each door, and each pair, is looked at in turns from its leaf and from elsewhere.
                    (number + round) as u64,
                    count,
                ),
                closed: closed.into_iter().collect(),
            }
        });
        Self {
            situations: situations.collect(),
            doors,
        }
    }

    /// How many doors some record names.
    #[must_use]
    pub fn doors(&self) -> usize {
        self.doors
    }

    /// In how many pairs of a cell and what is closed there one looks.
    #[must_use]
    pub fn situations(&self) -> usize {
        self.situations.len()
    }

    /// How many eyes there are: as many as [`check`](Self::check) advances by.
    #[must_use]
    pub fn eyes(&self) -> u64 {
        self.situations
            .iter()
            .map(|situation| situation.eyes.len() as u64)
            .sum()
    }

    /// Looks from all eyes; `advance` hears of each.
    pub fn check(&self, scene: &Scene, settings: &Settings, advance: &(dyn Fn() + Sync)) -> Outcome {
        look_from(scene, &self.situations, settings.size_px, advance)
    }
}

impl Cell {
    /// The doors that its record names.
    fn doors(&self) -> BTreeSet<ObjectId> {
        self.listed.iter().flat_map(|(_, doors)| doors).copied().collect()
    }
}

/// Cells that name a door: the nearest and any other in turns.
fn in_turns(scene: &Scene, cells: &[Cell], door: ObjectId, from: &[usize], seed: u64) -> Vec<usize> {
    let bounds = scene.bounds_of(door.0 as usize);
    let away_m = |cell: &usize| bounds.distance_m(cells[*cell].room.middle().to_array());
    let mut nearest = from.to_vec();
    nearest.sort_by(|a, b| away_m(a).total_cmp(&away_m(b)).then(a.cmp(b)));
    let mut any: Vec<_> = from
        .iter()
        .map(|cell| (Random::of([seed, u64::from(door.0), *cell as u64]).unit(), *cell))
        .collect();
    any.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut taken = BTreeSet::new();
    let both = nearest.into_iter().zip(any).flat_map(|(near, (_, any))| [near, any]);
    both.filter(|cell| taken.insert(*cell)).collect()
}

/// Eyes in a cell that look at a door, none within one that is closed.
fn eyes(
    scene: &Scene,
    cell: &Cell,
    (door, closed): (ObjectId, &BTreeSet<ObjectId>),
    seed: u64,
    first: u64,
    count: u64,
) -> Vec<Eye> {
    let leaves: Vec<_> = closed.iter().filter_map(|door| Leaf::of(scene, *door)).collect();
    let leaf = Leaf::of(scene, door);
    let eye = |number: u64| match &leaf {
        Some(leaf) if (first + number).is_multiple_of(2) => {
            let random = &mut Random::of([seed, (u64::from(door.0) << 32) | u64::from(cell.id.0), number]);
            // On one of the four sides, or a little beside it.
            let beside = |random: &mut Random| {
                let off = BESIDE * random.unit().powi(2);
                if random.unit() < 0.5 { -off } else { 1.0 + off }
            };
            let [across, up] = if random.unit() < 0.5 {
                [random.unit(), beside(random)]
            } else {
                [beside(random), random.unit()]
            };
            let at = leaf.at(across, up, random.unit());
            Eye {
                position: cell
                    .room
                    .entered_from(at, random, &|place| scene.error_near_m(&Block::at(place))),
                place: Place::Leaf,
            }
        }
        _ => cell.eye(scene, seed, (first + number) / 2 + u64::from(door.0)),
    };
    let outside = |eye: &Eye| !leaves.iter().any(|leaf| leaf.encloses(eye.position));
    // Further numbers are those of other eyes of the same kind.
    let moved = |number: u64| (0..TRIES).map(|again| eye(number + 2 * count * again)).find(outside);
    (0..count).filter_map(moved).collect()
}

#[cfg(test)]
mod tests;
