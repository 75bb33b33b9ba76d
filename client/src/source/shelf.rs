//! Which immutable objects are in a folder, and which goes when there are too many bytes? Those that were used longest ago.
//!
//! What a file says is believed only when it has the hash in its name, so a crash, a full disk or another program in the
//! folder cost a request and nothing else. The time of a file's last change is when it was last used: so the order
//! outlives the program. Two programs may share a folder; each keeps to its own count of it.

use std::{
    collections::{BTreeMap, HashMap},
    fs::{self, File},
    hash::{BuildHasher, RandomState},
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, SystemTime},
};

use belvedere_scene::BlobName;
use bytes::Bytes;

/// A file that was not finished for so long will not be.
const UNFINISHED_FOR: Duration = Duration::from_hours(1);

/// A folder of objects.
#[derive(Debug)]
pub(super) struct Shelf {
    folder: PathBuf,
    most_bytes: u64,
    books: Mutex<Books>,
}

/// What is known to be in the folder.
#[derive(Debug, Default)]
struct Books {
    bytes: u64,
    /// Sizes, and when each was used.
    files: HashMap<BlobName, (u64, u64)>,
    /// The same by use, longest ago first.
    order: BTreeMap<u64, BlobName>,
    /// Uses so far.
    uses: u64,
}

impl Shelf {
    pub(super) fn open(folder: PathBuf, most_bytes: u64) -> io::Result<Self> {
        let mut books = found_in(&folder)?;
        let gone = books.make_room(most_bytes);
        let shelf = Self {
            folder,
            most_bytes,
            books: Mutex::new(books),
        };
        shelf.remove(&gone);
        Ok(shelf)
    }

    pub(super) fn bytes(&self) -> u64 {
        self.books().bytes
    }

    /// The bytes of a kept object; one that is damaged or gone is forgotten.
    pub(super) fn take(&self, name: &BlobName) -> Option<Bytes> {
        if !self.books().files.contains_key(name) {
            return None;
        }
        let path = self.path(name);
        let bytes = fs::read(&path).ok();
        let Some(bytes) = bytes.filter(|bytes| name.is_of(bytes)) else {
            self.books().forget(name);
            self.remove(std::slice::from_ref(name));
            return None;
        };
        self.books().note(name.clone(), bytes.len() as u64);
        // Only the order after a restart suffers.
        _ = File::options()
            .append(true)
            .open(path)
            .and_then(|file| file.set_modified(SystemTime::now()));
        Some(bytes.into())
    }

    /// Keeps an object if it can; a folder that takes nothing more is no reason to fail.
    pub(super) fn put(&self, name: &BlobName, bytes: &Bytes) {
        let size = bytes.len() as u64;
        if size > self.most_bytes || !name.is_of(bytes) {
            return;
        }
        // Whoever reads meanwhile finds all of it or nothing.
        let unfinished = self
            .folder
            .join(format!("{name}.{:x}", RandomState::new().hash_one(name)));
        if fs::write(&unfinished, bytes).is_err() {
            _ = fs::remove_file(unfinished);
            return;
        }
        let mut books = self.books();
        if fs::rename(&unfinished, self.path(name)).is_err() {
            _ = fs::remove_file(unfinished);
            return;
        }
        books.note(name.clone(), size);
        self.remove(&books.make_room(self.most_bytes));
    }

    fn path(&self, name: &BlobName) -> PathBuf {
        self.folder.join(name.to_string())
    }

    fn books(&self) -> MutexGuard<'_, Books> {
        self.books.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn remove(&self, names: &[BlobName]) {
        for name in names {
            // Another program may have been faster.
            _ = fs::remove_file(self.path(name));
        }
    }
}

impl Books {
    /// Notes a use.
    fn note(&mut self, name: BlobName, bytes: u64) {
        self.forget(&name);
        self.uses += 1;
        self.bytes += bytes;
        self.files.insert(name.clone(), (bytes, self.uses));
        self.order.insert(self.uses, name);
    }

    fn forget(&mut self, name: &BlobName) {
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
            self.forget(&name);
            gone.push(name);
        }
        gone
    }
}

/// What is in a folder, longest unused first. What was long left unfinished is removed, and what is not ours left alone.
fn found_in(folder: &Path) -> io::Result<Books> {
    fs::create_dir_all(folder)?;
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let file_name = entry.file_name();
        let text = file_name.to_string_lossy();
        let is_unfinished = text
            .rsplit_once('.')
            .is_some_and(|(name, _)| name.parse::<BlobName>().is_ok());
        let name = text.parse::<BlobName>();
        if name.is_err() && !is_unfinished {
            continue;
        }
        let about = match entry.metadata() {
            Err(cause) if cause.kind() == ErrorKind::NotFound => continue,
            about => about?,
        };
        let used = about.modified()?;
        match name {
            Ok(name) => found.push((used, name, about.len())),
            Err(_) if used.elapsed().is_ok_and(|since| since > UNFINISHED_FOR) => _ = fs::remove_file(entry.path()),
            Err(_) => {}
        }
    }
    found.sort_by_key(|(used, name, _)| (*used, name.to_string()));
    let mut books = Books::default();
    found.into_iter().for_each(|(_, name, bytes)| books.note(name, bytes));
    Ok(books)
}
