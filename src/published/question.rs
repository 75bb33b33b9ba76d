//! What may be seen from a place that is no view cell? Asked on line, of the occluders that the revision holds.
//!
//! The ε-superset of Cohen-Or & Zadicario (1998, *Introduction*): whoever stays inside the region needs nothing else.

use belvedere_bake::{
    frame::Frame,
    occluders::{Region, Stored},
    visibility::conservative::{ConservativeSettings, Observer, Scenery},
};
use belvedere_scene::{Bounds, ObjectId, convex::HalfSpace, record::Hull};
use glam::DVec3;
use serde::Serialize;

/// What hides in one revision.
pub struct Blockers {
    pub(super) scenery: Scenery,
    /// The frame of its positions …
    pub(super) frame: Frame,
    /// … and the place in that frame that they are relative to.
    pub(super) origin: DVec3,
    doors: Vec<u32>,
}

/// A region and the doors that are closed.
#[derive(Debug, Clone)]
pub struct Question {
    /// The eye is somewhere in here, in world space, metres.
    pub eye: Bounds,
    /// No others are closed.
    pub closed: Vec<ObjectId>,
}

/// An object that cannot be proved hidden.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotHidden {
    /// The object.
    pub object: ObjectId,
    /// A box around it, rounded outwards; wider than need be where the frame is turned.
    pub bounds: Bounds,
    /// From the region to that box, metres.
    pub distance_m: f32,
    /// About what that box fills, seen from the middle of the region, steradians.
    pub solid_angle_sr: f32,
}

/// The door that is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoDoor(pub ObjectId);

impl Blockers {
    /// Reads what the bake stored.
    ///
    /// # Errors
    /// Says what is wrong with it.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let Stored { scenery, frame, origin } = Scenery::decode(bytes).map_err(|error| error.to_string())?;
        Ok(Self {
            doors: scenery.blocker.doors(),
            scenery,
            frame,
            origin,
        })
    }

    /// The region around a convex part of world space, what half-spaces leave of a box, rounded outwards. Cells that were
    /// cut in the frame are no smaller than that.
    #[must_use]
    pub fn region(&self, bounds: &Bounds, planes: &[HalfSpace]) -> Region {
        let bounds = self.frame.box_around(bounds, planes);
        let [min, max] = [bounds.min, bounds.max].map(|p| (DVec3::from(p) - self.origin).as_vec3());
        Region::rounded(min, max)
    }

    /// The region that a cell is, of which these are the corners: a box of the frame in which it was cut, or what its author drew.
    #[must_use]
    pub fn region_of(&self, (bounds, planes): (&Bounds, &[HalfSpace]), hull: &Hull) -> Region {
        const SLACK: f32 = 1e-4;
        let around = self.region(bounds, planes);
        if hull.points.len() < 4 {
            return around;
        }
        let relative = |p: DVec3| (self.frame.enter(p) - self.origin).as_vec3();
        let slack_m = SLACK * (around.max - around.min).max_element();
        let is_of_box = |p: &[f64; 3]| {
            let corner = relative(DVec3::from(*p));
            let off_m = (corner - around.min).abs().min((corner - around.max).abs());
            off_m.max_element() <= slack_m
        };
        if hull.points.len() == 8 && hull.points.iter().all(is_of_box) {
            around
        } else {
            around.hull_within(planes, &hull.points, relative)
        }
    }

    /// Everything that may be seen from somewhere in the region, largest solid angle first, then by id. Takes
    /// milliseconds of CPU.
    ///
    /// # Errors
    /// When a door is none.
    pub fn not_hidden(&self, question: &Question) -> Result<Vec<NotHidden>, NoDoor> {
        let is_door = |object: &&ObjectId| self.doors.binary_search(&object.0).is_ok();
        if let Some(other) = question.closed.iter().find(|object| !is_door(object)) {
            return Err(NoDoor(*other));
        }
        let closed: Vec<_> = question.closed.iter().map(|door| door.0).collect();
        let eye = self.region(&question.eye, &[]);
        let mut observer = Observer::new(&self.scenery, ConservativeSettings::ON_LINE);
        observer.close(&closed);
        let visible = observer.visible(&eye, &[]);
        let described = visible.into_iter().filter_map(|object| {
            let target = self.scenery.targets[object as usize].as_ref()?;
            Some(NotHidden {
                object: ObjectId(object),
                bounds: self.absolute([target.min, target.max]),
                distance_m: target.distance_m(&eye),
                solid_angle_sr: target.solid_angle_sr(eye.center()),
            })
        });
        let mut found: Vec<_> = described.collect();
        found.sort_by(|a, b| {
            b.solid_angle_sr
                .total_cmp(&a.solid_angle_sr)
                .then(a.object.cmp(&b.object))
        });
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use belvedere_bake::{city::City, world::World};
    use glam::Vec3;

    use super::*;

    fn blockers(frame: Frame) -> Blockers {
        let city = City {
            blocks: [2, 2],
            ..City::DENSE
        };
        let world = World::new(&city.scene()).unwrap();
        Blockers {
            scenery: Scenery::of(&world),
            frame,
            origin: DVec3::new(5.0, 0.0, 5.0),
            doors: Vec::new(),
        }
    }

    /// A cell that a prism of 3 m over some corners is, in world space.
    fn cell(frame: Frame, corners: &[[f64; 2]]) -> (Bounds, Vec<HalfSpace>, Hull) {
        let at = |y: f64| {
            corners
                .iter()
                .map(move |[x, z]| frame.leave(DVec3::new(*x, y, *z)).to_array())
        };
        let points: Vec<_> = at(0.0).chain(at(3.0)).collect();
        let normals = [DVec3::X, DVec3::Z].map(|normal| frame.leave(normal));
        let planes = normals.iter().flat_map(|normal| {
            let heights = points.iter().map(|p| normal.dot(DVec3::from(*p)));
            let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
                [low.min(at), high.max(at)]
            });
            [[normal.x, 0.0, normal.z, high], [-normal.x, 0.0, -normal.z, -low]]
        });
        let bounds = Bounds::around(points.iter().copied());
        let planes = planes.collect();
        let faces = Vec::new();
        (bounds, planes, Hull { points, faces })
    }

    #[test]
    fn a_cell_is_asked_from_as_it_was_cut_or_drawn_not_from_the_box_around_it() {
        for frame in [Frame::SOURCE, Frame::of_half_tangent(0.2).unwrap()] {
            let blockers = blockers(frame);
            let (bounds, planes, hull) = cell(frame, &[[1.0, 1.0], [4.0, 1.0], [4.0, 7.0], [1.0, 7.0]]);
            let region = blockers.region_of((&bounds, &planes), &hull);
            assert!(region.points.is_empty(), "{region:?}");
            let size = region.max - region.min;
            assert!((size - Vec3::new(3.0, 3.0, 6.0)).abs().max_element() < 1e-4, "{size}");
            let rhomb = [[0.0, 4.0], [3.0, 0.0], [6.0, 4.0], [3.0, 8.0]];
            let wedge = [[0.0, 0.0], [6.0, 0.0], [0.0, 6.0]];
            for corners in [&rhomb[..], &wedge] {
                let (bounds, planes, hull) = cell(frame, corners);
                let region = blockers.region_of((&bounds, &planes), &hull);
                assert_eq!(region.points.len(), 2 * corners.len());
                let around = blockers.region(&bounds, &planes);
                assert!((region.min - around.min).abs().max_element() < 1e-4);
                assert!((region.max - around.max).abs().max_element() < 1e-4);
            }
        }
    }
}
