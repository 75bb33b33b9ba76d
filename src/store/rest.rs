//! How does somebody who reads slowly get the rest of a form, without keeping all of it in memory meanwhile?
//!
//! A reader who shares the bytes of a form keeps them from being freed when the cache has let go of them, so a hundred slow ones would
//! hold a hundred blobs beside it. A [`Rest`] knows only where its bytes lie. As long as the cache has them it costs nothing; later it
//! reads a piece at a time from the store, of which each section is known again by its [seal](super::seals). What is not known any more
//! comes back into memory as a whole, and is checked as ever.
//!
//! A variant may be stored anew meanwhile: other bytes, of another length, that decode to the same blob. So a [`Rest`] of one holds the seal of
//! the whole that it began with, and gives nothing that is not of that; whoever reads it is cut off with [`StoreError::Changed`]. The bytes of an identity
//! are said by its name.
//!
//! Pieces are *lent*: their bytes are counted until they are freed. While much is lent, pieces are small, so that what readers hold
//! grows no further than by their number.

use std::{
    fs::File,
    future::Future,
    io::{self as std_io, Read, Seek, SeekFrom},
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use belvedere_scene::BlobName;
use bytes::Bytes;
use object_store::{GetOptions, ObjectStore, path::Path as Key};
use tokio_util::task::AbortOnDropHandle;

use super::{
    BlobStore, Coding, Representation, StoreError, first_bytes, io,
    loading::{aside, file_name},
    seals::Seal,
    unfinished::generic,
};

/// A usual piece.
const PIECE_BYTES: usize = 256 << 10;
/// One while much is lent.
const SMALL_PIECE_BYTES: usize = 16 << 10;
/// More than such a part of the cache's limit is much.
const MUCH: u64 = 4;

/// What of a form somebody has still to get. It holds none of its bytes.
#[derive(Debug, Clone)]
pub struct Rest {
    store: BlobStore,
    name: BlobName,
    variant: Option<Variant>,
    range: Range<usize>,
}

/// Which variant was begun with.
#[derive(Debug, Clone)]
struct Variant {
    coding: Coding,
    /// None is that of no stored bytes.
    seal: Option<Seal>,
}

impl Variant {
    /// Whether a form has the very bytes that were begun with, by when they were sealed.
    fn is(&self, form: &Representation) -> bool {
        let seals = self.seal.as_ref().zip(form.seal());
        seals.is_some_and(|(begun, there)| begun.is(there))
    }
}

impl Rest {
    fn coding(&self) -> Option<Coding> {
        self.variant.as_ref().map(|variant| variant.coding)
    }

    /// How many bytes these are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.range.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.range.is_empty()
    }

    /// The first of them were sent.
    pub fn advance(&mut self, bytes: usize) {
        self.range.start = self.range.end.min(self.range.start + bytes);
    }

    /// All of them, if they are in memory. Whoever keeps them keeps all that they are cut from.
    #[must_use]
    pub fn in_memory(&self) -> Option<Bytes> {
        let entry = self.store.inner.cache.get(&self.name)?;
        let form = entry.forms.of(self.coding())?;
        if self.variant.as_ref().is_some_and(|variant| !variant.is(form)) {
            return None;
        }
        form.bytes.get(self.range.clone())?;
        Some(form.bytes.slice(self.range.clone()))
    }

    /// The first of them, lent, if they are in memory.
    #[must_use]
    pub fn piece_in_memory(&self) -> Option<Bytes> {
        let bytes = self.in_memory()?;
        let piece = bytes.len().min(self.store.inner.lent.piece_bytes());
        Some(self.store.lend(bytes[..piece].to_vec()))
    }

    /// The first of them, lent: at least one where there are any.
    ///
    /// # Errors
    /// When the store fails, the bytes are damaged, or the blob has been deleted or the variant stored anew since.
    pub fn read(&self) -> impl Future<Output = Result<Bytes, StoreError>> + Send + use<> {
        let rest = self.clone();
        let runtime = self.store.inner.runtime.clone();
        async move {
            let reading = runtime.spawn(async move { rest.read_here().await });
            let read = AbortOnDropHandle::new(reading).await;
            read.map_err(|ended| io("read the rest of a blob".to_owned(), generic(ended.into())))?
        }
    }

    async fn read_here(self) -> Result<Bytes, StoreError> {
        if let Some(piece) = self.piece_in_memory() {
            return Ok(piece);
        }
        let Self {
            store,
            name,
            variant,
            range,
        } = &self;
        let (coding, seals) = (self.coding(), &store.inner.seals);
        let seal = match variant {
            Some(variant) => variant.seal.clone(),
            None => seals.of(name).and_then(|known| known.seal(None)),
        };
        let piece = range.start..range.end.min(range.start + store.inner.lent.piece_bytes());
        if let Some(seal) = &seal
            && let Some(bytes) = store.read_sealed(name, coding, seal, piece.clone()).await?
        {
            return Ok(store.lend(bytes));
        }
        let gone = || StoreError::Missing(name.clone());
        let forms = store.forms(name, coding).await?.ok_or_else(gone)?;
        store.load(name, &forms, coding).await?;
        let form = forms.of(coding).ok_or_else(gone)?;
        if let Some(Variant { coding, seal }) = variant
            && !seal.as_ref().is_some_and(|seal| seals.holds(seal, &form.bytes))
        {
            let (name, coding) = (name.clone(), *coding);
            return Err(StoreError::Changed { name, coding });
        }
        Ok(store.lend(form.bytes.get(piece).ok_or_else(gone)?.to_vec()))
    }
}

impl BlobStore {
    /// A part of a blob, or of this variant of it, for whoever may take it slowly.
    #[must_use]
    pub fn rest(&self, name: &BlobName, variant: Option<(Coding, &Representation)>, range: Range<usize>) -> Rest {
        let variant = variant.map(|(coding, form)| Variant {
            coding,
            seal: form.seal().cloned(),
        });
        Rest {
            store: self.clone(),
            name: name.clone(),
            variant,
            range,
        }
    }

    /// Bytes that a reader holds for itself, counted until they are freed.
    #[must_use]
    pub fn lend(&self, bytes: Vec<u8>) -> Bytes {
        Bytes::from_owner(self.inner.lent.lend(bytes))
    }

    /// Whether readers hold so much that they should not be given more than they need.
    #[must_use]
    pub fn has_lent_much(&self) -> bool {
        self.inner.lent.is_much()
    }

    /// Reads some of a form anew; none when it is not known again by its seal, and must be checked as a whole.
    async fn read_sealed(
        &self,
        name: &BlobName,
        coding: Option<Coding>,
        seal: &Seal,
        range: Range<usize>,
    ) -> Result<Option<Vec<u8>>, StoreError> {
        let seals = &self.inner.seals;
        let sections = seal.sections(&range);
        let Some(read) = self.read_part(&file_name(name, coding), sections.clone()).await? else {
            return Ok(None);
        };
        if !seals.holds_sections(seal, &sections, &read) {
            seals.forget(name);
            return Ok(None);
        }
        let from = range.start - sections.start;
        Ok(read.get(from..from + range.len()).map(<[u8]>::to_vec))
    }

    /// Some bytes of a file; none when there is no such file, or it has fewer.
    async fn read_part(&self, file: &str, range: Range<usize>) -> Result<Option<Bytes>, StoreError> {
        let failed = |cause| io(format!("read some of {file}"), cause);
        let Some(folder) = &self.inner.folder else {
            let range = Some((range.start as u64..range.end as u64).into());
            let options = GetOptions {
                range,
                ..GetOptions::default()
            };
            return match self.inner.objects.get_opts(&Key::from(file), options).await {
                Ok(found) => first_bytes::whole(found).await.map(Some).map_err(failed),
                Err(object_store::Error::NotFound { .. }) => Ok(None),
                Err(cause) => Err(failed(cause)),
            };
        };
        let path = folder.path.join(file);
        let read = aside(move || {
            let mut file = File::open(path)?;
            file.seek(SeekFrom::Start(range.start as u64))?;
            let mut bytes = vec![0; range.len()];
            file.read_exact(&mut bytes).map(|()| Bytes::from(bytes))
        });
        match read.await {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error)
                if matches!(
                    error.kind(),
                    std_io::ErrorKind::NotFound | std_io::ErrorKind::UnexpectedEof
                ) =>
            {
                Ok(None)
            }
            Err(error) => Err(failed(generic(error))),
        }
    }
}

/// What readers hold for themselves.
#[derive(Debug)]
pub(super) struct Lent {
    bytes: Arc<AtomicU64>,
    much: u64,
}

impl Lent {
    /// Beside a cache of so many bytes.
    pub(super) fn of(cache_bytes: u64) -> Self {
        Self {
            bytes: Arc::default(),
            much: cache_bytes / MUCH,
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    fn is_much(&self) -> bool {
        self.bytes() >= self.much
    }

    fn piece_bytes(&self) -> usize {
        if self.is_much() { SMALL_PIECE_BYTES } else { PIECE_BYTES }
    }

    fn lend(&self, bytes: Vec<u8>) -> Loan {
        self.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Loan {
            bytes,
            lent: self.bytes.clone(),
        }
    }
}

/// Bytes that are counted.
struct Loan {
    bytes: Vec<u8>,
    lent: Arc<AtomicU64>,
}

impl AsRef<[u8]> for Loan {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        self.lent.fetch_sub(self.bytes.len() as u64, Ordering::Relaxed);
    }
}
