//! In which forms is a blob held in memory, and how much of it does that take?

use std::{
    any::Any,
    sync::{Arc, OnceLock},
};

use belvedere_scene::{BlobHash, BlobName};
use bytes::Bytes;
use quick_cache::Weighter;

use super::{Coding, coding};

/// One stored form of a blob.
#[derive(Debug)]
pub struct Representation {
    /// The bytes as they go over the wire.
    pub bytes: Bytes,
    /// The strong entity tag with its quotes: `"{hash}"`, `"{hash}-zstd"` or `"{hash}-gzip"`.
    pub etag: Bytes,
    /// What whoever sends this form has worked out once.
    pub derived: Derived,
}

impl Representation {
    /// A form from which nothing is derived yet.
    #[must_use]
    pub fn new(bytes: Bytes, etag: Bytes) -> Self {
        Self {
            bytes,
            etag,
            derived: Derived::default(),
        }
    }
}

/// A value that a reader derives from a stored form; it is kept as long as the form is in memory.
#[derive(Debug, Default)]
pub struct Derived(OnceLock<Box<dyn Any + Send + Sync>>);

impl Derived {
    /// The derived value, made at the first call.
    ///
    /// # Panics
    /// When it was made as another type: one form has one kind of reader.
    pub fn get_or_make<T: Any + Send + Sync>(&self, make: impl FnOnce() -> T) -> &T {
        let made = self.0.get_or_init(|| Box::new(make()));
        made.downcast_ref().expect("one form has one kind of reader")
    }
}

/// Every stored form of one blob.
#[derive(Debug)]
pub struct Representations {
    /// The bytes that the name hashes.
    pub identity: Representation,
    /// Zstandard, when it saves enough.
    pub zstd: Option<Representation>,
    /// gzip, when it saves enough.
    pub gzip: Option<Representation>,
}

impl Representations {
    /// Those of bytes that are in no store, tagged as if they were: with all codings that save enough.
    pub(crate) fn of_bytes(bytes: Bytes) -> Self {
        let hash = BlobHash::of(&bytes);
        let tag = |end: &str| Bytes::from(format!("\"{hash}{end}\""));
        let (mut zstd, mut gzip) = (None, None);
        // An encoder that fails, as without memory, costs a form.
        for (coding, encoded) in coding::variants(&bytes).unwrap_or_default() {
            let form = Representation::new(encoded.into(), tag(&format!("-{}", coding.token())));
            match coding {
                Coding::Zstd => zstd = Some(form),
                Coding::Gzip => gzip = Some(form),
            }
        }
        Self {
            identity: Representation::new(bytes, tag("")),
            zstd,
            gzip,
        }
    }

    /// The form with this coding; `None` stands for the identity, which is always there.
    #[must_use]
    pub fn of(&self, coding: Option<Coding>) -> Option<&Representation> {
        match coding {
            None => Some(&self.identity),
            Some(Coding::Zstd) => self.zstd.as_ref(),
            Some(Coding::Gzip) => self.gzip.as_ref(),
        }
    }

    /// Whether there is more than one form to choose from.
    #[must_use]
    pub fn has_variants(&self) -> bool {
        self.zstd.is_some() || self.gzip.is_some()
    }

    pub(super) fn bytes(&self) -> u64 {
        let len = |form: Option<&Representation>| form.map_or(0, |form| form.bytes.len() as u64);
        len(Some(&self.identity)) + len(self.zstd.as_ref()) + len(self.gzip.as_ref())
    }
}

/// Weighs blobs in the cache.
#[derive(Debug, Clone)]
pub(super) struct ByBytes;

impl Weighter<BlobName, Arc<Representations>> for ByBytes {
    fn weight(&self, _: &BlobName, forms: &Arc<Representations>) -> u64 {
        /// Names, tags, what is derived from each form, and the cache's own entry.
        const OVERHEAD_BYTES: u64 = 4096;
        forms.bytes() + OVERHEAD_BYTES
    }
}
