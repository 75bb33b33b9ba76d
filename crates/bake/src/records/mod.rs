//! What is published? Writes the immutable objects of one revision: levels, pictures, object chunks, cell records and
//! the manifest above them (`docs/FORMAT.md`). Everything goes to a [`BlobSink`]; nothing is current until the caller
//! moves the scene's pointer.

mod cells;
#[cfg(test)]
mod city_tests;
mod impostors;
mod models;
mod outlook;
mod packs;
mod pages;
#[cfg(test)]
mod parts_tests;
mod populations;
mod rules;
mod settle;
mod sink;
mod sizes;
mod smooth;
mod standing;
mod starts;
mod viewpoints;

use std::collections::BTreeMap;

use belvedere_scene::{
    BlobName, Bounds, ModelId, ObjectId, Revision, SceneName,
    foliage::Foliage,
    index::{CHUNK_ENTRIES, CHUNK_MODELS, CellChunk, CellEntry},
    manifest::{Counts, FORMAT, FoliageRef, Manifest, OccludersRef, RecordSizes, VisibilitySummary},
    object::{Model, ModelChunk, ObjectChunk, ObjectEntry, Whole},
    pointer::Pointer,
};

pub use self::{
    models::Models,
    sink::{BlobSink, SinkError},
};
use self::{
    models::{UniqueBytes, coarsest},
    sink::Ledger,
};
use crate::{
    BakeError,
    cells::CellGraph,
    frame::Frame,
    growable::Growable,
    progress::{Progress, Stage},
    source::{Role, SourceObject, SourceScene},
    visibility::{Visibility, conservative::Scenery},
    world::World,
};

/// Up to this many bytes of level 0, textures included, a world is small: its manifest lists every object and clients
/// load all of them. One answer of this size costs about as much as the round trips that cells would.
pub const WHOLE_WORLD_BYTES: u64 = 256 << 10;
/// A manifest never lists more objects than this.
const WHOLE_WORLD_OBJECTS: usize = 512;

/// What the earlier stages found out.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// The source, objects in the order of their ids.
    pub scene: &'a SourceScene,
    /// Its name for people.
    pub title: &'a str,
    /// Size of the source files.
    pub source_bytes: u64,
    /// The same scene flattened, in its frame.
    pub world: &'a World,
    /// The frame.
    pub frame: Frame,
    /// The box around each object in world space, empty for one without geometry.
    pub bounds: &'a [Bounds],
    /// Its cells, in world space.
    pub graph: &'a CellGraph,
    /// What hides in it.
    pub scenery: &'a Scenery,
    /// What hides a share.
    pub foliage: &'a Foliage,
    /// What each cell sees.
    pub visibility: &'a Visibility,
}

impl Input<'_> {
    /// The box around everything, in world space.
    fn around(&self) -> Bounds {
        self.bounds.iter().fold(Bounds::EMPTY, |all, one| all.union(one))
    }
}

/// A revision whose objects are all in the sink.
#[derive(Debug, Clone)]
pub struct Written {
    /// Its manifest's name.
    pub manifest_name: BlobName,
    /// Its manifest.
    pub manifest: Manifest,
    /// Every object with its size, the manifest included, by name.
    pub blobs: Vec<(BlobName, u64)>,
    /// Cells that an earlier bake had looked from already.
    pub remembered_cells: u32,
    /// Which of its models clients can grow.
    pub growable: Growable,
}

impl Written {
    /// The revision's id.
    #[must_use]
    pub fn revision(&self) -> Revision {
        Revision::of_manifest(self.manifest_name.hash())
    }

    /// The pointer that makes it current under this name.
    #[must_use]
    pub fn pointer(&self, scene: SceneName) -> Pointer {
        let manifest = &self.manifest;
        Pointer {
            scene,
            title: manifest.title.clone(),
            revision: self.revision(),
            manifest: self.manifest_name.clone(),
            bounds: manifest.bounds,
            up: manifest.up.clone(),
            unit: manifest.unit.clone(),
            cells: manifest.counts.cells,
            objects: manifest.counts.objects,
            models: manifest.counts.models,
            triangles: manifest.counts.triangles,
            bytes: manifest.bytes.clone(),
            viewpoints: manifest.viewpoints.clone(),
        }
    }
}

/// Writes every object but the models' and the manifest last.
///
/// # Errors
/// When the sink refuses an object, or the caller cancels.
pub fn write(
    input: Input<'_>,
    models: &Models<'_>,
    sink: &dyn BlobSink,
    progress: &dyn Progress,
) -> Result<Written, BakeError> {
    let ledger = Ledger::new(sink, &models.blobs);
    progress.start(Stage::Publish, cells::STEPS * input.graph.cells.len() as u64);
    let entries = object_entries(input);
    let (models, packs) = packs::write(models, &models_seen(input), &input.graph.cells, &ledger)?;
    let models = &models[..];
    let put_objects = |row: &[ObjectEntry]| ledger.put_json(&ObjectChunk { objects: row.to_vec() });
    let objects = pages::write_tree(&entries, CHUNK_ENTRIES, |entry| entry.bounds, put_objects, &ledger)?;
    let used = used_models(&entries, models);
    let put_models = |row: &[UsedModel<'_>]| {
        let models = row.iter().map(|used| (used.id, used.model.clone())).collect();
        ledger.put_json(&ModelChunk { models })
    };
    let model_pages = pages::write_tree(&used, CHUNK_MODELS, |used| used.bounds, put_models, &ledger)?;
    let populations = populations::write(&entries, models, &ledger)?;
    let written = cells::write_records(input, &entries, models, &ledger, progress)?;
    let put_cells = |row: &[CellEntry]| ledger.put_json(&CellChunk { cells: row.to_vec() });
    let cells = pages::write_tree(&written.rows, CHUNK_ENTRIES, |row| row.bounds, put_cells, &ledger)?;

    let viewpoints = viewpoints::choose(input);
    let level0_bytes = level0_bytes(models);
    let is_small = level0_bytes <= WHOLE_WORLD_BYTES && entries.len() <= WHOLE_WORLD_OBJECTS;
    let mut starts = Vec::new();
    if !is_small {
        let written = starts::Written {
            visibility: input.visibility,
            cells: (&written.rows, &cells),
            objects: (&entries, &objects),
            models: (models, &model_pages),
            populations: populations.as_ref(),
        };
        starts = written.starts(&viewpoints, &ledger)?;
    }

    let stored = input.scenery.encode(&input.frame, input.world.origin());
    debug_assert!(Scenery::decode(&stored).is_ok(), "the server reads what is stored");
    let (url, occluders_bytes) = ledger.put("occ", stored)?;
    let occluders = OccludersRef {
        url,
        bytes: occluders_bytes,
    };

    let foliage = (!input.foliage.is_empty()).then(|| ledger.put_json(input.foliage));
    let foliage = foliage.transpose()?.map(|(url, bytes)| FoliageRef { url, bytes });

    let manifest = Manifest {
        format: FORMAT,
        title: input.title.to_owned(),
        bounds: input.around(),
        up: "+Y".to_owned(),
        unit: "m".to_owned(),
        counts: counts(input, &entries, models),
        bytes: sizes(input, (models, level0_bytes), &written.sizes, &ledger),
        viewpoints,
        visibility: VisibilitySummary {
            method: input.visibility.method.name().to_owned(),
            guarantee: input.visibility.guarantee,
            mean_seen: input.visibility.mean_seen,
            mean_not_hidden: Some(input.visibility.mean_not_hidden),
            reason: input.visibility.reason.clone(),
            mean_visible: mean(input.visibility.cells.iter().map(|cell| cell.objects.len() as f64)),
        },
        occluders: Some(occluders),
        foliage,
        records: written.sizes,
        packs,
        cells: cells.root,
        objects: objects.root,
        models: model_pages.root,
        populations: populations.map(|tree| tree.root),
        starts,
        whole: is_small.then(|| Whole {
            models: used.iter().map(|used| (used.id, used.model.clone())).collect(),
            objects: entries,
        }),
    };
    let (manifest_name, _) = ledger.put_json(&manifest)?;
    Ok(Written {
        manifest_name,
        manifest,
        blobs: ledger.into_blobs(),
        remembered_cells: input.visibility.remembered,
        growable: Growable::of(input.scene),
    })
}

/// The models that each cell sees.
fn models_seen(input: Input<'_>) -> Vec<Vec<usize>> {
    let model = |object: u32| input.scene.objects[object as usize].model;
    let cells = input.visibility.cells.iter();
    cells
        .map(|cell| cell.objects.iter().map(|seen| model(seen.object)).collect())
        .collect()
}

fn object_entries(input: Input<'_>) -> Vec<ObjectEntry> {
    let entry = |(id, object): (usize, &SourceObject)| ObjectEntry {
        object: ObjectId(id as u32),
        source_node: object.source_node.clone(),
        part: object.part,
        bounds: input.bounds[id],
        transform: object.world_from_object.to_cols_array(),
        scale: object.largest_scale(),
        model: ModelId(object.model as u32),
        mover: false,
        door: object.role == Role::Door,
    };
    input.scene.objects.iter().enumerate().map(entry).collect()
}

/// A model, and where the objects are that use it.
struct UsedModel<'m> {
    id: ModelId,
    model: &'m Model,
    bounds: Bounds,
}

fn used_models<'m>(entries: &[ObjectEntry], models: &'m [Model]) -> Vec<UsedModel<'m>> {
    let mut used: Vec<_> = (0..)
        .map(ModelId)
        .zip(models)
        .map(|(id, model)| UsedModel {
            id,
            model,
            bounds: Bounds::EMPTY,
        })
        .collect();
    for entry in entries {
        let bounds = &mut used[entry.model.index()].bounds;
        *bounds = bounds.union(&entry.bounds);
    }
    used
}

fn counts(input: Input<'_>, entries: &[ObjectEntry], models: &[Model]) -> Counts {
    Counts {
        cells: input.graph.cells.len() as u32,
        objects: entries.len() as u32,
        models: models.len() as u32,
        triangles: entries
            .iter()
            .map(|entry| models[entry.model.index()].levels[0].triangles)
            .sum(),
    }
}

/// Level 0 of every model with its pictures, each once.
fn level0_bytes(models: &[Model]) -> u64 {
    let mut level0 = UniqueBytes::default();
    for model in models {
        level0.add(&model.levels[0]);
    }
    level0.total()
}

fn sizes(
    input: Input<'_>,
    (models, level0_bytes): (&[Model], u64),
    records: &RecordSizes,
    ledger: &Ledger<'_>,
) -> BTreeMap<String, u64> {
    let mut lowest = UniqueBytes::default();
    for model in models {
        lowest.add(coarsest(model));
    }
    let smooth: BTreeMap<_, _> = models
        .iter()
        .filter_map(|model| model.smooth.as_ref())
        .map(|smooth| (&smooth.url, smooth.bytes))
        .collect();
    let drawn = models.iter().filter_map(|model| model.impostor.as_ref());
    let drawn: BTreeMap<_, _> = drawn
        .flat_map(|impostor| [&impostor.colour, &impostor.shape])
        .map(|picture| (&picture.url, picture.bytes))
        .collect();
    let textures = input
        .scene
        .images
        .iter()
        .map(|image| (&image.bytes, image.bytes.len() as u64));
    let textures: BTreeMap<_, _> = textures.collect();
    [
        ("source", input.source_bytes),
        ("published", ledger.total_bytes()),
        ("level0", level0_bytes),
        ("coarsest", lowest.total()),
        ("smooth", smooth.values().sum()),
        ("impostors", drawn.values().sum()),
        ("rules", ledger.bytes_of(rules::DCG)),
        ("populations", ledger.bytes_of(populations::POP)),
        ("textures", textures.values().sum()),
        ("records", records.record_bytes),
        ("steps", records.step_bytes),
    ]
    .map(|(name, bytes)| (name.to_owned(), bytes))
    .into()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}
