//! What of a model is superfluous?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.5: the generator without levels of detail cleans models up.

use crate::lod::LodSettings;
use crate::lod::collapse::SourceShapes;
use crate::lod::octree::{Locked, Octree};
use crate::source::SourceModel;

/// The same picture with less: each vertex and each shape once, no triangle without area, nothing that is not used.
///
/// Triangles without area become the line that they are drawn as, unless a triangle has that edge. Positions and
/// attributes stay bit for bit, but for −0, which becomes 0.
#[must_use]
pub fn clean(model: &SourceModel, settings: &LodSettings) -> SourceModel {
    let octree = Octree::new(&model.primitives, &Locked::default(), &settings.octree);
    let shapes = SourceShapes::new(&model.primitives, &settings.double_sided);
    SourceModel {
        name: model.name.clone(),
        primitives: shapes.collapse(&octree.clusters(0)).primitives,
        cut_positions: model.cut_positions.clone(),
        impostor: model.impostor,
        poses: model.poses.clone(),
        frames: model.frames.clone(),
        coarser: model.coarser.clone(),
        recipe: model.recipe.clone(),
        tie: model.tie,
    }
}
