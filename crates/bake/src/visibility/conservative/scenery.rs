//! What is there to be seen, and what hides it, ready for questions?

use std::sync::Arc;

use obvhs::bvh2::Bvh2;

use crate::{
    occluders::{Occluders, Region},
    visibility::{blocker::Blocker, segment},
    world::World,
};

/// This share of all objects may lie below the floor that things stand on: the ground itself, or what is below it.
const BELOW: f32 = 0.1;

/// All objects as boxes, and what hides them.
pub struct Scenery {
    /// What hides.
    pub blocker: Arc<Blocker>,
    /// The box around each object; `None` for one without geometry, which nobody sees.
    pub targets: Vec<Option<Region>>,
    pub(super) tree: Bvh2,
    /// Nearly all objects stand at or above this height, in metres.
    pub(super) floor_m: f32,
    /// Bodies of each object.
    pub(super) bodies_of: Vec<std::ops::Range<u32>>,
}

impl Scenery {
    /// Prepares a world for questions.
    #[must_use]
    pub fn of(world: &World) -> Self {
        Self::with(world, Occluders::of(world))
    }

    /// Prepares a world in which just these hide.
    #[must_use]
    pub fn with(world: &World, occluders: Occluders) -> Self {
        Self::new(occluders, Self::targets_of(world))
    }

    /// The box around each object of a world.
    #[must_use]
    pub fn targets_of(world: &World) -> Vec<Option<Region>> {
        let bounds = world.object_bounds().iter();
        bounds
            .map(|b| (!b.is_empty()).then(|| Region::around(world, b)))
            .collect()
    }

    /// Prepares occluders, whose bodies stand in the order of their objects, and the boxes of objects.
    #[must_use]
    pub fn new(occluders: Occluders, targets: Vec<Option<Region>>) -> Self {
        Self::behind(Arc::new(Blocker::new(occluders)), targets)
    }

    /// Prepares the boxes of objects, which are numbered as in what hides.
    pub(in crate::visibility) fn behind(blocker: Arc<Blocker>, targets: Vec<Option<Region>>) -> Self {
        let bodies = &blocker.occluders.bodies;
        let with_geometry = (0u32..)
            .zip(&targets)
            .filter_map(|(object, t)| Some((object, t.as_ref()?)));
        let tree = segment::numbered_tree(with_geometry.map(|(object, t)| (object, [t.min, t.max])), 0.0);
        let bodies_of = (0..targets.len() as u32)
            .map(|object| {
                let first = bodies.partition_point(|b| b.object < object) as u32;
                let end = bodies.partition_point(|b| b.object <= object) as u32;
                first..end
            })
            .collect();
        Self {
            blocker,
            floor_m: floor_m(&targets),
            targets,
            tree,
            bodies_of,
        }
    }
}

/// The height that all objects but the lowest [`BELOW`] stand at or above.
fn floor_m(targets: &[Option<Region>]) -> f32 {
    let mut bottoms: Vec<f32> = targets.iter().flatten().map(|target| target.min.y).collect();
    bottoms.sort_unstable_by(f32::total_cmp);
    bottoms
        .get((BELOW * bottoms.len() as f32) as usize)
        .copied()
        .unwrap_or(0.0)
}
