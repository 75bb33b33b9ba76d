//! What has a bake found so far? A file beside the blobs that a bake appends to, cell by cell, so that one that was killed
//! goes on where it was, and the next one of a changed scene looks only where something has changed.
//!
//! `{data}/bakes/{scene}.found`: one line for each result: the digest of what it was made from, the start of the SHA-256 of
//! both, and the result. A line that was cut off or damaged is found anew.

use std::{
    collections::BTreeMap,
    fs::{File, TryLockError},
    io::Write,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use anyhow::Context;
use belvedere_bake::{digest::Digest, memory::Memory};
use belvedere_scene::{BlobHash, SceneName};

/// So many hexadecimal digits of a hash stand with each result.
const CHECK_DIGITS: usize = 16;

/// What was found for one scene.
#[derive(Debug)]
pub(crate) struct FoundFile {
    path: PathBuf,
    /// By digest, in hexadecimal.
    known: BTreeMap<String, String>,
    written: Mutex<Written>,
    /// Held as long as this bake may write; never replaced, as the file itself is.
    _lock: Option<File>,
}

#[derive(Debug)]
struct Written {
    /// Or why nothing can be kept.
    file: Result<File, String>,
    /// Lines of this bake, recalled ones too.
    lines: BTreeMap<String, String>,
}

impl FoundFile {
    /// Opens what earlier bakes of a scene have found. What cannot be read is as if it were not there; where nothing can
    /// be written, the bake goes on without.
    pub(crate) fn open(folder: &Path, scene: &SceneName) -> Self {
        let path = folder.join(format!("{scene}.found"));
        let known: BTreeMap<_, _> = std::fs::read(&path)
            .unwrap_or_default()
            .split(|byte| *byte == b'\n')
            .filter_map(read)
            .collect();
        let (lock, file) = match append_to(folder, &path) {
            Ok((lock, file)) => (Some(lock), Ok(file)),
            Err(cause) => (None, Err(format!("{cause:#}"))),
        };
        Self {
            path,
            known,
            written: Mutex::new(Written {
                file,
                lines: BTreeMap::new(),
            }),
            _lock: lock,
        }
    }

    /// Forgets what this bake had no use for. Called when it is done. Says why nothing could be kept, if so.
    pub(crate) fn finish(self) -> Result<(), String> {
        let written = self.written.into_inner().unwrap_or_else(PoisonError::into_inner);
        written.file?;
        let text: String = written.lines.iter().map(|(key, result)| line(key, result)).collect();
        let fresh = self.path.with_extension("found.new");
        std::fs::write(&fresh, text)
            .and_then(|()| std::fs::rename(&fresh, &self.path))
            .map_err(|cause| format!("cannot write {}: {cause}", self.path.display()))
    }
}

/// The lock, and the file to append to.
fn append_to(folder: &Path, path: &Path) -> anyhow::Result<(File, File)> {
    let cannot = || format!("cannot write {}", path.display());
    std::fs::create_dir_all(folder).with_context(cannot)?;
    let lock = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(path.with_extension("lock"))
        .with_context(cannot)?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => anyhow::bail!("another bake of the scene is writing {}", path.display()),
        Err(TryLockError::Error(cause)) => return Err(cause).with_context(cannot),
    }
    let mut file = File::options()
        .append(true)
        .create(true)
        .open(path)
        .with_context(cannot)?;
    // Ends a line that was cut off; an empty one says nothing.
    file.write_all(b"\n").with_context(cannot)?;
    Ok((lock, file))
}

fn check(key: &str, result: &str) -> String {
    let mut check = BlobHash::of(format!("{key} {result}").as_bytes()).to_string();
    check.truncate(CHECK_DIGITS);
    check
}

fn line(key: &str, result: &str) -> String {
    format!("{key} {} {result}\n", check(key, result))
}

fn read(line: &[u8]) -> Option<(String, String)> {
    let mut parts = std::str::from_utf8(line).ok()?.splitn(3, ' ');
    let (key, claimed, result) = (parts.next()?, parts.next()?, parts.next()?);
    (check(key, result) == claimed).then(|| (key.to_owned(), result.to_owned()))
}

impl Memory for FoundFile {
    fn recall(&self, key: &Digest) -> Option<String> {
        let key = key.to_string();
        let result = self.known.get(&key)?.clone();
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        written.lines.insert(key, result.clone());
        Some(result)
    }

    fn keep(&self, key: &Digest, result: &str) {
        let key = key.to_string();
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        if let Ok(file) = &mut written.file
            && let Err(cause) = file.write_all(line(&key, result).as_bytes())
        {
            written.file = Err(format!("cannot write {}: {cause}", self.path.display()));
        }
        written.lines.insert(key, result.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYS: [Digest; 2] = [Digest([1; 32]), Digest([2; 32])];

    fn open(folder: &Path) -> FoundFile {
        FoundFile::open(folder, &"town".parse().unwrap())
    }

    #[test]
    fn a_bake_that_was_killed_finds_again_what_it_had_found() {
        let folder = tempfile::tempdir().unwrap();
        open(folder.path()).keep(&KEYS[0], "{\"a\":1}");
        let again = open(folder.path());
        assert_eq!(again.recall(&KEYS[0]).as_deref(), Some("{\"a\":1}"));
        assert_eq!(again.recall(&KEYS[1]), None);
    }

    #[test]
    fn what_a_bake_had_no_use_for_is_forgotten_when_it_is_done() {
        let folder = tempfile::tempdir().unwrap();
        let first = open(folder.path());
        KEYS.iter().for_each(|key| first.keep(key, "x"));
        first.finish().unwrap();
        let second = open(folder.path());
        second.recall(&KEYS[1]).unwrap();
        second.finish().unwrap();
        let third = open(folder.path());
        assert_eq!(
            (third.recall(&KEYS[0]), third.recall(&KEYS[1])),
            (None, Some("x".to_owned()))
        );
    }

    #[test]
    fn lines_that_were_cut_off_or_damaged_are_as_if_they_were_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let first = open(folder.path());
        KEYS.iter().for_each(|key| first.keep(key, "result"));
        let path = first.path.clone();
        drop(first);
        let text = std::fs::read(&path).unwrap();
        for end in 0..text.len() {
            std::fs::write(&path, &text[..end]).unwrap();
            let cut = open(folder.path());
            let whole = text[..end].iter().filter(|byte| **byte == b'\n').count() - usize::from(end > 0);
            let found = KEYS
                .iter()
                .filter(|key| cut.recall(key).as_deref() == Some("result"))
                .count();
            // The last line is whole without its end, too.
            assert!(found == whole || found == whole + 1, "{end}: {found}");
            cut.keep(&KEYS[1], "again");
            drop(cut);
            assert_eq!(open(folder.path()).recall(&KEYS[1]).as_deref(), Some("again"), "{end}");
        }
        for at in 0..text.len() {
            let mut damaged = text.clone();
            damaged[at] ^= 1;
            std::fs::write(&path, &damaged).unwrap();
            let found = open(folder.path());
            assert!(
                KEYS.iter()
                    .all(|key| found.recall(key).is_none_or(|result| result == "result")),
                "{at}"
            );
        }
    }

    #[test]
    fn two_bakes_of_a_scene_do_not_write_into_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let (first, second) = (open(folder.path()), open(folder.path()));
        first.keep(&KEYS[0], "x");
        second.keep(&KEYS[1], "y");
        assert!(second.finish().unwrap_err().contains("another bake of the scene"));
        first.finish().unwrap();
        assert_eq!(open(folder.path()).recall(&KEYS[0]).as_deref(), Some("x"));
    }
}
