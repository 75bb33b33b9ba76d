//! Do closed doors hide one region from another, and which of them does it take?
//!
//! A leaf stands in a doorway, but sight lines between two rooms diverge beyond it: they end in the masonry around, which is
//! many walls and bodies, none of which blocks them all. So the question is cut into easier ones, as portal sequences are
//! (Teller & Séquin, *Visibility preprocessing for interactive walkthroughs*, 1991): all sight lines cross the leaf's plane inside
//! a rectangle. What of it lies beside the leaf, or in its openings, is hidden piece by piece: behind a wall in the same plane,
//! from the eyes, or from the target. Pieces are halved where that fails.
//!
//! Guarantee: conservative as walls are ([`Wall`]), but for strips of [`BORDER`] beside the ends of a leaf, of its doorway and of what
//! sight lines cross, which are not looked at, and gaps of up to [`DOOR_GAP`] between a leaf and what stands beside it, which are
//! closed. Cost: a proof where one wall or body does; else a few for each piece, at most [`MOST_PIECES`] for a leaf, and for all of
//! them together at most [`MOST_TESTS`] tests of a wall in their planes. What is not proved by then is not hidden; nor is, from far
//! outside of the scene, what it takes more than one wall or body to hide.

use std::collections::BTreeSet;

use super::{
    blocker::Blocker,
    crossing::{BEHIND, between, region_of},
    prover::{Proofs, Prover, Witness},
};
use crate::occluders::{DOOR_GAP, Occluders, Rectangle, Region, Wall, Way};

/// Bodies are a little smaller than the masonry that they lie in, so pieces are looked at without a border where a leaf, a doorway or
/// what sight lines cross ends: so many times the width of gaps that count as closed.
const BORDER: f32 = 2.0;
/// So many pieces of the plane around a leaf are looked at.
const MOST_PIECES: usize = 256;
/// Openings of a leaf are told apart up to so many; a look at so many of its squares counts as a test.
const MOST_OPENINGS: usize = 64;
const SQUARES_A_TEST: usize = 64;
/// All pieces together may take so many tests; each piece costs one, and one for each wall in the plane of its leaf.
const MOST_TESTS: usize = 1_000_000;

/// What some closed doors hide.
pub struct Screening<'a> {
    blocker: &'a Blocker,
    prover: Prover<'a>,
    /// Rising.
    closed: Vec<u32>,
    /// Of all doors that ever were closed.
    leaves: Vec<Leaf<'a>>,
    /// What the proof at hand takes.
    taken: BTreeSet<u32>,
    pieces_left: usize,
    tests_left: usize,
    /// Where all sight lines cross the plane of the leaf at hand.
    crossed: Rectangle,
}

/// A side of a closed door, and what is known of the walls around it.
struct Leaf<'a> {
    door: u32,
    wall: &'a Wall,
    /// Walls in its plane.
    coplanar: Vec<&'a Wall>,
    /// Edges of the doorway that it fills, along each of its axes.
    doorway: [Vec<f32>; 2],
}

impl<'a> Screening<'a> {
    /// These doors are closed, and no others. All questions together take at most so many tests of a wall.
    #[must_use]
    pub fn new(blocker: &'a Blocker, closed: &[u32], steps: u32) -> Self {
        let proofs = Proofs {
            bodies: true,
            walls: true,
        };
        let mut screening = Self {
            blocker,
            prover: Prover::new(blocker, proofs),
            closed: Vec::new(),
            leaves: Vec::new(),
            taken: BTreeSet::new(),
            pieces_left: 0,
            tests_left: 0,
            crossed: [[0.0; 2]; 2],
        };
        screening.close(closed.to_vec(), steps);
        screening
    }

    /// From now on these of the doors are closed, and questions together take so many tests of a wall.
    pub fn close(&mut self, mut closed: Vec<u32>, steps: u32) {
        closed.sort_unstable();
        let blocker: &'a Blocker = self.blocker;
        let occluders = &blocker.occluders;
        for door in &closed {
            if !self.leaves.iter().any(|leaf| leaf.door == *door) {
                let sides = occluders.leaves().iter().filter(|wall| wall.door == Some(*door));
                self.leaves.extend(sides.map(|wall| Leaf::new(occluders, *door, wall)));
            }
        }
        self.prover.close(&closed);
        self.prover.allow(steps);
        self.closed = closed;
        self.tests_left = MOST_TESTS;
    }

    /// The closed doors that it takes so that no point of the target can be seen from any point of the eye region, as far as
    /// that can be proved; others may be open. `None` when it is not, and when no closed door stands between the two.
    pub fn hides(&mut self, eye: &Region, target: &Region) -> Option<BTreeSet<u32>> {
        let between = Region::of_box(eye.min.min(target.min), eye.max.max(target.max));
        let stands_between = |leaf: &usize| {
            let leaf = &self.leaves[*leaf];
            let [min, max] = leaf.wall.around();
            self.closed.binary_search(&leaf.door).is_ok() && Region::of_box(min, max).overlaps(&between)
        };
        let leaves: Vec<_> = (0..self.leaves.len()).filter(stands_between).collect();
        if leaves.is_empty() {
            return None;
        }
        self.taken.clear();
        let hidden = self.is_hidden(eye, target) || leaves.into_iter().any(|leaf| self.leaf_hides(leaf, eye, target));
        hidden.then(|| std::mem::take(&mut self.taken))
    }

    /// Whether walls and bodies alone hide it, closed doors among them.
    fn is_hidden(&mut self, eye: &Region, target: &Region) -> bool {
        let Some(witness) = self.prover.hides(eye, target) else {
            return false;
        };
        if let Witness::Walls(walls) = witness {
            let walls = walls.iter().map(|wall| &self.blocker.occluders.walls[*wall as usize]);
            self.taken.extend(walls.filter_map(|wall| wall.door));
        }
        true
    }

    /// Whether all sight lines cross the plane of a leaf, and none passes beside it.
    fn leaf_hides(&mut self, leaf: usize, eye: &Region, target: &Region) -> bool {
        let (number, leaf) = (leaf, self.leaves[leaf].wall);
        let plane_m = self.blocker.occluders.tolerance.plane_m;
        let [eye_low, eye_high] = eye.heights(leaf.normal, leaf.offset);
        let [low, high] = target.heights(leaf.normal, leaf.offset);
        let way = if eye_high <= 2.0 * plane_m && low >= BEHIND * plane_m {
            Way::Along
        } else if eye_low >= -2.0 * plane_m && high <= -BEHIND * plane_m {
            Way::Against
        } else {
            return false;
        };
        if !leaf.hides(way) || !self.blocker.is_near(eye) || !self.blocker.is_near(target) {
            return false;
        }
        self.pieces_left = MOST_PIECES;
        self.taken = BTreeSet::from([self.leaves[number].door]);
        self.crossed = between(leaf, eye, target);
        let hole_m = self.blocker.occluders.tolerance.hole_m;
        let pieces = self.leaves[number].cut(&self.crossed, hole_m);
        pieces
            .iter()
            .all(|piece| self.is_stopped(number, way, piece, eye, target))
    }

    /// Whether no sight line passes a piece of the plane of a leaf: none of the openings of the leaf there.
    fn is_stopped(&mut self, leaf: usize, way: Way, piece: &Rectangle, eye: &Region, target: &Region) -> bool {
        let wall = self.leaves[leaf].wall;
        let tests = wall.squares_in(piece).div_ceil(SQUARES_A_TEST);
        if self.tests_left < tests {
            return false;
        }
        self.tests_left -= tests;
        let openings = wall.openings(way, piece, 0.0, MOST_OPENINGS);
        let openings = openings.unwrap_or_else(|| vec![*piece]);
        openings
            .iter()
            .all(|opening| self.is_blocked(leaf, way, opening, eye, target))
    }

    /// Whether no sight line passes an opening.
    fn is_blocked(&mut self, leaf: usize, way: Way, piece: &Rectangle, eye: &Region, target: &Region) -> bool {
        let tolerance = &self.blocker.occluders.tolerance;
        let (around, margin_m) = (&self.leaves[leaf], 2.0 * tolerance.plane_m);
        let tests = 1 + around.coplanar.len();
        if self.pieces_left == 0 || self.tests_left < tests {
            return false;
        }
        self.pieces_left -= 1;
        self.tests_left -= tests;
        let region = region_of(
            around.wall,
            &around.off_joints(piece, &self.crossed, BORDER * tolerance.hole_m),
        );
        if around.has_a_wall_over(way, &region, margin_m)
            || self.is_hidden(eye, &region)
            || self.is_hidden(&region, target)
        {
            return true;
        }
        halves(piece)
            .iter()
            .all(|half| self.is_stopped(leaf, way, half, eye, target))
    }
}

impl<'a> Leaf<'a> {
    fn new(occluders: &'a Occluders, door: u32, leaf: &'a Wall) -> Self {
        let margin_m = 2.0 * occluders.tolerance.plane_m;
        let whole = [0, 1].map(|axis| [leaf.lines[axis][0], leaf.lines[axis][leaf.lines[axis].len() - 1]]);
        let region = region_of(leaf, &whole);
        let coplanar = occluders.walls.iter().filter(|wall| {
            wall.door.is_none() && is_parallel(wall.normal.dot(leaf.normal)) && lies_in_plane(wall, &region, margin_m)
        });
        Self {
            door,
            wall: leaf,
            coplanar: coplanar.map(|wall| &**wall).collect(),
            doorway: [0, 1].map(|axis| doorway(occluders, leaf, axis)),
        }
    }

    /// Whether a wall in its plane is opaque all over a piece of that.
    fn has_a_wall_over(&self, way: Way, piece: &Region, margin_m: f32) -> bool {
        self.coplanar.iter().any(|wall| {
            let way = match way {
                _ if wall.normal.dot(self.wall.normal) > 0.0 => way,
                Way::Along => Way::Against,
                Way::Against => Way::Along,
            };
            lies_in_plane(wall, piece, margin_m) && wall.covers(way, &around(wall, piece), margin_m)
        })
    }

    /// A piece without borders where it ends with the leaf, with the doorway or with what sight lines cross.
    fn off_joints(&self, piece: &Rectangle, crossed: &Rectangle, border_m: f32) -> Rectangle {
        [0, 1].map(|axis| {
            let [low, high] = piece[axis];
            let middle = 0.5 * (low + high);
            let joints = || self.joints(axis).chain(crossed[axis]);
            let border_m = |at: f32| if joints().any(|line| line == at) { border_m } else { 0.0 };
            [(low + border_m(low)).min(middle), (high - border_m(high)).max(middle)]
        })
    }

    /// Its own ends and the edges of the doorway that it fills, along an axis.
    fn joints(&self, axis: usize) -> impl Iterator<Item = f32> {
        let lines = &self.wall.lines[axis];
        [lines[0], lines[lines.len() - 1]]
            .into_iter()
            .chain(self.doorway[axis].iter().copied())
    }

    /// The parts of a rectangle of its plane, cut along its own ends and the edges of the doorway that it fills.
    fn cut(&self, rectangle: &Rectangle, hole_m: f32) -> Vec<Rectangle> {
        let [across, up] = [0, 1].map(|axis| {
            let [low, high] = rectangle[axis];
            let inside = self.joints(axis).filter(|line| low < *line && *line < high);
            let mut cuts: Vec<_> = inside.chain([low, high]).collect();
            cuts.sort_by(f32::total_cmp);
            cuts.dedup();
            // Rounding leaves slivers beside a leaf that ends with a doorway or with the floor.
            let is_joint = |at: f32| low < at && at < high;
            let is_sliver = |ends: &[f32]| (is_joint(ends[0]) || is_joint(ends[1])) && ends[1] - ends[0] <= hole_m;
            let pieces = cuts.windows(2).filter(|ends| !is_sliver(ends));
            pieces.map(|ends| [ends[0], ends[1]]).collect::<Vec<_>>()
        });
        across.iter().flat_map(|u| up.iter().map(move |v| [*u, *v])).collect()
    }
}

fn is_parallel(cosine: f32) -> bool {
    cosine.abs() > 1.0 - 1e-6
}

/// Whether all of a region is as near to the plane of a wall as makes no difference.
fn lies_in_plane(wall: &Wall, region: &Region, margin_m: f32) -> bool {
    let [low, high] = region.heights(wall.normal, wall.offset);
    low.abs().max(high.abs()) <= margin_m
}

/// Lines of nearby walls that stand parallel to a leaf, just inside its edges, along one of its axes.
fn doorway(occluders: &Occluders, leaf: &Wall, axis: usize) -> Vec<f32> {
    let length = |axis: usize| leaf.lines[axis][leaf.lines[axis].len() - 1] - leaf.lines[axis][0];
    let longest_m = length(0).max(length(1));
    let inside_m = 2.0 * DOOR_GAP * longest_m;
    let parallel = occluders.walls.iter().filter(|wall| {
        let along = wall.normal.dot(leaf.normal);
        let apart_m = wall.offset - along.signum() * leaf.offset;
        wall.door.is_none() && is_parallel(along) && apart_m.abs() < longest_m
    });
    let lines = parallel.flat_map(|wall| {
        [0, 1].into_iter().flat_map(move |own| {
            let along = wall.axes[own].dot(leaf.axes[axis]);
            let parallel = is_parallel(along);
            let lines = wall.lines[own].iter().filter(move |_| parallel);
            lines.map(move |line| line * along.signum())
        })
    });
    let edges = [leaf.lines[axis][0], leaf.lines[axis][leaf.lines[axis].len() - 1]];
    let beside_an_edge = |line: &f32| edges.iter().any(|edge| (edge - line).abs() <= inside_m);
    let mut lines: Vec<_> = lines.filter(beside_an_edge).collect();
    lines.sort_by(f32::total_cmp);
    lines.dedup();
    lines
}

fn halves(piece: &Rectangle) -> [Rectangle; 2] {
    let length = |axis: usize| piece[axis][1] - piece[axis][0];
    let axis = usize::from(length(1) > length(0));
    let middle = 0.5 * (piece[axis][0] + piece[axis][1]);
    let mut halves = [*piece, *piece];
    halves[0][axis][1] = middle;
    halves[1][axis][0] = middle;
    halves
}

/// The rectangle around a region in the plane of a wall.
fn around(wall: &Wall, region: &Region) -> Rectangle {
    let mut rectangle = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    for corner in region.corners() {
        let place = wall.place(corner);
        for axis in 0..2 {
            rectangle[axis] = [rectangle[axis][0].min(place[axis]), rectangle[axis][1].max(place[axis])];
        }
    }
    rectangle
}
