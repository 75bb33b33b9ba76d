//! What is in a data folder? The catalogue, the blobs, and a lock that keeps `gc` away from a running bake.

use std::{
    fs::{File, TryLockError},
    path::{Path, PathBuf},
};

use anyhow::Context;

use crate::{db::Catalogue, store::BlobStore};

/// Commands read most blobs once; the server chooses its own limit.
const CACHE_BYTES: u64 = 64 << 20;

/// `{data}/catalogue.sqlite`, `{data}/o/…`, `{data}/bakes/…` and `{data}/lock`.
#[derive(Debug, Clone)]
pub(crate) struct DataFolder {
    path: PathBuf,
    catalogue: Catalogue,
    store: BlobStore,
}

/// Held while blobs are written or collected.
#[derive(Debug)]
pub(crate) struct DataLock {
    _file: File,
}

impl DataFolder {
    /// Opens the folder; makes it when it is not there.
    pub(crate) async fn open(path: &Path) -> anyhow::Result<Self> {
        let catalogue = Catalogue::open(path).await?;
        let store = BlobStore::open_folder(path, CACHE_BYTES).await?;
        Ok(Self {
            path: path.to_owned(),
            catalogue,
            store,
        })
    }

    /// Opens the folder only when something was published into it.
    pub(crate) async fn open_existing(path: &Path) -> anyhow::Result<Self> {
        anyhow::ensure!(
            path.join("catalogue.sqlite").is_file(),
            "{} is not a data folder: it has no catalogue.sqlite; bake something first with \
             `belvedere bake FILE --scene NAME --data {}`",
            path.display(),
            path.display(),
        );
        Self::open(path).await
    }

    /// Which scenes there are.
    pub(crate) fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The bytes.
    pub(crate) fn store(&self) -> &BlobStore {
        &self.store
    }

    /// Where bakes keep what they find while they go on.
    pub(crate) fn bakes(&self) -> PathBuf {
        self.path.join("bakes")
    }

    /// Says that new blobs are being written that no revision names yet. Several bakes may hold it.
    pub(crate) fn lock_for_writing(&self) -> anyhow::Result<DataLock> {
        let file = self.lock_file()?;
        file.lock_shared().context("cannot lock the data folder")?;
        Ok(DataLock { _file: file })
    }

    /// Says that blobs without a revision are being removed. Refused while something is being baked.
    pub(crate) fn lock_for_collecting(&self) -> anyhow::Result<DataLock> {
        let file = self.lock_file()?;
        match file.try_lock() {
            Ok(()) => Ok(DataLock { _file: file }),
            Err(TryLockError::WouldBlock) => anyhow::bail!(
                "something is being baked into {} right now; run gc again when it is done",
                self.path.display()
            ),
            Err(TryLockError::Error(cause)) => Err(cause).context("cannot lock the data folder"),
        }
    }

    fn lock_file(&self) -> anyhow::Result<File> {
        let path = self.path.join("lock");
        File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .with_context(|| format!("cannot open {}", path.display()))
    }
}
