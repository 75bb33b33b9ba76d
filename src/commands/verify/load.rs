//! What does a published scene hold, as the oracle wants it? Each level 0 once, where every object stands, and the
//! record of each cell: read from the blobs, as a client reads them.

use std::collections::BTreeMap;

use anyhow::Context;
use belvedere_scene::{BlobName, CellId, ObjectId, Revision, SceneName, manifest::VisibilitySummary, pointer::Pointer};
use belvedere_verify::{
    check::Cell,
    glb,
    scene::{Model, Object, Scene},
};
use glam::DMat4;

use crate::{commands::output::no_such_cell, publish::data::DataFolder, published::SceneReader, store::BlobStore};

/// A published scene, ready to be checked.
pub(in crate::commands) struct Published {
    pub(in crate::commands) pointer: Pointer,
    pub(in crate::commands) visibility: VisibilitySummary,
    pub(in crate::commands) scene: Scene,
    pub(in crate::commands) cells: Vec<Cell>,
    /// The name of each object in the source.
    pub(in crate::commands) nodes: Vec<String>,
}

/// Reads the current revision of a scene, with one of its cells or all.
pub(in crate::commands) async fn published(
    data: &DataFolder,
    name: &SceneName,
    only: Option<CellId>,
) -> anyhow::Result<Published> {
    let _no_gc = data.lock_for_writing().await?;
    let Some(baked) = data.catalogue().baked(name).await? else {
        anyhow::bail!(unknown(data, name).await?);
    };
    read(data, baked.pointer, only).await
}

/// The same of any revision, in all of its cells; none when it is not kept.
pub(in crate::commands) async fn revision(
    data: &DataFolder,
    name: &SceneName,
    revision: Revision,
) -> anyhow::Result<Option<Published>> {
    let _no_gc = data.lock_for_writing().await?;
    match data.catalogue().pointer_of(name, revision).await? {
        Some(pointer) => Ok(Some(read(data, pointer, None).await?)),
        None => Ok(None),
    }
}

async fn read(data: &DataFolder, pointer: Pointer, only: Option<CellId>) -> anyhow::Result<Published> {
    let reader = SceneReader::of(&pointer, data.store().clone());
    let manifest = reader.manifest().await?;
    if let Some(cell) = only {
        let count = pointer.cells;
        anyhow::ensure!(cell.0 < count, no_such_cell(cell, count));
    }
    let mut models = Models::default();
    let (mut objects, mut nodes) = (Vec::new(), Vec::new());
    for id in (0..pointer.objects).map(ObjectId) {
        let lost = || format!("the scene's index does not lead to {id}");
        let info = reader.object_info(id).await?.with_context(lost)?;
        let level = info
            .levels
            .first()
            .with_context(|| format!("{id} has no level of detail"))?;
        objects.push(Object {
            id,
            model: models.position(data.store(), &level.url).await?,
            world_from_object: DMat4::from_cols_array(&info.transform),
            door: info.door,
            error_m: level.geometric_error_m,
        });
        nodes.push(info.source_node);
    }
    let mut cells = Vec::new();
    for id in (0..pointer.cells)
        .map(CellId)
        .filter(|id| only.is_none_or(|only| only == *id))
    {
        let lost = || format!("the scene's index does not lead to {id}");
        let record = reader.cell_record(id).await?.with_context(lost)?;
        cells.push(Cell::of(&record));
    }
    Ok(Published {
        visibility: manifest.visibility.clone(),
        scene: Scene::new(models.read, objects),
        cells,
        nodes,
        pointer,
    })
}

/// What to say of a scene that is not there.
async fn unknown(data: &DataFolder, name: &SceneName) -> anyhow::Result<String> {
    let known: Vec<_> = data
        .catalogue()
        .pointers()
        .await?
        .into_iter()
        .map(|p| p.scene.to_string())
        .collect();
    Ok(match &known[..] {
        [] => format!("there is no scene `{name}`, nor any other: bake one with `belvedere bake FILE --scene {name}`"),
        known => format!(
            "there is no scene `{name}` in this data folder; there is {}",
            known.join(", ")
        ),
    })
}

/// Every level 0 once.
#[derive(Default)]
struct Models {
    read: Vec<Model>,
    position: BTreeMap<BlobName, usize>,
}

impl Models {
    async fn position(&mut self, store: &BlobStore, name: &BlobName) -> anyhow::Result<usize> {
        if let Some(known) = self.position.get(name) {
            return Ok(*known);
        }
        let bytes = store.get(name).await?;
        let bytes = bytes.with_context(|| format!("blob {name} is not stored; publish the scene again"))?;
        let model = glb::read(&bytes).with_context(|| format!("blob {name} cannot be drawn"))?;
        self.read.push(model);
        self.position.insert(name.clone(), self.read.len() - 1);
        Ok(self.read.len() - 1)
    }
}
