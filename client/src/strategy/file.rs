//! What is a file called, and what does it take on the line? Servers compress as they send; documents say how large files
//! are, not how small they get, so each kind counts with the share that is left of it on average (`viewer/core/strategy/file.ts`).

use std::{fmt, ops::Range};

use belvedere_scene::{BlobHash, BlobName, rung::RungName};

/// What one asks a published tree for: an immutable object, or a slice of a smooth LOD.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FileName {
    /// An object below `/o/`.
    Object(BlobName),
    /// A rung of a smooth LOD; it has no hash of its own.
    Rung(RungName),
}

/// The same in a word: what a file is looked up by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    hash: BlobHash,
    rung: Option<u8>,
}

/// A file, and how large it is said to be.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct FileRef {
    /// Its name.
    pub name: FileName,
    /// Its size as stored.
    pub bytes: u64,
}

/// What is known of the stream of a smooth LOD.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StreamRef {
    /// Where each of its rungs ends; the last where all of it does.
    pub(crate) ends: Vec<u64>,
    /// Whether its model can be drawn with nothing else.
    pub(crate) is_needed: bool,
}

impl StreamRef {
    /// Where in the stream a rung is, if it has one of this number.
    pub(crate) fn place(&self, number: u8) -> Option<Range<u64>> {
        let number = usize::from(number);
        let from = number
            .checked_sub(1)
            .map_or(Some(0), |before| self.ends.get(before).copied());
        Some(from?..*self.ends.get(number)?)
    }
}

/// What the headers of a request and its answer take, about.
pub const REQUEST_BYTES: f64 = 400.0;

/// What gzip leaves of each kind, over the built-in museum and five other worlds; all else is entropy-coded already.
const LEFT: [(&str, f64); 6] = [
    ("glb", 0.47),
    ("pack", 0.31),
    ("gltf", 0.35),
    ("json", 0.21),
    ("dcg", 0.29),
    ("pop", 0.23),
];

impl From<&BlobName> for Key {
    fn from(name: &BlobName) -> Self {
        Self {
            hash: name.hash(),
            rung: None,
        }
    }
}

impl From<&RungName> for Key {
    fn from(name: &RungName) -> Self {
        Self {
            hash: name.hash,
            rung: Some(name.number),
        }
    }
}

impl Key {
    /// Whether bytes are the object that is looked up by it.
    #[must_use]
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        self.rung.is_none() && BlobHash::of(bytes) == self.hash
    }
}

impl FileName {
    /// What it is looked up by.
    #[must_use]
    pub fn key(&self) -> Key {
        match self {
            Self::Object(name) => name.into(),
            Self::Rung(name) => name.into(),
        }
    }

    /// The last part of its path: `{hash}.{ext}` or `{hash}.r{n}.slod`.
    #[must_use]
    pub fn file_name(&self) -> String {
        match self {
            Self::Object(name) => name.to_string(),
            Self::Rung(name) => name.file_name(),
        }
    }

    /// Where it is below the root of a published tree.
    #[must_use]
    pub fn path(&self) -> String {
        match self {
            Self::Object(name) => name.url(),
            Self::Rung(name) => name.to_string(),
        }
    }

    /// Whether bytes may be it: those of an object have the hash in its name. Rungs are compared when all have come.
    #[must_use]
    pub fn may_be(&self, bytes: &[u8]) -> bool {
        match self {
            Self::Object(name) => name.is_of(bytes),
            Self::Rung(_) => true,
        }
    }

    fn ext(&self) -> &str {
        match self {
            Self::Object(name) => name.ext(),
            Self::Rung(_) => belvedere_scene::rung::SLOD,
        }
    }
}

impl fmt::Display for FileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path())
    }
}

impl FileRef {
    /// An object of so many bytes.
    #[must_use]
    pub fn object(name: &BlobName, bytes: u64) -> Self {
        Self {
            name: FileName::Object(name.clone()),
            bytes,
        }
    }

    /// Whether something grows out of it.
    #[must_use]
    pub fn is_rules(&self) -> bool {
        self.name.ext() == "dcg"
    }

    /// What it takes on the line, without a request.
    #[must_use]
    pub fn compressed_bytes(&self) -> f64 {
        compressed_bytes(self.name.ext(), self.bytes)
    }
}

/// What so many bytes of a kind of file take on the line.
#[must_use]
pub fn compressed_bytes(ext: &str, bytes: u64) -> f64 {
    let left = LEFT.iter().find(|(kind, _)| *kind == ext);
    bytes as f64 * left.map_or(1.0, |(_, left)| *left)
}
