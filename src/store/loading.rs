//! How does a blob come into memory, and is it what its name promises?
//!
//! Its identity is hashed, and its variants are decoded. Of files all of that is one errand of the blocking pool: to go there and
//! come back for each file and each check would take longer than reading them.

use std::{
    io::ErrorKind,
    path::Path,
    sync::{Arc, atomic::Ordering},
};

use belvedere_scene::{BlobHash, BlobName};
use bytes::Bytes;

use super::{
    BlobStore, Coding, Representation, Representations, StoreError, coding, identity_key, io, unfinished::generic,
    variant_key,
};

/// What is stored of a blob.
struct Stored {
    identity: Bytes,
    variants: Vec<(Coding, Bytes)>,
}

impl BlobStore {
    /// Loads a blob; what comes damaged from a bucket was perhaps changed on its way, and is read once more.
    pub(super) async fn load(&self, name: &BlobName) -> Result<Arc<Representations>, Option<StoreError>> {
        if self.inner.folder.is_none() {
            match self.load_once(name, false).await {
                Err(Some(StoreError::Corrupt { .. } | StoreError::CorruptVariant { .. })) => {
                    tracing::warn!(%name, "a blob came damaged from the bucket; it is read again");
                }
                loaded => return loaded,
            }
        }
        self.load_once(name, true).await
    }

    /// Loads a blob, with the variants that are whole if it may do `without` others.
    pub(super) async fn load_once(
        &self,
        name: &BlobName,
        without: bool,
    ) -> Result<Arc<Representations>, Option<StoreError>> {
        let (forms, damaged) = match &self.inner.folder {
            Some(folder) => {
                let (path, name) = (folder.path.clone(), name.clone());
                aside(move || from_files(&path, &name)?.ok_or(None)?.checked(&name).map_err(Some)).await?
            }
            None => {
                let (stored, name) = (
                    self.read_from_bucket(name).await.map_err(Some)?.ok_or(None)?,
                    name.clone(),
                );
                aside(move || stored.checked(&name)).await.map_err(Some)?
            }
        };
        for coding in damaged {
            let error = StoreError::CorruptVariant {
                name: name.clone(),
                coding,
            };
            if !without {
                return Err(Some(error));
            }
            if self.damaged().insert(variant_key(name, coding)) {
                self.inner.damaged_variants.fetch_add(1, Ordering::Relaxed);
                tracing::error!(%error, "it is served in its other forms");
            }
        }
        Ok(Arc::new(forms))
    }

    /// Whether a blob is there with just these bytes, and no variant of it is damaged.
    pub(super) async fn holds(&self, name: &BlobName, bytes: &Bytes) -> Result<bool, StoreError> {
        if self.stored_len(name).await? != Some(bytes.len() as u64) {
            return Ok(false);
        }
        let Some(folder) = &self.inner.folder else {
            return Ok(true);
        };
        let (path, name, bytes) = (folder.path.clone(), name.clone(), bytes.clone());
        aside(move || Ok(from_files(&path, &name)?.is_some_and(|stored| stored.is_whole(&bytes)))).await
    }

    async fn read_from_bucket(&self, name: &BlobName) -> Result<Option<Stored>, StoreError> {
        let Some(identity) = self.read(&identity_key(name)).await? else {
            return Ok(None);
        };
        let variant = async |coding| match coding::worth_trying(name.ext()) {
            true => self.read(&variant_key(name, coding)).await,
            false => Ok(None),
        };
        let [zstd, gzip] = Coding::ALL;
        let (first, second) = tokio::try_join!(variant(zstd), variant(gzip))?;
        let variants = [(zstd, first), (gzip, second)];
        Ok(Some(Stored {
            identity,
            variants: variants
                .into_iter()
                .filter_map(|(coding, bytes)| Some((coding, bytes?)))
                .collect(),
        }))
    }
}

/// Leaves something that takes a while to the blocking pool.
pub(super) async fn aside<T: Send + 'static>(errand: impl FnOnce() -> T + Send + 'static) -> T {
    let done = tokio::task::spawn_blocking(errand).await;
    done.expect("what reads, checks or encodes does not panic and is not aborted")
}

fn from_files(folder: &Path, name: &BlobName) -> Result<Option<Stored>, StoreError> {
    let Some(identity) = file(folder, &name.to_string())? else {
        return Ok(None);
    };
    let mut variants = Vec::new();
    if coding::worth_trying(name.ext()) {
        for coding in Coding::ALL {
            let variant = file(folder, variant_key(name, coding).as_ref())?;
            variants.extend(variant.map(|bytes| (coding, bytes)));
        }
    }
    Ok(Some(Stored { identity, variants }))
}

fn file(folder: &Path, name: &str) -> Result<Option<Bytes>, StoreError> {
    match std::fs::read(folder.join(name)) {
        Ok(bytes) => Ok(Some(bytes.into())),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(io(format!("read {name}"), generic(error))),
    }
}

impl Stored {
    /// Whether it is these bytes, and every variant is of them.
    fn is_whole(&self, bytes: &Bytes) -> bool {
        let mut variants = self.variants.iter();
        self.identity == *bytes && variants.all(|(coding, variant)| coding.decodes_to(variant, bytes))
    }

    /// All forms that are whole, and which are not.
    fn checked(self, name: &BlobName) -> Result<(Representations, Vec<Coding>), StoreError> {
        let Self { identity, variants } = self;
        let found = BlobHash::of(&identity);
        if found != name.hash() {
            return Err(StoreError::Corrupt {
                name: name.clone(),
                bytes: identity.len(),
                found,
            });
        }
        let (whole, damaged): (Vec<_>, Vec<_>) = variants
            .into_iter()
            .partition(|(coding, bytes)| coding.decodes_to(bytes, &identity));
        let mut forms = Representations {
            identity: Representation::new(identity, format!("\"{}\"", name.hash()).into()),
            zstd: None,
            gzip: None,
        };
        for (coding, bytes) in whole {
            let etag = format!("\"{}-{}\"", name.hash(), coding.token());
            let form = Some(Representation::new(bytes, etag.into()));
            match coding {
                Coding::Zstd => forms.zstd = form,
                Coding::Gzip => forms.gzip = form,
            }
        }
        Ok((forms, damaged.into_iter().map(|(coding, _)| coding).collect()))
    }
}
