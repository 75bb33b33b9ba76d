//! How does a node stand in its parent? By a matrix, or by a scale, a rotation and a translation, which animations change.

use glam::{DMat4, DQuat, DVec3};

use super::document::Item;
use super::error::{Read, flaw};

/// The transform that a node states: a matrix, or these in its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Local {
    pub(super) matrix: Option<DMat4>,
    pub(super) translation: DVec3,
    /// Of length one.
    pub(super) rotation: DQuat,
    pub(super) scale: DVec3,
}

impl Local {
    /// Reads it.
    pub(super) fn of(node: &Item) -> Read<Self> {
        if let Some(numbers) = node.numbers::<16>("matrix")? {
            return Ok(Self {
                matrix: Some(affine(DMat4::from_cols_array(&numbers), node)?),
                translation: DVec3::ZERO,
                rotation: DQuat::IDENTITY,
                scale: DVec3::ONE,
            });
        }
        let rotation = node.numbers("rotation")?.map_or(DQuat::IDENTITY, DQuat::from_array);
        Ok(Self {
            matrix: None,
            translation: node.numbers("translation")?.map_or(DVec3::ZERO, DVec3::from_array),
            rotation: unit(rotation),
            scale: node.numbers("scale")?.map_or(DVec3::ONE, DVec3::from_array),
        })
    }

    /// The same as one matrix.
    pub(super) fn parent_from_node(&self) -> DMat4 {
        let Self {
            matrix,
            translation,
            rotation,
            scale,
        } = *self;
        matrix.unwrap_or_else(|| DMat4::from_scale_rotation_translation(scale, rotation, translation))
    }
}

/// A matrix whose bottom row is that of an affine transform.
fn affine(matrix: DMat4, node: &Item) -> Read<DMat4> {
    let bottom = matrix.row(3);
    // Exporters that multiply matrices in single precision leave a little in the bottom row.
    if (bottom - glam::DVec4::W).abs().max_element() > 1e-3 {
        return flaw(
            "node whose matrix is not affine: left out with all below it",
            format!("{}/matrix", node.place),
        );
    }
    let column = |c: glam::DVec4, w: f64| c.truncate().extend(w);
    Ok(DMat4::from_cols(
        column(matrix.x_axis, 0.0),
        column(matrix.y_axis, 0.0),
        column(matrix.z_axis, 0.0),
        column(matrix.w_axis, 1.0),
    ))
}

/// A rotation of length one; one without a direction turns nothing.
pub(super) fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 0.0 && length.is_finite() {
        DQuat::from_vec4(glam::DVec4::from(rotation) / length)
    } else {
        DQuat::IDENTITY
    }
}
