//! Which poses does a skinned mesh go through whose impostor is to move? Its skin, at equidistant moments of an animation.

use std::collections::BTreeMap;

use belvedere_scene::impostor::Wish;
use glam::{DMat4, DVec3};

use super::ImportError;
use super::animation::Movement;
use super::impostor::Asked;
use super::nodes::{Hierarchy, PlacedNode};
use super::primitives::ReadPrimitive;
use super::reader::Reader;
use super::skin::Skin;
use crate::source::{Primitive, SourceModel};

/// What posing a vertex takes: its matrix, its position in f64, and what is kept of it.
const POSED_VERTEX_BYTES: usize = 400;

/// What the animations do, each sampled once for each number of frames; `None` for what is none.
#[derive(Default)]
pub(super) struct Movements(BTreeMap<(Option<String>, u32), Option<Movement>>);

/// A skinned mesh, at the node that asks for its frames.
pub(super) struct Skinned<'s> {
    pub(super) node: &'s PlacedNode,
    pub(super) skin: usize,
    pub(super) read: &'s [ReadPrimitive],
    /// Where the model's origin is in the world.
    pub(super) origin: DVec3,
}

/// What a node asks for, when it asks for frames.
pub(super) fn moving(node: &PlacedNode) -> Option<&Asked> {
    node.impostor.as_ref().filter(|asked| asked.wish.frames > 1)
}

impl Movements {
    /// Gives a model the poses that are asked for, and its stride. Where there are none it has one pose, and the reason is
    /// counted.
    pub(super) fn give(
        &mut self,
        model: &mut SourceModel,
        skinned: &Skinned<'_>,
        (reader, hierarchy): (&mut Reader, &Hierarchy),
    ) -> Result<(), ImportError> {
        let Some(asked) = moving(skinned.node) else {
            return Ok(());
        };
        let frames = asked.wish.frames;
        let key = (asked.animation.clone(), frames);
        if !self.0.contains_key(&key) {
            let sampled = Movement::sample(reader, hierarchy, (asked.animation.as_deref(), frames));
            let sampled = reader.settle(sampled)?;
            self.0.insert(key.clone(), sampled);
        }
        let Some(movement) = &self.0[&key] else { return Ok(()) };
        let mut poses = Vec::new();
        for worlds in &movement.worlds {
            let Some(pose) = pose(skinned, worlds, (reader, hierarchy))? else {
                return Ok(());
            };
            poses.push(pose);
        }
        model.poses = poses;
        model.impostor = model.impostor.map(|wish| Wish {
            stride: asked.stride(movement.duration_s),
            ..wish
        });
        Ok(())
    }
}

/// The mesh in one pose, relative to its origin.
fn pose(
    skinned: &Skinned<'_>,
    worlds: &[DMat4],
    (reader, hierarchy): (&mut Reader, &Hierarchy),
) -> Result<Option<Vec<Primitive>>, ImportError> {
    let place = &skinned.node.name;
    let vertices: usize = skinned.read.iter().map(|r| r.primitive.positions.len()).sum();
    reader.budget.claim(vertices, POSED_VERTEX_BYTES, || place.clone())?;
    let opened = Skin::open(reader, (hierarchy, &|position| worlds[position]), skinned.skin);
    let Some(skin) = reader.settle(opened)? else {
        return Ok(None);
    };
    let placed = skin.pose(skinned.read, Some(skinned.origin), (&mut reader.defects, place));
    Ok(reader.settle(placed)?.map(|placed| placed.primitives))
}
