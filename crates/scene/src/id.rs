//! How are things named?
//!
//! Dense indices (`o9`, `c12`, `m3`) name what stands inside one revision; a [`BlobHash`] names bytes by their content
//! (SHA-256, so that `sha256sum` and a browser's WebCrypto can check it); a [`SceneName`] names a world in a URL.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Why a text is not an id.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IdError {
    /// A dense id is its letter and a decimal number without leading zeros.
    #[error("`{text}` is not {what}: expected `{letter}` and a number, like `{letter}12`")]
    Dense {
        /// What was read.
        text: String,
        /// What it should have named.
        what: &'static str,
        /// The letter of this kind of id.
        letter: char,
    },
    /// A scene name must be usable as one URL segment and one folder name everywhere.
    #[error(
        "`{0}` is not a scene name: use 1 to 64 of a-z, 0-9, `-` and `_`, starting with a letter or digit (`index` is taken)"
    )]
    Scene(String),
    /// A blob is named by 64 lower-case hex digits.
    #[error("`{0}` is not a content hash: expected 64 lower-case hex digits")]
    Hash(String),
    /// The name of an immutable object is its hash and its extension.
    #[error("`{0}` is not the name of an immutable object: expected a content hash, a dot and an extension")]
    Blob(String),
    /// A revision is 16 lower-case hex digits.
    #[error("`{0}` is not a revision: expected 16 lower-case hex digits")]
    Revision(String),
}

macro_rules! dense_id {
    ($(#[$doc:meta])* $name:ident, $letter:literal, $what:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an index into a dense table.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($letter, "{}"), self.0)
            }
        }

        impl FromStr for $name {
            type Err = IdError;

            fn from_str(text: &str) -> Result<Self, IdError> {
                let digits = text.strip_prefix($letter).filter(|d| {
                    !d.is_empty() && d.bytes().all(|b| b.is_ascii_digit()) && (*d == "0" || !d.starts_with('0'))
                });
                digits.and_then(|d| d.parse().ok()).map(Self).ok_or_else(|| IdError::Dense {
                    text: text.to_owned(),
                    what: $what,
                    letter: $letter,
                })
            }
        }

        string_serde!($name);
    };
}

/// Serialises through `Display` and `FromStr`.
macro_rules! string_serde {
    ($name:ident) => {
        impl Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
                text.parse().map_err(serde::de::Error::custom)
            }
        }
    };
}

pub(crate) use string_serde;

dense_id!(
    /// A placed object of one revision, `o9`.
    ObjectId, 'o', "an object"
);
dense_id!(
    /// A view cell of one revision, `c12`.
    CellId, 'c', "a view cell"
);
dense_id!(
    /// Unique geometry of one revision, `m3`, shared by every object that uses it.
    ModelId, 'm', "a model"
);

/// The SHA-256 of a blob's bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlobHash(pub [u8; 32]);

impl BlobHash {
    /// Names these bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        Self(Sha256::digest(bytes).into())
    }
}

/// A [`BlobHash`] of bytes that come piece by piece.
#[derive(Debug, Clone, Default)]
pub struct BlobHasher(Sha256);

impl BlobHasher {
    /// Takes in what comes next.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Names all that was taken in.
    #[must_use]
    pub fn finish(self) -> BlobHash {
        BlobHash(self.0.finalize().into())
    }
}

/// What each character is worth as a hex digit; more than 15 when it is none.
const DIGITS: [u8; 256] = {
    let mut digits = [u8::MAX; 256];
    let mut digit = 0;
    while digit < 16 {
        digits[b"0123456789abcdef"[digit] as usize] = digit as u8;
        digit += 1;
    }
    digits
};

impl fmt::Display for BlobHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = [0; 64];
        for (digits, byte) in text.as_chunks_mut::<2>().0.iter_mut().zip(self.0) {
            *digits = [byte >> 4, byte & 15].map(|digit| b"0123456789abcdef"[usize::from(digit)]);
        }
        f.write_str(str::from_utf8(&text).expect("they are digits"))
    }
}

impl fmt::Debug for BlobHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "BlobHash({self})")
    }
}

impl FromStr for BlobHash {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let read = || {
            let mut bytes = [0; 32];
            let (pairs, []) = text.as_bytes().as_chunks::<2>() else {
                return None;
            };
            if pairs.len() != bytes.len() {
                return None;
            }
            // All of them before anything is decided: servers read names at every request.
            let mut odd = 0;
            for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
                let (high, low) = (DIGITS[usize::from(*high)], DIGITS[usize::from(*low)]);
                odd |= high | low;
                *byte = high << 4 | low & 15;
            }
            (odd < 16).then_some(Self(bytes))
        };
        read().ok_or_else(|| IdError::Hash(text.to_owned()))
    }
}

string_serde!(BlobHash);

/// The name of an immutable object below `/o/`: `{hash}.{ext}`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlobName {
    hash: BlobHash,
    ext: Extension,
}

/// One to eight of `a-z0-9`, then zeros. It lies where the name does: servers look names up at every request.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Extension([u8; Self::MOST_BYTES]);

impl Extension {
    const MOST_BYTES: usize = 8;

    fn new(text: &str) -> Option<Self> {
        let plain = text.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
        let mut bytes = [0; Self::MOST_BYTES];
        bytes.get_mut(..text.len())?.copy_from_slice(text.as_bytes());
        (plain && !text.is_empty()).then_some(Self(bytes))
    }

    fn text(&self) -> &str {
        let end = self.0.iter().position(|b| *b == 0).unwrap_or(Self::MOST_BYTES);
        str::from_utf8(&self.0[..end]).expect("it is letters and digits")
    }
}

impl fmt::Debug for Extension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.text(), f)
    }
}

impl BlobName {
    /// Names these bytes; `ext` is one to eight of `a-z0-9`.
    ///
    /// # Errors
    /// When the extension holds anything else.
    pub fn of(bytes: &[u8], ext: &str) -> Result<Self, IdError> {
        Self::new(BlobHash::of(bytes), ext)
    }

    /// Puts a known hash and an extension together.
    ///
    /// # Errors
    /// When the extension is not one to eight of `a-z0-9`.
    pub fn new(hash: BlobHash, ext: &str) -> Result<Self, IdError> {
        match Extension::new(ext) {
            Some(ext) => Ok(Self { hash, ext }),
            None => Err(IdError::Blob(format!("{hash}.{ext}"))),
        }
    }

    /// The content hash.
    #[must_use]
    pub fn hash(&self) -> BlobHash {
        self.hash
    }

    /// Whether it names these bytes.
    #[must_use]
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        BlobHash::of(bytes) == self.hash
    }

    /// The extension, without the dot.
    #[must_use]
    pub fn ext(&self) -> &str {
        self.ext.text()
    }

    /// The URL below the root of the published tree: `/o/{hash}.{ext}`.
    #[must_use]
    pub fn url(&self) -> String {
        format!("/o/{self}")
    }

    /// Reads a URL written by [`BlobName::url`].
    ///
    /// # Errors
    /// When it is anything else.
    pub fn from_url(url: &str) -> Result<Self, IdError> {
        url.strip_prefix("/o/")
            .ok_or_else(|| IdError::Blob(url.to_owned()))?
            .parse()
    }
}

impl fmt::Display for BlobName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.hash, self.ext())
    }
}

impl FromStr for BlobName {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let (hash, ext) = text.split_once('.').ok_or_else(|| IdError::Blob(text.to_owned()))?;
        let hash = hash.parse().map_err(|_| IdError::Blob(text.to_owned()))?;
        Self::new(hash, ext)
    }
}

/// Serialises as its URL, `/o/{hash}.{ext}`.
impl Serialize for BlobName {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.url())
    }
}

impl<'de> Deserialize<'de> for BlobName {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let url = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
        Self::from_url(&url).map_err(serde::de::Error::custom)
    }
}

/// One immutable bake of a scene: the first 16 hex digits of its manifest's hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Revision(pub [u8; 8]);

impl Revision {
    /// The revision whose manifest has this hash.
    #[must_use]
    pub fn of_manifest(hash: BlobHash) -> Self {
        let mut first = [0; 8];
        first.copy_from_slice(&hash.0[..8]);
        Self(first)
    }
}

impl fmt::Display for Revision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl FromStr for Revision {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let wrong = || IdError::Revision(text.to_owned());
        if text.len() != 16 || !text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f')) {
            return Err(wrong());
        }
        u64::from_str_radix(text, 16)
            .map(|n| Self(n.to_be_bytes()))
            .map_err(|_| wrong())
    }
}

string_serde!(Revision);

/// The name of a world: one URL segment, one folder name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SceneName(String);

impl SceneName {
    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for SceneName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for SceneName {
    type Err = IdError;

    fn from_str(text: &str) -> Result<Self, IdError> {
        let ok = (1..=64).contains(&text.len())
            && text != "index"
            && text
                .bytes()
                .all(|b| matches!(b, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_'))
            && text.starts_with(|c: char| c.is_ascii_alphanumeric());
        if ok {
            Ok(Self(text.to_owned()))
        } else {
            Err(IdError::Scene(text.to_owned()))
        }
    }
}

string_serde!(SceneName);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_read_what_they_write() {
        assert_eq!("c12".parse(), Ok(CellId(12)));
        assert_eq!(CellId(12).to_string(), "c12");
        assert_eq!("o0".parse(), Ok(ObjectId(0)));
        let hash = BlobHash::of(b"hello");
        assert_eq!(hash.to_string().parse(), Ok(hash));
        assert_eq!(
            hash.to_string(),
            "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824"
        );
        let name = BlobName::new(hash, "glb").unwrap();
        assert_eq!(BlobName::from_url(&name.url()), Ok(name));
        let revision = Revision::of_manifest(hash);
        assert_eq!(revision.to_string().parse(), Ok(revision));
    }

    #[test]
    fn what_is_not_an_id_is_refused() {
        for text in ["", "c", "o1", "c01", "c-1", "c+1", "c4294967296", "c1 ", "C1", "c１"] {
            assert!(text.parse::<CellId>().is_err(), "accepted {text:?}");
        }
        for text in ["", "index", "a/b", "..", "-a", "A", "ä", &"a".repeat(65)] {
            assert!(text.parse::<SceneName>().is_err(), "accepted {text:?}");
        }
        let hash = BlobHash::of(b"").to_string();
        for text in [
            hash.to_uppercase(),
            format!("{hash}.glb/"),
            hash[1..].to_owned(),
            format!("{hash}.GLB"),
        ] {
            assert!(text.parse::<BlobName>().is_err(), "accepted {text:?}");
        }
    }
}
