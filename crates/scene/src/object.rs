//! What does a client know of an object before it has any geometry?
//!
//! Objects and models travel in chunks of their own ([`ObjectChunk`], [`ModelChunk`]), so that what many objects share travels
//! once. Joining an entry with its model gives an [`ObjectInfo`], the self-contained form that the query routes answer with.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{BlobName, Bounds, ModelId, ObjectId, impostor::Impostor, rung::SmoothLod, sound};

/// One discrete level of detail of a model. Level 0 is the finest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Its number, which is also its position in the list.
    pub level: u32,
    /// Its GLB.
    pub url: BlobName,
    /// Size of the GLB as stored, without content encoding. Textures are separate, see `textures`.
    pub bytes: u64,
    /// Triangles in it.
    pub triangles: u64,
    /// No point of the source surface is farther from this level's surface, nor the reverse. In a [`Model`]: units of
    /// the model's own space; in an [`ObjectInfo`]: metres in the world.
    pub geometric_error_m: f64,
    /// From this distance (eye to bounding box) on, the level is good enough: its error covers at most
    /// [`SCREEN_ERROR_PX`] pixels. Space as for `geometric_error_m`.
    pub switch_distance_m: f64,
    /// Textures that the GLB refers to, each an immutable object of its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub textures: Vec<TextureRef>,
    /// The same GLB among others that the same cells see.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<PackRef>,
}

/// Where a GLB stands in a pack: an immutable object (`.pack`) that is nothing but GLBs, one after the other.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackRef {
    /// The pack.
    pub url: BlobName,
    /// Its size as stored.
    pub bytes: u64,
    /// Where in it the GLB starts.
    pub from: u64,
}

/// A texture that a level refers to.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TextureRef {
    /// The picture.
    pub url: BlobName,
    /// Its size as stored.
    pub bytes: u64,
}

/// The screen error that switching distances are made for, in pixels.
pub const SCREEN_ERROR_PX: f64 = 1.0;
/// The picture height that switching distances are made for, in pixels.
pub const SCREEN_HEIGHT_PX: f64 = 1080.0;
/// The vertical view angle that switching distances are made for, in degrees.
pub const VIEW_ANGLE_DEG: f64 = 60.0;

/// The distance from which an error of `geometric_error_m` covers at most [`SCREEN_ERROR_PX`] pixels
/// (thesis §6.3: `d = s / (error · 2·tan(α/2))`; here the error is a length instead of an octree edge).
#[must_use]
pub fn switch_distance_m(geometric_error_m: f64) -> f64 {
    let screen_error = SCREEN_ERROR_PX / SCREEN_HEIGHT_PX;
    geometric_error_m / (screen_error * 2.0 * (VIEW_ANGLE_DEG.to_radians() / 2.0).tan())
}

/// Unique geometry with its levels, shared by every object that uses it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Finest first; never empty.
    #[serde(deserialize_with = "sound::read_levels")]
    pub levels: Vec<Level>,
    /// The same in one stream of which every beginning is a coarser mesh, where that pays.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "sound::read")]
    pub smooth: Option<SmoothLod>,
    /// Pictures of it for far away, where its author asks for them.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "sound::read")]
    pub impostor: Option<Impostor>,
    /// The rules that it has grown from, where it can be grown alone: for clients that know the language.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "sound::read")]
    pub procedural: Option<Procedural>,
}

/// Rules from which a model can be grown instead of being downloaded (`docs/PROCEDURAL.md`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Procedural {
    /// The rules (`.dcg`), the same object for every model that is made of them.
    pub rules: BlobName,
    /// Their size as stored.
    pub rules_bytes: u64,
    /// What they import, by the names that they give it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub imports: BTreeMap<String, Import>,
    /// The part of them; absent for the file as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// A number or a list for each parameter.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Where random numbers come from.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub seed: u32,
}

/// A file that rules import.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Import {
    /// Its text (`.dcg`).
    pub url: BlobName,
    /// Its size as stored.
    pub bytes: u64,
}

fn is_zero(seed: &u32) -> bool {
    *seed == 0
}

/// A placed instance of a model, as a chunk lists it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectEntry {
    /// Its id in this revision.
    pub object: ObjectId,
    /// The name of its node in the source, or `node[i]`.
    pub source_node: String,
    /// Which part of a mesh that was split spatially, 0 when it was not.
    pub part: u32,
    /// Its box in the world, metres.
    pub bounds: Bounds,
    /// `world_from_object`, column-major, as glTF writes matrices.
    pub transform: [f64; 16],
    /// Largest axis scale of `transform`: multiplies the model's errors into metres.
    pub scale: f64,
    /// The geometry.
    pub model: ModelId,
    /// Whether it may move.
    pub mover: bool,
    /// Whether it is a door.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub door: bool,
}

/// A run of objects: an immutable object (`.json`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectChunk {
    /// With rising ids, without gaps.
    pub objects: Vec<ObjectEntry>,
}

/// A run of models: an immutable object (`.json`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelChunk {
    /// Ids without gaps.
    #[serde(deserialize_with = "sound::read_models")]
    pub models: BTreeMap<ModelId, Model>,
}

/// All objects of a small world, with all models.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Whole {
    /// With rising ids, without gaps.
    pub objects: Vec<ObjectEntry>,
    /// Every model that they use.
    #[serde(deserialize_with = "sound::read_models")]
    pub models: BTreeMap<ModelId, Model>,
}

impl ObjectChunk {
    /// The entry of an object, when it is in this chunk.
    #[must_use]
    pub fn entry(&self, object: ObjectId) -> Option<&ObjectEntry> {
        let first = self.objects.first()?.object.0;
        self.objects
            .get(object.0.checked_sub(first)? as usize)
            .filter(|entry| entry.object == object)
    }
}

/// Everything a client needs to place an object and to choose what to download of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectInfo {
    /// Its id in this revision.
    pub object: ObjectId,
    /// The name of its node in the source, or `node[i]`.
    pub source_node: String,
    /// Which part of a mesh that was split spatially.
    pub part: u32,
    /// Its box in the world, metres.
    pub bounds: Bounds,
    /// `world_from_object`, column-major.
    pub transform: [f64; 16],
    /// The geometry.
    pub model: Option<ModelId>,
    /// The rules that the geometry has grown from; null where there are none, or it cannot be grown alone.
    #[serde(default, deserialize_with = "sound::read")]
    pub procedural: Option<Procedural>,
    /// Whether it may move.
    pub mover: bool,
    /// Whether it is a door.
    #[serde(default)]
    pub door: bool,
    /// Its levels, finest first, errors and distances in metres.
    #[serde(deserialize_with = "sound::read")]
    pub levels: Vec<Level>,
    /// Its smooth LOD, errors in metres; null where there is none.
    #[serde(default, deserialize_with = "sound::read")]
    pub smooth: Option<SmoothLod>,
    /// Its impostor, errors and distances in metres, middle and radius in the model's space; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "sound::read")]
    pub impostor: Option<Impostor>,
}

impl ObjectInfo {
    /// Joins an entry with its model: errors and distances become metres.
    #[must_use]
    pub fn join(entry: &ObjectEntry, model: &Model) -> Self {
        let in_metres = |level: &Level| Level {
            geometric_error_m: level.geometric_error_m * entry.scale,
            switch_distance_m: level.switch_distance_m * entry.scale,
            ..level.clone()
        };
        Self {
            object: entry.object,
            source_node: entry.source_node.clone(),
            part: entry.part,
            bounds: entry.bounds,
            transform: entry.transform,
            model: Some(entry.model),
            procedural: model.procedural.clone(),
            mover: entry.mover,
            door: entry.door,
            levels: model.levels.iter().map(in_metres).collect(),
            smooth: model.smooth.as_ref().map(|smooth| smooth.scaled(entry.scale)),
            impostor: model.impostor.as_ref().map(|impostor| impostor.scaled(entry.scale)),
        }
    }
}
