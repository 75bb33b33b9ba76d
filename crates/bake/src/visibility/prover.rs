//! Can one region be seen from another? Proofs that it cannot, from what hides between them.
//!
//! Two kinds of proof, either of which can be left out:
//!
//! * **one body** ([`Body::separates`]; Cohen-Or & Zadicario, *Visibility streaming for network-based walkthroughs*,
//!   1998): every segment between the two regions meets one convex body. The first ray, between the middles, finds the
//!   bodies that come into question; bodies that worked lately are tried before.
//! * **walls with openings** (portal sequences; Teller & Séquin, *Visibility preprocessing for interactive
//!   walkthroughs*, 1991): where all sight lines cross a wall, they cross it inside a rectangle. If that is opaque, nothing
//!   gets through. Else they go through its openings, and for each of these the proof starts again with sight lines that
//!   also pass the opening: the separating planes of every two of the regions they pass clip the next rectangle. A sequence ends
//!   when a wall is opaque or clipping leaves nothing.
//!
//! Departure from Teller: openings belong to walls, not to faces of cells, so open space costs no steps and cells may
//! be cut freely. Guarantee: conservative; walls down to [`Tolerance::hole_m`]. Cost: a ray and a few box tests where a
//! proof is short, at most [`MAX_STEPS`] wall tests where there is none.
//!
//! [`Tolerance::hole_m`]: crate::occluders::Tolerance::hole_m

use std::{borrow::Borrow, ops::ControlFlow};

use glam::{Vec2, Vec3};
use obvhs::bvh2::Bvh2;

use super::{
    segment,
    stops::{Stops, stops},
    within::Solids,
};
use crate::occluders::{Body, Occluders, Rectangle, Region, Tolerance, Wall, Way};

/// At most this many tests of a wall for one question.
pub const MAX_STEPS: u32 = 300;
/// Sight lines are followed through at most this many openings.
const MAX_OPENINGS_PASSED: usize = 4;
/// A wall with more openings than this in the way proves nothing.
const MAX_OPENINGS: usize = 8;
/// How many walls are tried before a question is given up, by how many openings were passed.
const WALLS_TRIED: [usize; MAX_OPENINGS_PASSED] = [3, 2, 1, 1];
/// How many bodies, and how many walls, that worked lately in the same direction are tried first.
const RECENT: usize = 6;
/// So many directions all around.
const SECTORS: usize = 64;
/// Which of the two.
const BODIES: usize = 0;
const WALLS: usize = 1;
/// How many bodies on the first ray are tried, from the eye on.
const BODIES_TRIED: usize = 16;
/// Bodies of one solid are nearer to each other than so many times the width of the holes that are closed.
const TOUCHING: f32 = 4.0;
/// A wall hides only what lies further behind its plane than so many times the distance within which faces lie in it.
pub(super) const BEHIND: f32 = 4.0;

/// What hides, ready for questions.
pub struct Blocker {
    /// What it was made from.
    pub occluders: Occluders,
    /// Those that hide.
    bodies: Bvh2,
    walls: Stops,
    solids: Solids,
}

/// Which proofs may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Proofs {
    /// One convex body between.
    pub bodies: bool,
    /// Walls and their openings.
    pub walls: bool,
}

/// Why something cannot be seen.
#[derive(Debug, Clone, PartialEq)]
pub enum Witness {
    /// This body of [`Occluders::bodies`] blocks every sight line.
    Body(u32),
    /// These walls of [`Occluders::walls`] do, one after the other: what an opening of one lets through, another stops.
    Walls(Vec<u32>),
    /// Several bodies do together ([`super::fusion`]).
    Fused,
}

impl Blocker {
    /// Makes occluders ready for questions.
    #[must_use]
    pub fn new(occluders: Occluders) -> Self {
        let Tolerance { hole_m, .. } = occluders.tolerance;
        let hiding = (0u32..).zip(&occluders.bodies).filter(|(_, body)| body.hides);
        let bodies = segment::numbered_tree(hiding.map(|(number, b)| (number, [b.min, b.max])), 0.0);
        Self {
            walls: Stops::of(&occluders.walls, occluders.tolerance),
            solids: Solids::of(&occluders.bodies, TOUCHING * hole_m),
            bodies,
            occluders,
        }
    }

    /// Whether a point lies inside a solid thing.
    #[must_use]
    pub fn holds(&self, point: Vec3) -> bool {
        self.solids.holds(&self.occluders.bodies, point)
    }

    fn body(&self, index: u32) -> &Body {
        &self.occluders.bodies[index as usize]
    }

    /// Objects that are doors, rising.
    #[must_use]
    pub fn doors(&self) -> Vec<u32> {
        let mut doors: Vec<_> = self.occluders.leaves().iter().filter_map(|wall| wall.door).collect();
        doors.sort_unstable();
        doors
    }

    /// Whether a segment passes a door.
    #[must_use]
    pub fn door_is_on(&self, door: u32, from: Vec3, to: Vec3) -> bool {
        let mut doors = self.occluders.leaves().iter().filter(|wall| wall.door == Some(door));
        doors.any(|wall| stops(wall, from, to))
    }

    /// Walls that stop a segment; of doors only these. Where doors are closed, also walls that it passes through an opening:
    /// a leaf fills an opening, but not what diverges behind it.
    fn walls_on(&self, from: Vec3, to: Vec3, closed: &[u32], found: &mut Vec<u32>) {
        let walls = &self.occluders.walls;
        let mut note = |index: u32| {
            let takes_part = walls[index as usize].door.is_none_or(|door| closed.contains(&door));
            if takes_part && !found.contains(&index) {
                found.push(index);
            }
        };
        if closed.is_empty() {
            self.walls.on(from, to, &mut |index| {
                note(index);
                ControlFlow::Continue(())
            });
        } else {
            self.walls.met(from, to, &mut note);
        }
    }
}

/// Asks questions about one blocker; remembers what worked.
pub struct Prover<'a> {
    blocker: &'a Blocker,
    proofs: Proofs,
    closed: Vec<u32>,
    /// Where eyes are …
    eye: Region,
    /// … and the solids that may hold some of them, rising.
    within: Vec<u32>,
    /// Bodies and walls that worked lately, by the direction of the target, the last one first.
    recent: Vec<[Vec<u32>; 2]>,
    steps_left: u32,
    /// Tests of a wall for all questions about openings.
    budget: u32,
    /// The openings on the longest way that the last question left open.
    leak: Vec<Region>,
}

/// How sight lines cross a wall.
struct Crossing {
    wall: u32,
    way: Way,
    /// All of them cross inside.
    rectangle: Rectangle,
}

impl<'a> Prover<'a> {
    /// A prover that knows nothing yet.
    #[must_use]
    pub fn new(blocker: &'a Blocker, proofs: Proofs) -> Self {
        Self {
            blocker,
            proofs,
            closed: Vec::new(),
            eye: Region::default(),
            within: Vec::new(),
            recent: vec![Default::default(); SECTORS],
            steps_left: 0,
            budget: u32::MAX,
            leak: Vec::new(),
        }
    }

    /// Openings through which sight lines may get, as far as the last question about openings could not say: where to
    /// look for one.
    #[must_use]
    pub fn leak(&self) -> &[Region] {
        &self.leak
    }

    /// From now on all questions about openings together take no more tests of a wall than this.
    pub fn allow(&mut self, steps: u32) {
        self.budget = steps;
    }

    /// From now on these doors are closed, and no others.
    pub fn close(&mut self, doors: &[u32]) {
        self.closed = doors.to_vec();
        for [_, walls] in &mut self.recent {
            walls.clear();
        }
    }

    /// From now on eyes are in this region.
    fn stand_in(&mut self, eye: &Region) {
        if self.eye != *eye {
            let Blocker { occluders, solids, .. } = self.blocker;
            self.within = solids.around(&occluders.bodies, eye);
            self.eye = eye.clone();
        }
    }

    /// Whether a body may hide things from a region: no eye in there is inside the same solid.
    pub fn is_outside(&mut self, eye: &Region, body: u32) -> bool {
        self.stand_in(eye);
        self.hides_at_all(body)
    }

    fn hides_at_all(&self, body: u32) -> bool {
        self.within.binary_search(&self.blocker.solids.of_body(body)).is_err()
    }

    /// Whether one body lies between two regions for all eyes.
    fn separates(&self, body: u32, from: &Region, to: &Region) -> bool {
        self.hides_at_all(body) && self.blocker.body(body).separates(from, to, true)
    }

    /// A proof that no point of the target can be seen from any point of the eye region, if one is found.
    pub fn hides(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        self.hides_by_one(eye, target)
            .or_else(|| self.hides_by_openings(eye, target))
    }

    /// Such a proof with what worked lately, one body or one wall: the cheapest, for groups of targets.
    pub fn hides_lately(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        if eye.overlaps(target) {
            return None;
        }
        self.stand_in(eye);
        let body = |index: &u32| self.separates(*index, eye, target);
        let sector = sector(eye, target);
        let [bodies, walls] = &self.recent[sector];
        if let Some(at) = bodies.iter().position(body) {
            return Some(Witness::Body(self.remember(sector, BODIES, at)));
        }
        let wall = |index: &u32| self.opaque(*index, &[eye, target]);
        let at = walls.iter().position(wall)?;
        Some(Witness::Walls(vec![self.remember(sector, WALLS, at)]))
    }

    /// Such a proof with one body or one wall.
    pub fn hides_by_one(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        if let Some(witness) = self.hides_lately(eye, target) {
            return Some(witness);
        }
        if eye.overlaps(target) {
            return None;
        }
        let found = self.first_body(eye, target).map(|body| (BODIES, body));
        let (kind, index) = found.or_else(|| self.first_wall(eye, target).map(|wall| (WALLS, wall)))?;
        let recent = &mut self.recent[sector(eye, target)][kind];
        recent.truncate(RECENT - 1);
        recent.insert(0, index);
        Some(if kind == BODIES {
            Witness::Body(index)
        } else {
            Witness::Walls(vec![index])
        })
    }

    /// Such a proof with sequences of walls: the dearest.
    pub fn hides_by_openings(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        self.leak.clear();
        if !self.proofs.walls || self.budget == 0 || eye.overlaps(target) {
            return None;
        }
        self.stand_in(eye);
        let allowed = MAX_STEPS.min(self.budget);
        self.steps_left = allowed;
        let mut passed = vec![eye.clone(), target.clone()];
        let mut chain = Vec::new();
        let blocked = self.walls_block(&mut passed, &mut chain);
        self.budget -= allowed - self.steps_left;
        blocked.then(|| {
            chain.sort_unstable();
            chain.dedup();
            Witness::Walls(chain)
        })
    }

    /// Moves what worked again to the front.
    fn remember(&mut self, sector: usize, kind: usize, at: usize) -> u32 {
        let recent = &mut self.recent[sector][kind];
        recent[..=at].rotate_right(1);
        recent[0]
    }

    /// The first body on the ray between the middles that hides the target.
    fn first_body(&self, eye: &Region, target: &Region) -> Option<u32> {
        if !self.proofs.bodies {
            return None;
        }
        let (from, to) = (eye.center(), target.center());
        let mut tries_left = BODIES_TRIED;
        let mut found = None;
        segment::along(&self.blocker.bodies, from, to, &mut |index| {
            let body = self.blocker.body(index);
            if body.meets(from, to) {
                tries_left -= 1;
                found = self.separates(index, eye, target).then_some(index);
            }
            go_on(found.is_none() && tries_left > 0)
        });
        found
    }

    /// A wall on the ray between the middles that is opaque wherever sight lines cross it.
    fn first_wall(&self, eye: &Region, target: &Region) -> Option<u32> {
        if !self.proofs.walls {
            return None;
        }
        let (from, to) = (eye.center(), target.center());
        let walls = &self.blocker.occluders.walls;
        let mut found = None;
        self.blocker.walls.on(from, to, &mut |index| {
            let door = walls[index as usize].door;
            let takes_part = door.is_none_or(|door| self.closed.contains(&door));
            if takes_part && self.opaque(index, &[eye, target]) {
                found = Some(index);
            }
            go_on(found.is_none())
        });
        found
    }

    /// Whether a wall is opaque wherever sight lines between two regions cross it.
    fn opaque(&self, index: u32, between: &[&Region; 2]) -> bool {
        let margin_m = 2.0 * self.blocker.occluders.tolerance.plane_m;
        let wall = &self.blocker.occluders.walls[index as usize];
        self.crossing(index, between)
            .is_some_and(|crossing| wall.covers(crossing.way, &crossing.rectangle, margin_m))
    }

    /// Whether walls block all sight lines that pass through these regions: from the first, to the second, and through
    /// the openings after them. Walls that it took are added to `chain`.
    fn walls_block(&mut self, passed: &mut Vec<Region>, chain: &mut Vec<u32>) -> bool {
        let openings_passed = passed.len() - 2;
        let mut candidates = Vec::new();
        match passed.last().filter(|_| openings_passed > 0) {
            None => self
                .blocker
                .walls_on(passed[0].center(), passed[1].center(), &self.closed, &mut candidates),
            Some(opening) => {
                self.blocker
                    .walls_on(passed[0].center(), opening.center(), &self.closed, &mut candidates);
                self.blocker
                    .walls_on(opening.center(), passed[1].center(), &self.closed, &mut candidates);
                if self.proofs.bodies && self.body_beside(passed) {
                    return true;
                }
            }
        }
        let margin_m = 2.0 * self.blocker.occluders.tolerance.plane_m;
        let mut partial: Vec<(f32, Crossing)> = Vec::new();
        for index in candidates {
            if self.steps_left == 0 {
                return false;
            }
            self.steps_left -= 1;
            let wall = &self.blocker.occluders.walls[index as usize];
            match self.crossing(index, passed) {
                Some(crossing)
                    if is_empty(&crossing.rectangle, margin_m)
                        || wall.covers(crossing.way, &crossing.rectangle, margin_m) =>
                {
                    chain.push(index);
                    return true;
                }
                Some(crossing) => partial.push((wall.opaque_share(crossing.way, &crossing.rectangle), crossing)),
                None => {}
            }
        }
        if openings_passed > self.leak.len() {
            self.leak = passed[2..].to_vec();
        }
        if openings_passed == MAX_OPENINGS_PASSED {
            return false;
        }
        partial.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.wall.cmp(&b.1.wall)));
        partial.truncate(WALLS_TRIED[openings_passed]);
        partial.into_iter().any(|(_, crossing)| {
            let wall = &self.blocker.occluders.walls[crossing.wall as usize];
            let Some(openings) = wall.openings(crossing.way, &crossing.rectangle, margin_m, MAX_OPENINGS) else {
                return false;
            };
            let known = chain.len();
            let blocked = openings.iter().all(|opening| {
                passed.push(region_of(wall, opening));
                let blocked = self.walls_block(passed, chain);
                passed.pop();
                blocked
            });
            if blocked {
                chain.push(crossing.wall);
            } else {
                chain.truncate(known);
            }
            blocked
        })
    }

    /// Whether a body that worked lately separates the last opening from the eye or the target.
    fn body_beside(&self, passed: &[Region]) -> bool {
        let (eye, target) = (&passed[0], &passed[1]);
        let opening = &passed[passed.len() - 1];
        let recent = self.recent[sector(eye, target)][BODIES].iter();
        let mut between =
            recent.map(|body| self.separates(*body, eye, opening) || self.separates(*body, opening, target));
        between.any(|between| between)
    }

    /// How sight lines that pass these regions cross a wall, if they surely do.
    fn crossing<R: Borrow<Region>>(&self, index: u32, passed: &[R]) -> Option<Crossing> {
        let occluders = &self.blocker.occluders;
        let wall = &occluders.walls[index as usize];
        let plane_m = occluders.tolerance.plane_m;
        let sides: Vec<i8> = passed
            .iter()
            .enumerate()
            .map(|(i, region)| {
                let [low, high] = region.borrow().heights(wall.normal, wall.offset);
                let beyond_m = if i == 1 { BEHIND * plane_m } else { -2.0 * plane_m };
                if low >= beyond_m {
                    1
                } else if high <= -beyond_m {
                    -1
                } else {
                    0
                }
            })
            .collect();
        // Where sight lines come from: the eye's side, or the side away from the target.
        let near = if sides[0] != 0 { sides[0] } else { -sides[1] };
        if near == 0 || sides[1] == near {
            return None;
        }
        let way = if near > 0 { Way::Against } else { Way::Along };
        if !wall.hides(way) {
            return None;
        }
        let mut rectangle = [[f32::NEG_INFINITY, f32::INFINITY]; 2];
        let mut crossed = false;
        for (a, _) in sides.iter().enumerate().filter(|(_, side)| **side == near) {
            for (b, _) in sides.iter().enumerate().filter(|(_, side)| **side == -near) {
                crossed = true;
                let between = between(wall, passed[a].borrow(), passed[b].borrow());
                for axis in 0..2 {
                    rectangle[axis][0] = rectangle[axis][0].max(between[axis][0]);
                    rectangle[axis][1] = rectangle[axis][1].min(between[axis][1]);
                }
            }
        }
        crossed.then_some(Crossing {
            wall: index,
            way,
            rectangle,
        })
    }
}

/// Which way a target lies.
fn sector(eye: &Region, target: &Region) -> usize {
    let away = target.center() - eye.center();
    // A diamond instead of a circle: 0 to 4 once around.
    let across = away.x.abs() + away.z.abs();
    let turn = if across > 0.0 { away.x / across } else { 0.0 };
    let turn = if away.z < 0.0 { 3.0 - turn } else { 1.0 + turn };
    (turn * (SECTORS as f32 / 4.0)) as usize % SECTORS
}

fn go_on(go_on: bool) -> ControlFlow<()> {
    if go_on {
        ControlFlow::Continue(())
    } else {
        ControlFlow::Break(())
    }
}

/// Clipping left nothing, for certain.
fn is_empty(rectangle: &Rectangle, margin_m: f32) -> bool {
    rectangle.iter().any(|[low, high]| low - high > 0.5 * margin_m)
}

/// A rectangle in which all segments between two regions on different sides cross a wall. Only segments on the convex hull
/// of both can cross at its border; for two boxes these join equal corners.
pub(super) fn between(wall: &Wall, a: &Region, b: &Region) -> Rectangle {
    let mut rectangle = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    let mut include = |place: Vec2| {
        for axis in 0..2 {
            rectangle[axis][0] = rectangle[axis][0].min(place[axis]);
            rectangle[axis][1] = rectangle[axis][1].max(place[axis]);
        }
    };
    let at = |p: Vec3| (wall.normal.dot(p) - wall.offset, wall.place(p));
    let mut segment = |(height_a, place_a): (f32, Vec2), (height_b, place_b): (f32, Vec2)| {
        let drop = height_a - height_b;
        if drop.abs() <= f32::MIN_POSITIVE {
            include(place_a);
            include(place_b);
        } else {
            include(place_a.lerp(place_b, (height_a / drop).clamp(0.0, 1.0)));
        }
    };
    if a.points.is_empty() && b.points.is_empty() {
        for i in 0..8 {
            segment(at(a.corner(i)), at(b.corner(i)));
        }
    } else {
        for from in a.corners() {
            let from = at(from);
            for to in b.corners() {
                segment(from, at(to));
            }
        }
    }
    rectangle
}

/// An opening as a region: a flat box where the wall stands along the world's axes.
pub(super) fn region_of(wall: &Wall, opening: &Rectangle) -> Region {
    let [u, v] = *opening;
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| wall.point(Vec2::new(u[i], v[j])));
    let hull = Region::hull(corners.to_vec());
    if wall.normal.abs().max_element() > 1.0 - 1e-6 {
        Region::of_box(hull.min, hull.max)
    } else {
        hull
    }
}
