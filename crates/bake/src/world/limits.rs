//! How large may a world be?

use belvedere_scene::Bounds;
use glam::DVec3;

use super::copies::Once;
use super::flatten::used_points;
use crate::source::{SourceModel, SourceScene};

/// The largest number of triangles in memory: at about 200 bytes each, what a large machine holds.
pub const MAX_TRIANGLES: usize = 64 << 20;
/// The largest number of triangles with all copies of models that are held once: what numbers of 32 bits name.
pub const MAX_PLACED_TRIANGLES: usize = u32::MAX as usize;
/// The largest distance of a vertex from the middle of the scene. Beyond it `f32` could not tell walls apart.
pub const MAX_REACH_M: f64 = 1e9;
/// The least size of a scene that has any. What is found small in one of them has faces whose areas `f32` can still square.
pub const MIN_SIZE_M: f64 = 1e-4;

/// Why a scene cannot be asked for visibility.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// No usual memory would suffice.
    #[error(
        "the scene has {count} triangles, those of models that stand in many places counted once; at most {MAX_TRIANGLES} are possible: bake it in parts"
    )]
    TooManyTriangles {
        /// How many there are.
        count: usize,
    },
    /// They could not be numbered.
    #[error(
        "the scene has {count} triangles with all its instances, at most {MAX_PLACED_TRIANGLES} are possible: bake it in parts"
    )]
    TooManyCopies {
        /// How many there are.
        count: usize,
    },
    /// Shares of its size would be zero.
    #[error("the scene is {size_m:e} m large, at least {MIN_SIZE_M:e} m are needed: scale it up")]
    TooSmall {
        /// Its longest edge.
        size_m: f64,
    },
    /// Coordinates would lose all precision.
    #[error(
        "object {object} (`{node}`) reaches {reach_m:e} m from the middle of the scene, at most {MAX_REACH_M:e} m are possible"
    )]
    TooLarge {
        /// Index of the object.
        object: usize,
        /// The name of its node.
        node: String,
        /// How far it reaches.
        reach_m: f64,
    },
    /// Places would be rounded away.
    #[error(
        "object {object} (`{node}`) reaches {reach_m:e} m from the origin, where numbers of single precision are 64 m apart; at \
         most {MAX_REACH_M:e} m are possible: move the scene to its origin"
    )]
    TooFar {
        /// Index of the object.
        object: usize,
        /// The name of its node.
        node: String,
        /// The largest of its coordinates.
        reach_m: f64,
    },
}

/// Whether a scene is small enough when these models are held once.
pub(super) fn check_size(scene: &SourceScene, once: &Once) -> Result<(), WorldError> {
    let triangles = |model: usize| scene.models[model].triangle_count();
    let flat = scene.objects.iter().filter(|object| !once.places(object));
    let held = (0..scene.models.len()).filter(|model| once.0[*model]).map(triangles);
    let count = flat.map(|object| triangles(object.model)).sum::<usize>() + held.sum::<usize>();
    if count > MAX_TRIANGLES {
        return Err(WorldError::TooManyTriangles { count });
    }
    check_placed(scene)
}

/// Whether the triangles of all objects can be numbered, which is quick to say.
pub(crate) fn check_placed(scene: &SourceScene) -> Result<(), WorldError> {
    let count = scene.placed_triangles();
    if count > MAX_PLACED_TRIANGLES {
        return Err(WorldError::TooManyCopies { count });
    }
    Ok(())
}

/// Whether all objects lie where numbers of single precision tell their places apart: no corner of the box around an object's model has a
/// larger coordinate than may be.
pub(crate) fn check_place(scene: &SourceScene) -> Result<(), WorldError> {
    let points =
        |model: &SourceModel| Bounds::around(model.primitives.iter().flat_map(used_points).map(|p| p.map(f64::from)));
    let bounds: Vec<Bounds> = scene.models.iter().map(points).collect();
    for (object, placed) in scene.objects.iter().enumerate() {
        let around = &bounds[placed.model];
        if around.is_empty() {
            continue;
        }
        let corners = around
            .corners()
            .map(|corner| placed.world_from_object.transform_point3(DVec3::from(corner)));
        let reach_m = corners
            .into_iter()
            .map(|corner| corner.abs().max_element())
            .fold(0.0, f64::max);
        if reach_m > MAX_REACH_M {
            return Err(WorldError::TooFar {
                object,
                node: placed.source_node.clone(),
                reach_m,
            });
        }
    }
    Ok(())
}

/// Whether a scene is large enough, or one point.
pub(super) fn check_extent(bounds: Bounds) -> Result<(), WorldError> {
    if bounds.is_empty() {
        return Ok(());
    }
    let size_m = bounds.size_m().into_iter().fold(0.0, f64::max);
    if size_m > 0.0 && size_m < MIN_SIZE_M {
        return Err(WorldError::TooSmall { size_m });
    }
    Ok(())
}

/// Whether nothing of a scene is too far from its middle.
pub(super) fn check_reach(scene: &SourceScene, object_bounds: &[Bounds], origin: DVec3) -> Result<(), WorldError> {
    for (object, b) in object_bounds.iter().enumerate().filter(|(_, b)| !b.is_empty()) {
        let corners = b.corners().map(|c| (DVec3::from(c) - origin).length());
        let reach_m = corners.into_iter().fold(0.0, f64::max);
        if !reach_m.is_finite() || reach_m > MAX_REACH_M {
            return Err(WorldError::TooLarge {
                object,
                node: scene.objects[object].source_node.clone(),
                reach_m,
            });
        }
    }
    Ok(())
}
