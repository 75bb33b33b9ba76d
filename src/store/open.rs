//! How is a store opened? In a folder, which is made, or in a bucket, which must be there.

use std::{
    path::Path,
    sync::{Arc, Mutex, atomic::AtomicU64},
};

use object_store::{ObjectStore, local::LocalFileSystem};
use quick_cache::{OptionsBuilder, sync::Cache};
use tokio::runtime::Handle;

use super::{
    BlobStore, Bucket, Folder, Inner, StoreError, forms::ByBytes, io, rest::Lent, seals::Seals, sync,
    unfinished::generic,
};
use crate::spread::Spread;

impl BlobStore {
    /// The store in the folder `{data}/o`, which is made when it is not there.
    ///
    /// # Errors
    /// When the folder cannot be made or opened.
    pub async fn open_folder(data: &Path, cache_bytes: u64) -> Result<Self, StoreError> {
        let folder = data.join("o");
        let failed = |cause| io(format!("open the folder {}", folder.display()), cause);
        tokio::fs::create_dir_all(&folder)
            .await
            .map_err(generic)
            .map_err(failed)?;
        let local = LocalFileSystem::new_with_prefix(&folder)
            .map_err(failed)?
            .with_fsync(!sync::AT_ONCE);
        let opened = tokio::fs::File::open(&folder).await.map_err(generic).map_err(failed)?;
        let folder = Folder {
            path: folder,
            opened: Arc::new(opened.into_std().await),
        };
        Self::over(Arc::new(local), Some(folder), cache_bytes).marked().await
    }

    /// The store below `o/` of a place in a bucket, which must be there.
    ///
    /// # Errors
    /// When the bucket does not answer, or not to these keys.
    pub async fn open_bucket(bucket: &Bucket, cache_bytes: u64) -> Result<Self, StoreError> {
        Self::open_over(bucket.open("o")?, cache_bytes).await
    }

    /// The store over whatever keeps objects by name, holding up to `cache_bytes` in memory.
    ///
    /// # Errors
    /// When it does not answer.
    pub async fn open_over(objects: Arc<dyn ObjectStore>, cache_bytes: u64) -> Result<Self, StoreError> {
        Self::over(objects, None, cache_bytes).marked().await
    }

    /// A store that has no marker yet gets one, which names nobody.
    async fn marked(self) -> Result<Self, StoreError> {
        match self.probe().await {
            Ok(()) => {}
            // What else is wrong is no reason to write: the marker may say whose the store is.
            Err(StoreError::Io { cause, .. }) if matches!(*cause, object_store::Error::NotFound { .. }) => {
                self.mark().await?;
            }
            Err(error) => return Err(error),
        }
        Ok(self)
    }

    /// Whether a bucket is there and opens to these keys; changes nothing in it.
    ///
    /// # Errors
    /// As [`BlobStore::open_bucket`].
    pub async fn reach_bucket(bucket: &Bucket) -> Result<(), StoreError> {
        let listed = bucket.open("o")?.list_with_delimiter(None).await;
        listed
            .map(drop)
            .map_err(|source| io("list its blobs".to_owned(), source))
    }

    /// The store over any folder or bucket that has been opened before, holding up to `cache_bytes` in memory.
    fn over(objects: Arc<dyn ObjectStore>, folder: Option<Folder>, cache_bytes: u64) -> Self {
        /// Only a hint for the cache's tables.
        const TYPICAL_BLOB_BYTES: u64 = 32 << 10;
        /// Few shards, so that one large blob still fits into its share of the limit.
        const SHARDS: usize = 4;
        /// One part of so many for what is known of blobs, in memory or not: of those in a store of four times the limit, if each takes
        /// 16 KiB with all its forms.
        const SEALS: u64 = 16;
        const LEAST_SEALS_BYTES: u64 = 16 << 10;
        let seals_bytes = cache_bytes / SEALS;
        let cache_bytes = cache_bytes - seals_bytes;
        let options = OptionsBuilder::new()
            .shards(SHARDS)
            .estimated_items_capacity((cache_bytes / TYPICAL_BLOB_BYTES).max(64) as usize)
            .weight_capacity(cache_bytes)
            .build()
            .expect("both capacities are given");
        Self {
            inner: Arc::new(Inner {
                objects,
                folder,
                cache: Cache::with_options(
                    options,
                    ByBytes,
                    quick_cache::DefaultHashBuilder::default(),
                    quick_cache::sync::DefaultLifecycle::default(),
                ),
                seals: Seals::new(seals_bytes.max(LEAST_SEALS_BYTES)),
                lent: Lent::of(cache_bytes),
                runtime: Handle::current(),
                hits: Spread::default(),
                misses: AtomicU64::new(0),
                damaged: Mutex::default(),
                damaged_variants: AtomicU64::new(0),
            }),
        }
    }
}
