//! In which forms is a blob held in memory, and how much of it does that take?

use std::{
    any::Any,
    sync::{Arc, OnceLock},
};

use belvedere_scene::{BlobHash, BlobName};
use bytes::Bytes;
use quick_cache::Weighter;
use tokio::sync::OnceCell;

use super::{Coding, coding, seals::Seal};

/// One stored form of a blob.
#[derive(Debug)]
pub struct Representation {
    /// The bytes as they go over the wire.
    pub bytes: Bytes,
    /// The strong entity tag with its quotes: `"{hash}"`, `"{hash}-zstd"` or `"{hash}-gzip"`.
    pub etag: Bytes,
    /// What whoever sends this form has worked out once.
    pub derived: Derived,
    /// By which it is known again when it is read anew; none of what is in no store.
    seal: OnceLock<Seal>,
}

impl Representation {
    /// A form from which nothing is derived yet.
    #[must_use]
    pub fn new(bytes: Bytes, etag: Bytes) -> Self {
        Self {
            bytes,
            etag,
            derived: Derived::default(),
            seal: OnceLock::new(),
        }
    }

    /// Takes note of the seal of its bytes, if it has none.
    pub(super) fn seal_with(&self, seal: Option<Seal>) {
        if let Some(seal) = seal {
            // The first one says the same.
            _ = self.seal.set(seal);
        }
    }

    pub(super) fn seal(&self) -> Option<&Seal> {
        self.seal.get()
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

/// Which forms of one blob are stored, and those of them that are in memory.
#[derive(Debug)]
pub struct Representations {
    /// The bytes that the name hashes.
    identity: Slot,
    /// Zstandard, when it saves enough.
    zstd: Option<Slot>,
    /// gzip, when it saves enough.
    gzip: Option<Slot>,
}

/// A stored form: empty until somebody asks for it, and then what was read, or nothing where that is damaged.
pub(super) type Slot = OnceCell<Option<Representation>>;

impl Representations {
    /// Those of a blob that is stored with these codings, of which nothing is read yet.
    pub(super) fn stored(with: impl Fn(Coding) -> bool) -> Self {
        let slot = |coding| with(coding).then(Slot::default);
        Self {
            identity: Slot::default(),
            zstd: slot(Coding::Zstd),
            gzip: slot(Coding::Gzip),
        }
    }

    /// Nothing but an identity.
    #[must_use]
    pub fn alone(identity: Representation) -> Self {
        Self {
            identity: Some(identity).into(),
            zstd: None,
            gzip: None,
        }
    }

    /// An identity, and other forms of it.
    pub(super) fn held(identity: Representation, variants: impl IntoIterator<Item = (Coding, Representation)>) -> Self {
        let mut forms = Self::alone(identity);
        for (coding, form) in variants {
            let slot = Some(Some(form).into());
            match coding {
                Coding::Zstd => forms.zstd = slot,
                Coding::Gzip => forms.gzip = slot,
            }
        }
        forms
    }

    /// Those of bytes that are in no store, tagged as if they were: with all codings that save enough.
    pub(crate) fn of_bytes(bytes: Bytes) -> Self {
        let hash = BlobHash::of(&bytes);
        // An encoder that fails, as without memory, costs a form.
        let variants = coding::variants(&bytes).unwrap_or_default();
        let variants = variants.into_iter().map(|(coding, encoded)| {
            let form = Representation::new(encoded.into(), etag(hash, Some(coding)));
            (coding, form)
        });
        Self::held(Representation::new(bytes, etag(hash, None)), variants)
    }

    /// The form with this coding, if it is in memory; `None` stands for the identity.
    #[must_use]
    pub fn of(&self, coding: Option<Coding>) -> Option<&Representation> {
        self.slot(coding)?.get()?.as_ref()
    }

    /// Whether there is a form with this coding, in memory or not, which nobody has found damaged.
    #[must_use]
    pub fn has(&self, coding: Option<Coding>) -> bool {
        self.slot(coding).is_some_and(|slot| !matches!(slot.get(), Some(None)))
    }

    /// Whether there is more than one form to choose from.
    #[must_use]
    pub fn has_variants(&self) -> bool {
        Coding::ALL.into_iter().any(|coding| self.has(Some(coding)))
    }

    pub(super) fn slot(&self, coding: Option<Coding>) -> Option<&Slot> {
        match coding {
            None => Some(&self.identity),
            Some(Coding::Zstd) => self.zstd.as_ref(),
            Some(Coding::Gzip) => self.gzip.as_ref(),
        }
    }
}

/// The strong entity tag of a form.
pub(super) fn etag(hash: BlobHash, coding: Option<Coding>) -> Bytes {
    let tag = match coding {
        None => format!("\"{hash}\""),
        Some(coding) => format!("\"{hash}-{}\"", coding.token()),
    };
    tag.into()
}

/// A blob as the cache holds it.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) forms: Arc<Representations>,
    /// What it weighed when it was put there: forms that are read later are weighed when it is put there again.
    pub(super) weight: u64,
}

impl Entry {
    pub(super) fn of(forms: Arc<Representations>) -> Self {
        /// The name and the cache's own entry.
        const BLOB_BYTES: u64 = 512;
        /// Its tag, and what is derived from it.
        const FORM_BYTES: u64 = 4096;
        let codings = [None].into_iter().chain(Coding::ALL.map(Some));
        let held = codings.filter_map(|coding| forms.of(coding));
        let weight = BLOB_BYTES + held.map(|form| form.bytes.len() as u64 + FORM_BYTES).sum::<u64>();
        Self { forms, weight }
    }
}

/// Weighs blobs in the cache.
#[derive(Debug, Clone)]
pub(super) struct ByBytes;

impl Weighter<BlobName, Entry> for ByBytes {
    fn weight(&self, _: &BlobName, entry: &Entry) -> u64 {
        entry.weight
    }
}
