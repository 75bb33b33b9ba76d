//! How do many small files come with one request? As a bundle, where the server offers them (`docs/FORMAT.md`): one address
//! names them all, and its answer holds them one after the other. What may come so is as in `viewer/core/bundles.ts`.

use std::ops::Range;

use bytes::Bytes;

use super::{
    file::{FileRef, REQUEST_BYTES},
    meter::AHEAD_S,
};

/// What a name takes in the address of a bundle, and its place in the table.
const NAME_BYTES: f64 = 75.0;
/// What is larger gains little and would hold up the others.
const MOST_MEMBER_BYTES: u64 = 16 * 1024;
/// So much comes together at most, and no more than the line brings in [`AHEAD_S`], so that what turns out to be urgent on a slow line
/// need not wait long.
const MOST_BYTES: u64 = 32 * 1024;
const MOST_MEMBERS: usize = 64;
const MAGIC: &[u8; 4] = b"BVBN";
const VERSION: u16 = 1;
const HEAD_BYTES: usize = 8;

/// Whether a file may come in a bundle: a small one that does not take more so than alone. Members are not compressed, so
/// what shrinks by more than a request costs is better fetched alone.
#[must_use]
pub fn is_small(file: &FileRef) -> bool {
    file.bytes <= MOST_MEMBER_BYTES && file.bytes as f64 + NAME_BYTES <= file.compressed_bytes() + REQUEST_BYTES
}

/// The first members that fit into one bundle on a line of this speed, of small ones in the order in which they are wanted; in the order in
/// which an address names them, so that who wants the same asks for the same.
pub fn together(files: impl IntoIterator<Item = FileRef>, bytes_per_s: f64) -> Vec<FileRef> {
    let most_bytes = MOST_BYTES.min((AHEAD_S * bytes_per_s) as u64);
    let (mut taken, mut total) = (Vec::new(), 0);
    for file in files {
        if taken.len() == MOST_MEMBERS || !taken.is_empty() && total + file.bytes > most_bytes {
            break;
        }
        if !taken.contains(&file) {
            total += file.bytes;
            taken.push(file);
        }
    }
    taken.sort_by_cached_key(|file| file.name.file_name());
    taken
}

/// The path of a bundle.
#[must_use]
pub fn path_of(members: &[FileRef]) -> String {
    let names: Vec<_> = members.iter().map(|file| file.name.file_name()).collect();
    format!("/o/bundle/{}", names.join("+"))
}

/// What the answer to that has.
#[must_use]
pub fn bytes_of(members: &[FileRef]) -> u64 {
    let table = HEAD_BYTES + 4 * members.len();
    table as u64 + members.iter().map(|file| file.bytes).sum::<u64>()
}

/// Where the members of a bundle of so many begin and end, as far as its table says it, in their order; `None` while that is not here,
/// and when it is anything else.
#[must_use]
pub fn places_of(so_far: &[u8], members: usize) -> Option<Vec<Range<usize>>> {
    let number = |at: usize| {
        so_far
            .get(at..at + 2)
            .map(|two| usize::from(u16::from_le_bytes([two[0], two[1]])))
    };
    let right = so_far.get(..4)? == MAGIC && number(4)? == usize::from(VERSION) && number(6)? == members;
    let table = HEAD_BYTES + 4 * members;
    if !right || so_far.len() < table {
        return None;
    }
    let ends = so_far[HEAD_BYTES..table].chunks_exact(4);
    let ends = ends.map(|end| table + u32::from_le_bytes([end[0], end[1], end[2], end[3]]) as usize);
    let mut from = table;
    let place = |to: usize| (to >= from).then(|| std::mem::replace(&mut from, to)..to);
    ends.map(place).collect()
}

/// The members of a bundle of so many; `None` when it is anything else.
#[must_use]
pub fn members_of(bundle: &Bytes, members: usize) -> Option<Vec<Bytes>> {
    let places = places_of(bundle, members)?;
    let is_all = places.last().is_some_and(|last| last.end == bundle.len());
    // A copy, so that what stays does not keep the others in memory.
    let member = |place: Range<usize>| Bytes::copy_from_slice(&bundle[place]);
    is_all.then(|| places.into_iter().map(member).collect())
}

#[cfg(test)]
mod tests {
    use belvedere_scene::BlobName;

    use super::*;

    fn file(bytes: u64, ext: &str) -> FileRef {
        FileRef::object(&BlobName::of(&bytes.to_le_bytes(), ext).unwrap(), bytes)
    }

    #[test]
    fn what_shrinks_on_its_way_or_is_large_goes_alone() {
        assert!(is_small(&file(9000, "slod")));
        assert!(is_small(&file(400, "glb")));
        assert!(!is_small(&file(9000, "glb")));
        assert!(!is_small(&file(17_000, "slod")));
    }

    #[test]
    fn an_address_does_not_depend_on_who_wants_what_first() {
        let [a, b, c] = [10, 11, 12].map(|bytes| file(bytes, "png"));
        let one = together([a.clone(), b.clone(), a.clone(), c.clone()], f64::INFINITY);
        assert_eq!(one.len(), 3);
        assert_eq!(path_of(&one), path_of(&together([c, a, b], f64::INFINITY)));
    }

    #[test]
    fn what_comes_together_takes_no_longer_than_half_a_second_on_a_slow_line() {
        let files = || (0..9).map(|i| file(8000 + i, "png"));
        for (bytes_per_s, members) in [
            (f64::INFINITY, 4),
            (64_000.0, 3),
            (33_000.0, 2),
            (16_000.0, 1),
            (1_000.0, 1),
        ] {
            assert_eq!(together(files(), bytes_per_s).len(), members, "{bytes_per_s}");
        }
    }

    #[test]
    fn members_come_out_whole_or_not_at_all() {
        let mut bundle = b"BVBN\x01\0\x02\0\x03\0\0\0\x05\0\0\0abcde".to_vec();
        let read = |bundle: &[u8]| members_of(&Bytes::copy_from_slice(bundle), 2);
        assert_eq!(
            read(&bundle).unwrap(),
            [Bytes::from_static(b"abc"), Bytes::from_static(b"de")]
        );
        for short in 0..bundle.len() {
            assert_eq!(read(&bundle[..short]), None);
            let places = places_of(&bundle[..short], 2);
            assert_eq!(
                places,
                (short >= 16).then(|| vec![16..19, 19..21]),
                "after {short} bytes"
            );
        }
        bundle.push(0);
        assert_eq!(read(&bundle), None);
        bundle.pop();
        bundle[8] = 6;
        assert_eq!(read(&bundle), None, "it ends before it begins");
    }
}
