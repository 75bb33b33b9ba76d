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
    /// What the file lacks, because it has not taken it: the end of a line that was cut off, and the lines that follow. An empty
    /// line says nothing.
    owed: String,
    /// Lines of this bake, recalled ones too.
    lines: BTreeMap<String, String>,
}

impl Written {
    /// Whatever the file does not take now, it is given again with the next line: a disk that is full may have room then.
    fn append(&mut self, line: &str) {
        let Ok(file) = &mut self.file else {
            return;
        };
        self.owed.push_str(line);
        if file.write_all(self.owed.as_bytes()).is_ok() {
            self.owed.clear();
        } else if !self.owed.starts_with('\n') {
            self.owed.insert(0, '\n');
        }
    }
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
                owed: "\n".to_owned(),
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
    let file = File::options()
        .append(true)
        .create(true)
        .open(path)
        .with_context(cannot)?;
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
        written.append(&line(&key, result));
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

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_full_disk_did_not_take_is_written_when_it_has_room() {
        let on_a_full_disk = |found: &FoundFile| {
            let full = File::options().write(true).open("/dev/full").unwrap();
            let mut written = found.written.lock().unwrap();
            std::mem::replace(&mut written.file, Ok(full)).unwrap()
        };
        let folder = tempfile::tempdir().unwrap();
        let killed = open(folder.path());
        let file = on_a_full_disk(&killed);
        killed.keep(&KEYS[0], "x");
        killed.written.lock().unwrap().file = Ok(file);
        killed.keep(&KEYS[1], "y");
        drop(killed);
        let again = open(folder.path());
        assert_eq!(
            KEYS.map(|key| again.recall(&key)),
            [Some("x".to_owned()), Some("y".to_owned())]
        );
        _ = on_a_full_disk(&again);
        again.keep(&KEYS[0], "z");
        again.finish().unwrap();
        assert_eq!(open(folder.path()).recall(&KEYS[0]).as_deref(), Some("z"));
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
