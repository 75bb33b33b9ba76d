//! What are the bytes around a record or its steps? Magic, version, lengths; and the functions that give and take them.

use std::collections::BTreeSet;

use super::{
    CellRecord,
    coded::{self, Coded},
};
use crate::ObjectId;

/// Why bytes are not a cell record or steps.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The first four bytes are not `BVCR`, or `BVST` for steps.
    #[error("not what was expected: it does not start with `{0}`")]
    Magic(&'static str),
    /// Written by a build of another format.
    #[error("of version {found}; this build reads version {known}")]
    Version {
        /// The version that it claims.
        found: u16,
        /// The version that this build reads.
        known: u16,
    },
    /// It ends early, claims too much, or holds values that make no sense.
    #[error("damaged: {0}")]
    Damaged(String),
}

impl DecodeError {
    pub(super) fn damaged(what: &str) -> Self {
        Self::Damaged(what.to_owned())
    }
}

/// The first bytes of a binary record.
const MAGIC: &str = "BVCR";
/// The version of binary records and steps.
pub(super) const VERSION: u16 = 2;

impl CellRecord {
    /// The binary form: `BVCR`, the version as u16 little-endian, the length of the rest, the rest. Solid angles,
    /// fractions and the miss bound are rounded, see [`CellRecord::rounded`].
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = header(MAGIC);
        let stream = coded::step(&Coded::default(), &Coded::of(self));
        push_integer(&mut bytes, stream.len() as u64);
        bytes.extend(stream);
        bytes
    }

    /// Reads the binary form.
    ///
    /// # Errors
    /// When the bytes are cut short, damaged, of another version, or hold indices out of range or numbers that are not
    /// finite. Work and memory are linear in the bytes, but for a geometry section of up to 1 MiB.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let mut rest = after_header(bytes, MAGIC)?;
        let length = take_integer(&mut rest)?;
        if length != rest.len() as u64 {
            let (claimed, there) = (length, rest.len());
            return Err(DecodeError::Damaged(format!(
                "it claims {claimed} bytes where {there} are"
            )));
        }
        coded::follow(&Coded::default(), rest)?.record()
    }

    /// What changes on the way to an adjacent cell: one of the [`Steps`](super::Steps) of this record's cell.
    #[must_use]
    pub fn step_to(&self, next: &Self) -> Vec<u8> {
        coded::step(&Coded::of(self), &Coded::of(next))
    }

    /// The record that a step leads to. It encodes to the same bytes as the one that the step was made for.
    ///
    /// # Errors
    /// When the step is damaged or was made for another record than this one and that shows.
    pub fn follow(&self, step: &[u8]) -> Result<Self, DecodeError> {
        coded::follow(&Coded::of(self), step)?.record()
    }

    /// The record as the binary form has it: solid angles rounded to 4π · 2⁻ⁿ sr (n up to 63), fractions to 2⁻ⁿ (n up to
    /// 7), the miss bound up to the next of eight steps to each halving; visible objects by solid angle, then by id.
    #[must_use]
    pub fn rounded(&self) -> Self {
        let rounded = Coded::of(self).record();
        rounded.expect("what was just encoded can be decoded")
    }

    /// How many bytes say which objects are visible to someone who starts from the set `known`: nothing for
    /// [`CellRecord::encode`], what is visible next door for a step. Without solid angles, fractions, doors, cells and
    /// geometry.
    #[must_use]
    pub fn set_bytes(&self, known: impl IntoIterator<Item = ObjectId>) -> u64 {
        let known: BTreeSet<u32> = known.into_iter().map(|object| object.0).collect();
        coded::set_bytes(&Vec::from_iter(known), &Coded::of(self)) as u64
    }

    /// The objects of both sets, in no particular order.
    pub fn objects(&self) -> impl Iterator<Item = ObjectId> {
        self.lpvs.iter().chain(&self.opvs).map(|visible| visible.object)
    }
}

pub(super) fn header(magic: &str) -> Vec<u8> {
    let mut bytes = magic.as_bytes().to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes
}

/// What follows magic and version.
pub(super) fn after_header<'a>(bytes: &'a [u8], magic: &'static str) -> Result<&'a [u8], DecodeError> {
    let rest = bytes.strip_prefix(magic.as_bytes()).ok_or(DecodeError::Magic(magic))?;
    let (version, rest) = rest
        .split_first_chunk()
        .ok_or_else(|| DecodeError::damaged("no version"))?;
    match u16::from_le_bytes(*version) {
        VERSION => Ok(rest),
        found => Err(DecodeError::Version { found, known: VERSION }),
    }
}

/// Seven bits to a byte, lowest first; the eighth says that more follow.
pub(super) fn push_integer(bytes: &mut Vec<u8>, mut integer: u64) {
    while integer >= 0x80 {
        bytes.push(integer as u8 | 0x80);
        integer >>= 7;
    }
    bytes.push(integer as u8);
}

/// An integer of at most 32 bits.
pub(super) fn take_integer(bytes: &mut &[u8]) -> Result<u64, DecodeError> {
    let mut integer = 0;
    for shift in [0, 7, 14, 21, 28] {
        let (byte, rest) = bytes
            .split_first()
            .ok_or_else(|| DecodeError::damaged("it ends in its header"))?;
        *bytes = rest;
        integer |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(integer);
        }
    }
    Err(DecodeError::damaged(
        "an integer of its header has more than five bytes",
    ))
}
