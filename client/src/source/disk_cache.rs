//! What need not be fetched again, also by the next visit? Immutable objects that are on disk. Those that were used longest
//! ago make room for new ones.
//!
//! What a file says is believed only when it has the hash in its name, so a crash, a full disk or another program in the
//! folder cost a request and nothing else. The time of a file's last change is when it was last used: so the order
//! outlives the program. Two programs may share a folder; each keeps to its own count of it.

use std::{
    collections::{BTreeMap, HashMap},
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::SystemTime,
};

use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{ByteSource, is_sound};
use crate::Error;

/// A source in front of which what was fetched is kept in a folder.
#[derive(Debug)]
pub struct DiskCache<S> {
    folder: PathBuf,
    most_bytes: u64,
    source: S,
    shelf: Mutex<Shelf>,
}

/// What is in the folder.
#[derive(Debug, Default)]
struct Shelf {
    bytes: u64,
    /// Sizes, and when each was used.
    files: HashMap<BlobName, (u64, u64)>,
    /// The same by use, longest ago first.
    order: BTreeMap<u64, BlobName>,
    /// Uses so far.
    uses: u64,
}

impl<S> DiskCache<S> {
    /// Keeps at most so many bytes of this source in a folder, which is made when it is not there, and goes on with what is
    /// in it.
    ///
    /// # Errors
    /// When there can be no such folder, or it cannot be read.
    pub fn open(folder: impl Into<PathBuf>, most_bytes: u64, source: S) -> Result<Self, Error> {
        let folder = folder.into();
        let shelf = match read_shelf(&folder) {
            Ok(shelf) => shelf,
            Err(cause) => return Err(Error::Cache { folder, cause }),
        };
        let cache = Self {
            folder,
            most_bytes,
            source,
            shelf: Mutex::new(shelf),
        };
        cache.remove(cache.shelf().make_room(most_bytes));
        Ok(cache)
    }

    /// How many bytes are kept.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.shelf().bytes
    }

    fn shelf(&self) -> MutexGuard<'_, Shelf> {
        self.shelf.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn remove(&self, names: Vec<BlobName>) {
        for name in names {
            // Somebody may have been faster.
            _ = fs::remove_file(self.folder.join(name.to_string()));
        }
    }

    /// The bytes of a kept object; one that is damaged or gone is forgotten.
    fn kept(&self, name: &BlobName) -> Option<Bytes> {
        if !self.shelf().files.contains_key(name) {
            return None;
        }
        let path = self.folder.join(name.to_string());
        let bytes = fs::read(&path)
            .ok()
            .filter(|bytes| is_sound(&name.url(), bytes) == Some(true));
        let Some(bytes) = bytes else {
            self.shelf().take(name);
            self.remove(vec![name.clone()]);
            return None;
        };
        self.shelf().put(name.clone(), bytes.len() as u64);
        // Only the order after a restart suffers.
        _ = File::options()
            .append(true)
            .open(path)
            .and_then(|file| file.set_modified(SystemTime::now()));
        Some(bytes.into())
    }

    /// Keeps an object if it can; a folder that takes nothing more is no reason to fail.
    fn keep(&self, name: &BlobName, bytes: &Bytes) {
        let size = bytes.len() as u64;
        if size > self.most_bytes || is_sound(&name.url(), bytes) != Some(true) {
            return;
        }
        let room = self.shelf().make_room(self.most_bytes - size);
        self.remove(room);
        // Whoever reads meanwhile finds all of it or nothing.
        let unfinished = self.folder.join(format!("{name}.{}", std::process::id()));
        let written =
            fs::write(&unfinished, bytes).and_then(|()| fs::rename(&unfinished, self.folder.join(name.to_string())));
        match written {
            Ok(()) => self.shelf().put(name.clone(), size),
            Err(_) => _ = fs::remove_file(unfinished),
        }
    }
}

impl<S: ByteSource> ByteSource for DiskCache<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        let Ok(name) = BlobName::from_url(path) else {
            return self.source.get_carried(path).await;
        };
        if let Some(bytes) = self.kept(&name) {
            return Ok((bytes, 0));
        }
        let (bytes, carried) = self.source.get_carried(path).await?;
        self.keep(&name, &bytes);
        Ok((bytes, carried))
    }
}

impl Shelf {
    fn put(&mut self, name: BlobName, bytes: u64) {
        self.take(&name);
        self.uses += 1;
        self.bytes += bytes;
        self.files.insert(name.clone(), (bytes, self.uses));
        self.order.insert(self.uses, name);
    }

    fn take(&mut self, name: &BlobName) {
        if let Some((bytes, used)) = self.files.remove(name) {
            self.bytes -= bytes;
            self.order.remove(&used);
        }
    }

    /// Forgets what was used longest ago until no more than so many bytes are left.
    fn make_room(&mut self, most_bytes: u64) -> Vec<BlobName> {
        let mut gone = Vec::new();
        while self.bytes > most_bytes
            && let Some((_, name)) = self.order.first_key_value()
        {
            let name = name.clone();
            self.take(&name);
            gone.push(name);
        }
        gone
    }
}

/// What is in a folder, longest unused first; what was left unfinished is removed, and what is not ours is left alone.
fn read_shelf(folder: &Path) -> io::Result<Shelf> {
    fs::create_dir_all(folder)?;
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let file_name = entry.file_name();
        let text = file_name.to_string_lossy();
        if let Ok(name) = text.parse::<BlobName>() {
            let about = entry.metadata()?;
            found.push((about.modified()?, name, about.len()));
        } else if text
            .rsplit_once('.')
            .is_some_and(|(name, _)| name.parse::<BlobName>().is_ok())
        {
            fs::remove_file(entry.path())?;
        }
    }
    found.sort_by_key(|(used, name, _)| (*used, name.to_string()));
    let mut shelf = Shelf::default();
    found.into_iter().for_each(|(_, name, bytes)| shelf.put(name, bytes));
    Ok(shelf)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

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
        let unfinished = format!("{}.77", path(1).strip_prefix("/o/").unwrap());
        fs::write(folder.path().join("notes.txt"), b"mine").unwrap();
        fs::write(folder.path().join(&unfinished), b"half").unwrap();
        let cache = DiskCache::open(folder.path(), 1, Origin::default()).unwrap();
        assert_eq!(cache.bytes(), 0);
        assert!(folder.path().join("notes.txt").exists() && !folder.path().join(unfinished).exists());
        let file = folder.path().join("notes.txt");
        let error = DiskCache::open(&file, 1, Origin::default()).unwrap_err().to_string();
        assert!(error.contains("notes.txt"), "{error}");
    }
}
