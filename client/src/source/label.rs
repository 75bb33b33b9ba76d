//! What is a file on the shelf, and is it what was put there? An immutable object has its hash in its name. A part of one, a rung or a
//! range, has only that of the whole, which says nothing of the part: so its file begins with a seal, the hash of its name and its bytes.
//! The seal shows what became of it here; whether the right bytes were sent shows when all parts are together, and not before.

use std::{fmt, ops::Range};

use belvedere_scene::{BlobHash, BlobName, rung::RungName};
use bytes::Bytes;

/// The name of a file on the shelf.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Label {
    Whole(BlobName),
    Rung(RungName),
    /// `{hash}.b{from}-{to}.{ext}`: bytes of an object.
    Part(BlobName, Range<u64>),
}

impl Label {
    /// What is at a path, if it is an object or a rung.
    pub(super) fn of_path(path: &str) -> Option<Self> {
        let rung = || path.parse().ok().map(Self::Rung);
        BlobName::from_url(path).ok().map(Self::Whole).or_else(rung)
    }

    /// Reads what [`fmt::Display`] writes.
    pub(super) fn read(file_name: &str) -> Option<Self> {
        if let Ok(whole) = file_name.parse() {
            return Some(Self::Whole(whole));
        }
        if let Some(rung) = RungName::from_file_name(file_name) {
            return Some(Self::Rung(rung));
        }
        let (hash, rest) = file_name.split_once(".b")?;
        let (range, ext) = rest.split_once('.')?;
        let (from, to) = range.split_once('-')?;
        let part = Self::Part(
            BlobName::new(hash.parse().ok()?, ext).ok()?,
            from.parse().ok()?..to.parse().ok()?,
        );
        (part.to_string() == file_name).then_some(part)
    }

    /// Whether it is a part of an object.
    pub(super) fn is_part_of(&self, whole: &BlobName) -> bool {
        match self {
            Self::Whole(_) => false,
            Self::Rung(rung) => rung.whole() == *whole,
            Self::Part(of, _) => of == whole,
        }
    }

    /// What is written of it; nothing where it cannot be what it is called.
    pub(super) fn seal(&self, bytes: &Bytes) -> Option<Bytes> {
        match self {
            Self::Whole(name) => name.is_of(bytes).then(|| bytes.clone()),
            _ => Some([&self.seal_of(bytes).0, &bytes[..]].concat().into()),
        }
    }

    /// What it is, out of what was written; nothing where that is damaged.
    pub(super) fn unseal(&self, written: Bytes) -> Option<Bytes> {
        if let Self::Whole(name) = self {
            return name.is_of(&written).then_some(written);
        }
        let (seal, bytes) = written.split_first_chunk()?;
        (self.seal_of(bytes).0 == *seal).then(|| written.slice(seal.len()..))
    }

    fn seal_of(&self, bytes: &[u8]) -> BlobHash {
        BlobHash::of(&[self.to_string().as_bytes(), bytes].concat())
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(name) => name.fmt(f),
            Self::Rung(rung) => f.write_str(&rung.file_name()),
            Self::Part(of, Range { start, end }) => write!(f, "{}.b{start}-{end}.{}", of.hash(), of.ext()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels() -> [Label; 3] {
        let whole = BlobName::of(b"whole", "slod").unwrap();
        let rung = RungName {
            hash: whole.hash(),
            number: 2,
        };
        [Label::Whole(whole.clone()), Label::Rung(rung), Label::Part(whole, 1..3)]
    }

    #[test]
    fn labels_are_read_as_they_are_written_and_nothing_else_is() {
        for label in labels() {
            assert_eq!(Label::read(&label.to_string()), Some(label));
        }
        let hash = BlobHash::of(b"whole");
        for wrong in [
            ".b1-3",
            ".b01-3.slod",
            ".b1-.slod",
            ".b1.slod",
            ".b1-3.slod.77",
            ".r2.slod.77",
        ] {
            assert_eq!(Label::read(&format!("{hash}{wrong}")), None, "{wrong}");
        }
    }

    #[test]
    fn a_part_is_believed_where_it_is_what_was_put_there_under_that_name() {
        let [whole, rung, part] = labels();
        let right = Bytes::from_static(b"whole");
        assert_eq!(
            whole.seal(&right).and_then(|written| whole.unseal(written)),
            Some(right.clone())
        );
        assert_eq!(whole.seal(&Bytes::from_static(b"other")), None);
        for (label, other) in [(&rung, &part), (&part, &rung)] {
            let written = label.seal(&right).unwrap();
            assert_eq!(label.unseal(written.clone()), Some(right.clone()));
            assert_eq!(other.unseal(written.clone()), None, "it has another name");
            assert_eq!(label.unseal(written.slice(..written.len() - 1)), None);
            assert_eq!(label.unseal(written.slice(..20)), None);
        }
    }

    #[test]
    fn parts_know_of_what() {
        let is_part = |of: &[u8]| labels().map(|label| label.is_part_of(&BlobName::of(of, "slod").unwrap()));
        assert_eq!(
            [is_part(b"whole"), is_part(b"other")],
            [[false, true, true], [false; 3]]
        );
    }
}
