//! How does one fetch a smooth LOD piece by piece? In rungs: the disjoint slices between the places where its header
//! says that it is good to stop.
//!
//! Some caches refuse ranges, so each rung has an address of its own, `/o/{hash}.r{n}.slod`, and is answered whole.
//! `{hash}` is that of the whole stream; all rungs together, in order, are its bytes.

use std::{fmt, ops::Range, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::{BlobHash, BlobName, IdError, id::string_serde, object::TextureRef, smooth::Header};

/// The extension of smooth LODs.
pub const SLOD: &str = "slod";

/// The smooth LOD of a model. In a model: errors in units of its own space; in an object info: metres in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SmoothLod {
    /// The whole stream (`docs/SLOD.md`).
    pub url: BlobName,
    /// Its size.
    pub bytes: u64,
    /// A glTF document without meshes: its material *i* is the stream's material *i*.
    pub materials: BlobName,
    /// Size of that document.
    pub materials_bytes: u64,
    /// Textures that the materials refer to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub textures: Vec<TextureRef>,
    /// The slices of the stream, coarsest first; never empty.
    pub rungs: Vec<Rung>,
}

impl SmoothLod {
    /// The same with errors multiplied by this: model space to metres.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        let rungs = self.rungs.iter().map(|rung| Rung {
            geometric_error_m: rung.geometric_error_m * scale,
            rms_error_m: rung.rms_error_m * scale,
            ..rung.clone()
        });
        Self {
            rungs: rungs.collect(),
            ..self.clone()
        }
    }
}

/// A slice of a smooth LOD, and the mesh that it and all before it give.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// The slice alone.
    pub url: RungName,
    /// Its first byte.
    pub from: u64,
    /// Behind its last byte.
    pub to: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// No point of the source surface is farther from the mesh, nor the reverse. Never rises from rung to rung.
    pub geometric_error_m: f64,
    /// Root mean square distance between the mesh and that of the whole stream, measured at sampled points.
    pub rms_error_m: f64,
}

impl Header {
    /// The bytes of a rung; `None` beyond the last.
    #[must_use]
    pub fn rung(&self, number: usize) -> Option<Range<u32>> {
        let end = self.cuts.get(number)?.bytes;
        let start = number.checked_sub(1).map_or(0, |before| self.cuts[before].bytes);
        Some(start..end)
    }
}

/// The name of a rung below `/o/`: `{hash}.r{n}.slod`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RungName {
    /// Hash of the whole stream.
    pub hash: BlobHash,
    /// Which of its rungs, from 0.
    pub number: u8,
}

impl RungName {
    /// The stream that it is a slice of.
    #[must_use]
    pub fn whole(&self) -> BlobName {
        BlobName::new(self.hash, SLOD).expect("the extension is four letters")
    }

    /// The name of its file: `{hash}.r{n}.slod`.
    #[must_use]
    pub fn file_name(&self) -> String {
        format!("{}.r{}.{SLOD}", self.hash, self.number)
    }

    /// Reads a name written by [`RungName::file_name`].
    #[must_use]
    pub fn from_file_name(name: &str) -> Option<Self> {
        // The end first: it is what most names of other objects lack.
        let (hash, number) = name.strip_suffix(SLOD)?.strip_suffix('.')?.rsplit_once(".r")?;
        let plain = number.bytes().all(|b| b.is_ascii_digit()) && (number == "0" || !number.starts_with('0'));
        Some(Self {
            hash: hash.parse().ok()?,
            number: number.parse().ok().filter(|_| plain)?,
        })
    }
}

impl fmt::Display for RungName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "/o/{}", self.file_name())
    }
}

impl FromStr for RungName {
    type Err = IdError;

    fn from_str(url: &str) -> Result<Self, IdError> {
        url.strip_prefix("/o/")
            .and_then(Self::from_file_name)
            .ok_or_else(|| IdError::Blob(url.to_owned()))
    }
}

string_serde!(RungName);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written_and_nothing_else_is() {
        let hash = BlobHash::of(b"a stream");
        for number in [0, 1, 9, 10, 255] {
            let name = RungName { hash, number };
            assert_eq!(name.to_string().parse(), Ok(name));
            assert_eq!(name.whole().url(), format!("/o/{hash}.slod"));
        }
        for wrong in [
            ".r.slod",
            ".r00.slod",
            ".r+1.slod",
            ".r256.slod",
            ".r1slod",
            ".r1.slod.gz",
            ".slod",
        ] {
            assert_eq!(RungName::from_file_name(&format!("{hash}{wrong}")), None, "{wrong}");
        }
    }
}
