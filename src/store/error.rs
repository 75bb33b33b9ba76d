//! Why can a blob not be stored or read? Damage is told apart from a store that does not answer.

use std::sync::Arc;

use belvedere_scene::{BlobHash, BlobName};

use super::{Coding, MAX_BLOB_BYTES};

/// Why a blob could not be stored or read. "No such blob" is not among them: that is an answer.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// The stored bytes are not those that the name promises.
    #[error(
        "blob {name} is damaged: its {bytes} stored bytes hash to {found}; delete the file and bake its scene again"
    )]
    Corrupt {
        /// The blob.
        name: BlobName,
        /// The length that was read.
        bytes: usize,
        /// What it hashes to.
        found: BlobHash,
    },
    /// A stored form is not one of its blob.
    #[error("the {} form of blob {name} is damaged; delete its file and bake its scene again", coding.token())]
    CorruptVariant {
        /// The blob.
        name: BlobName,
        /// Which form.
        coding: Coding,
    },
    /// A blob that must be there is not.
    #[error("blob {0} is not in the store; bake its scene again")]
    Missing(BlobName),
    /// A caller offers bytes under a name that is not theirs.
    #[error("these bytes hash to {found}, they cannot be stored as {name}")]
    Misnamed {
        /// The name that was asked for.
        name: BlobName,
        /// What the bytes hash to.
        found: BlobHash,
    },
    /// Larger than [`MAX_BLOB_BYTES`].
    #[error("blob {name} has {bytes} bytes; the store takes up to {MAX_BLOB_BYTES}")]
    TooLarge {
        /// The blob.
        name: BlobName,
        /// Its size.
        bytes: u64,
    },
    /// The folder or bucket does not answer as it should.
    #[error("the store cannot {what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: Arc<object_store::Error>,
    },
    /// A content coder failed.
    #[error("cannot encode blob {name}: {source}")]
    Encode {
        /// The blob.
        name: BlobName,
        /// Why it failed.
        source: Arc<std::io::Error>,
    },
}

pub(super) fn io(what: String, source: object_store::Error) -> StoreError {
    StoreError::Io {
        what,
        source: Arc::new(source),
    }
}
