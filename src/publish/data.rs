//! What is in a data folder? The catalogue and the blobs, unless a database and a bucket hold these; what is being worked
//! on; and a lock that keeps `gc` away from a running bake.

use std::{
    fs::{File, TryLockError},
    path::PathBuf,
};

use anyhow::Context;
use belvedere_scene::SceneName;
use tokio::sync::Mutex;

use super::alone::has_no_locks;
use crate::{
    db::{Baked, BlobLock, Catalogue},
    folder,
    place::{Place, PlaceArgs},
    store::BlobStore,
};

/// Commands read most blobs once; the server chooses its own limit.
const CACHE_BYTES: u64 = 64 << 20;
/// So many scenes are named where one was asked for that is not there.
const NAMED: usize = 12;

/// `{data}/catalogue.sqlite` and `{data}/o/…` or their places elsewhere, `{data}/bakes/…` and `{data}/lock`.
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
    everywhere: Mutex<Everywhere>,
}

/// The lock of all nodes.
#[derive(Debug)]
struct Everywhere {
    lock: BlobLock,
    /// Whether it was lost and taken anew. What was written before that stays in doubt, however long it is held since.
    was_lost: bool,
}

impl Everywhere {
    fn new(lock: BlobLock) -> Mutex<Self> {
        Mutex::new(Self { lock, was_lost: false })
    }
}

impl DataLock {
    /// Whether it was held all the time until now.
    pub(crate) async fn holds(&self) -> bool {
        self.everywhere.lock().await.lock.holds().await
    }
}

impl DataFolder {
    /// Opens the folder, and what is elsewhere; makes it when it is not there.
    pub(crate) async fn open(place: &PlaceArgs) -> anyhow::Result<Self> {
        Self::open_place(&Place::try_from(place)?).await
    }

    /// The same for settings that are checked.
    pub(crate) async fn open_place(place: &Place) -> anyhow::Result<Self> {
        folder::make_data(&place.data)?;
        Ok(Self {
            path: place.data.clone(),
            catalogue: place.open_catalogue().await?,
            store: place.open_store(CACHE_BYTES).await?,
        })
    }

    /// Opens the folder only when something was published into it.
    pub(crate) async fn open_existing(place: &PlaceArgs) -> anyhow::Result<Self> {
        let place = Place::try_from(place)?;
        anyhow::ensure!(
            place.has_catalogue(),
            "{} is not a data folder: it has no {}; bake something first with \
             `belvedere bake FILE --scene NAME --data {}`",
            place.data.display(),
            crate::db::FILE_NAME,
            place.data.display(),
        );
        Self::open_place(&place).await
    }

    /// Which scenes there are.
    pub(crate) fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// A scene's current revision.
    pub(crate) async fn baked(&self, scene: &SceneName) -> anyhow::Result<Baked> {
        match self.catalogue.baked(scene).await? {
            Some(baked) => Ok(baked),
            None => Err(self.no_such_scene(scene).await),
        }
    }

    /// What to say of a scene that is not in the catalogue.
    pub(crate) async fn no_such_scene(&self, scene: &SceneName) -> anyhow::Error {
        let pointers = match self.catalogue.pointers().await {
            Ok(pointers) => pointers,
            Err(error) => return error,
        };
        let mut names: Vec<_> = pointers.iter().map(|pointer| format!("`{}`", pointer.scene)).collect();
        let more = names.len().saturating_sub(NAMED);
        names.truncate(NAMED);
        let others = match (names.len(), more) {
            (0, _) => "nor any other".to_owned(),
            (1, _) => format!("there is {}", names[0]),
            (_, 0) => format!("there are {}", names.join(", ")),
            (_, more) => format!("there are {} and {more} more", names.join(", ")),
        };
        anyhow::anyhow!(
            "there is no scene `{scene}` in this data folder, {others}; `belvedere bake FILE --scene {scene}` makes one"
        )
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
    pub(crate) async fn lock_for_writing(&self) -> anyhow::Result<DataLock> {
        let file = self.lock_file()?;
        file.lock_shared().map_err(|error| self.not_locked(error))?;
        Ok(DataLock {
            _file: file,
            everywhere: Everywhere::new(self.catalogue.lock_for_writing().await?),
        })
    }

    /// Whether the lock kept `gc` away all the time since it was first taken. If not, because the catalogue was away
    /// meanwhile, it does from now on.
    pub(crate) async fn still_locked(&self, lock: &DataLock) -> anyhow::Result<bool> {
        let mut everywhere = lock.everywhere.lock().await;
        if !everywhere.lock.holds().await {
            everywhere.was_lost = true;
            everywhere.lock = self.catalogue.lock_for_writing().await?;
        }
        Ok(!everywhere.was_lost)
    }

    /// Says that blobs without a revision are being removed. Refused while something is being baked.
    pub(crate) async fn lock_for_collecting(&self) -> anyhow::Result<DataLock> {
        let file = self.lock_file()?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => anyhow::bail!(
                "something is being baked into {} right now; run gc again when it is done",
                self.path.display()
            ),
            Err(TryLockError::Error(cause)) => return Err(self.not_locked(cause)),
        }
        let everywhere = self.catalogue.lock_for_collecting().await?;
        let everywhere =
            everywhere.context("something is being baked by another node right now; run gc again when it is done")?;
        Ok(DataLock {
            _file: file,
            everywhere: Everywhere::new(everywhere),
        })
    }

    fn not_locked(&self, error: std::io::Error) -> anyhow::Error {
        let way_out = if has_no_locks(&error) {
            ": its file system has no locks, as network folders may; put it on a disk of this machine, and the blobs into a bucket \
             (`store`) where several machines share them"
        } else {
            ""
        };
        anyhow::Error::new(error).context(format!("cannot lock the data folder {}{way_out}", self.path.display()))
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
