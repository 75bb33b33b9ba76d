//! How is a form known again that was checked once and is read anew, without checking it once more?
//!
//! To check a form is to decode it and to hash what comes out. When it has proved right, a seal of its stored bytes is remembered:
//! a message authentication code (GMAC, NIST SP 800-38D) under a key that this process has made for itself and tells nobody.
//! Whatever has this seal later is what was checked, as surely as a hash of 128 bits says it, in a tenth of the time. The tag of
//! one message is compared with that of another under the same nonce, which gives nothing away where no tag is ever told.

use std::sync::atomic::{AtomicU64, Ordering};

use aws_lc_rs::{
    aead::{AES_128_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, Tag, UnboundKey},
    constant_time::verify_slices_are_equal,
};
use belvedere_scene::BlobName;
use quick_cache::sync::Cache;

use super::Coding;

/// What a seal of one blob takes in memory, with its name and the cache's own entry.
pub(super) const BLOB_BYTES: u64 = 256;

/// What is remembered of a stored form.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seal {
    /// How many bytes it has.
    pub(super) length: u32,
    nonce: u64,
    tag: [u8; 16],
}

/// What is remembered of a blob.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Known {
    /// Which codings it is stored with.
    with: [bool; Coding::ALL.len()],
    seals: [Option<Seal>; 1 + Coding::ALL.len()],
}

/// The seals of many blobs; those that nobody asks for are forgotten first.
#[derive(Debug)]
pub(super) struct Seals {
    key: LessSafeKey,
    next: AtomicU64,
    known: Cache<BlobName, Known>,
}

impl Seals {
    /// For so many blobs.
    pub(super) fn new(blobs: usize) -> Self {
        let mut key = [0; 16];
        getrandom::fill(&mut key).expect("the system gives random numbers");
        let key = UnboundKey::new(&AES_128_GCM, &key).expect("the key is as long as it must be");
        Self {
            key: LessSafeKey::new(key),
            next: AtomicU64::new(0),
            known: Cache::new(blobs),
        }
    }

    /// What is known of a blob.
    pub(super) fn of(&self, name: &BlobName) -> Option<Known> {
        self.known.get(name)
    }

    /// Remembers a form that was checked, of a blob that is stored with these codings.
    pub(super) fn add(&self, name: &BlobName, coding: Option<Coding>, bytes: &[u8], with: impl Fn(Coding) -> bool) {
        let Ok(length) = u32::try_from(bytes.len()) else { return };
        let nonce = self.next.fetch_add(1, Ordering::Relaxed);
        let Some(tag) = self.tag(nonce, bytes) else { return };
        let Ok(tag) = tag.as_ref().try_into() else { return };
        let mut known = self.of(name).unwrap_or_default();
        known.with = Coding::ALL.map(with);
        known.seals[place(coding)] = Some(Seal { length, nonce, tag });
        self.known.insert(name.clone(), known);
    }

    /// Whether these are the bytes that were sealed.
    pub(super) fn holds(&self, seal: &Seal, bytes: &[u8]) -> bool {
        bytes.len() as u64 == u64::from(seal.length)
            && self
                .tag(seal.nonce, bytes)
                .is_some_and(|tag| verify_slices_are_equal(tag.as_ref(), &seal.tag).is_ok())
    }

    /// Forgets a blob, whose files may have changed.
    pub(super) fn forget(&self, name: &BlobName) {
        self.known.remove(name);
    }

    fn tag(&self, nonce: u64, bytes: &[u8]) -> Option<Tag> {
        let mut unique = [0; NONCE_LEN];
        unique[..8].copy_from_slice(&nonce.to_le_bytes());
        let nonce = Nonce::assume_unique_for_key(unique);
        self.key
            .seal_in_place_separate_tag(nonce, Aad::from(bytes), &mut [])
            .ok()
    }
}

impl Known {
    /// Whether the blob is stored with this coding.
    pub(super) fn with(&self, coding: Coding) -> bool {
        self.with[place(Some(coding)) - 1]
    }

    /// The seal of a form that was checked.
    pub(super) fn seal(&self, coding: Option<Coding>) -> Option<Seal> {
        self.seals[place(coding)]
    }
}

/// Where a form stands among all.
fn place(coding: Option<Coding>) -> usize {
    match coding {
        None => 0,
        Some(Coding::Zstd) => 1,
        Some(Coding::Gzip) => 2,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_seal_holds_for_the_bytes_that_were_sealed_and_for_no_others(
            bytes in proptest::collection::vec(any::<u8>(), 1..3000), at in any::<usize>(), flipped in 1u8..,
        ) {
            let seals = Seals::new(8);
            let name = BlobName::of(&bytes, "bin").unwrap();
            seals.add(&name, Some(Coding::Gzip), &bytes, |coding| coding == Coding::Gzip);
            let known = seals.of(&name).unwrap();
            prop_assert!(known.with(Coding::Gzip) && !known.with(Coding::Zstd));
            prop_assert!(known.seal(None).is_none() && known.seal(Some(Coding::Zstd)).is_none());
            let seal = known.seal(Some(Coding::Gzip)).unwrap();
            prop_assert!(seals.holds(&seal, &bytes));
            prop_assert!(!seals.holds(&seal, &bytes[1..]));
            let mut damaged = bytes.clone();
            damaged[at % bytes.len()] ^= flipped;
            prop_assert!(!seals.holds(&seal, &damaged));
            // The seals of another process say nothing here.
            prop_assert!(!Seals::new(8).holds(&seal, &bytes));
            seals.forget(&name);
            prop_assert!(seals.of(&name).is_none());
        }
    }
}
