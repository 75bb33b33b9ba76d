//! What may be seen from a place that is no view cell? Asked on line, of the occluders that the revision holds.
//!
//! The ε-superset of Cohen-Or & Zadicario (1998, *Introduction*): whoever stays inside the region needs nothing else.

use belvedere_bake::{
    frame::Frame,
    occluders::{Region, Stored},
    visibility::conservative::{ConservativeSettings, Observer, Scenery},
};
use belvedere_scene::{Bounds, ObjectId, convex::HalfSpace};
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
