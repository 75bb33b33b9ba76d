//! How do many small things come in one answer? As a bundle: an address that names objects, rungs and slices, and an
//! answer that holds them and never changes.
//!
//! `/o/bundle/{member}+{member}…`, where a member is `{hash}.{ext}`, a rung `{hash}.r{n}.slod`, or the bytes from `from`
//! up to `to` of an object, `{hash}.{ext}@{from}-{to}`. The answer is `BVBN`, a version, the number of members, where
//! each ends, and their bytes (`docs/FORMAT.md`).

use std::{fmt, ops::Range, str::FromStr};

use crate::{BlobName, rung::RungName};

/// What addresses of bundles begin with.
pub const PATH: &str = "/o/bundle/";
/// The link by which the pointer of a scene says that its server answers bundles.
pub const OFFER: &str = "</o/bundle/>; rel=\"bundles\"";
/// What an answer is.
pub const MEDIA_TYPE: &str = "application/vnd.belvedere.bundle";
/// The version of the format.
pub const VERSION: u16 = 1;
/// A bundle holds at most so many members …
pub const MOST_MEMBERS: usize = 64;
/// … of at most so many bytes together: what is larger gains nothing.
pub const MOST_BYTES: u64 = 8 << 20;

const MAGIC: &[u8; 4] = b"BVBN";
/// What stands before the table.
const HEAD_BYTES: usize = 8;
/// What each member takes in the table.
const END_BYTES: usize = 4;
/// For so many there is room at once.
const USUAL_MEMBERS: usize = 16;
/// No more of what is no member is repeated.
const SHOWN_CHARS: usize = 100;

/// One thing in a bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Member {
    /// All of an object.
    Whole(BlobName),
    /// A rung of a smooth LOD.
    Rung(RungName),
    /// These bytes of an object; never none.
    Slice(BlobName, Range<u64>),
}

/// An address names no bundle.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Too many members.
    #[error("a bundle has at most {MOST_MEMBERS} members")]
    TooMany,
    /// This is none.
    #[error(
        "`{0}` is no member of a bundle: it must be {{hash}}.{{ext}}, {{hash}}.r{{n}}.slod or \
         {{hash}}.{{ext}}@{{from}}-{{to}}; `+` stands between members"
    )]
    NoMember(String),
}

impl AddressError {
    fn no_member(text: &str) -> Self {
        Self::NoMember(text.chars().take(SHOWN_CHARS).collect())
    }
}

/// The members of a bundle would have more than [`MOST_BYTES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a bundle has at most {MOST_BYTES} bytes; fetch what is large alone")]
pub struct TooLarge;

impl Member {
    /// The object that it is, or is a part of.
    #[must_use]
    pub fn blob(&self) -> BlobName {
        match self {
            Self::Whole(name) | Self::Slice(name, _) => name.clone(),
            Self::Rung(rung) => rung.whole(),
        }
    }

    fn read(text: &str) -> Option<Self> {
        if let Some((name, range)) = text.split_once('@') {
            return Some(Self::Slice(name.parse().ok()?, slice(range)?));
        }
        match RungName::from_file_name(text) {
            Some(rung) => Some(Self::Rung(rung)),
            None => text.parse().map(Self::Whole).ok(),
        }
    }
}

impl fmt::Display for Member {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(name) => name.fmt(f),
            Self::Rung(rung) => f.write_str(&rung.file_name()),
            Self::Slice(name, range) => write!(f, "{name}@{}-{}", range.start, range.end),
        }
    }
}

impl FromStr for Member {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        Self::read(text).ok_or_else(|| AddressError::no_member(text))
    }
}

/// The bytes of an object that are meant; never none.
fn slice(text: &str) -> Option<Range<u64>> {
    let (from, to) = text.split_once('-')?;
    let range = number(from)?..number(to)?;
    (!range.is_empty()).then_some(range)
}

/// A number has one spelling, so that an answer has one address.
fn number(text: &str) -> Option<u64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit()) && (text == "0" || !text.starts_with('0'));
    text.parse().ok().filter(|_| plain)
}

/// The path of a bundle of these.
#[must_use]
pub fn path(members: &[Member]) -> String {
    let names: Vec<_> = members.iter().map(Member::to_string).collect();
    format!("{PATH}{}", names.join("+"))
}

/// Whether links hold an [`OFFER`], however it is quoted.
#[must_use]
pub fn is_offered(links: &str) -> bool {
    links.contains("rel=\"bundles\"") || links.contains("rel=bundles")
}

/// What a path names behind [`PATH`]: one member or more.
///
/// # Errors
/// When there are more than [`MOST_MEMBERS`], or one is none.
pub fn members(text: &str) -> Result<Vec<Member>, AddressError> {
    let mut members = Vec::with_capacity(USUAL_MEMBERS);
    // Slices often come from one object, whose name is then read once.
    let mut last: Option<(&str, BlobName)> = None;
    for member in text.split('+') {
        if members.len() == MOST_MEMBERS {
            return Err(AddressError::TooMany);
        }
        let read = match (member.split_once('@'), &last) {
            (Some((name, range)), Some((before, blob))) if name == *before => {
                slice(range).map(|range| Member::Slice(blob.clone(), range))
            }
            (named, _) => {
                let read = Member::read(member);
                last = named
                    .zip(read.as_ref().map(Member::blob))
                    .map(|((name, _), blob)| (name, blob));
                read
            }
        };
        let read = read.ok_or_else(|| AddressError::no_member(member))?;
        members.push(read);
    }
    Ok(members)
}

/// What a bundle of so many members has, which have so many bytes together.
#[must_use]
pub fn bytes_of(members: usize, bytes: u64) -> u64 {
    table_end(members) as u64 + bytes
}

/// Where the table ends, and the first member begins.
fn table_end(members: usize) -> usize {
    HEAD_BYTES + END_BYTES * members
}

/// What stands in an answer before its members, as they are added.
#[derive(Debug, Clone)]
pub struct Head {
    bytes: Vec<u8>,
    /// Of the members so far.
    length: u64,
}

impl Head {
    /// That of a bundle of so many members, of which none was added yet.
    ///
    /// # Panics
    /// With more than [`MOST_MEMBERS`].
    #[must_use]
    pub fn of(members: usize) -> Self {
        assert!(members <= MOST_MEMBERS, "an address names no more");
        let mut bytes = Vec::with_capacity(table_end(members));
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&(members as u16).to_le_bytes());
        Self { bytes, length: 0 }
    }

    /// Adds a member of so many bytes.
    ///
    /// # Errors
    /// When all have more than [`MOST_BYTES`] then.
    pub fn add(&mut self, bytes: u64) -> Result<(), TooLarge> {
        let length = self.length.saturating_add(bytes);
        if length > MOST_BYTES {
            return Err(TooLarge);
        }
        self.length = length;
        self.bytes.extend_from_slice(&(length as u32).to_le_bytes());
        Ok(())
    }

    /// What the answer has in all.
    #[must_use]
    pub fn answer_bytes(&self) -> u64 {
        self.bytes.len() as u64 + self.length
    }

    /// As it stands before the members.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// Where the members of a bundle of so many begin and end, in their order, as far as its table says it; `None` while that is
/// not here, and when it is anything else. They may end behind what is here.
#[must_use]
pub fn places(so_far: &[u8], members: usize) -> Option<Vec<Range<usize>>> {
    let (head, behind) = so_far.split_first_chunk::<HEAD_BYTES>()?;
    let [m, a, g, ic, version @ .., c0, c1] = head;
    let (version, count) = (
        u16::from_le_bytes(*version),
        usize::from(u16::from_le_bytes([*c0, *c1])),
    );
    if [*m, *a, *g, *ic] != *MAGIC || version != VERSION || count != members {
        return None;
    }
    let (ends, _) = behind.get(..END_BYTES * members)?.as_chunks::<END_BYTES>();
    let table = table_end(members);
    let mut from = table;
    let place = |end: &[u8; END_BYTES]| {
        let end = u32::from_le_bytes(*end);
        let to = table + usize::try_from(end).ok().filter(|_| u64::from(end) <= MOST_BYTES)?;
        (to >= from).then(|| std::mem::replace(&mut from, to)..to)
    };
    ends.iter().map(place).collect()
}

/// The same of a bundle that is all here; `None` when that is anything else, ends too early or goes on.
#[must_use]
pub fn whole_places(bundle: &[u8], members: usize) -> Option<Vec<Range<usize>>> {
    places(bundle, members).filter(|places| places.last().is_some_and(|last| last.end == bundle.len()))
}

#[cfg(test)]
mod tests;
