//! How does a client find its way inside one revision? Pointer → manifest → one chunk of the cell index → record →
//! the object chunks that it names; where one begins, a start instead of all these chunks. Index documents are kept; nothing else is.

use std::{
    any::Any,
    collections::HashMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use belvedere_scene::{
    BlobName, CellId, ModelId, ObjectId, Revision,
    index::{CellChunk, CellEntry, Page, PageEntry, PageKind},
    manifest::{FORMAT, Manifest},
    object::{Model, ModelChunk, ObjectChunk, ObjectEntry, ObjectInfo},
    pointer::Pointer,
    population::Population,
    record::{CellRecord, Steps},
    start::Start,
};
use bytes::Bytes;
use serde::de::DeserializeOwned;
use tokio::sync::{Mutex, MutexGuard};

use crate::{
    ByteSource, Error,
    document::{document, fresh, pointer_of, pointer_path, stale, verified},
    stand_ins::Spared,
};

/// The one field that every version of the manifest has.
#[derive(serde::Deserialize)]
struct FormatOnly {
    format: u32,
}

/// Documents that have been read, each of the type that its place in the index says.
type Documents = HashMap<BlobName, Arc<dyn Any + Send + Sync>>;

/// Why a document of an index could not be had.
#[derive(Debug)]
struct Loss {
    cause: String,
    /// Whether that was for a reason that passes.
    passes: bool,
}

/// What starts have told.
#[derive(Debug, Default)]
struct Started {
    cells: HashMap<CellId, CellEntry>,
    objects: HashMap<ObjectId, ObjectEntry>,
}

/// One revision of a scene. It never changes; [`Scene::newer`] opens the one that took its place.
#[derive(Debug)]
pub struct Scene<S> {
    source: Arc<S>,
    pointer: Pointer,
    manifest: Manifest,
    /// Pages and chunks that were read.
    index: Mutex<Documents>,
    /// Those of the revision before, of which some may be in this one as well.
    inherited: Mutex<Documents>,
    /// Those that could not be had.
    lost: Mutex<HashMap<BlobName, Loss>>,
    /// Whether one of them was gone since somebody last asked.
    missed: AtomicBool,
    /// Whether they are not asked for again either where they failed for a reason that passes.
    gives_up: bool,
    started: Mutex<Started>,
    models: Mutex<HashMap<ModelId, Arc<Model>>>,
    /// Models of which populations have told: they can be grown, and nobody knows how else they can be drawn.
    grown: Mutex<HashMap<ModelId, Arc<Model>>>,
    spared: Mutex<Spared>,
}

impl<S: ByteSource> Scene<S> {
    pub(crate) fn read(source: Arc<S>, pointer: Pointer, manifest: &[u8]) -> Result<Self, Error> {
        let path = pointer.manifest.url();
        let version: FormatOnly = document(&path, manifest)?;
        if version.format != FORMAT {
            return Err(Error::Format {
                found: version.format,
                known: FORMAT,
            });
        }
        Ok(Self {
            source,
            manifest: document(&path, manifest)?,
            pointer,
            index: Mutex::default(),
            inherited: Mutex::default(),
            lost: Mutex::default(),
            missed: AtomicBool::new(false),
            gives_up: false,
            started: Mutex::default(),
            models: Mutex::default(),
            grown: Mutex::default(),
            spared: Mutex::default(),
        })
    }

    /// The pointer as it was when the scene was opened.
    #[must_use]
    pub fn pointer(&self) -> &Pointer {
        &self.pointer
    }

    /// The same scene for who goes on at once without what its source does not bring: a document of the index that could not be had is
    /// not asked for again, whatever the reason. Otherwise one that failed for a reason that passes is, each time.
    #[must_use]
    pub fn giving_up(self) -> Self {
        Self { gives_up: true, ..self }
    }

    /// Whether the pointer says the same as when the scene was opened, as far as caches on the way know: for who looks every few
    /// seconds. What has changed just now may not be known yet, and what a cache knows may be older than this revision, so who
    /// hears no asks for the [newer revision](Scene::newer_revision).
    ///
    /// # Errors
    /// When its pointer cannot be fetched or read.
    pub async fn is_current(&self) -> Result<bool, Error> {
        let now = pointer_of(&*self.source, &self.pointer.scene).await?;
        Ok(now.manifest == self.pointer.manifest)
    }

    /// The revision in which the scene is published now, if that is another one, asked for past all caches: for who has a reason to,
    /// such as a file that is gone.
    ///
    /// # Errors
    /// When its pointer cannot be fetched or read.
    pub async fn newer_revision(&self) -> Result<Option<Revision>, Error> {
        let now = self.newer_pointer().await?;
        Ok(now.map(|now| now.revision))
    }

    /// The same, opened. What was read of the index of this revision and is in the other as well is not read again.
    ///
    /// # Errors
    /// When its pointer or manifest cannot be fetched or read.
    pub async fn newer(&self) -> Result<Option<Self>, Error> {
        let Some(pointer) = self.newer_pointer().await? else {
            return Ok(None);
        };
        let manifest = verified(&*self.source, &pointer.manifest, None).await;
        let manifest = manifest.map_err(|cause| stale(&pointer.scene, cause))?;
        let mut newer = Self::read(self.source.clone(), pointer, &manifest)?;
        let mut index = self.index.lock().await.clone();
        // Whose objects a population names depends on where it hangs in the index.
        index.retain(|_, document| !document.is::<Population>());
        (newer.inherited, newer.gives_up) = (Mutex::new(index), self.gives_up);
        Ok(Some(newer))
    }

    async fn newer_pointer(&self) -> Result<Option<Pointer>, Error> {
        let now: Pointer = fresh(&*self.source, &pointer_path(&self.pointer.scene)).await?;
        Ok(Some(now).filter(|now| now.manifest != self.pointer.manifest))
    }

    /// Whether a document of this revision was found to be gone, whoever needed it and whatever came of that; told once.
    pub(crate) fn has_missed(&self) -> bool {
        self.missed.swap(false, Ordering::Relaxed)
    }

    pub(crate) fn source(&self) -> &S {
        &self.source
    }

    /// The revision's manifest.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// What the index knows of a cell; `None` when there is no such cell.
    ///
    /// # Errors
    /// When a part of the index cannot be fetched or read.
    pub async fn cell(&self, cell: CellId) -> Result<Option<CellEntry>, Error> {
        if let Some(known) = self.started.lock().await.cells.get(&cell) {
            return Ok(Some(known.clone()));
        }
        let Some(entry) = self.leaf(&self.manifest.cells, cell.0).await? else {
            return Ok(None);
        };
        let chunk: Arc<CellChunk> = self.indexed(&entry.url, Some(entry.bytes)).await?;
        Ok(chunk.cells.iter().find(|c| c.cell == cell).cloned())
    }

    /// What is visible from a cell.
    ///
    /// # Errors
    /// When the record cannot be fetched, or is damaged.
    pub async fn record(&self, cell: &CellEntry) -> Result<CellRecord, Error> {
        self.remembered(&cell.record, Some(cell.record_bytes), |bytes| {
            CellRecord::decode(bytes).map_err(|cause| Error::Record { cell: cell.cell, cause })
        })
        .await
    }

    /// What changes on the way to each neighbour of a cell; `None` when it has none.
    ///
    /// # Errors
    /// When the steps cannot be fetched, or are damaged.
    pub async fn steps(&self, cell: &CellEntry) -> Result<Option<Steps>, Error> {
        let Some(name) = &cell.steps else { return Ok(None) };
        self.remembered(name, cell.steps_bytes, |bytes| {
            let steps = Steps::decode(bytes);
            steps
                .map(Some)
                .map_err(|cause| Error::Record { cell: cell.cell, cause })
        })
        .await
    }

    /// The infos of everything visible, in the record's order: objects inside the cell first.
    ///
    /// # Errors
    /// When a chunk of objects cannot be fetched or read, or lacks an object that the record names.
    pub async fn visible(&self, record: &CellRecord) -> Result<Vec<ObjectInfo>, Error> {
        let mut infos = Vec::new();
        for visible in record.visible() {
            infos.push(self.object(visible.object).await?);
        }
        Ok(infos)
    }

    /// The info of one object.
    ///
    /// # Errors
    /// When its chunk cannot be fetched or read, or the index does not lead to it.
    pub async fn object(&self, object: ObjectId) -> Result<ObjectInfo, Error> {
        let entry = self.entry(object).await?;
        Ok(ObjectInfo::join(&entry, &*self.model(&entry).await?))
    }

    /// What the index knows of one object.
    ///
    /// # Errors
    /// When its chunk cannot be fetched or read, or the index does not lead to it.
    pub async fn entry(&self, object: ObjectId) -> Result<ObjectEntry, Error> {
        let missing = || Error::NotIndexed(object);
        if let Some(whole) = &self.manifest.whole {
            let found = whole.objects.iter().find(|entry| entry.object == object);
            return found.cloned().ok_or_else(missing);
        }
        if let Some(known) = self.started.lock().await.objects.get(&object) {
            return Ok(known.clone());
        }
        let leaf = self.leaf(&self.manifest.objects, object.0).await?.ok_or_else(missing)?;
        let chunk: Arc<ObjectChunk> = self.indexed(&leaf.url, Some(leaf.bytes)).await?;
        chunk.entry(object).cloned().ok_or_else(missing)
    }

    /// What there is of the model of an object, read once for all that use it.
    ///
    /// # Errors
    /// When its chunk cannot be fetched or read, or the index does not lead to it.
    pub async fn model(&self, entry: &ObjectEntry) -> Result<Arc<Model>, Error> {
        let missing = || Error::NotIndexed(entry.object);
        if let Some(known) = self.models.lock().await.get(&entry.model) {
            return Ok(known.clone());
        }
        let model = match &self.manifest.whole {
            Some(whole) => whole.models.get(&entry.model).cloned(),
            None => {
                let leaf = self
                    .leaf(&self.manifest.models, entry.model.0)
                    .await?
                    .ok_or_else(missing)?;
                let models: Arc<ModelChunk> = self.indexed(&leaf.url, Some(leaf.bytes)).await?;
                models.models.get(&entry.model).cloned()
            }
        };
        let model = Arc::new(model.ok_or_else(missing)?);
        Ok(self.models.lock().await.entry(entry.model).or_insert(model).clone())
    }

    /// Which grown models stand where: a leaf of [`Manifest::populations`].
    ///
    /// # Errors
    /// When it cannot be fetched, or is damaged.
    pub async fn population(&self, entry: &PageEntry) -> Result<Arc<Population>, Error> {
        self.read_once(&entry.url, Some(entry.bytes), |bytes| {
            Population::decode(bytes, ObjectId(entry.first), entry.count).map_err(|cause| Error::Document {
                path: entry.url.url(),
                cause: cause.to_string(),
            })
        })
        .await
    }

    /// A model as its population knows it.
    pub(crate) async fn grown_model(&self, population: &Population, recipe: usize) -> Option<Arc<Model>> {
        let id = population.recipes.get(recipe)?.model;
        let mut grown = self.grown.lock().await;
        if let Some(known) = grown.get(&id) {
            return Some(known.clone());
        }
        let model = Arc::new(Model {
            levels: Vec::new(),
            smooth: None,
            impostor: None,
            procedural: Some(population.procedural(recipe)?),
        });
        grown.insert(id, model.clone());
        Some(model)
    }

    /// What populations have spared so far.
    pub(crate) async fn spared(&self) -> MutexGuard<'_, Spared> {
        self.spared.lock().await
    }

    /// Takes in what a start tells.
    pub(crate) async fn learn(&self, start: &Start) {
        let mut started = self.started.lock().await;
        let Started { cells, objects } = &mut *started;
        cells.extend(start.cells.iter().map(|entry| (entry.cell, entry.clone())));
        objects.extend(start.objects.iter().map(|entry| (entry.object, entry.clone())));
        drop(started);
        let mut models = self.models.lock().await;
        for (id, model) in &start.models {
            models.entry(*id).or_insert_with(|| Arc::new(model.clone()));
        }
    }

    /// Whether a start has told of an object.
    pub(crate) async fn is_started(&self, object: ObjectId) -> bool {
        self.started.lock().await.objects.contains_key(&object)
    }

    /// Whether a document of an index has been read.
    pub(crate) async fn is_read(&self, name: &BlobName) -> bool {
        self.index.lock().await.contains_key(name) || self.inherited.lock().await.contains_key(name)
    }

    /// An immutable object, verified against the hash in its name.
    ///
    /// # Errors
    /// When it cannot be fetched or arrives damaged.
    pub async fn blob(&self, name: &BlobName) -> Result<Bytes, Error> {
        verified(&*self.source, name, None).await
    }

    /// The chunk of an index tree below which an id lies.
    pub(crate) async fn leaf(&self, root: &Page, id: u32) -> Result<Option<PageEntry>, Error> {
        let mut entry = root.entry_of(id).cloned();
        while let Some(page) = entry.as_ref().filter(|e| e.kind == PageKind::Page) {
            entry = self
                .indexed::<Page>(&page.url, Some(page.bytes))
                .await?
                .entry_of(id)
                .cloned();
        }
        Ok(entry)
    }

    /// Asks again for what could not be had.
    pub(crate) async fn forgive(&self) {
        self.lost.lock().await.clear();
    }

    /// Who looks at what could not be had waits as long as this is held.
    #[cfg(test)]
    pub(crate) async fn hold_lost(&self) -> impl Sized {
        self.lost.lock().await
    }

    /// Asks again for what could not be had for a reason that passes.
    pub(crate) async fn forgive_what_passes(&self) {
        self.lost.lock().await.retain(|_, loss| !loss.passes);
    }

    /// A document of an index, which has so many bytes where that is known, fetched once; what is not there, or damaged, is not asked
    /// for again either.
    pub(crate) async fn indexed<T: DeserializeOwned + Send + Sync + 'static>(
        &self,
        name: &BlobName,
        bytes: Option<u64>,
    ) -> Result<Arc<T>, Error> {
        self.read_once(name, bytes, |bytes| document::<T>(&name.url(), bytes))
            .await
    }

    async fn read_once<T: Send + Sync + 'static>(
        &self,
        name: &BlobName,
        bytes: Option<u64>,
        read: impl Fn(&Bytes) -> Result<T, Error>,
    ) -> Result<Arc<T>, Error> {
        let known = self.index.lock().await.get(name).cloned();
        if let Some(Ok(document)) = known.map(Arc::downcast) {
            return Ok(document);
        }
        let inherited = self.inherited.lock().await.remove(name).map(Arc::downcast);
        let read = match inherited {
            Some(Ok(document)) => document,
            _ => Arc::new(self.remembered(name, bytes, read).await?),
        };
        self.index.lock().await.insert(name.clone(), read.clone());
        Ok(read)
    }

    /// A document that is fetched and read unless it could not be before; with [`Scene::giving_up`] whatever the reason was.
    async fn remembered<T>(
        &self,
        name: &BlobName,
        bytes: Option<u64>,
        read: impl Fn(&Bytes) -> Result<T, Error>,
    ) -> Result<T, Error> {
        if let Some(Loss { cause, passes }) = self.lost.lock().await.get(name) {
            let (cause, passes) = (cause.clone(), *passes);
            return Err(Error::GivenUp { cause, passes });
        }
        let came = verified(&*self.source, name, bytes).await;
        let is_gone = matches!(came, Err(Error::Missing(_)));
        self.missed.fetch_or(is_gone, Ordering::Relaxed);
        let read = came.and_then(|bytes| read(&bytes));
        if let Err(cause) = &read
            && (self.gives_up || !cause.passes())
        {
            let loss = Loss {
                cause: cause.to_string(),
                passes: cause.passes(),
            };
            self.lost.lock().await.insert(name.clone(), loss);
        }
        read
    }

    /// How many documents could not be had or read, and are not asked for again.
    pub(crate) async fn lost_documents(&self) -> usize {
        self.lost.lock().await.len()
    }
}
