//! Which content codings does a blob get, and are they worth their bytes?
//!
//! Made once at publish time, so the strongest setting that ends in reasonable time is right: Zstandard (RFC 8878)
//! with a content checksum, level by size, and gzip 9 (RFC 1952) for clients without Zstandard.

use std::io::{self, Read, Write};

use belvedere_scene::BlobName;

use super::MAX_BLOB_BYTES;

/// A content coding other than the identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    /// Zstandard.
    Zstd,
    /// gzip.
    Gzip,
}

impl Coding {
    /// All of them.
    pub(crate) const ALL: [Self; 2] = [Self::Zstd, Self::Gzip];

    /// Its name in `Content-Encoding`.
    #[must_use]
    pub fn token(self) -> &'static str {
        match self {
            Self::Zstd => "zstd",
            Self::Gzip => "gzip",
        }
    }

    /// What a variant's file name ends with.
    #[must_use]
    pub fn file_suffix(self) -> &'static str {
        match self {
            Self::Zstd => "zst",
            Self::Gzip => "gz",
        }
    }

    /// Encodes; the same bytes give the same result.
    pub(super) fn encode(self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        match self {
            Self::Zstd => {
                // Browsers refuse windows over 8 MiB (RFC 9659); levels above 19 would choose larger ones.
                let level = if bytes.len() <= 4 << 20 { 19 } else { 12 };
                let mut encoder = zstd::Encoder::new(Vec::new(), level)?;
                encoder.window_log(23)?;
                encoder.include_checksum(true)?;
                encoder.set_pledged_src_size(Some(bytes.len() as u64))?;
                encoder.write_all(bytes)?;
                encoder.finish()
            }
            Self::Gzip => {
                let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
                encoder.write_all(bytes)?;
                encoder.finish()
            }
        }
    }

    /// Whether a variant is whole and of these bytes.
    pub(super) fn decodes_to(self, variant: &[u8], bytes: &[u8]) -> bool {
        self.decoded(variant, bytes.len() as u64)
            .is_some_and(|decoded| decoded == bytes)
    }

    /// Whether a variant is whole and of the bytes that this name hashes.
    pub(super) fn decodes_to_name(self, variant: &[u8], name: &BlobName) -> bool {
        self.decoded(variant, MAX_BLOB_BYTES)
            .is_some_and(|decoded| name.is_of(&decoded))
    }

    /// What a variant decodes to, if it is whole, nothing follows it, and it decodes to no more bytes than these.
    fn decoded(self, variant: &[u8], most: u64) -> Option<Vec<u8>> {
        let mut decoded = Vec::new();
        // One byte more than there should be shows that there are too many.
        let most_read = most + 1;
        match self {
            Self::Zstd => {
                let decoder = zstd::Decoder::with_buffer(variant).ok()?;
                decoder.take(most_read).read_to_end(&mut decoded).ok()?;
            }
            Self::Gzip => {
                let mut decoder = flate2::bufread::GzDecoder::new(variant).take(most_read);
                decoder.read_to_end(&mut decoded).ok()?;
                if !decoder.into_inner().into_inner().is_empty() {
                    return None;
                }
            }
        }
        (decoded.len() as u64 <= most).then_some(decoded)
    }
}

/// What the codings make of these bytes, where that saves enough.
pub(super) fn variants(bytes: &[u8]) -> io::Result<Vec<(Coding, Vec<u8>)>> {
    let mut variants = vec![];
    for coding in Coding::ALL {
        let encoded = coding.encode(bytes)?;
        if saves_enough(bytes.len(), encoded.len()) {
            variants.push((coding, encoded));
        }
    }
    Ok(variants)
}

/// Whether a blob of this kind can be expected to shrink. Pictures and smooth LODs are entropy-coded already.
pub(super) fn worth_trying(ext: &str) -> bool {
    !matches!(ext, "png" | "jpg" | "jpeg" | "webp" | "avif" | "ktx2" | "slod")
}

/// At least 5 %: less would not pay for one more copy in every cache.
fn saves_enough(identity_bytes: usize, encoded_bytes: usize) -> bool {
    encoded_bytes as u64 * 100 <= identity_bytes as u64 * 95
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_encoded_decodes_to_the_same_bytes_and_to_no_others() {
        let bytes: Vec<u8> = (0..40_000u32).flat_map(|i| (i / 7).to_le_bytes()).collect();
        for coding in Coding::ALL {
            let variant = coding.encode(&bytes).unwrap();
            assert!(coding.decodes_to(&variant, &bytes));
            assert!(!coding.decodes_to(&variant, &bytes[..bytes.len() - 1]));
            assert!(!coding.decodes_to(&variant[..variant.len() - 1], &bytes));
            assert!(!coding.decodes_to(&[], &bytes));
            assert!(!coding.decodes_to(&[&variant[..], b"more"].concat(), &bytes));
            let name = |bytes: &[u8]| BlobName::of(bytes, "bin").unwrap();
            assert!(coding.decodes_to_name(&variant, &name(&bytes)));
            assert!(!coding.decodes_to_name(&variant, &name(&bytes[1..])));
            assert!(!coding.decodes_to_name(&variant[1..], &name(&bytes)));
        }
    }

    #[test]
    fn a_variant_must_save_a_twentieth() {
        for (identity, encoded, worth) in [(100, 95, true), (100, 96, false), (0, 9, false), (3, 13, false)] {
            assert_eq!(saves_enough(identity, encoded), worth, "{identity} → {encoded}");
        }
    }
}
