//! What hides? Convex bodies inside closed things, and walls with their openings: a scene as a blocker of sight lines.
//!
//! Visible sets are proved from these, off line for every cell ([`crate::visibility`]) and on line for any region. Faces
//! that hide nothing (glass, open doors, culled backs) are in neither, so whatever is proved hidden is hidden in every
//! renderer.

mod body;
mod fill;
mod planes;
mod region;
mod solids;
mod stored;
mod wall;

pub(crate) use self::wall::Rectangle;
pub use self::{
    body::Body,
    region::Region,
    stored::StoredError,
    wall::{Tolerance, Wall, Way},
};
use crate::world::World;

/// A blocker of sight lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Occluders {
    /// Convex bodies, by object.
    pub bodies: Vec<Body>,
    /// Walls, largest first, then the leaves of doors.
    pub walls: Vec<Wall>,
    /// What counts as coplanar and as no hole.
    pub tolerance: Tolerance,
}

/// Bodies are this share of the scene's diagonal smaller than what they lie in.
pub(crate) const MARGIN: f32 = 2e-6;
/// Gaps in walls narrower than this share of the scene's diagonal are closed: a tenth of a millimetre in a museum.
const HOLE: f32 = 2e-6;

/// A closed door fills its opening: gaps around the leaf up to this share of its longest edge are closed, six
/// centimetres around a common door.
pub(crate) const DOOR_GAP: f32 = 0.03;

impl Occluders {
    /// The leaves of doors, which stand last among the walls.
    pub(crate) fn leaves(&self) -> &[Wall] {
        &self.walls[self.walls.partition_point(|wall| wall.door.is_none())..]
    }

    /// Adds bodies that an author drew.
    pub fn add(&mut self, bodies: Vec<Body>) {
        self.bodies.extend(bodies);
        self.bodies.sort_by_key(|body| body.object);
    }

    /// Finds what hides in a world.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let diagonal_m = world.bounds().diagonal_m() as f32;
        let tolerance = Tolerance {
            plane_m: 0.01 * HOLE * diagonal_m,
            hole_m: HOLE * diagonal_m,
        };
        // f32 cannot place points of a large scene more exactly than this.
        let plane_m = tolerance.plane_m.max(2.0 * f32::EPSILON * diagonal_m);
        let tolerance = Tolerance { plane_m, ..tolerance };
        let leaves = world.doors().iter().map(|door| {
            let bounds = &world.object_bounds()[*door as usize];
            let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
            Wall::leaf(*door, min, max, DOOR_GAP * (max - min).max_element())
        });
        let mut walls = planes::walls(world, tolerance);
        walls.extend(leaves);
        Self {
            bodies: solids::bodies(world, MARGIN * diagonal_m),
            walls,
            tolerance,
        }
    }
}
