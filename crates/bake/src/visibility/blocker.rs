//! What hides in a scene, ready for questions?
//!
//! [`Occluders`] with an index of each kind: bodies by their boxes, walls by their pieces ([`Stops`]), and which bodies make up one
//! solid thing ([`Solids`]), since from inside a thing none of its bodies hides.

use std::ops::ControlFlow;

use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::{
    segment,
    stops::{Stops, stops},
    within::Solids,
};
use crate::occluders::{Body, Occluders, Region, Tolerance};

/// Bodies of one solid are nearer to each other than so many times the width of the holes that are closed.
const TOUCHING: f32 = 4.0;

/// Eyes no further behind a face than so many times the distance within which faces lie in one plane are before it: cells end at
/// walls, but for rounding. Those further behind are inside what it bounds.
pub(super) const AT_FACE: f32 = 2.0;

/// From regions that reach further out than so many times the scene's width only single bodies and single walls hide, which are
/// asked in double precision: places of openings and shadows are known to single precision.
const NEAR: f32 = 4.0;

/// From, and of, what reaches further out than so many times the scene's width nothing is hidden.
const FURTHEST: f32 = 1e8;

/// What hides, ready for questions.
pub struct Blocker {
    /// What it was made from.
    pub occluders: Occluders,
    /// Those that hide.
    pub(super) bodies: Bvh2,
    pub(super) walls: Stops,
    pub(super) solids: Solids,
}

impl Blocker {
    /// Makes occluders ready for questions.
    #[must_use]
    pub fn new(occluders: Occluders) -> Self {
        let Tolerance { hole_m, plane_m } = occluders.tolerance;
        let inset_m = hole_m - AT_FACE * plane_m;
        let hiding = (0u32..).zip(&occluders.bodies).filter(|(_, body)| body.hides);
        let bodies = segment::numbered_tree(hiding.map(|(number, b)| (number, [b.min, b.max])), 0.0);
        Self {
            walls: Stops::of(&occluders.walls, occluders.tolerance),
            solids: Solids::of(&occluders.bodies, TOUCHING * hole_m, inset_m),
            bodies,
            occluders,
        }
    }

    /// Whether a point lies inside a solid thing.
    #[must_use]
    pub fn holds(&self, point: Vec3) -> bool {
        self.solids.holds(&self.occluders.bodies, point)
    }

    /// Whether a region is so near that all kinds of proof are exact enough.
    pub(super) fn is_near(&self, region: &Region) -> bool {
        region.reach_m() <= NEAR * self.occluders.tolerance.scale_m()
    }

    /// Whether anything may be proved of the sight lines between two regions.
    pub(super) fn may_separate(&self, eye: &Region, target: &Region) -> bool {
        let furthest_m = FURTHEST * self.occluders.tolerance.scale_m();
        !eye.overlaps(target) && eye.reach_m().max(target.reach_m()) <= furthest_m
    }

    pub(super) fn body(&self, index: u32) -> &Body {
        &self.occluders.bodies[index as usize]
    }

    /// Objects that are doors, rising.
    #[must_use]
    pub fn doors(&self) -> Vec<u32> {
        let mut doors: Vec<_> = self.occluders.leaves().iter().filter_map(|wall| wall.door).collect();
        doors.sort_unstable();
        doors.dedup();
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
    pub(super) fn walls_on(&self, from: Vec3, to: Vec3, closed: &[u32], found: &mut Vec<u32>) {
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
