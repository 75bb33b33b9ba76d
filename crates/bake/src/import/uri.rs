//! Where is the data that a URI names? In the URI itself, or in a file beside the source; nowhere else.

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// What a URI names.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Target<'a> {
    /// A `data:` URI.
    Data(DataUri<'a>),
    /// A path relative to the source, percent-decoded, with `/` between its parts and no `.` or `..` in it.
    File(String),
    /// Something outside of the source's folder.
    Outside,
}

/// A `data:` URI, not decoded yet.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct DataUri<'a> {
    payload: &'a str,
    base64: bool,
}

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

impl DataUri<'_> {
    /// The most bytes that it can decode to.
    pub(super) fn max_bytes(&self) -> usize {
        self.payload.len()
    }

    /// Its bytes; `None` when it is not properly encoded.
    pub(super) fn decode(&self) -> Option<Vec<u8>> {
        if self.base64 {
            BASE64.decode(self.payload.trim_end()).ok()
        } else {
            percent_decode(self.payload)
        }
    }
}

/// Finds out what a URI names.
pub(super) fn target(uri: &str) -> Target<'_> {
    if let Some(rest) = strip_prefix_ignoring_case(uri, "data:") {
        let (media_type, payload) = rest.split_once(',').unwrap_or((rest, ""));
        let base64 = media_type
            .rsplit(';')
            .next()
            .is_some_and(|t| t.trim().eq_ignore_ascii_case("base64"));
        return Target::Data(DataUri { payload, base64 });
    }
    let Some(path) = percent_decode(uri).and_then(|bytes| String::from_utf8(bytes).ok()) else {
        return Target::Outside;
    };
    relative_path(&path).map_or(Target::Outside, Target::File)
}

/// Why a path leads to no file of a folder, and what would.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Astray {
    /// It names none.
    #[error("it names no file: write its path, as in \"tree.dcg\"")]
    Empty,
    #[error("a path has no U+{:04X} in it: leave it out", u32::from(*.0))]
    Character(char),
    #[error("it is an address, and nothing is fetched: put the file beside the source, and write its path")]
    Address,
    /// It stands in drives and alternate streams, too.
    #[error("a path has no `:` in it: put the file beside the source, under a name without that")]
    Colon,
    #[error("a path has no `\\` in it: write `/` behind each folder")]
    Backslash,
    #[error("it begins with `/`, at the root of a disk: put the file beside the source, and write its path from there")]
    Rooted,
    #[error("it lies outside of the source's folder: put it beside the source")]
    Outside,
}

/// A path that stays in its folder, without `.` parts.
pub(super) fn relative_path(path: &str) -> Result<String, Astray> {
    if let Some(control) = path.chars().find(|c| c.is_control()) {
        return Err(Astray::Character(control));
    }
    if path.contains("://") {
        return Err(Astray::Address);
    }
    for (character, astray) in [(':', Astray::Colon), ('\\', Astray::Backslash)] {
        if path.contains(character) {
            return Err(astray);
        }
    }
    if path.starts_with('/') {
        return Err(Astray::Rooted);
    }
    let parts: Vec<&str> = path.split('/').filter(|part| !matches!(*part, "" | ".")).collect();
    if parts.is_empty() {
        Err(Astray::Empty)
    } else if parts.contains(&"..") {
        Err(Astray::Outside)
    } else {
        Ok(parts.join("/"))
    }
}

fn strip_prefix_ignoring_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then(|| &text[prefix.len()..])
}

/// Undoes `%20` and the like; `None` for a broken escape.
fn percent_decode(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let (digits, after) = after.split_at_checked(2)?;
        let digit = |d: u8| char::from(d).to_digit(16);
        bytes.push((digit(digits[0])? * 16 + digit(digits[1])?) as u8);
        rest = after;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(uri: &str) -> Option<String> {
        match target(uri) {
            Target::File(path) => Some(path),
            _ => None,
        }
    }

    #[test]
    fn a_file_uri_is_percent_decoded_and_tidied() {
        assert_eq!(file("a%20b.bin").unwrap(), "a b.bin");
        assert_eq!(file("./textures//x.png").unwrap(), "textures/x.png");
        assert_eq!(file("caf%C3%A9.bin").unwrap(), "café.bin");
    }

    #[test]
    fn a_uri_that_leaves_the_folder_is_outside() {
        for uri in [
            "../x.bin",
            "a/../../x.bin",
            "a/../x.bin",
            "%2e%2e/x.bin",
            "/etc/passwd",
            "%2Fetc/passwd",
            "C:\\x.bin",
            "C:/x.bin",
            "a\\b.bin",
            "https://example.org/x.bin",
            "file:///x.bin",
            "//host/x.bin",
            "x%00.bin",
            "bad%zz",
            "bad%2",
            "%FF",
            "",
            ".",
        ] {
            assert_eq!(target(uri), Target::Outside, "{uri:?}");
        }
    }

    #[test]
    fn data_uris_are_decoded_with_and_without_padding() {
        for uri in [
            "data:application/octet-stream;base64,AAEC/w==",
            "DATA:;base64,AAEC/w",
            "data:text/plain,%00%01%02%FF",
        ] {
            let Target::Data(data) = target(uri) else {
                panic!("{uri} is no data")
            };
            assert_eq!(data.decode().unwrap(), [0, 1, 2, 255], "{uri}");
        }
        let Target::Data(broken) = target("data:;base64,$$$$") else {
            panic!("no data")
        };
        assert_eq!(broken.decode(), None);
    }
}
