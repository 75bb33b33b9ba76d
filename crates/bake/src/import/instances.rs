//! Where do the instances of a node stand? `EXT_mesh_gpu_instancing`: one transform for each element of its accessors.

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::accessors::Accessor;
use super::document::Item;
use super::error::{Read, flaw};
use super::local::unit;
use super::reader::Reader;

/// The transforms of a node's instances, each relative to the node; `None` when the node is not instanced.
pub(super) struct Instances {
    /// How many there are.
    pub(super) count: usize,
    translations: Option<Accessor>,
    rotations: Option<Accessor>,
    scales: Option<Accessor>,
}

impl Instances {
    /// Opens the instances of a node.
    pub(super) fn open(reader: &mut Reader, node: &Item) -> Read<Option<Self>> {
        let Some(extension) = node.extension("EXT_mesh_gpu_instancing") else {
            return Ok(None);
        };
        let attributes = extension.needed("attributes")?;
        let mut open = |key: &str, components: usize| -> Read<Option<Accessor>> {
            let Some(index) = attributes.index(key)? else {
                return Ok(None);
            };
            let accessor = reader.accessor(index)?;
            if accessor.layout.components != components {
                return flaw(
                    "instances of the wrong type: not drawn",
                    format!("{}/{key}", attributes.place),
                );
            }
            Ok(Some(accessor))
        };
        let translations = open("TRANSLATION", 3)?;
        let rotations = open("ROTATION", 4)?;
        let scales = open("SCALE", 3)?;
        let counts = || {
            [&translations, &rotations, &scales]
                .into_iter()
                .flatten()
                .map(|a| a.count)
        };
        let Some(count) = counts().min() else {
            return flaw("instances without transforms: not drawn", attributes.place);
        };
        if counts().any(|c| c != count) {
            reader
                .defects
                .note("instances with unequal lists: the shortest counts", 1, || {
                    attributes.place.clone()
                });
        }
        Ok(Some(Self {
            count,
            translations,
            rotations,
            scales,
        }))
    }

    /// Places instance `index` in the space of its node.
    pub(super) fn node_from_instance(&self, index: usize) -> DMat4 {
        let vector = |a: &Option<Accessor>, rest: DVec3| {
            a.as_ref()
                .map_or(rest, |a| DVec3::from_array(a.floats::<3>(index).map(f64::from)))
        };
        let rotation = self.rotations.as_ref().map_or(DQuat::IDENTITY, |a| {
            unit(DQuat::from_vec4(DVec4::from_array(a.floats::<4>(index).map(f64::from))))
        });
        DMat4::from_scale_rotation_translation(
            vector(&self.scales, DVec3::ONE),
            rotation,
            vector(&self.translations, DVec3::ZERO),
        )
    }
}
