//! What does one revision say about a place, a cell or an object?
//!
//! Walks the two index trees of the revision as a client does (`belvedere_scene::index`): every step reads one small
//! immutable blob. Decoded documents are cached, limited by the bytes that they were decoded from. Finding a cell or
//! an object costs one blob for each level of the tree; a page of objects in a box reads at most
//! `MAX_CHUNKS_A_PAGE` chunks, however large the world is.

use std::{any::Any, sync::Arc};

use belvedere_scene::pointer::Pointer;
use belvedere_scene::{
    BlobName, Bounds, CellId, ObjectId,
    foliage::Foliage,
    index::{CellChunk, CellEntry, CellSearch, Located, Page, PageEntry, PageKind},
    manifest::Manifest,
    object::{ModelChunk, ObjectChunk, ObjectEntry, ObjectInfo},
    record::{CellJson, CellRecord, Steps},
};
use quick_cache::{Weighter, sync::Cache};
use serde::{Serialize, de::DeserializeOwned};

use super::Blockers;
use crate::store::{BlobStore, StoreError};

/// A page of objects in a box is cut after this many chunks, even when it is not full yet.
pub(super) const MAX_CHUNKS_A_PAGE: usize = 256;

/// Why a published revision cannot be read. Asking for something that it does not have is not an error.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ReadError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The revision names a blob that is not stored.
    #[error("blob {0} is part of a published revision but is not stored; publish the scene again")]
    Missing(BlobName),
    /// A blob is not what the revision says that it is.
    #[error("blob {name} cannot be read: {reason}")]
    Malformed {
        /// The blob.
        name: BlobName,
        /// What is wrong with it.
        reason: String,
    },
}

/// Decoded documents of every scene, limited in bytes.
#[derive(Debug)]
pub struct DecodedCache(Cache<BlobName, Decoded, BySource>);

#[derive(Debug, Clone)]
struct Decoded {
    document: Arc<dyn Any + Send + Sync>,
    source_bytes: u64,
}

#[derive(Debug, Clone)]
struct BySource;

impl Weighter<BlobName, Decoded> for BySource {
    fn weight(&self, _: &BlobName, decoded: &Decoded) -> u64 {
        decoded.source_bytes.max(256)
    }
}

impl Default for DecodedCache {
    fn default() -> Self {
        /// Of JSON and records as stored; decoded they take about as much again.
        const SOURCE_BYTES: u64 = 64 << 20;
        Self(Cache::with_weighter(4096, SOURCE_BYTES, BySource))
    }
}

/// Some objects, rising by id.
#[derive(Debug, Default, PartialEq)]
pub struct ObjectPage {
    /// The objects.
    pub objects: Vec<ObjectInfo>,
    /// Where the next page starts: after this id. It need not be among `objects`.
    pub more_after: Option<ObjectId>,
}

/// An object with how well it can be seen.
#[derive(Debug, PartialEq, Serialize)]
pub struct VisibleObject {
    /// The object.
    #[serde(flatten)]
    pub info: ObjectInfo,
    /// The share of sight lines from the cell that arrive.
    pub fraction: f32,
    /// Doors that hide it when they are closed.
    pub doors: Vec<ObjectId>,
}

/// Some of what can be seen from a cell, in the order of its record.
#[derive(Debug, PartialEq)]
pub struct VisiblePage {
    /// The objects.
    pub objects: Vec<VisibleObject>,
    /// Where the next page starts: after this object.
    pub more_after: Option<ObjectId>,
}

/// Reads one revision.
#[derive(Debug)]
pub struct SceneReader {
    manifest: BlobName,
    blobs: BlobStore,
    decoded: Arc<DecodedCache>,
}

impl SceneReader {
    /// Reads the revision that a pointer names.
    #[must_use]
    pub fn of(pointer: &Pointer, blobs: BlobStore) -> Self {
        Self::new(pointer.manifest.clone(), blobs, Arc::default())
    }

    pub(super) fn new(manifest: BlobName, blobs: BlobStore, decoded: Arc<DecodedCache>) -> Self {
        Self {
            manifest,
            blobs,
            decoded,
        }
    }

    /// The revision's manifest.
    ///
    /// # Errors
    /// When it cannot be read.
    pub async fn manifest(&self) -> Result<Arc<Manifest>, ReadError> {
        self.json(&self.manifest).await
    }

    /// The cell at a point, or the nearest one; `None` only when the scene has no cells.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub async fn cell_at(&self, point: [f64; 3]) -> Result<Option<Located>, ReadError> {
        let mut search = CellSearch::new(&self.manifest().await?.cells, point);
        while let Some(entry) = search.wants() {
            match entry.kind {
                PageKind::Page => search.give_page(self.json::<Page>(&entry.url).await?.as_ref()),
                PageKind::Chunk => search.give_chunk(self.json::<CellChunk>(&entry.url).await?.as_ref()),
            }
        }
        Ok(search.finish())
    }

    /// What the index knows of every cell, by id.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub async fn all_cells(&self) -> Result<Vec<CellEntry>, ReadError> {
        let mut open = self.manifest().await?.cells.entries.clone();
        open.reverse();
        let mut cells = Vec::new();
        while let Some(entry) = open.pop() {
            match entry.kind {
                PageKind::Page => {
                    let page = self.json::<Page>(&entry.url).await?;
                    open.extend(page.entries.iter().rev().cloned());
                }
                PageKind::Chunk => cells.extend(self.json::<CellChunk>(&entry.url).await?.cells.iter().cloned()),
            }
        }
        Ok(cells)
    }

    /// What the index knows of a cell.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub async fn cell_entry(&self, cell: CellId) -> Result<Option<CellEntry>, ReadError> {
        let manifest = self.manifest().await?;
        let Some(chunk) = self.chunk_of::<CellChunk>(&manifest.cells, cell.0).await? else {
            return Ok(None);
        };
        let at = chunk.cells.binary_search_by_key(&cell, |entry| entry.cell);
        Ok(at.ok().map(|at| chunk.cells[at].clone()))
    }

    /// What is visible from a cell.
    ///
    /// # Errors
    /// When the index or the record cannot be read.
    pub async fn cell_record(&self, cell: CellId) -> Result<Option<Arc<CellRecord>>, ReadError> {
        let Some(entry) = self.cell_entry(cell).await? else {
            return Ok(None);
        };
        let decode = |bytes: &[u8]| CellRecord::decode(bytes).map_err(|e| e.to_string());
        self.decode(&entry.record, decode).await.map(Some)
    }

    /// What hides, for questions about any place; `None` when the revision holds none.
    ///
    /// # Errors
    /// When it cannot be read.
    pub async fn blockers(&self) -> Result<Option<Arc<Blockers>>, ReadError> {
        match &self.manifest().await?.occluders {
            Some(occluders) => self.decode(&occluders.url, Blockers::read).await.map(Some),
            None => Ok(None),
        }
    }

    /// Where leaves hide a share of what is behind them.
    ///
    /// # Errors
    /// When it cannot be read, or breaks its promises.
    pub async fn foliage(&self) -> Result<Foliage, ReadError> {
        match &self.manifest().await?.foliage {
            Some(foliage) => {
                let decode = |bytes: &[u8]| {
                    let read: Foliage = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
                    let sound = read.is_sound();
                    sound
                        .then_some(read)
                        .ok_or_else(|| "its squares make no sense".to_owned())
                };
                Ok(Foliage::clone(&*self.decode(&foliage.url, decode).await?))
            }
            None => Ok(Foliage::default()),
        }
    }

    /// What changes on the way to each neighbour of a cell; `None` when there is no such cell or it has no neighbour.
    ///
    /// # Errors
    /// When the index or the steps cannot be read.
    pub async fn steps(&self, cell: CellId) -> Result<Option<Arc<Steps>>, ReadError> {
        let Some(name) = self.cell_entry(cell).await?.and_then(|entry| entry.steps) else {
            return Ok(None);
        };
        let decode = |bytes: &[u8]| Steps::decode(bytes).map_err(|e| e.to_string());
        self.decode(&name, decode).await.map(Some)
    }

    /// The JSON form of a cell's record.
    ///
    /// # Errors
    /// When it cannot be read.
    pub async fn cell_json(&self, entry: &CellEntry) -> Result<CellJson, ReadError> {
        let json: Arc<CellJson> = self.json(&entry.record_json).await?;
        Ok(CellJson::clone(&json))
    }

    /// Everything a client needs to know of an object.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub async fn object_info(&self, object: ObjectId) -> Result<Option<ObjectInfo>, ReadError> {
        let manifest = self.manifest().await?;
        let Some(chunk) = self.chunk_of::<ObjectChunk>(&manifest.objects, object.0).await? else {
            return Ok(None);
        };
        match chunk.entry(object) {
            Some(entry) => self.joined(entry).await.map(Some),
            None => Ok(None),
        }
    }

    /// At most `limit` objects whose boxes meet `bounds`, with ids after `after`.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub async fn objects_in(
        &self,
        bounds: &Bounds,
        after: Option<ObjectId>,
        limit: usize,
    ) -> Result<ObjectPage, ReadError> {
        let manifest = self.manifest().await?;
        let first = after.map_or(0, |after| u64::from(after.0) + 1);
        let reaches = |entry: &&PageEntry| u64::from(entry.first) + u64::from(entry.count) > first;
        // Visited from a stack, so the first entry must come last.
        let below = |page: &Page| -> Vec<PageEntry> {
            let mut entries: Vec<_> = page.intersecting(bounds).filter(reaches).cloned().collect();
            entries.reverse();
            entries
        };
        let mut open = below(&manifest.objects);
        let mut page = ObjectPage::default();
        let mut chunks = 0;
        while let Some(entry) = open.pop() {
            if entry.kind == PageKind::Page {
                open.extend(below(self.json::<Page>(&entry.url).await?.as_ref()));
                continue;
            }
            if chunks == MAX_CHUNKS_A_PAGE {
                page.more_after = entry.first.checked_sub(1).map(ObjectId);
                return Ok(page);
            }
            chunks += 1;
            let chunk = self.json::<ObjectChunk>(&entry.url).await?;
            let meeting = chunk
                .objects
                .iter()
                .filter(|object| u64::from(object.object.0) >= first && object.bounds.intersects(bounds));
            for object in meeting {
                if page.objects.len() == limit {
                    page.more_after = page.objects.last().map(|last| last.object);
                    return Ok(page);
                }
                page.objects.push(self.joined(object).await?);
            }
        }
        Ok(page)
    }

    /// At most `limit` of the objects that can be seen from a cell, those after `after` in the order of its record,
    /// without those that one of the `closed` doors hides. `None` when there is no such cell, or `after` cannot be seen
    /// from it.
    ///
    /// # Errors
    /// When the index or the record cannot be read.
    pub async fn visible(
        &self,
        cell: CellId,
        closed: &[ObjectId],
        after: Option<ObjectId>,
        limit: usize,
    ) -> Result<Option<VisiblePage>, ReadError> {
        let Some(record) = self.cell_record(cell).await? else {
            return Ok(None);
        };
        let mut seen = record.visible();
        seen.retain(|visible| !visible.is_hidden_by(closed));
        let start = match after {
            None => 0,
            Some(after) => match seen.iter().position(|visible| visible.object == after) {
                Some(at) => at + 1,
                None => return Ok(None),
            },
        };
        let end = seen.len().min(start.saturating_add(limit));
        let mut objects = Vec::with_capacity(end - start);
        for visible in &seen[start..end] {
            let info = self.object_info(visible.object).await?;
            objects.push(VisibleObject {
                info: info.ok_or_else(|| self.dangling(&self.manifest, visible.object))?,
                fraction: visible.fraction,
                doors: visible.doors.clone(),
            });
        }
        let more_after = (end < seen.len()).then(|| seen[end - 1].object);
        Ok(Some(VisiblePage { objects, more_after }))
    }

    /// An entry with its model.
    async fn joined(&self, entry: &ObjectEntry) -> Result<ObjectInfo, ReadError> {
        let manifest = self.manifest().await?;
        let chunk = self.chunk_of::<ModelChunk>(&manifest.models, entry.model.0).await?;
        let model = chunk.as_ref().and_then(|chunk| chunk.models.get(&entry.model));
        let model = model.ok_or_else(|| self.dangling(&self.manifest, entry.object))?;
        Ok(ObjectInfo::join(entry, model))
    }

    fn dangling(&self, name: &BlobName, object: ObjectId) -> ReadError {
        ReadError::Malformed {
            name: name.clone(),
            reason: format!("it does not lead to object {object} and its model"),
        }
    }

    /// The leaf below which an id lies.
    async fn chunk_of<T>(&self, root: &Page, id: u32) -> Result<Option<Arc<T>>, ReadError>
    where
        T: DeserializeOwned + Any + Send + Sync,
    {
        let mut entry = root.entry_of(id).cloned();
        while let Some(found) = entry {
            match found.kind {
                PageKind::Chunk => return self.json(&found.url).await.map(Some),
                PageKind::Page => entry = self.json::<Page>(&found.url).await?.entry_of(id).cloned(),
            }
        }
        Ok(None)
    }

    async fn json<T>(&self, name: &BlobName) -> Result<Arc<T>, ReadError>
    where
        T: DeserializeOwned + Any + Send + Sync,
    {
        self.decode(name, |bytes| serde_json::from_slice(bytes).map_err(|e| e.to_string()))
            .await
    }

    async fn decode<T, F>(&self, name: &BlobName, decode: F) -> Result<Arc<T>, ReadError>
    where
        T: Any + Send + Sync,
        F: FnOnce(&[u8]) -> Result<T, String>,
    {
        let malformed = |reason| ReadError::Malformed {
            name: name.clone(),
            reason,
        };
        let load = async {
            let bytes = self.blobs.get(name).await?;
            let bytes = bytes.ok_or_else(|| ReadError::Missing(name.clone()))?;
            Ok::<_, ReadError>(Decoded {
                document: Arc::new(decode(&bytes).map_err(malformed)?),
                source_bytes: bytes.len() as u64,
            })
        };
        let decoded = match self.decoded.0.get(name) {
            Some(decoded) => decoded,
            None => self.decoded.0.get_or_insert_async(name, load).await?,
        };
        let document = decoded.document.downcast();
        document.map_err(|_| malformed("it is named in two places as two kinds of document".to_owned()))
    }
}
