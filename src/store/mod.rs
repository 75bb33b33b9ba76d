//! Where do immutable objects live, and how are they read without touching the disk each time?
//!
//! A [`BlobStore`] holds blobs by name, `{hash}.{ext}`, and beside each its content-coded variants
//! (`{hash}.{ext}.zst`, `{hash}.{ext}.gz`), made once by [`BlobStore::put`], in a folder or in a [`Bucket`]. Reading goes through a cache that is
//! limited in bytes, so that hot objects cost neither a system call nor a hop to the blocking pool.
//!
//! **Order of writing.** Variants first, the identity file last, each in one step: a blob exists exactly when its
//! identity file does, and is deleted in the same order. Whoever names blobs in a place that lasts calls [`BlobStore::sync`] before: one request to the disk for
//! thousands of files. A crash before leaves variants that nobody reads, which [`BlobStore::list`] names, and parts of files, which
//! [`BlobStore::unfinished`] names, so that both can be collected, and a loss of power may leave files without their bytes; `put` compares what is there and mends it. A bucket
//! that has taken an object keeps it whole, so there `put` compares lengths and `sync` has nothing to do.
//!
//! **Trust.** An identity is hashed when it is first loaded, and so is what a variant decodes to; later its [seal](seals) is compared. Bytes that are not what their name
//! promises are [`StoreError::Corrupt`], never served, never kept in memory and never mistaken for "no such blob". Where a
//! variant is damaged, that is told once, in the log ([`StoreError::CorruptVariant`]), and the blob has one form less. Each form is
//! checked when it is loaded, by itself, and loaded when it is asked for.
//!
//! **Limit.** A blob comes into memory as a whole, hence [`MAX_BLOB_BYTES`]. Whoever takes it slowly does not keep it there: what a
//! reader has still to get is a [`Rest`].

mod at_hand;
mod bucket;
mod coding;
mod errands;
mod error;
mod first_bytes;
mod forms;
mod loading;
mod open;
mod owner;
mod rest;
mod seals;
mod sync;
mod tree;
mod unfinished;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    path::PathBuf,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use belvedere_scene::{BlobHash, BlobName};
use bytes::Bytes;
use futures_util::{TryStreamExt, future::try_join_all};
use object_store::{ObjectStore, ObjectStoreExt, PutOptions, path::Path as Key};
use quick_cache::sync::Cache;
use tokio::runtime::Handle;

pub use bucket::{Bucket, NoBucket, credentials};
pub use coding::Coding;
pub use errands::Errands;
pub use error::StoreError;
use error::io;
use forms::{ByBytes, Entry};
pub use forms::{Derived, Representation, Representations};
use loading::aside;
use rest::Lent;
pub use rest::Rest;
use seals::Seals;
pub use tree::BucketTree;
pub use unfinished::Unfinished;
use unfinished::generic;

use crate::{media, spread::Spread};

/// The largest blob that can be stored.
pub const MAX_BLOB_BYTES: u64 = 256 << 20;

/// A file that every store has, so that an empty store can be told from one that is gone (an unmounted disk), and that says
/// whose it is.
const MARKER: &str = "belvedere-store";

/// What [`BlobStore::put`] did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PutOutcome {
    /// The blob was there already; nothing was written.
    AlreadyThere,
    /// Written, with its variants.
    Stored {
        /// Bytes on disk of the identity and its variants together.
        stored_bytes: u64,
    },
}

/// How often the cache had what was asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CacheUse {
    /// Reads answered from memory.
    pub hits: u64,
    /// Reads that went to the store.
    pub misses: u64,
    /// Bytes held.
    pub bytes: u64,
    /// Bytes beside those, which readers hold of what they have still to get.
    pub lent_bytes: u64,
    /// Variants that were found damaged, each once until it is written anew.
    pub damaged_variants: u64,
}

#[derive(Debug)]
struct Folder {
    path: PathBuf,
    opened: Arc<File>,
}

/// Immutable objects by name. Cheap to clone.
#[derive(Debug, Clone)]
pub struct BlobStore {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    objects: Arc<dyn ObjectStore>,
    /// Where they are, if that is no bucket, which keeps what it has taken whole, and hands it out by itself.
    folder: Option<Folder>,
    cache: Cache<BlobName, Entry, ByBytes>,
    seals: Seals,
    lent: Lent,
    /// Where rests are read: readers may be on runtimes that shall not wait for files.
    runtime: Handle,
    hits: Spread<AtomicU64>,
    misses: AtomicU64,
    /// The keys of variants that were told to be damaged and not written anew since.
    damaged: Mutex<BTreeSet<Key>>,
    damaged_variants: AtomicU64,
}

impl BlobStore {
    /// Stores a blob with the variants that save enough. A blob that is there, and whole, is not written again.
    ///
    /// # Errors
    /// When the bytes are not those of the name or are too many, or the store fails.
    pub async fn put(&self, name: &BlobName, bytes: Bytes) -> Result<PutOutcome, StoreError> {
        let len = bytes.len() as u64;
        if len > MAX_BLOB_BYTES {
            return Err(StoreError::TooLarge {
                name: name.clone(),
                bytes: len,
            });
        }
        if self.holds(name, &bytes).await? {
            return Ok(PutOutcome::AlreadyThere);
        }
        let (owned, input) = (name.clone(), bytes.clone());
        let variants = aside(move || variants_of(&owned, &input)).await?;
        let stored_bytes = len + variants.iter().map(|(_, variant)| variant.len() as u64).sum::<u64>();
        let writing = variants
            .into_iter()
            .map(async |(coding, variant)| self.write(&variant_key(name, coding), variant.into()).await);
        try_join_all(writing).await?;
        self.write(&identity_key(name), bytes).await?;
        self.inner.cache.remove(name);
        self.inner.seals.forget(name);
        for coding in Coding::ALL {
            self.damaged().remove(&variant_key(name, coding));
        }
        Ok(PutOutcome::Stored { stored_bytes })
    }

    /// Copies a blob with its variants, as they are, into another store. Says whether it was new there.
    ///
    /// # Errors
    /// When the blob or one of its variants is not here or damaged, or a store fails.
    pub async fn copy_to(&self, name: &BlobName, target: &Self) -> Result<bool, StoreError> {
        let forms = self.load_once(name, false).await;
        let forms = forms.map_err(|error| error.unwrap_or_else(|| StoreError::Missing(name.clone())))?;
        let identity = forms.of(None).map(|identity| identity.bytes.clone());
        let identity = identity.ok_or_else(|| StoreError::Missing(name.clone()))?;
        if target.holds(name, &identity).await? {
            return Ok(false);
        }
        for coding in Coding::ALL {
            if let Some(variant) = forms.of(Some(coding)) {
                target.write(&variant_key(name, coding), variant.bytes.clone()).await?;
            }
        }
        target.write(&identity_key(name), identity).await?;
        Ok(true)
    }

    /// Makes everything that was stored so far outlive a loss of power.
    ///
    /// # Errors
    /// When the disk fails.
    pub async fn sync(&self) -> Result<(), StoreError> {
        let Some(folder) = self.inner.folder.as_ref().filter(|_| sync::AT_ONCE) else {
            return Ok(());
        };
        let folder = folder.opened.clone();
        let synced = aside(move || sync::all(&folder)).await;
        synced.map_err(|e| io("write its blobs out to the disk".to_owned(), generic(e)))
    }

    /// How many bytes are stored of a blob; `None` when there is no such blob.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn stored_bytes(&self, name: &BlobName) -> Result<Option<u64>, StoreError> {
        self.stored_len(name).await
    }

    /// Removes a blob with its variants; removing what is not there is no error.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn delete(&self, name: &BlobName) -> Result<(), StoreError> {
        // As long as a variant is there, so is what it is a variant of.
        let keys = [
            variant_key(name, Coding::Zstd),
            variant_key(name, Coding::Gzip),
            identity_key(name),
        ];
        for key in keys {
            match self.inner.objects.delete(&key).await {
                Ok(()) | Err(object_store::Error::NotFound { .. }) => {}
                Err(source) => return Err(io(format!("delete {key}"), source)),
            }
        }
        self.inner.cache.remove(name);
        self.inner.seals.forget(name);
        Ok(())
    }

    /// Every blob of which anything is stored, even if only variants that a crash left behind, with its bytes on disk.
    /// Files that are not blobs are left out.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(&self) -> Result<BTreeMap<BlobName, u64>, StoreError> {
        self.inner
            .objects
            .list(None)
            .try_fold(BTreeMap::new(), async |mut blobs, object| {
                let file = object.location.as_ref();
                let stem = file.strip_suffix(".zst").or_else(|| file.strip_suffix(".gz"));
                if let Ok(name) = stem.unwrap_or(file).parse::<BlobName>() {
                    *blobs.entry(name).or_insert(0) += object.size;
                }
                Ok(blobs)
            })
            .await
            .map_err(|source| io("list its blobs".to_owned(), source))
    }

    /// Whether the store is there and can be read.
    ///
    /// # Errors
    /// When it is not.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let found = self.inner.objects.head(&Key::from(MARKER)).await;
        found
            .map(drop)
            .map_err(|source| io(format!("find its marker `{MARKER}`"), source))
    }

    /// How the cache is doing.
    #[must_use]
    pub fn cache_use(&self) -> CacheUse {
        CacheUse {
            hits: self.inner.hits.sum(),
            misses: self.inner.misses.load(Ordering::Relaxed),
            bytes: self.inner.cache.weight(),
            lent_bytes: self.inner.lent.bytes(),
            damaged_variants: self.inner.damaged_variants.load(Ordering::Relaxed),
        }
    }

    fn damaged(&self) -> MutexGuard<'_, BTreeSet<Key>> {
        self.inner.damaged.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn stored_len(&self, name: &BlobName) -> Result<Option<u64>, StoreError> {
        match self.inner.objects.head(&identity_key(name)).await {
            Ok(meta) => Ok(Some(meta.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(source) => Err(io(format!("look for {name}"), source)),
        }
    }

    async fn read(&self, key: &Key) -> Result<Option<Bytes>, StoreError> {
        let failed = |source| io(format!("read {key}"), source);
        match self.inner.objects.get(key).await {
            Ok(found) if self.inner.folder.is_some() => Ok(Some(found.bytes().await.map_err(failed)?)),
            Ok(found) => Ok(Some(first_bytes::whole(found).await.map_err(failed)?)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(source) => Err(failed(source)),
        }
    }

    async fn write(&self, key: &Key, bytes: Bytes) -> Result<(), StoreError> {
        let options = if self.inner.folder.is_none() {
            tree::told(key.as_ref(), media::FOR_EVER)
        } else {
            // Files have no header fields.
            PutOptions::default()
        };
        let written = self.inner.objects.put_opts(key, bytes.into(), options).await;
        written.map(drop).map_err(|source| io(format!("write {key}"), source))
    }
}

fn identity_key(name: &BlobName) -> Key {
    Key::from(name.to_string())
}

fn variant_key(name: &BlobName, coding: Coding) -> Key {
    Key::from(format!("{name}.{}", coding.file_suffix()))
}

fn variants_of(name: &BlobName, bytes: &[u8]) -> Result<Vec<(Coding, Vec<u8>)>, StoreError> {
    let found = BlobHash::of(bytes);
    if found != name.hash() {
        return Err(StoreError::Misnamed {
            name: name.clone(),
            found,
        });
    }
    if !coding::worth_trying(name.ext()) {
        return Ok(vec![]);
    }
    coding::variants(bytes).map_err(|source| StoreError::Encode {
        name: name.clone(),
        source: Arc::new(source),
    })
}

#[cfg(test)]
mod tests;
