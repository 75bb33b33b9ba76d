//! How do many small files come with one request? As a bundle, where the server offers them (`docs/FORMAT.md`): one address
//! names them all, and its answer holds them one after the other. What may come so is as in `viewer/core/strategy/bundles.ts`.

use belvedere_scene::bundle::{self, MOST_MEMBERS, Member};

use super::{
    file::{FileName, FileRef, REQUEST_BYTES},
    meter::AHEAD_S,
};

/// What a name takes in the address of a bundle, and its place in the table.
const NAME_BYTES: f64 = 75.0;
/// What is larger gains little and would hold up the others.
const MOST_MEMBER_BYTES: u64 = 16 * 1024;
/// So much comes together at most, and no more than the line brings in [`AHEAD_S`], so that what turns out to be urgent on a slow line
/// need not wait long.
const MOST_BYTES: u64 = 32 * 1024;

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
    let member = |file: &FileRef| match &file.name {
        FileName::Object(name) => Member::Whole(name.clone()),
        FileName::Rung(name) => Member::Rung(*name),
    };
    bundle::path(&members.iter().map(member).collect::<Vec<_>>())
}

/// What the answer to that has.
#[must_use]
pub fn bytes_of(members: &[FileRef]) -> u64 {
    bundle::bytes_of(members.len(), members.iter().map(|file| file.bytes).sum())
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use belvedere_scene::BlobName;
    use serde::Deserialize;

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

    /// What `crates/scene/tests/golden_bundle.rs` says of what is asked for.
    #[derive(Deserialize)]
    struct Golden {
        asked: Asked,
    }

    #[derive(Deserialize)]
    struct Asked {
        urls: Vec<String>,
        path: String,
    }

    #[test]
    fn the_golden_set_is_asked_for_at_its_address() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/bundle/cases.json");
        let Golden { asked } = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        let file = |url: &String| {
            let object = |_| FileName::Object(BlobName::from_url(url).unwrap());
            let name = url.parse().map_or_else(object, FileName::Rung);
            FileRef { name, bytes: 100 }
        };
        let mut files: Vec<_> = asked.urls.iter().map(file).collect();
        for _ in 0..files.len() {
            files.rotate_left(1);
            assert_eq!(path_of(&together(files.clone(), f64::INFINITY)), asked.path);
        }
    }
}
