//! Which door closes an opening? The one whose outline covers it.
//!
//! Each door is looked at in its own frame, as its leaf is. One that stands askew covers what lies between its own edges, and not what
//! else lies in the box around it along the axes; one whose head is slanted or arched covers nothing above that.

use std::collections::BTreeSet;

use belvedere_scene::Bounds;
use glam::{DVec2, DVec3};

use super::{
    CellGraph,
    hull::convex_outline,
    near::{Boxes, grown},
};
use crate::{
    occluders::{DOOR_GAP, DoorFrame},
    world::World,
};

/// Nothing is further away than this.
const FURTHEST_M: f64 = 1e10;

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
    /// The middle of the box around it, in world space.
    middle: [f64; 3],
}

impl Cover {
    /// `None` for a door that shows no area.
    fn of(world: &World, door: u32) -> Option<Self> {
        let triangles = world.triangles_of(door);
        triangles.first()?;
        let frame = DoorFrame::of(&triangles);
        let corners = triangles.iter().flat_map(|face| face.corners);
        let middle = Bounds::around(corners.clone().map(|corner| world.absolute(corner))).center();
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
            middle,
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

    /// A box in world space around all that it covers.
    fn around(&self, world: &World, reach_m: f64) -> Bounds {
        let middle = self.frame.place(world.relative(self.middle));
        let depth_m = self.depths.map(|depth| (depth - middle.z).abs());
        let depth_m = depth_m[0].max(depth_m[1]) + self.gap_m.max(reach_m);
        let count = self.outline.len();
        let outwards = |i: usize| {
            let along = (self.outline[(i + 1) % count] - self.outline[i % count]).truncate();
            -along.perp().normalize_or_zero()
        };
        // Where two edges meet, what lies within the gap of both reaches as far as where they meet when each is moved outwards.
        let corner_m = (0..count).map(|i| {
            let [before, after] = [outwards(i + count - 1), outwards(i)];
            let moved = self.gap_m * (before + after) / (1.0 + before.dot(after));
            ((self.outline[i] - middle).truncate() + moved).length()
        });
        let width_m = corner_m.fold(0.0, f64::max);
        let radius_m = width_m.hypot(depth_m);
        // Places are known to single precision.
        let rounding_m = f64::from(8.0 * f32::EPSILON * world.scale_m());
        let radius_m = (radius_m + rounding_m).min(FURTHEST_M);
        let point = Bounds {
            min: self.middle,
            max: self.middle,
        };
        grown(&point, radius_m)
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
        let boxes = Boxes::of(covers.iter().map(|cover| cover.around(world, reach_m)).collect());
        for portal in self.cells.iter_mut().flat_map(|cell| &mut cell.portals) {
            let Some(corner) = portal.polygon.first() else { continue };
            let mut near = boxes.holding(*corner).into_iter().map(|cover| &covers[cover as usize]);
            let closes = |cover: &&Cover| {
                let mut corners = portal.polygon.iter();
                corners.all(|corner| cover.holds(world, *corner, reach_m))
            };
            portal.door = near.find(closes).map(|cover| cover.door);
        }
    }

    /// Doors that no opening names, rising.
    pub(crate) fn idle_doors(&self, world: &World) -> Vec<u32> {
        let portals = self.cells.iter().flat_map(|cell| &cell.portals);
        let named: BTreeSet<u32> = portals.filter_map(|portal| portal.door).collect();
        let idle = world.doors().iter().filter(|door| !named.contains(door));
        idle.copied().collect()
    }

    /// Which of some doors lie in an opening, though they may cover a part of it only; rising as they are.
    pub(crate) fn doors_in_openings(&self, world: &World, doors: &[u32]) -> Vec<u32> {
        let covers: Vec<_> = doors.iter().filter_map(|door| Cover::of(world, *door)).collect();
        let boxes = Boxes::of(covers.iter().map(|cover| cover.around(world, self.voxel_m)).collect());
        let mut lying = BTreeSet::new();
        for portal in self.cells.iter().flat_map(|cell| &cell.portals) {
            let around = Bounds::around(portal.polygon.iter().copied());
            for number in boxes.meeting(&around) {
                let cover = &covers[number as usize];
                if !lying.contains(&cover.door) && cover.lies_in(world, &portal.polygon, self.voxel_m) {
                    lying.insert(cover.door);
                }
            }
        }
        lying.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::{
        cells::{Portal, ViewCell, plan::Builder},
        source::Role,
    };

    /// A leaf 1 m wide and 2 m high that stands at a place, turned about the vertical: its corners, or a gable's.
    fn outline([x, z]: [f32; 2], turned: f32, gable: bool) -> Vec<Vec3> {
        let (sin, cos) = turned.sin_cos();
        let at = |along: f32, y: f32| Vec3::new(x + cos * along, y, z - sin * along);
        let mut corners = vec![at(-0.5, 0.0), at(0.5, 0.0), at(0.5, 2.0), at(-0.5, 2.0)];
        if gable {
            corners[2] = at(0.0, 2.6);
            corners.pop();
        }
        corners
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn an_opening_has_the_door_that_asking_each_door_finds(
            doors in prop::collection::vec((0u8..5, 0u8..5, 0.0..3.0f32, any::<bool>()), 1..20),
            askew in 0.0..0.08f32,
            grown in 0.97..1.1f32,
        ) {
            let mut builder = Builder::default();
            let mut graph = CellGraph { voxel_m: 1e-3, ..CellGraph::default() };
            let mut cell = ViewCell::of_box(Bounds { min: [0.0; 3], max: [20.0; 3] });
            for (x, z, turned, gable) in &doors {
                let at = [x, z].map(|i| 1.5 * f32::from(*i));
                let corners = outline(at, *turned, *gable);
                let indices = (2..corners.len() as u32).flat_map(|i| [0, i - 1, i]).collect();
                let door = builder.mesh("door:d", corners.iter().map(Vec3::to_array).collect(), indices);
                builder.scene.objects[door as usize].role = Role::Door;
                let middle = Vec3::new(at[0], 1.0, at[1]);
                let corner = |p: Vec3| (middle + grown * (p - middle)).as_dvec3().to_array();
                cell.portals.push(Portal {
                    to: 0,
                    polygon: outline(at, turned + askew, *gable).into_iter().map(corner).collect(),
                    door: None,
                });
            }
            graph.cells.push(cell);
            let world = World::new(&builder.scene).unwrap();
            graph.name_doors(&world);
            let covers: Vec<_> = world.doors().iter().filter_map(|door| Cover::of(&world, *door)).collect();
            for portal in &graph.cells[0].portals {
                let closes = |cover: &&Cover| portal.polygon.iter().all(|corner| cover.holds(&world, *corner, graph.voxel_m));
                prop_assert_eq!(portal.door, covers.iter().find(closes).map(|cover| cover.door));
            }
        }
    }
}
