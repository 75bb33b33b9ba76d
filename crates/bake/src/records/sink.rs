//! Where do finished bytes go? The bake does no I/O: it hands each immutable object to a sink.

use std::{collections::BTreeMap, sync::Mutex};

use belvedere_scene::{BlobName, IdError};

/// Takes immutable objects. Called from many threads, in any order; the same object may come more than once.
pub trait BlobSink: Sync {
    /// Keeps these bytes under their name.
    ///
    /// # Errors
    /// When they cannot be kept; the bake stops and nothing is published.
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError>;
}

/// Why an object could not be kept.
#[derive(Debug, thiserror::Error)]
#[error("cannot store {name}: {cause}")]
pub struct SinkError {
    /// The object.
    pub name: BlobName,
    /// What the store said.
    #[source]
    pub cause: Box<dyn std::error::Error + Send + Sync>,
}

/// Names, keeps and counts the objects of one revision.
pub(super) struct Ledger<'a> {
    sink: &'a dyn BlobSink,
    sizes: Mutex<BTreeMap<BlobName, u64>>,
}

impl<'a> Ledger<'a> {
    /// A ledger of a revision that some objects belong to which are kept already.
    pub(super) fn new(sink: &'a dyn BlobSink, kept: &[(BlobName, u64)]) -> Self {
        Self {
            sink,
            sizes: Mutex::new(kept.iter().cloned().collect()),
        }
    }

    /// Names these bytes and hands them on; gives the name and the size.
    pub(super) fn put(&self, ext: &'static str, bytes: Vec<u8>) -> Result<(BlobName, u64), SinkError> {
        let name = named(&bytes, ext);
        let size = bytes.len() as u64;
        let new = self
            .sizes
            .lock()
            .expect("no thread panics while it holds this lock")
            .insert(name.clone(), size);
        if new.is_none() {
            self.sink.put(&name, bytes)?;
        }
        Ok((name, size))
    }

    /// Writes a document as compact JSON.
    pub(super) fn put_json(&self, document: &impl serde::Serialize) -> Result<(BlobName, u64), SinkError> {
        self.put("json", json(document))
    }

    /// Every object so far with its size, by name.
    pub(super) fn into_blobs(self) -> Vec<(BlobName, u64)> {
        self.sizes
            .into_inner()
            .expect("no thread panics while it holds this lock")
            .into_iter()
            .collect()
    }

    /// Bytes of every object so far with this extension.
    pub(super) fn bytes_of(&self, ext: &str) -> u64 {
        let sizes = self.sizes.lock().expect("no thread panics while it holds this lock");
        let of_kind = sizes.iter().filter(|(name, _)| name.ext() == ext);
        of_kind.map(|(_, bytes)| bytes).sum()
    }

    /// Bytes of every object so far.
    pub(super) fn total_bytes(&self) -> u64 {
        self.sizes
            .lock()
            .expect("no thread panics while it holds this lock")
            .values()
            .sum()
    }
}

fn named(bytes: &[u8], ext: &'static str) -> BlobName {
    let name: Result<BlobName, IdError> = BlobName::of(bytes, ext);
    name.expect("extensions written in this crate are short and lower case")
}

fn json(document: &impl serde::Serialize) -> Vec<u8> {
    serde_json::to_vec(document).expect("documents of the published format have string keys and no failing serialiser")
}
