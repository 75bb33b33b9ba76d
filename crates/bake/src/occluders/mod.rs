//! What hides? Convex bodies inside closed things, and walls with their openings: a scene as a blocker of sight lines.
//!
//! Visible sets are proved from these, off line for every cell ([`crate::visibility`]) and on line for any region. Faces
//! that hide nothing (glass, open doors, culled backs) are in neither, so whatever is proved hidden is hidden in every
//! renderer.

mod body;
mod fill;
mod hiders;
mod leaf;
mod parts;
mod pieces;
mod planes;
mod region;
mod rest;
mod solids;
mod squares;
mod stored;
mod wall;

pub use self::{
    body::Body,
    hiders::Hiders,
    region::Region,
    stored::{Stored, StoredError},
    wall::{Tolerance, Wall, Way},
};
pub(crate) use self::{body::is_bottom, leaf::Frame as DoorFrame, wall::Rectangle};
use std::sync::Arc;

use glam::Vec3;

use crate::world::World;

/// A blocker of sight lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Occluders {
    /// Convex bodies, by object.
    pub bodies: Vec<Body>,
    /// Walls, then the leaves of doors.
    pub walls: Vec<Arc<Wall>>,
    /// What counts as coplanar and as no hole.
    pub tolerance: Tolerance,
}

/// Gaps in walls narrower than this share of the scene's diagonal are closed, and bodies are so much smaller on every side than
/// what they lie in: a tenth of a millimetre in a museum.
pub(crate) const HOLE: f32 = 2e-6;

/// Gaps between a closed door and what stands beside it are closed up to this share of its longest edge: six centimetres around a
/// common one.
pub(crate) const DOOR_GAP: f32 = 0.03;

/// A leaf fills its door when the diagonal of the one is at least this share of that of the other.
const FILLS: f32 = 0.9;

impl Occluders {
    /// Finds what hides in a world.
    #[must_use]
    pub fn of(world: &World) -> Self {
        Hiders::of(world, Vec::new()).occluders()
    }

    /// The leaves of doors, which stand last among the walls.
    pub(crate) fn leaves(&self) -> &[Arc<Wall>] {
        &self.walls[self.walls.partition_point(|wall| wall.door.is_none())..]
    }

    /// Doors that one sees through when they are closed, from one side at least.
    pub(crate) fn leaky_doors(&self) -> impl Iterator<Item = u32> {
        let leaky = |leaves: &&[Arc<Wall>]| {
            let [min, max] = around(leaves);
            let fills = |leaf: &Arc<Wall>| {
                let [low, high] = leaf.around();
                (high - low).length() >= FILLS * (max - min).length()
            };
            let mut ways = [Way::Against, Way::Along].into_iter();
            let is_filled = |leaf: &Arc<Wall>, way: Way| {
                let lengths = leaf.lines.iter().map(|lines| lines[lines.len() - 1] - lines[0]);
                leaf.is_filled(way, DOOR_GAP * lengths.fold(0.0, f32::max))
            };
            !ways.all(|way| leaves.iter().any(|leaf| is_filled(leaf, way) && fills(leaf)))
        };
        let doors = self.leaves().chunk_by(|a, b| a.door == b.door);
        doors.filter(leaky).filter_map(|leaves| leaves[0].door)
    }
}

/// The box around some walls: the lowest corner and the highest.
fn around(walls: &[Arc<Wall>]) -> [Vec3; 2] {
    let boxes = walls.iter().map(|wall| wall.around());
    boxes.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[min, max], [low, high]| {
        [min.min(low), max.max(high)]
    })
}

impl Tolerance {
    /// The width of the scene that it belongs to, in metres: its diagonal, rounded up.
    #[must_use]
    pub fn scale_m(&self) -> f32 {
        self.hole_m / HOLE
    }
}

/// What counts as coplanar and as no hole in a world.
pub(crate) fn tolerance_of(world: &World) -> Tolerance {
    let scale_m = world.scale_m();
    let plane_m = 0.01 * HOLE * scale_m;
    Tolerance {
        // f32 cannot place points of a large scene more exactly than this.
        plane_m: plane_m.max(2.0 * f32::EPSILON * scale_m),
        hole_m: HOLE * scale_m,
    }
}
