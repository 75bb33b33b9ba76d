//! Which immutable objects are in a folder, and which goes when there are too many bytes? Those that were used longest ago.
//!
//! What a file says is believed only when it has the hash in its name, or the [seal](super::label) of a part, so a crash, a full disk
//! or another program in the folder cost a request and nothing else. The time of a file's last change is when it was last used: so the order
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

use super::label::Label;

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
    files: HashMap<Label, (u64, u64)>,
    /// The same by use, longest ago first.
    order: BTreeMap<u64, Label>,
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

    /// The bytes of a kept file, which has so many where that is known; one that is damaged or gone is forgotten.
    pub(super) fn take(&self, label: &Label, expected: Option<u64>) -> Option<Bytes> {
        if !self.books().files.contains_key(label) {
            return None;
        }
        let path = self.path(label);
        let written = fs::read(&path).ok().map(Bytes::from);
        let size = written.as_ref().map_or(0, Bytes::len) as u64;
        let bytes = written.and_then(|written| label.unseal(written));
        let is_as_long = |bytes: &Bytes| expected.is_none_or(|expected| bytes.len() as u64 == expected);
        let Some(bytes) = bytes.filter(is_as_long) else {
            self.books().forget(label);
            self.remove(std::slice::from_ref(label));
            return None;
        };
        self.books().note(label.clone(), size);
        // Only the order after a restart suffers.
        _ = File::options()
            .append(true)
            .open(path)
            .and_then(|file| file.set_modified(SystemTime::now()));
        Some(bytes)
    }

    /// Keeps a file if it can; a folder that takes nothing more is no reason to fail.
    pub(super) fn put(&self, label: &Label, bytes: &Bytes) {
        let Some(written) = label.seal(bytes) else { return };
        let size = written.len() as u64;
        if size > self.most_bytes {
            return;
        }
        // Whoever reads meanwhile finds all of it or nothing.
        let unfinished = self
            .folder
            .join(format!("{label}.{:x}", RandomState::new().hash_one(label)));
        if fs::write(&unfinished, written).is_err() {
            _ = fs::remove_file(unfinished);
            return;
        }
        let mut books = self.books();
        if fs::rename(&unfinished, self.path(label)).is_err() {
            _ = fs::remove_file(unfinished);
            return;
        }
        books.note(label.clone(), size);
        self.remove(&books.make_room(self.most_bytes));
    }

    /// Forgets all parts of an object; answers with what is to be [removed](Shelf::remove).
    pub(super) fn forget_parts(&self, whole: &BlobName) -> Vec<Label> {
        let mut books = self.books();
        let parts: Vec<Label> = books
            .files
            .keys()
            .filter(|label| label.is_part_of(whole))
            .cloned()
            .collect();
        parts.iter().for_each(|part| books.forget(part));
        parts
    }

    fn path(&self, label: &Label) -> PathBuf {
        self.folder.join(label.to_string())
    }

    fn books(&self) -> MutexGuard<'_, Books> {
        self.books.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn remove(&self, labels: &[Label]) {
        for label in labels {
            // Another program may have been faster.
            _ = fs::remove_file(self.path(label));
        }
    }
}

impl Books {
    /// Notes a use.
    fn note(&mut self, label: Label, bytes: u64) {
        self.forget(&label);
        self.uses += 1;
        self.bytes += bytes;
        self.files.insert(label.clone(), (bytes, self.uses));
        self.order.insert(self.uses, label);
    }

    fn forget(&mut self, label: &Label) {
        if let Some((bytes, used)) = self.files.remove(label) {
            self.bytes -= bytes;
            self.order.remove(&used);
        }
    }

    /// Forgets what was used longest ago until no more than so many bytes are left.
    fn make_room(&mut self, most_bytes: u64) -> Vec<Label> {
        let mut gone = Vec::new();
        while self.bytes > most_bytes
            && let Some((_, label)) = self.order.first_key_value()
        {
            let label = label.clone();
            self.forget(&label);
            gone.push(label);
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
            .is_some_and(|(name, _)| Label::read(name).is_some());
        let label = Label::read(&text);
        if label.is_none() && !is_unfinished {
            continue;
        }
        let about = match entry.metadata() {
            Err(cause) if cause.kind() == ErrorKind::NotFound => continue,
            about => about?,
        };
        let used = about.modified()?;
        match label {
            Some(label) => found.push((used, label, about.len())),
            None if used.elapsed().is_ok_and(|since| since > UNFINISHED_FOR) => _ = fs::remove_file(entry.path()),
            None => {}
        }
    }
    found.sort_by_key(|(used, label, _)| (*used, label.to_string()));
    let mut books = Books::default();
    found.into_iter().for_each(|(_, label, bytes)| books.note(label, bytes));
    Ok(books)
}
