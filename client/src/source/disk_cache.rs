//! What need not be fetched again, also by the next visit? Immutable objects that are on disk, within a limit.

use std::{ops::Range, path::PathBuf, sync::Arc};

use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{Ask, ByteSource, Watch, shelf::Shelf, unwatched};
use crate::Error;

/// A source in front of which what was fetched is kept in a folder. Those objects that were used longest ago make room for
/// new ones; what has not the hash in its name is neither kept nor believed.
#[derive(Debug)]
pub struct DiskCache<S> {
    shelf: Arc<Shelf>,
    source: S,
}

impl<S> DiskCache<S> {
    /// Keeps at most so many bytes of this source in a folder, which is made when it is not there, and goes on with what is
    /// in it.
    ///
    /// # Errors
    /// When there can be no such folder, or it cannot be read.
    pub fn open(folder: impl Into<PathBuf>, most_bytes: u64, source: S) -> Result<Self, Error> {
        let folder = folder.into();
        match Shelf::open(folder.clone(), most_bytes) {
            Ok(shelf) => Ok(Self {
                shelf: Arc::new(shelf),
                source,
            }),
            Err(cause) => Err(Error::Cache { folder, cause }),
        }
    }

    /// How many bytes are kept.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.shelf.bytes()
    }

    /// Asks the folder where it may block.
    async fn with_shelf<T: Send + 'static>(&self, ask: impl FnOnce(&Shelf) -> T + Send + 'static) -> Option<T> {
        let shelf = Arc::clone(&self.shelf);
        tokio::task::spawn_blocking(move || ask(&shelf)).await.ok()
    }
}

impl<S: ByteSource> ByteSource for DiskCache<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.get_watched(Ask::of(path), &mut unwatched).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let (Ok(name), false) = (BlobName::from_url(ask.path), ask.fresh) else {
            return self.source.get_watched(ask, watch).await;
        };
        let asked = name.clone();
        if let Some(bytes) = self.with_shelf(move |shelf| shelf.take(&asked)).await.flatten() {
            watch(&bytes);
            return Ok((bytes, 0));
        }
        let (bytes, carried) = self.source.get_watched(ask, watch).await?;
        let kept = bytes.clone();
        self.with_shelf(move |shelf| shelf.put(&name, &kept)).await;
        Ok((bytes, carried))
    }

    /// A part of what is in the folder, or of what the source has: that has no hash, and is not kept.
    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        if let Ok(name) = BlobName::from_url(path)
            && let Some(whole) = self.with_shelf(move |shelf| shelf.take(&name)).await.flatten()
        {
            return Ok((super::part_of(path, &whole, range)?, 0));
        }
        self.source.get_range(path, range).await
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    async fn keep(&self, path: &str, bytes: &Bytes) {
        if let Ok(name) = BlobName::from_url(path) {
            let kept = bytes.clone();
            self.with_shelf(move |shelf| shelf.put(&name, &kept)).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, File},
        sync::atomic::{AtomicU64, Ordering},
        time::{Duration, SystemTime},
    };

    use super::*;

    /// Answers each path with 100 bytes of its own, and counts.
    #[derive(Debug, Default)]
    struct Origin(AtomicU64);

    fn content(number: u8) -> Vec<u8> {
        vec![number; 100]
    }

    fn path(number: u8) -> String {
        BlobName::of(&content(number), "glb").unwrap().url()
    }

    impl ByteSource for Origin {
        async fn get(&self, asked: &str) -> Result<Bytes, Error> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let number = (0..=255).find(|number| path(*number) == asked);
            Ok(number.map_or_else(|| Bytes::from_static(b"a pointer"), |number| content(number).into()))
        }
    }

    /// Gets these, and answers what of it the origin had to be asked for.
    async fn asked(cache: &DiskCache<Origin>, numbers: &[u8]) -> Vec<u8> {
        let mut asked = Vec::new();
        for number in numbers {
            let before = cache.source.0.load(Ordering::Relaxed);
            assert_eq!(cache.get(&path(*number)).await.unwrap(), content(*number));
            if cache.source.0.load(Ordering::Relaxed) > before {
                asked.push(*number);
            }
        }
        asked
    }

    #[tokio::test]
    async fn what_was_used_longest_ago_makes_room_also_after_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(folder.path(), 300, Origin::default()).unwrap();
        assert_eq!(asked(&cache, &[1, 2, 3, 1, 4, 1, 3]).await, [1, 2, 3, 4]);
        assert_eq!(cache.bytes(), 300);
        assert_eq!(asked(&cache, &[2]).await, [2], "it made room for 4");
        // Used in this order: 1, 3, 2; files tell times apart only roughly.
        for (ago, number) in [(30, 1), (20, 3), (10, 2)] {
            let file = folder.path().join(path(number).strip_prefix("/o/").unwrap());
            let used = SystemTime::now() - Duration::from_secs(ago);
            File::options()
                .append(true)
                .open(file)
                .unwrap()
                .set_modified(used)
                .unwrap();
        }
        let again = DiskCache::open(folder.path(), 200, Origin::default()).unwrap();
        assert_eq!(again.bytes(), 200);
        assert_eq!(asked(&again, &[2, 3, 1]).await, [1]);
    }

    #[tokio::test]
    async fn nothing_wrong_is_kept_or_believed() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::open(folder.path(), 1000, Origin::default()).unwrap();
        asked(&cache, &[1, 2]).await;
        let file = |number: u8| folder.path().join(path(number).strip_prefix("/o/").unwrap());
        fs::write(file(1), b"damaged").unwrap();
        fs::remove_file(file(2)).unwrap();
        assert_eq!(asked(&cache, &[1, 2, 1, 2]).await, [1, 2]);
        // An origin that answers a name with something else.
        let wrong = BlobName::of(b"something else", "glb").unwrap().url();
        assert_eq!(cache.get(&wrong).await.unwrap(), Bytes::from_static(b"a pointer"));
        cache.get("/v1/scenes/town/index.json").await.unwrap();
        assert_eq!(cache.bytes(), 200);
    }

    #[test]
    fn a_folder_keeps_what_is_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, minutes: u64| {
            let path = folder.path().join(name);
            fs::write(&path, b"half").unwrap();
            let used = SystemTime::now() - Duration::from_mins(minutes);
            File::options()
                .append(true)
                .open(&path)
                .unwrap()
                .set_modified(used)
                .unwrap();
            path
        };
        let name = path(1).strip_prefix("/o/").unwrap().to_owned();
        let left = file(&format!("{name}.77"), 90);
        let others = [file("notes.txt", 90), file(&format!("{name}.78"), 30)];
        let cache = DiskCache::open(folder.path(), 1, Origin::default()).unwrap();
        assert_eq!(cache.bytes(), 0);
        assert!(!left.exists() && others.iter().all(|other| other.exists()));
        let error = DiskCache::open(&others[0], 1, Origin::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("notes.txt"), "{error}");
    }
}
