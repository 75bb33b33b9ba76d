//! How does a blob come into memory, and is it what its name promises?
//!
//! From a folder only what is asked for is read: an identity is hashed, and of a variant what it decodes to, which is the name of both.
//! What has proved right before is known by its [seal](super::seals). A look at which forms there are, and the form that is wished
//! for, are one errand of the blocking pool: to go there and come back for each file and each check would take longer than reading
//! them. A form that is known, and in the system's memory, needs no errand. From a bucket a blob comes as a whole.

use std::{
    io::ErrorKind,
    path::Path,
    sync::{Arc, atomic::Ordering},
};

use belvedere_scene::{BlobHash, BlobName};
use bytes::Bytes;

use super::{
    BlobStore, Coding, Folder, Representation, Representations, StoreError, at_hand, coding,
    forms::{Entry, etag},
    identity_key, io,
    unfinished::generic,
    variant_key,
};

/// What takes longer to read than to hand to another thread is not read by one that others wait for.
const AT_HAND_BYTES: u32 = 256 << 10;

/// What is stored of a blob.
struct Stored {
    identity: Bytes,
    variants: Vec<(Coding, Bytes)>,
}

impl BlobStore {
    /// The bytes that a blob's name hashes; `None` when there is no such blob.
    ///
    /// # Errors
    /// When the store fails or the stored bytes are damaged.
    pub async fn get(&self, name: &BlobName) -> Result<Option<Bytes>, StoreError> {
        let Some(forms) = self.forms(name, None).await? else {
            return Ok(None);
        };
        match self.load(name, &forms, None).await {
            Ok(()) => Ok(forms.of(None).map(|identity| identity.bytes.clone())),
            Err(StoreError::Missing(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Which forms there are of a blob; `None` when there is no such blob. If none is in memory, the one that is wished for
    /// is read, or the identity where there is no such form.
    ///
    /// # Errors
    /// When the store fails or the stored bytes are damaged.
    pub async fn forms(
        &self,
        name: &BlobName,
        wished: Option<Coding>,
    ) -> Result<Option<Arc<Representations>>, StoreError> {
        if let Some(Entry { forms, .. }) = self.inner.cache.get(name) {
            let chosen = wished.filter(|coding| forms.has(Some(*coding)));
            // Otherwise it is read, and counted then.
            if forms.of(chosen).is_some() {
                self.was_in_memory();
            }
            return Ok(Some(forms));
        }
        self.inner.misses.fetch_add(1, Ordering::Relaxed);
        let looking = async { self.look(name, wished).await.map(|forms| Entry::of(Arc::new(forms))) };
        // Readers of one blob wait for the first of them, so that a burst loads it once.
        match self.inner.cache.get_or_insert_async(name, looking).await {
            Ok(Entry { forms, .. }) => Ok(Some(forms)),
            Err(None) => Ok(None),
            Err(Some(error)) => Err(error),
        }
    }

    /// Reads one more form of a blob, which is in memory then unless it proves damaged: then it is no more among its forms.
    ///
    /// # Errors
    /// When the store fails, the identity is damaged, or the blob has been deleted since.
    pub async fn load(
        &self,
        name: &BlobName,
        forms: &Arc<Representations>,
        coding: Option<Coding>,
    ) -> Result<(), StoreError> {
        let (Some(slot), true) = (forms.slot(coding), self.inner.folder.is_some()) else {
            return Ok(());
        };
        if slot.initialized() {
            return Ok(());
        }
        self.inner.misses.fetch_add(1, Ordering::Relaxed);
        let reading = || {
            let (store, name, forms) = (self.clone(), name.clone(), forms.clone());
            aside(move || store.read_form(&name, &forms, coding))
        };
        match slot.get_or_try_init(reading).await {
            Ok(_) => {
                self.weigh(name, forms);
                Ok(())
            }
            Err(error) => {
                self.inner.cache.remove(name);
                Err(error.unwrap_or_else(|| StoreError::Missing(name.clone())))
            }
        }
    }

    /// The bytes that a blob's name hashes if they are in memory: no waiting and, if they are not, no trace.
    #[must_use]
    pub fn in_memory(&self, name: &BlobName) -> Option<Bytes> {
        let bytes = self.inner.cache.get(name)?.forms.of(None)?.bytes.clone();
        self.was_in_memory();
        Some(bytes)
    }

    /// Which forms there are of a blob, if that is known: no waiting.
    #[must_use]
    pub fn known(&self, name: &BlobName) -> Option<Arc<Representations>> {
        if let Some(Entry { forms, .. }) = self.inner.cache.get(name) {
            return Some(forms);
        }
        let known = self.inner.seals.of(name)?;
        Some(Arc::new(Representations::stored(|coding| known.with(coding))))
    }

    /// Reads one more form of a blob if that needs no waiting: it was checked before, and is in the system's memory. Says whether it
    /// is in memory then.
    #[must_use]
    pub fn load_now(&self, name: &BlobName, forms: &Arc<Representations>, coding: Option<Coding>) -> bool {
        let read = || {
            let slot = forms.slot(coding)?;
            let folder = self.inner.folder.as_ref()?;
            let seal = self.inner.seals.of(name)?.seal(coding)?;
            if seal.length > AT_HAND_BYTES {
                return None;
            }
            let bytes = at_hand::read(&folder.opened, &file_name(name, coding), seal.length as usize)?;
            if !self.inner.seals.holds(&seal, &bytes) {
                return None;
            }
            let form = Representation::new(bytes.into(), etag(name.hash(), coding));
            form.seal_with(Some(seal));
            slot.set(Some(form)).ok()
        };
        if read().is_none() {
            return forms.of(coding).is_some();
        }
        self.inner.misses.fetch_add(1, Ordering::Relaxed);
        self.inner.cache.insert(name.clone(), Entry::of(forms.clone()));
        self.weigh(name, forms);
        true
    }

    /// A blob weighs more since another form of it is here; unless it has been thrown out, or read anew, meanwhile.
    fn weigh(&self, name: &BlobName, forms: &Arc<Representations>) {
        let cache = &self.inner.cache;
        while let Some(held) = cache.peek(name).filter(|held| Arc::ptr_eq(&held.forms, forms)) {
            let entry = Entry::of(forms.clone());
            // Forms that come at the same time are weighed by whoever comes last.
            if entry.weight == held.weight || cache.replace(name.clone(), entry, true).is_err() {
                return;
            }
        }
    }

    /// Counts that somebody was answered from memory.
    pub fn was_in_memory(&self) {
        self.inner.hits.add(1);
    }

    /// Which forms there are; what comes damaged from a bucket was perhaps changed on its way, and is read once more.
    async fn look(&self, name: &BlobName, wished: Option<Coding>) -> Result<Representations, Option<StoreError>> {
        if self.inner.folder.is_some() {
            let (store, name) = (self.clone(), name.clone());
            return aside(move || store.look_in_folder(&name, wished)).await;
        }
        let forms = match self.load_once(name, false).await {
            Err(Some(StoreError::Corrupt { .. } | StoreError::CorruptVariant { .. })) => {
                tracing::warn!(%name, "a blob came damaged from the bucket; it is read again");
                self.load_once(name, true).await?
            }
            loaded => loaded?,
        };
        for coding in [None].into_iter().chain(Coding::ALL.map(Some)) {
            if let Some(form) = forms.of(coding) {
                let with = |coding| forms.has(Some(coding));
                form.seal_with(self.inner.seals.add(name, coding, &form.bytes, with));
            }
        }
        Ok(forms)
    }

    fn look_in_folder(&self, name: &BlobName, wished: Option<Coding>) -> Result<Representations, Option<StoreError>> {
        let folder = self.inner.folder.as_ref().ok_or(None)?;
        let there = |coding| is_there(folder, &file_name(name, coding));
        if !there(None)? {
            self.inner.seals.forget(name);
            return Err(None);
        }
        let mut with = Vec::new();
        for coding in Coding::ALL {
            if coding::worth_trying(name.ext()) && there(Some(coding))? {
                with.push(coding);
            }
        }
        let forms = Representations::stored(|coding| with.contains(&coding));
        let wished = wished.filter(|coding| with.contains(coding));
        let form = self.read_form(name, &forms, wished)?;
        if let Some(slot) = forms.slot(wished) {
            // Nobody else has it yet.
            let _ = slot.set(form);
        }
        Ok(forms)
    }

    /// Reads a stored form from the folder, and checks it; none when it is a variant that is damaged, or gone. No error is that the
    /// blob itself is gone.
    fn read_form(
        &self,
        name: &BlobName,
        forms: &Representations,
        coding: Option<Coding>,
    ) -> Result<Option<Representation>, Option<StoreError>> {
        let folder = self.inner.folder.as_ref().ok_or(None)?;
        let Some(bytes) = file(&folder.path, &file_name(name, coding))? else {
            return if coding.is_none() { Err(None) } else { Ok(None) };
        };
        let seals = &self.inner.seals;
        let mut seal = seals.of(name).and_then(|known| known.seal(coding));
        if !seal.as_ref().is_some_and(|seal| seals.holds(seal, &bytes)) {
            if seal.is_some() {
                // What was known of it is not so any more.
                seals.forget(name);
            }
            match coding {
                None => is_named(name, &bytes)?,
                Some(coding) if coding.decodes_to_name(&bytes, name) => {}
                Some(coding) => {
                    self.tell_damaged(name, coding);
                    return Ok(None);
                }
            }
            seal = seals.add(name, coding, &bytes, |coding| forms.slot(Some(coding)).is_some());
        }
        let form = Representation::new(bytes, etag(name.hash(), coding));
        form.seal_with(seal);
        Ok(Some(form))
    }

    /// Tells of a damaged variant, once until it is written anew.
    fn tell_damaged(&self, name: &BlobName, coding: Coding) {
        if self.damaged().insert(variant_key(name, coding)) {
            self.inner.damaged_variants.fetch_add(1, Ordering::Relaxed);
            let error = StoreError::CorruptVariant {
                name: name.clone(),
                coding,
            };
            tracing::error!(%error, "it is served in its other forms");
        }
    }

    /// Loads all forms of a blob, with the variants that are whole if it may do `without` others.
    pub(super) async fn load_once(
        &self,
        name: &BlobName,
        without: bool,
    ) -> Result<Representations, Option<StoreError>> {
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
            if !without {
                return Err(Some(StoreError::CorruptVariant {
                    name: name.clone(),
                    coding,
                }));
            }
            self.tell_damaged(name, coding);
        }
        Ok(forms)
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

/// The file that holds a form.
pub(super) fn file_name(name: &BlobName, coding: Option<Coding>) -> String {
    match coding {
        None => name.to_string(),
        Some(coding) => format!("{name}.{}", coding.file_suffix()),
    }
}

fn is_there(folder: &Folder, file: &str) -> Result<bool, StoreError> {
    let found = folder.path.join(file).try_exists();
    found.map_err(|error| io(format!("look for {file}"), generic(error)))
}

/// That these are the bytes which a name hashes.
fn is_named(name: &BlobName, bytes: &[u8]) -> Result<(), StoreError> {
    let found = BlobHash::of(bytes);
    if found == name.hash() {
        return Ok(());
    }
    Err(StoreError::Corrupt {
        name: name.clone(),
        bytes: bytes.len(),
        found,
    })
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
        is_named(name, &identity)?;
        let (whole, damaged): (Vec<_>, Vec<_>) = variants
            .into_iter()
            .partition(|(coding, bytes)| coding.decodes_to(bytes, &identity));
        let form = |bytes, coding| Representation::new(bytes, etag(name.hash(), coding));
        let variants = whole
            .into_iter()
            .map(|(coding, bytes)| (coding, form(bytes, Some(coding))));
        let forms = Representations::held(form(identity, None), variants);
        Ok((forms, damaged.into_iter().map(|(coding, _)| coding).collect()))
    }
}
