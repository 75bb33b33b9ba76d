//! Which files beside the source did the importer read? Reads them from one folder, never from outside it, or from what
//! is built into the program, and remembers their hashes so that an unchanged source is not baked again.
//! And what is a file without an extension?

use std::{
    borrow::Cow,
    io::Read,
    path::{Path, PathBuf},
    sync::Mutex,
};

use belvedere_bake::import::{FileError, SourceFiles};
use belvedere_scene::BlobHash;

use crate::worlds;

/// The folder beside a source file.
#[derive(Debug)]
pub(crate) struct SourceFolder {
    /// `None`: what is built into the program.
    root: Option<PathBuf>,
    read: Mutex<Vec<ReadFile>>,
}

/// A file that was asked for.
#[derive(Debug, Clone)]
pub(crate) struct ReadFile {
    pub(crate) name: String,
    /// `None` when it could not be read: adding it later changes the result.
    pub(crate) hash: Option<BlobHash>,
    pub(crate) bytes: u64,
}

impl SourceFolder {
    /// The folder in which this file stands.
    pub(crate) fn beside(file: &Path) -> Self {
        let folder = file
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        Self {
            root: Some(folder.to_owned()),
            read: Mutex::default(),
        }
    }

    /// What is built into the program.
    pub(crate) fn built_in() -> Self {
        Self {
            root: None,
            read: Mutex::default(),
        }
    }

    /// Every file that was asked for, in order.
    pub(crate) fn into_read(self) -> Vec<ReadFile> {
        self.read
            .into_inner()
            .expect("no thread panics while it holds this lock")
    }

    /// The hash of a file as it is now; `None` when it cannot be read.
    pub(crate) fn hash_of(&self, relative: &str) -> Option<BlobHash> {
        self.open(relative, u64::MAX).ok().map(|bytes| BlobHash::of(&bytes))
    }

    fn open(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let Some(root) = &self.root else {
            let text = worlds::text(relative).ok_or(FileError::Missing)?;
            return Ok(text.as_bytes().to_vec());
        };
        let unreadable = |cause: std::io::Error| match cause.kind() {
            std::io::ErrorKind::NotFound => FileError::Missing,
            _ => FileError::Io(cause.to_string()),
        };
        // A link may lead out of the folder though the name does not.
        let root = root.canonicalize().map_err(unreadable)?;
        let path = root.join(relative).canonicalize().map_err(unreadable)?;
        if !path.starts_with(&root) {
            return Err(FileError::Io("a link leads out of the source's folder".to_owned()));
        }
        if !path.is_file() {
            return Err(FileError::Io("it is not a regular file".to_owned()));
        }
        let mut bytes = Vec::new();
        let file = std::fs::File::open(&path).map_err(unreadable)?;
        file.take(max_bytes.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        if bytes.len() as u64 > max_bytes {
            Err(FileError::TooLarge(max_bytes))
        } else {
            Ok(bytes)
        }
    }
}

impl SourceFiles for SourceFolder {
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let opened = self.open(relative, max_bytes);
        let bytes = opened.as_deref().unwrap_or_default();
        let file = ReadFile {
            name: relative.to_owned(),
            hash: opened.is_ok().then(|| BlobHash::of(bytes)),
            bytes: bytes.len() as u64,
        };
        self.read
            .lock()
            .expect("no thread panics while it holds this lock")
            .push(file);
        opened
    }
}

/// The file's name, with an extension where it has none and its content does not begin as what glTF comes in: texts are
/// told apart by their names, and an upload may have come without one. Floor plans have rows of walls, rules do not.
pub(crate) fn told_apart<'a>(file_name: &'a str, bytes: &[u8]) -> Cow<'a, str> {
    let text = str::from_utf8(bytes)
        .unwrap_or_default()
        .trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    let known = ["glTF", "PK", "{", "<"].iter().any(|start| text.starts_with(start));
    if file_name.contains('.') || text.is_empty() || known {
        return Cow::Borrowed(file_name);
    }
    let is_plan = text.lines().any(|line| line.trim_start().starts_with("##"));
    Cow::Owned(format!("{file_name}.{}", if is_plan { "plan" } else { "dcg" }))
}

#[cfg(test)]
mod tests {
    use super::told_apart;

    #[test]
    fn texts_without_an_extension_are_told_apart_by_their_content() {
        let plan = include_bytes!("../../tests/fixtures/museum.plan");
        let rules = include_bytes!("../../content/town.dcg");
        for (name, bytes, told) in [
            ("town", &plan[..], "town.plan"),
            ("town", rules, "town.dcg"),
            ("town.dcg", plan, "town.dcg"),
            ("town", b"glTF\x02\0\0\0", "town"),
            ("town", b"PK\x03\x04", "town"),
            ("town", b"\n {\"asset\": {}}", "town"),
            ("town", b"\xff\xfe", "town"),
            ("town", b"", "town"),
        ] {
            assert_eq!(told_apart(name, bytes), told);
        }
    }
}
