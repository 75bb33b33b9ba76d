//! How is a form known again that was checked once and is read anew, without checking it once more?
//!
//! To check a form is to decode it and to hash what comes out. When it has proved right, a seal of its stored bytes is remembered:
//! a message authentication code (GMAC, NIST SP 800-38D) under a key that this process has made for itself and tells nobody.
//! Whatever has this seal later is what was checked, as surely as a hash of 128 bits says it, in a tenth of the time. The tag of
//! one message is compared with that of another under the same nonce, which gives nothing away where no tag is ever told.
//!
//! Each [section](SECTION_BYTES) of a form has a tag of its own, so that some of it can be read anew without the rest.

use std::{
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use aws_lc_rs::{
    aead::{AES_128_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, Tag, UnboundKey},
    constant_time::verify_slices_are_equal,
};
use belvedere_scene::BlobName;
use quick_cache::{Weighter, sync::Cache};

use super::Coding;

/// What the seals of one small blob take in memory, with its name and the cache's own entry.
const BLOB_BYTES: u64 = 256;
/// So much of a form is known again by itself; the last section may be shorter.
const SECTION_BYTES: usize = 64 << 10;
const TAG_BYTES: usize = 16;

/// What is remembered of a stored form.
#[derive(Debug, Clone)]
pub(super) struct Seal {
    /// How many bytes it has.
    pub(super) length: u32,
    /// That of the first section; the others follow.
    nonce: u64,
    tags: Arc<[[u8; TAG_BYTES]]>,
}

/// What is remembered of a blob.
#[derive(Debug, Clone, Default)]
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
    known: Cache<BlobName, Known, ByBytes>,
}

/// Weighs what is remembered.
#[derive(Debug, Clone)]
struct ByBytes;

impl Weighter<BlobName, Known> for ByBytes {
    fn weight(&self, _: &BlobName, known: &Known) -> u64 {
        let tags = known.seals.iter().flatten().map(|seal| seal.tags.len()).sum::<usize>();
        BLOB_BYTES + (tags * TAG_BYTES) as u64
    }
}

impl Seals {
    /// As many as this holds.
    pub(super) fn new(bytes: u64) -> Self {
        let mut key = [0; 16];
        getrandom::fill(&mut key).expect("the system gives random numbers");
        let key = UnboundKey::new(&AES_128_GCM, &key).expect("the key is as long as it must be");
        Self {
            key: LessSafeKey::new(key),
            next: AtomicU64::new(0),
            known: Cache::with_weighter((bytes / BLOB_BYTES) as usize, bytes, ByBytes),
        }
    }

    /// What is known of a blob.
    pub(super) fn of(&self, name: &BlobName) -> Option<Known> {
        self.known.get(name)
    }

    /// Remembers a form that was checked, of a blob that is stored with these codings; gives its seal.
    pub(super) fn add(
        &self,
        name: &BlobName,
        coding: Option<Coding>,
        bytes: &[u8],
        with: impl Fn(Coding) -> bool,
    ) -> Option<Seal> {
        let length = u32::try_from(bytes.len()).ok()?;
        let sections = bytes.chunks(SECTION_BYTES);
        let nonce = self.next.fetch_add(sections.len() as u64, Ordering::Relaxed);
        let tag = |(nonce, section)| self.tag(nonce, section)?.as_ref().try_into().ok();
        let tags = (nonce..).zip(sections).map(tag).collect::<Option<_>>()?;
        let seal = Seal { length, nonce, tags };
        let mut known = self.of(name).unwrap_or_default();
        known.with = Coding::ALL.map(with);
        known.seals[place(coding)] = Some(seal.clone());
        self.known.insert(name.clone(), known);
        Some(seal)
    }

    /// Whether these are the bytes that were sealed.
    pub(super) fn holds(&self, seal: &Seal, bytes: &[u8]) -> bool {
        self.holds_sections(seal, &(0..seal.length as usize), bytes)
    }

    /// Whether these are the bytes of just these [sections](Seal::sections).
    pub(super) fn holds_sections(&self, seal: &Seal, sections: &Range<usize>, bytes: &[u8]) -> bool {
        let first = sections.start / SECTION_BYTES;
        // Another one may have been sealed meanwhile, which is shorter.
        let tags = seal.tags.get(first..).unwrap_or_default();
        let mut tagged = (seal.nonce + first as u64..).zip(tags).zip(bytes.chunks(SECTION_BYTES));
        bytes.len() == sections.len()
            && sections.end <= seal.length as usize
            && tagged.all(|((nonce, expected), section)| {
                let tag = self.tag(nonce, section);
                tag.is_some_and(|tag| verify_slices_are_equal(tag.as_ref(), expected).is_ok())
            })
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

impl Seal {
    /// Whether this is the seal that was given at the same time: of the very same bytes.
    pub(super) fn is(&self, other: &Self) -> bool {
        self.nonce == other.nonce
    }

    /// The sections in which these bytes lie.
    pub(super) fn sections(&self, bytes: &Range<usize>) -> Range<usize> {
        let end = bytes.end.next_multiple_of(SECTION_BYTES).min(self.length as usize);
        bytes.start / SECTION_BYTES * SECTION_BYTES..end
    }
}

impl Known {
    /// Whether the blob is stored with this coding.
    pub(super) fn with(&self, coding: Coding) -> bool {
        self.with[place(Some(coding)) - 1]
    }

    /// The seal of a form that was checked.
    pub(super) fn seal(&self, coding: Option<Coding>) -> Option<Seal> {
        self.seals[place(coding)].clone()
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
            let seals = Seals::new(1 << 20);
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
            prop_assert!(!Seals::new(1 << 20).holds(&seal, &bytes));
            seals.forget(&name);
            prop_assert!(seals.of(&name).is_none());
        }

        #[test]
        fn some_of_a_form_is_known_again_by_its_sections(
            length in 1..5 * SECTION_BYTES, from in any::<usize>(), to in any::<usize>(), flipped in 1u8..,
        ) {
            let bytes: Vec<u8> = (0..length).map(|at| (at % 251) as u8).collect();
            let (from, to) = (from % length, to % length);
            let asked = from.min(to)..from.max(to) + 1;
            let seals = Seals::new(1 << 20);
            let name = BlobName::of(&bytes, "bin").unwrap();
            seals.add(&name, None, &bytes, |_| false);
            let seal = seals.of(&name).unwrap().seal(None).unwrap();
            let sections = seal.sections(&asked);
            prop_assert!(sections.start <= asked.start && asked.end <= sections.end);
            prop_assert!(sections.len() < asked.len() + 2 * SECTION_BYTES);
            let read = &bytes[sections.clone()];
            prop_assert!(seals.holds_sections(&seal, &sections, read));
            prop_assert!(!seals.holds_sections(&seal, &sections, &read[1..]));
            let mut damaged = read.to_vec();
            damaged[asked.start - sections.start] ^= flipped;
            prop_assert!(!seals.holds_sections(&seal, &sections, &damaged));
            // What lies elsewhere is not what lies here.
            let elsewhere = sections.start + SECTION_BYTES..sections.end + SECTION_BYTES;
            if let Some(other) = bytes.get(elsewhere) {
                prop_assert!(!seals.holds_sections(&seal, &sections, other));
            }
        }
    }
}
