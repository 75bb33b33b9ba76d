//! Which revision of a scene is current? The two mutable documents of the published tree.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{BlobName, Bounds, CellId, Revision, SceneName};

/// `/v1/scenes/index.json`: the scenes of this tree, by name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneList {
    /// Sorted by name.
    pub scenes: Vec<SceneSummary>,
}

/// One line of the list of scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    /// Its name in URLs.
    pub scene: SceneName,
    /// Its name for people.
    pub title: String,
    /// The current revision.
    pub revision: Revision,
    /// The box around its objects, metres.
    pub bounds: Bounds,
}

/// `/v1/scenes/{scene}/index.json`: the pointer. Moving it publishes a revision; moving it back is the undo.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pointer {
    /// The scene's name in URLs.
    pub scene: SceneName,
    /// Its name for people.
    pub title: String,
    /// The current revision.
    pub revision: Revision,
    /// The revision's manifest.
    pub manifest: BlobName,
    /// The box around its objects, metres.
    pub bounds: Bounds,
    /// Always `+Y`, as in glTF.
    pub up: String,
    /// Always `m`, as in glTF.
    pub unit: String,
    /// How many view cells there are.
    pub cells: u32,
    /// How many objects there are.
    pub objects: u32,
    /// How many models there are.
    pub models: u32,
    /// Triangles drawn when every object stands at level 0.
    pub triangles: u64,
    /// Sizes by name: `source` (the file that was baked), `published` (every blob of the revision once),
    /// `level0`, `coarsest`, `textures`, `records`.
    pub bytes: BTreeMap<String, u64>,
    /// Where one may start; at least one.
    pub viewpoints: Vec<Viewpoint>,
}

impl Pointer {
    /// The scene's line in the list of scenes.
    #[must_use]
    pub fn summary(&self) -> SceneSummary {
        SceneSummary {
            scene: self.scene.clone(),
            title: self.title.clone(),
            revision: self.revision,
            bounds: self.bounds,
        }
    }
}

/// A place to start from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// Its name for people.
    pub name: String,
    /// The eye, world space, metres.
    pub position: [f64; 3],
    /// Unit quaternion x, y, z, w; the identity looks along −Z with +Y up, as a glTF camera does.
    pub orientation: [f64; 4],
    /// The cell that holds it, or the nearest one.
    pub cell: CellId,
    /// Whether the author named no place to start from, and the bake chose this one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub made_up: bool,
}
