//! Which door closes an opening? The one whose outline covers it.
//!
//! Each door is looked at in its own frame, as its leaf is. One that stands askew covers what lies between its own edges, and not what
//! else lies in the box around it along the axes; one whose head is slanted or arched covers nothing above that.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use super::{CellGraph, hull::convex_outline};
use crate::{
    occluders::{DOOR_GAP, DoorFrame},
    world::World,
};

/// Where a door closes openings.
struct Cover {
    door: u32,
    frame: DoorFrame,
    /// Convex and counter-clockwise, seen along the direction through the door.
    outline: Vec<DVec3>,
    /// From where to where it reaches in that direction.
    depths: [f64; 2],
    /// How wide a gap it may leave.
    gap_m: f64,
}

impl Cover {
    /// `None` for a door that shows no area.
    fn of(world: &World, door: u32) -> Option<Self> {
        let triangles = world.triangles_of(door);
        triangles.first()?;
        let frame = DoorFrame::of(&triangles);
        let corners = triangles.iter().flat_map(|face| face.corners);
        let corners: Vec<DVec3> = corners.map(|corner| frame.place(corner)).collect();
        let low = corners.iter().copied().reduce(DVec3::min)?;
        let high = corners.iter().copied().reduce(DVec3::max)?;
        let flat: Vec<DVec3> = corners.iter().map(|corner| corner.truncate().extend(0.0)).collect();
        let outline = convex_outline(&flat, DVec3::Z);
        (outline.len() >= 3).then(|| Self {
            door,
            frame,
            outline,
            depths: [low.z, high.z],
            gap_m: f64::from(DOOR_GAP) * (high - low).truncate().max_element(),
        })
    }

    /// Whether an opening that may lie so far before or behind it is one in which it lies, though it may cover a part of it only.
    fn lies_in(&self, world: &World, opening: &[[f64; 3]], reach_m: f64) -> bool {
        let reach_m = self.gap_m.max(reach_m);
        let range = self.depths[0] - reach_m..=self.depths[1] + reach_m;
        let mut corners = Vec::with_capacity(opening.len());
        for corner in opening {
            let corner = self.frame.place(world.relative(*corner));
            if !range.contains(&corner.z) {
                return false;
            }
            corners.push(corner);
        }
        let around = |points: &[DVec3]| {
            let low = points.iter().copied().reduce(DVec3::min).unwrap_or_default();
            (low, points.iter().copied().reduce(DVec3::max).unwrap_or_default())
        };
        let ((low, high), (least, most)) = (around(&corners), around(&self.outline));
        let common = high.min(most) - low.max(least);
        common.truncate().min_element() > self.gap_m
    }

    /// Whether it covers a point of an opening that may lie so far before or behind it.
    fn holds(&self, world: &World, point: [f64; 3], reach_m: f64) -> bool {
        let point = self.frame.place(world.relative(point));
        let reach_m = self.gap_m.max(reach_m);
        let next = self.outline.iter().cycle().skip(1);
        let within = |(from, to): (&DVec3, &DVec3)| {
            let outwards = -DVec2::perp((to - from).truncate()).normalize_or_zero();
            outwards.dot((point - from).truncate()) <= self.gap_m
        };
        self.depths[0] - reach_m <= point.z
            && point.z <= self.depths[1] + reach_m
            && self.outline.iter().zip(next).all(within)
    }
}

impl CellGraph {
    /// Names with each opening the door that closes it, if there is one: a door whose outline, grown by the gap that a leaf may leave,
    /// covers the whole opening, which lies no more than a voxel before or behind it.
    pub(super) fn name_doors(&mut self, world: &World) {
        let covers: Vec<Cover> = world
            .doors()
            .iter()
            .filter_map(|door| Cover::of(world, *door))
            .collect();
        let reach_m = self.voxel_m;
        for portal in self.cells.iter_mut().flat_map(|cell| &mut cell.portals) {
            let closes = |cover: &&Cover| {
                let mut corners = portal.polygon.iter();
                corners.all(|corner| cover.holds(world, *corner, reach_m))
            };
            portal.door = covers.iter().find(closes).map(|cover| cover.door);
        }
    }

    /// Doors that no opening names, and for each whether it lies in one all the same, of which it covers a part only.
    pub(crate) fn idle_doors(&self, world: &World) -> Vec<(u32, bool)> {
        let portals = || self.cells.iter().flat_map(|cell| &cell.portals);
        let named: BTreeSet<u32> = portals().filter_map(|portal| portal.door).collect();
        let idle = world.doors().iter().filter(|door| !named.contains(door));
        let lies_in_one = |door: u32| {
            let cover = Cover::of(world, door);
            cover.is_some_and(|cover| portals().any(|portal| cover.lies_in(world, &portal.polygon, self.voxel_m)))
        };
        idle.map(|door| (*door, lies_in_one(*door))).collect()
    }
}
