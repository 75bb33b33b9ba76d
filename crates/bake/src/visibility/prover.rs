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
//! Eyes may be anywhere: single bodies and walls are asked in double precision. From far outside of the scene openings are not
//! looked through, and from very far nothing is proved ([`Blocker::is_near`], [`Blocker::may_separate`]).
//!
//! [`Body::separates`]: crate::occluders::Body::separates
//! [`Tolerance::hole_m`]: crate::occluders::Tolerance::hole_m

use std::ops::ControlFlow;

use super::{
    blocker::Blocker,
    crossing::{Crossing, region_of},
    segment,
};
use crate::occluders::{Region, Wall};

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
    /// This body of [`Occluders::bodies`](crate::occluders::Occluders::bodies) blocks every sight line.
    Body(u32),
    /// These walls of [`Occluders::walls`](crate::occluders::Occluders::walls) do, one after the other: what an opening of one lets through, another stops.
    Walls(Vec<u32>),
    /// Several bodies do together ([`super::fusion`]).
    Fused,
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
    /// The object that the question is about, if it is about all of one.
    whole: Option<u32>,
    steps_left: u32,
    /// Tests of a wall for all questions about openings.
    budget: u32,
    /// The openings on the longest way that the last question left open.
    leak: Vec<Region>,
    /// An axis, and where a wall stands across it that proved nothing since eyes of the last question are on both sides.
    astride: Option<(usize, f32)>,
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
            whole: None,
            steps_left: 0,
            budget: u32::MAX,
            leak: Vec::new(),
            astride: None,
        }
    }

    /// Openings through which sight lines may get, as far as the last question about openings could not say: where to
    /// look for one.
    #[must_use]
    pub fn leak(&self) -> &[Region] {
        &self.leak
    }

    /// Where to cut the eyes of the last question, so that one more wall can take part.
    #[must_use]
    pub fn astride(&self) -> Option<(usize, f32)> {
        self.astride
    }

    /// From now on all questions about openings together take no more tests of a wall than this.
    pub fn allow(&mut self, steps: u32) {
        self.budget = steps;
    }

    /// How many tests of a wall questions about openings may still take.
    #[must_use]
    pub fn budget(&self) -> u32 {
        self.budget
    }

    /// Faces that stand off their plane by this much, in metres, still lie in it.
    #[must_use]
    pub fn margin_m(&self) -> f32 {
        2.0 * self.blocker.occluders.tolerance.plane_m
    }

    /// From now on nothing counts that worked lately.
    pub(super) fn forget(&mut self) {
        self.recent.iter_mut().flatten().for_each(Vec::clear);
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

    /// Whether one body lies between two regions for all eyes, and is none of what all of is asked about.
    fn separates(&self, index: u32, from: &Region, to: &Region) -> bool {
        let body = self.blocker.body(index);
        self.whole != Some(body.object) && self.hides_at_all(index) && body.separates(from, to, true)
    }

    /// A proof that no point of the target can be seen from any point of the eye region, if one is found.
    pub fn hides(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        self.hides_by_one(eye, target)
            .or_else(|| self.hides_by_openings(eye, target))
    }

    /// Such a proof with what worked lately, one body or one wall: the cheapest, for groups of targets.
    pub fn hides_lately(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        if !self.blocker.may_separate(eye, target) {
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
        if !self.blocker.may_separate(eye, target) {
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

    /// The same about all of an object, which none of its own bodies can hide, whatever rounding says.
    pub fn hides_whole_by_one(&mut self, eye: &Region, target: &Region, object: u32) -> Option<Witness> {
        self.whole = Some(object);
        let witness = self.hides_by_one(eye, target);
        self.whole = None;
        witness
    }

    /// Such a proof with sequences of walls: the dearest.
    pub fn hides_by_openings(&mut self, eye: &Region, target: &Region) -> Option<Witness> {
        self.leak.clear();
        self.astride = None;
        let may_ask = self.proofs.walls && self.budget > 0 && self.blocker.may_separate(eye, target);
        if !may_ask || !self.blocker.is_near(eye) || !self.blocker.is_near(target) {
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
        let margin_m = self.margin_m();
        let wall = &self.blocker.occluders.walls[index as usize];
        Crossing::of(&self.blocker.occluders, index, between)
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
        let margin_m = self.margin_m();
        let mut partial: Vec<(f32, Crossing)> = Vec::new();
        for index in candidates {
            if self.steps_left == 0 {
                return false;
            }
            self.steps_left -= 1;
            let wall = &self.blocker.occluders.walls[index as usize];
            match Crossing::of(&self.blocker.occluders, index, passed) {
                Some(crossing)
                    if crossing.is_empty(margin_m) || wall.covers(crossing.way, &crossing.rectangle, margin_m) =>
                {
                    chain.push(index);
                    return true;
                }
                Some(crossing) => partial.push((wall.opaque_share(crossing.way, &crossing.rectangle), crossing)),
                None if self.astride.is_none() => self.astride = across(wall, &passed[0], margin_m),
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
}

/// The axis that a wall stands across, and where, if eyes are on both sides of it.
fn across(wall: &Wall, eye: &Region, margin_m: f32) -> Option<(usize, f32)> {
    let axis = wall.axis()?;
    let at = wall.offset / wall.normal[axis];
    (eye.min[axis] + margin_m < at && at < eye.max[axis] - margin_m).then_some((axis, at))
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
