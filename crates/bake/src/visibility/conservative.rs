//! What may be seen from a region? Everything that cannot be proved hidden.
//!
//! Works down the tree of object boxes, nearest first: a box of the tree that is hidden takes all it holds with it (boxes
//! before primitives; Cohen-Or & Zadicario 1998, *Ray shooting*), by one body or by all nearer ones together
//! ([`super::fusion`]), so cost grows with what is visible. What is left is asked about once more with the shadows of all
//! that is left; bodies of hidden objects take no part (occluded occluders are redundant). Then walls are looked through.
//! What is still left is asked about from halves of the region, coarse to fine, as long as that pays: seen from the region
//! is what is seen from one of its halves. At last each object is asked about alone ([`super::narrow`]).
//!
//! Guarantee: never misses an object, see [`super::prover`] and [`super::fusion`] for what is assumed.

use std::{cmp::Reverse, collections::BinaryHeap};

use glam::Vec3;

pub use self::scenery::Scenery;
use super::{
    fusion::Shadows,
    narrow::{Blind, Scout},
    prover::{Proofs, Prover},
};
use crate::occluders::Region;

mod parts;
mod reasons;
mod scenery;

/// Halves are asked about as long as at least one out of so many questions was settled.
const PAYS: usize = 16;

/// So many objects are asked about at once whether openings hide them, …
const SAMPLE: usize = 32;
/// … and no more when fewer than one out of so many were.
const RARE: usize = 16;

/// Which proofs are used, and how finely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConservativeSettings {
    /// One body, or walls with openings, or both.
    pub proofs: Proofs,
    /// Whether bodies may hide together.
    pub fusion: bool,
    /// How often a region is halved for what could not be proved hidden from all of it.
    pub halvings: u32,
    /// How often the region and objects may be cut into parts, for all objects together that could not be proved hidden as a whole.
    pub cuts: u32,
    /// All questions about openings of one region together take at most so many tests of a wall.
    pub steps: u32,
}

impl ConservativeSettings {
    /// For answers within milliseconds.
    pub const ON_LINE: Self = Self {
        proofs: Proofs {
            bodies: true,
            walls: true,
        },
        fusion: true,
        halvings: 0,
        cuts: 0,
        steps: 1500,
    };

    /// For a first, rough answer with the same kinds of proof: one body, one wall, or bodies together.
    #[must_use]
    pub fn rough(self) -> Self {
        Self {
            halvings: 0,
            cuts: 0,
            steps: 0,
            ..self
        }
    }
}

/// Asks what can be seen from regions of one scenery.
pub struct Observer<'a> {
    scenery: &'a Scenery,
    settings: ConservativeSettings,
    prover: Prover<'a>,
    shadows: Shadows,
    /// Objects that are known to be visible, whatever is proved.
    known: Vec<bool>,
    /// How often each object may still be cut.
    cuts_left: Vec<u32>,
}

/// What is looked at next.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum What {
    Node(u32),
    Object(u32),
}

impl<'a> Observer<'a> {
    /// An observer that knows nothing yet.
    #[must_use]
    pub fn new(scenery: &'a Scenery, settings: ConservativeSettings) -> Self {
        Self {
            scenery,
            settings,
            prover: Prover::new(&scenery.blocker, settings.proofs),
            shadows: Shadows::default(),
            known: vec![false; scenery.targets.len()],
            cuts_left: vec![0; scenery.targets.len()],
        }
    }

    /// From now on it remembers no more of what hid something than a new one.
    pub(super) fn forget(&mut self) {
        self.prover.forget();
    }

    /// From now on these doors are closed, and no others.
    pub fn close(&mut self, doors: &[u32]) {
        self.prover.close(doors);
    }

    /// Objects that may be seen from a region, rising. `seen` are known to be visible: nobody has to ask about them.
    pub fn visible(&mut self, eye: &Region, seen: &[u32]) -> Vec<u32> {
        self.visible_or_found(eye, seen, &mut Blind)
    }

    /// The same, with somebody who looks for what cheap proofs leave open before the dear ones begin, and for what these leave
    /// open.
    pub fn visible_or_found(&mut self, eye: &Region, seen: &[u32], scout: &mut dyn Scout) -> Vec<u32> {
        for object in seen {
            self.known[*object as usize] = true;
        }
        self.prover.allow(self.settings.steps);
        let mut open = self.not_hidden(eye);
        self.fuse(eye, &mut open);
        for object in self.questions(&open) {
            self.known[object as usize] = scout.glances(object, eye);
        }
        let questions = self.questions(&open);
        let cuts = self.settings.cuts / questions.len().max(1) as u32;
        for object in questions {
            self.cuts_left[object as usize] = cuts;
        }
        // Objects that are already known to be visible are no question any more; but they still take part in hiding
        // others.
        let mut visible: Vec<u32> = open.iter().copied().filter(|o| self.known[*o as usize]).collect();
        visible.extend(seen.iter().filter(|o| open.binary_search(o).is_err()));
        self.refine(eye, &mut open, None, self.settings.halvings, scout, &mut visible);
        for object in visible.iter().chain(seen) {
            self.known[*object as usize] = false;
        }
        visible.sort_unstable();
        visible.dedup();
        visible
    }

    /// Openings through which an object might be seen from a region; `None` when it is hidden from there.
    pub fn ways_to(&mut self, eye: &Region, object: u32) -> Option<Vec<Region>> {
        let target = self.scenery.targets[object as usize].as_ref()?;
        let hidden = self.prover.hides_whole_by_one(eye, target, object).is_some()
            || self.prover.hides_by_openings(eye, target).is_some();
        (!hidden).then(|| self.prover.leak().to_vec())
    }

    /// Objects that neither one body or wall nor, if wanted, the bodies of nearer ones together hide from all of the
    /// region, rising. Nearest first, so that what hides is known before what it hides.
    fn not_hidden(&mut self, eye: &Region) -> Vec<u32> {
        let scenery = self.scenery;
        let tree = &scenery.tree;
        let mut open = Vec::new();
        if tree.nodes.is_empty() {
            return open;
        }
        let region = |index: u32| {
            let aabb = tree.nodes[index as usize].aabb();
            Region::of_box(Vec3::from(aabb.min), Vec3::from(aabb.max))
        };
        let fused = self.settings.fusion;
        if fused {
            self.shadows.begin(eye, eye.min.y.min(scenery.floor_m));
        }
        // Distances are not negative, so their bits are in order.
        let place = |region: &Region, what: What| Reverse((region.distance_m(eye).to_bits(), what));
        let mut queue = BinaryHeap::from([place(&region(0), What::Node(0))]);
        while let Some(Reverse((_, what))) = queue.pop() {
            match what {
                What::Node(index) => {
                    let group = region(index);
                    if (fused && self.shadows.hide(&group)) || self.prover.hides_lately(eye, &group).is_some() {
                        continue;
                    }
                    let node = &tree.nodes[index as usize];
                    if node.is_leaf() {
                        let objects = &tree.primitive_indices[node.first_index as usize..][..node.prim_count as usize];
                        let targets = objects
                            .iter()
                            .filter_map(|o| Some((o, scenery.targets[*o as usize].as_ref()?)));
                        queue.extend(targets.map(|(object, target)| place(target, What::Object(*object))));
                    } else {
                        let children = [node.first_index, node.first_index + 1];
                        queue.extend(children.map(|child| place(&region(child), What::Node(child))));
                    }
                }
                What::Object(object) => {
                    let Some(target) = &scenery.targets[object as usize] else {
                        continue;
                    };
                    // Who hides it hides all that it could hide, so it takes no part, known or not.
                    if fused && self.shadows.hide(target) {
                        continue;
                    }
                    let known = self.known[object as usize];
                    if known || self.prover.hides_whole_by_one(eye, target, object).is_none() {
                        open.push(object);
                        if fused {
                            self.draw(eye, object);
                        }
                    }
                }
            }
        }
        open.sort_unstable();
        open
    }

    /// Draws the shadows of an object's bodies, as far as no eye of the region is inside them. From far out they are not exact enough.
    fn draw(&mut self, eye: &Region, object: u32) {
        if !self.scenery.blocker.is_near(eye) {
            return;
        }
        for index in self.scenery.bodies_of[object as usize].clone() {
            let body = &self.scenery.blocker.occluders.bodies[index as usize];
            if body.hides && self.prover.is_outside(eye, index) {
                self.shadows.add(body);
            }
        }
    }

    /// Takes out what bodies of the others hide together. Objects that are known to be visible stay.
    fn fuse(&mut self, eye: &Region, open: &mut Vec<u32>) {
        if !self.settings.fusion {
            return;
        }
        let scenery = self.scenery;
        let questions = |open: &[u32], known: &[bool], level: bool| -> Vec<u32> {
            let unknown = open.iter().filter(|o| !known[**o as usize]);
            let on_level = |o: &&u32| {
                scenery.targets[**o as usize]
                    .as_ref()
                    .is_some_and(|t| (t.min.y >= eye.min.y) == level)
            };
            unknown.filter(on_level).copied().collect()
        };
        let mut hidden: Vec<u32> = Vec::new();
        // What lies below the eyes has its own floor.
        for level in [true, false] {
            let questions = questions(open, &self.known, level);
            let heights = questions.iter().filter_map(|o| scenery.targets[*o as usize].as_ref());
            let Some(lowest_m) = heights.map(|t| t.min.y).reduce(f32::min) else {
                continue;
            };
            let floor_m = lowest_m.min(eye.min.y);
            if !self.shadows.are_of(eye, floor_m) {
                self.shadows.begin(eye, floor_m);
                for object in open.iter() {
                    self.draw(eye, *object);
                }
            }
            let shadows = &self.shadows;
            let is_hidden = |o: &u32| scenery.targets[*o as usize].as_ref().is_some_and(|t| shadows.hide(t));
            hidden.extend(questions.into_iter().filter(is_hidden));
        }
        hidden.sort_unstable();
        open.retain(|object| hidden.binary_search(object).is_err());
    }

    /// Takes out what walls hide whose openings have to be looked through. Of very many some are asked about first: where they
    /// settle next to none, as out of doors, the others stay.
    fn look_through_openings(&mut self, eye: &Region, open: &mut Vec<u32>) {
        let questions = self.questions(open);
        let mut hidden = Vec::new();
        let step = questions.len().div_ceil(SAMPLE).max(1);
        for first in 0..step {
            let some = questions.iter().skip(first).step_by(step);
            hidden.extend(some.copied().filter(|object| {
                let target = self.scenery.targets[*object as usize].as_ref();
                target.is_some_and(|target| self.prover.hides_by_openings(eye, target).is_some())
            }));
            if step > 1 && hidden.len() * RARE < SAMPLE * (first + 1) {
                break;
            }
        }
        hidden.sort_unstable();
        open.retain(|object| hidden.binary_search(object).is_err());
    }

    fn questions(&self, open: &[u32]) -> Vec<u32> {
        let unknown = open.iter().filter(|object| !self.known[**object as usize]);
        unknown.copied().collect()
    }

    /// Adds to `visible` what of `open` may be seen from this part of the region. If it is a half, so many were asked about
    /// before it was halved.
    fn refine(
        &mut self,
        eye: &Region,
        open: &mut Vec<u32>,
        asked: Option<usize>,
        halvings: u32,
        scout: &mut dyn Scout,
        visible: &mut Vec<u32>,
    ) {
        self.look_through_openings(eye, open);
        let questions = self.questions(open);
        if questions.is_empty() {
            return;
        }
        let pays = asked.is_none_or(|asked| (asked - questions.len()) * PAYS >= asked);
        if halvings == 0 || !pays {
            let questions = self.not_hidden_in_parts(eye, questions, scout);
            // What is left is in the set, whatever can be proved from other parts.
            for object in &questions {
                self.known[*object as usize] = true;
            }
            visible.extend(questions);
            return;
        }
        for half in eye.halves() {
            let asked = self.questions(open).len();
            let mut left: Vec<u32> = Vec::with_capacity(open.len());
            for object in open.iter() {
                let target = self.scenery.targets[*object as usize].as_ref();
                let is_open = |target| self.prover.hides_whole_by_one(&half, target, *object).is_none();
                if self.known[*object as usize] || target.is_some_and(is_open) {
                    left.push(*object);
                }
            }
            self.fuse(&half, &mut left);
            self.refine(&half, &mut left, Some(asked), halvings - 1, scout, visible);
        }
    }
}
