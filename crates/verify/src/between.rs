//! Does any sight line lead from one cell into another? Looked for with growing effort, and proved that there is none where
//! that can be.
//!
//! Most of what a cell sees is found by rays that look around from it, which see into every cell that they pass. Cells that see
//! each other through a row of doorways only are all but never met so. A sight line is straight, so it passes the openings
//! between the cells on its way in order: lines through two openings of such a row, drawn out into both cells, are aimed at what is
//! left (the idea of the stabbing lines of Teller & Séquin, *Visibility Preprocessing for Interactive Walkthroughs*, 1991, by
//! chance instead of linear programs). Lines that got furthest are changed a little, again and again. What no line passes
//! [`shut`](crate::shut) may prove hidden.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use belvedere_scene::ObjectId;
use glam::DVec3;
use rayon::prelude::*;

use crate::{
    block::Block,
    blockade::Blockade,
    check::Cell,
    eyes::{in_polygon, on_border},
    random::Random,
};

/// Lines that got furthest are kept …
const KEPT: usize = 64;
/// … and each is changed in so many ways …
const WAYS: u64 = 8;
/// … so often, by so much of the way to another place in the cell at first, and each time by so much less.
const ROUNDS: u32 = 24;
const STEP: f64 = 0.5;
const STEP_SHRINKS: f64 = 0.8;
/// Lines that are drawn out of one cell into another end so far inside, as a share of what is there.
const INSIDE: f64 = 1e-2;
/// Rows of openings from one cell to another that are tried.
const ROWS: u64 = 8;
/// A proof may look at so many pairs of parts of the two cells.
const PARTS: u32 = 4_096;

/// How hard to look for a sight line between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effort {
    /// Lines through the openings between them.
    Aim,
    /// More of these and others, which are changed, and a proof is tried.
    Hunt,
}

impl Effort {
    /// Both, rising.
    pub const ALL: [Self; 2] = [Self::Aim, Self::Hunt];

    /// How many lines, of each kind.
    #[must_use]
    pub const fn lines(self) -> u64 {
        match self {
            Self::Aim => 1 << 10,
            Self::Hunt => 1 << 13,
        }
    }
}

/// A ray that is in a cell for no larger share of its way is not surely there.
const ROUNDING: f64 = 1e-6;
/// So many rays look around from a cell.
pub const RAYS_AROUND: u64 = 1 << 12;

/// What was found out about two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// A line leads from the one into the other.
    Seen,
    /// None was found.
    NotFound,
    /// There is none.
    Hidden,
}

/// The cells of a scene, and what hides in it.
#[derive(Debug)]
pub struct Between {
    blockade: Blockade,
    cells: Vec<Cell>,
    /// The box around each.
    blocks: Vec<Block>,
    /// What no ray leaves.
    all: Block,
    error_m: f64,
}

type Line = [DVec3; 2];

impl Between {
    /// The cells by id, and how far what is drawn may be from where it was when they were made.
    #[must_use]
    pub fn new(blockade: Blockade, cells: Vec<Cell>, error_m: f64) -> Self {
        let blocks: Vec<_> = cells.iter().map(|cell| Block::around(cell.room.corners())).collect();
        let all = blocks.iter().copied().reduce(|all, block| all.union(&block));
        Self {
            blockade,
            cells,
            all: all.unwrap_or(Block::around(std::iter::empty())),
            blocks,
            error_m,
        }
    }

    /// What hides.
    #[must_use]
    pub fn blockade(&self) -> &Blockade {
        &self.blockade
    }

    /// The cells that rays from one cell pass while these doors are closed and the others open.
    #[must_use]
    pub fn around(&self, from: usize, closed: &BTreeSet<ObjectId>) -> Vec<bool> {
        let here = &self.cells[from];
        let none = || vec![false; self.cells.len()];
        let look = |mut seen: Vec<bool>, n: u64| {
            let random = &mut Random::of([6, u64::from(here.id.0), n]);
            let eye = here.room.eye(6, here.id.0, n, &|_| self.error_m).position;
            let towards = self.blocks[random.below(self.blocks.len())];
            let at = towards.min + DVec3::from_array([0; 3].map(|_| random.unit())) * (towards.max - towards.min);
            let Some(direction) = (at - eye).try_normalize() else {
                return seen;
            };
            let way = direction * (self.all.max - self.all.min).length();
            let end = self.blockade.reach(eye, eye + way, closed);
            // What ends at a wall is not behind it because of rounding.
            let hair = ROUNDING + 2.0 * self.error_m / way.length();
            for (number, (block, cell)) in self.blocks.iter().zip(&self.cells).enumerate() {
                seen[number] |= block.is_passed(eye, end * way)
                    && cell
                        .room
                        .along(eye, way)
                        .is_some_and(|[enter, leave]| leave.min(end) - enter.max(0.0) > hair);
            }
            seen
        };
        let join = |mut a: Vec<bool>, b: Vec<bool>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        };
        (0..RAYS_AROUND).into_par_iter().fold(none, look).reduce(none, join)
    }

    /// Whether a line leads from one cell into another while these doors are closed and the others open. Light goes both
    /// ways, so it may be free from either end.
    #[must_use]
    pub fn look(&self, from: usize, to: usize, closed: &BTreeSet<ObjectId>, effort: Effort) -> Sight {
        let (Some(here), Some(there)) = (self.cells.get(from), self.cells.get(to)) else {
            return Sight::NotFound;
        };
        let place =
            |cell: &Cell, seed: u64, number: u64| cell.room.eye(seed, cell.id.0, number, &|_| self.error_m).position;
        // Kinds of places take turns; those of the one cell slower, so that all meet all.
        let random = |n: u64| [place(here, 1, n), place(there, 2, n / 7 + 7 * (n % 7))];
        let (lines, rows) = (effort.lines(), self.rows(from, to));
        let aimed = |n: u64| self.aimed(&rows, (here, there), n);
        if effort == Effort::Aim {
            let mut all = (0..lines).filter_map(aimed);
            let found = all.any(|line| self.is_free(&line, closed));
            return if found { Sight::Seen } else { Sight::NotFound };
        }
        let shuts = |from: usize, to: usize| {
            let blocks = (&self.blocks[from], &self.blocks[to]);
            self.blockade.shuts(blocks.0, blocks.1, closed, self.error_m, PARTS)
        };
        if shuts(from, to) && shuts(to, from) {
            return Sight::Hidden;
        }
        let reach = |line: Line| (self.reach(&line, closed), line);
        let mut best: Vec<_> = (0..lines).into_par_iter().map(|n| reach(random(n))).collect();
        let more = (0..lines).into_par_iter().filter_map(|n| aimed(n).map(reach));
        best.extend(more.collect::<Vec<_>>());
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
                reach([a.lerp(place(here, 3, n), at_a), b.lerp(place(there, 4, n), at_b)])
            };
            let changed: Vec<_> = (0..KEPT as u64 * WAYS).into_par_iter().map(changed).collect();
            best.extend(changed);
            step *= STEP_SHRINKS;
        }
        if best.iter().any(|(reach, _)| *reach == f64::INFINITY) {
            Sight::Seen
        } else {
            Sight::NotFound
        }
    }

    fn is_free(&self, [a, b]: &Line, closed: &BTreeSet<ObjectId>) -> bool {
        self.blockade.sees(*a, *b, closed) || self.blockade.sees(*b, *a, closed)
    }

    /// How far light gets on a line from both ends; infinitely far when it is free.
    fn reach(&self, [a, b]: &Line, closed: &BTreeSet<ObjectId>) -> f64 {
        let [ahead, back] = [(a, b), (b, a)].map(|(from, to)| self.blockade.reach(*from, *to, closed));
        if ahead == 1.0 || back == 1.0 {
            f64::INFINITY
        } else {
            ahead + back
        }
    }

    /// Short rows of openings that lead from one cell to another, through cells that a straight line may pass.
    fn rows(&self, from: usize, to: usize) -> Vec<Vec<&[DVec3]>> {
        let all = self.blocks[from].union(&self.blocks[to]);
        let rows = (0..ROWS).filter_map(|row| {
            let random = &mut Random::of([from as u64, to as u64, row]);
            let mut came: BTreeMap<usize, (usize, &[DVec3])> = BTreeMap::new();
            let mut open = VecDeque::from([from]);
            while let Some(cell) = open.pop_front() {
                if cell == to {
                    break;
                }
                let openings = &self.cells[cell].openings;
                let first = random.below(openings.len().max(1));
                let (before, after) = openings.split_at(first.min(openings.len()));
                for (next, opening) in after.iter().chain(before) {
                    let next = next.index();
                    if next != from
                        && !came.contains_key(&next)
                        && next < self.cells.len()
                        && self.blocks[next].meets(&all)
                    {
                        came.insert(next, (cell, opening));
                        open.push_back(next);
                    }
                }
            }
            let mut row = Vec::new();
            let mut at = to;
            while at != from {
                let (before, opening) = came.get(&at)?;
                row.push(*opening);
                at = *before;
            }
            row.reverse();
            Some(row)
        });
        rows.collect()
    }

    /// Line `n` through two openings of a row, from the one cell into the other.
    fn aimed(&self, rows: &[Vec<&[DVec3]>], (here, there): (&Cell, &Cell), n: u64) -> Option<Line> {
        let row = rows.get(n as usize % rows.len().max(1))?;
        let random = &mut Random::of([u64::from(here.id.0), u64::from(there.id.0), n]);
        let (i, j) = (random.below(row.len()), random.below(row.len()));
        let mut point = |opening: &[DVec3]| {
            if random.unit() < 0.3 {
                on_border(opening, random)
            } else {
                in_polygon(opening, random)
            }
        };
        let p = point(row[i.min(j)]);
        // Next to a single opening the other point is in one of the cells.
        let q = if i == j {
            there.room.eye(5, there.id.0, n, &|_| self.error_m).position
        } else {
            point(row[i.max(j)])
        };
        let way = q - p;
        let [begin, leave] = here.room.along(p, way)?;
        let [enter, end] = there.room.along(p, way)?;
        // A hair inside both cells: what is longer may be blocked in there.
        let (leave, enter) = (leave.min(0.0), enter.max(0.0));
        let (a, b) = (leave + INSIDE * (begin - leave), enter + INSIDE * (end - enter));
        (begin < leave && enter < end).then(|| [p + a * way, p + b * way])
    }
}
