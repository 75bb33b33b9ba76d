//! Why can a blob not be stored or read? Damage is told apart from a store that does not answer.

use std::{borrow::Cow, error::Error, io, sync::Arc};

use belvedere_scene::{BlobHash, BlobName};
use object_store::client::{HttpError, HttpErrorKind};

use super::{Coding, MAX_BLOB_BYTES};

const REQUEST_TIMEOUT: u16 = 408;
const TOO_MANY: u16 = 429;

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
    /// A stored form is not one of its blob; whoever reads the blob gets the others.
    #[error("the {} form of blob {name} is damaged; delete its file and bake its scene again", coding.token())]
    CorruptVariant {
        /// The blob.
        name: BlobName,
        /// Which form.
        coding: Coding,
    },
    /// A stored form was written anew while somebody read it: what was sent of it and what is there do not go together.
    #[error("the {} form of blob {name} was stored anew while it was read; whoever asks again gets it whole", coding.token())]
    Changed {
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
    #[error("the store cannot {what}: {}", without_markup(&cause.to_string()))]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed. What it says may hold the document that a server has sent, so it is told as above alone.
        cause: Arc<object_store::Error>,
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

impl StoreError {
    /// Whether folder or bucket did not answer, or said that they cannot just now, so that the same may work another time.
    #[must_use]
    pub fn was_away(&self) -> bool {
        self.is_because(|cause| {
            if refused_with(cause).is_some_and(|status| status >= 500 || [REQUEST_TIMEOUT, TOO_MANY].contains(&status))
            {
                return true;
            }
            if let Some(failed) = cause.downcast_ref::<HttpError>() {
                return !matches!(failed.kind(), HttpErrorKind::Unknown);
            }
            cause.downcast_ref::<io::Error>().is_some_and(|error| {
                use io::ErrorKind as K;
                matches!(
                    error.kind(),
                    K::ConnectionRefused
                        | K::ConnectionReset
                        | K::ConnectionAborted
                        | K::TimedOut
                        | K::StaleNetworkFileHandle
                )
            })
        })
    }

    /// Whether the disk, or a quota on it, had no room.
    #[must_use]
    pub fn found_no_room(&self) -> bool {
        self.is_because(|cause| {
            let error = cause.downcast_ref::<io::Error>();
            error.is_some_and(|error| matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded))
        })
    }

    fn is_because(&self, is_so: impl Fn(&(dyn Error + 'static)) -> bool) -> bool {
        let Self::Io { cause, .. } = self else { return false };
        let mut cause: Option<&(dyn Error + 'static)> = Some(cause.as_ref());
        while let Some(this) = cause {
            if is_so(this) {
                return true;
            }
            cause = this.source();
        }
        false
    }
}

/// The status that a bucket's server answered with: `object_store` tells it in words alone.
fn refused_with(cause: &(dyn Error + 'static)) -> Option<u16> {
    let told = cause.to_string();
    let status = told.strip_prefix("Server returned non-2xx status code: ")?;
    status.get(..3)?.parse().ok()
}

pub(super) fn io(what: String, cause: object_store::Error) -> StoreError {
    StoreError::Io {
        what,
        cause: Arc::new(cause),
    }
}

/// Instead of the XML that a store answers with, what that says to people.
fn without_markup(told: &str) -> Cow<'_, str> {
    let starts = ["<?xml", "<Error", "<!DOCTYPE", "<html"];
    let Some(start) = starts.into_iter().filter_map(|mark| told.find(mark)).min() else {
        return Cow::Borrowed(told);
    };
    let (before, document) = told.split_at(start);
    let message = document
        .split_once("<Message>")
        .and_then(|(_, rest)| rest.split_once("</Message>"));
    match message {
        Some((message, _)) => Cow::Owned(format!("{before}{message}")),
        None => Cow::Borrowed(before.trim_end_matches([' ', ':'])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documents_of_a_store_are_not_told_but_what_they_say() {
        let status = "Server returned non-2xx status code: 404 Not Found: ";
        let xml = "<?xml version=\"1.0\"?>\n<Error><Code>NoSuchBucket</Code><Message>The bucket does not exist</Message></Error>";
        for (document, told) in [
            (xml, "404 Not Found: The bucket does not exist"),
            ("<html><body>gone</body></html>", "404 Not Found"),
            ("gone", "404 Not Found: gone"),
        ] {
            let source = format!("{status}{document}").into();
            let error = anyhow::Error::from(io(
                "list its blobs".to_owned(),
                object_store::Error::Generic { store: "S3", source },
            ));
            let sentence = format!("{:#}", error.context("cannot open the store"));
            assert!(sentence.ends_with(told), "{sentence}");
        }
    }
}
