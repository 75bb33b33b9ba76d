//! Which bytes does a `Range` header ask for? RFC 9110 §14.
//!
//! What cannot be read is ignored, as the RFC wants. Requests that would cost more than the whole (too many ranges, or
//! ranges that overlap) get the whole.

use std::ops::Range;

use axum::http::header;

use super::fields::{Fields, text};

/// More ranges than this get the whole: they cost more in part headers than they save.
pub(super) const MAX_RANGES: usize = 64;

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Asked {
    /// Everything.
    Whole,
    /// One slice.
    One(Range<u64>),
    /// Several disjoint slices, in the order asked.
    Many(Vec<Range<u64>>),
    /// Nothing that is there.
    Nothing,
}

/// Reads the `Range` header for `len` bytes.
pub(super) fn read(headers: &impl Fields, len: u64) -> Asked {
    let mut values = headers.all(&header::RANGE);
    let (Some(value), None) = (values.next(), values.next()) else {
        return Asked::Whole;
    };
    text(value).and_then(|text| parse(text, len)).unwrap_or(Asked::Whole)
}

/// `None` when it is malformed.
fn parse(text: &str, len: u64) -> Option<Asked> {
    let (unit, set) = text.split_once('=')?;
    if !unit.trim().eq_ignore_ascii_case("bytes") {
        return None;
    }
    let mut slices = vec![];
    let mut specs = 0;
    for spec in set
        .split(',')
        .map(|spec| spec.trim_matches([' ', '\t']))
        .filter(|spec| !spec.is_empty())
    {
        specs += 1;
        if specs > MAX_RANGES {
            return Some(Asked::Whole);
        }
        slices.extend(slice(spec, len)?);
    }
    match slices.as_slice() {
        [] if specs == 0 => None,
        [] => Some(Asked::Nothing),
        [one] => Some(Asked::One(one.clone())),
        many if overlap(many) => Some(Asked::Whole),
        _ => Some(Asked::Many(slices)),
    }
}

/// `None` when it is malformed, `Some(None)` when it lies outside.
fn slice(spec: &str, len: u64) -> Option<Option<Range<u64>>> {
    let (first, last) = spec.split_once('-')?;
    let slice = match (first, last) {
        ("", last) => len.saturating_sub(number(last)?)..len,
        (first, "") => number(first)?..len,
        (first, last) => {
            let (first, last) = (number(first)?, number(last)?);
            if last < first {
                return None;
            }
            first..last.saturating_add(1).min(len)
        }
    };
    Some((slice.start < slice.end).then_some(slice))
}

/// Numbers beyond u64 are as good as the largest.
fn number(digits: &str) -> Option<u64> {
    let ok = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    ok.then(|| digits.parse().unwrap_or(u64::MAX))
}

fn overlap(slices: &[Range<u64>]) -> bool {
    let mut sorted = slices.to_vec();
    sorted.sort_by_key(|slice| slice.start);
    sorted.windows(2).any(|pair| pair[1].start < pair[0].end)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderMap;

    use super::*;

    fn asked(text: &str, len: u64) -> Asked {
        let headers: HeaderMap = [(header::RANGE, text.parse().unwrap())].into_iter().collect();
        read(&headers, len)
    }

    #[test]
    fn ranges_are_read_as_the_rfc_says() {
        use Asked::{Many, Nothing, One, Whole};
        for (text, expected) in [
            ("bytes=0-0", One(0..1)),
            ("bytes=2-5", One(2..6)),
            ("bytes=2-", One(2..10)),
            ("bytes=-3", One(7..10)),
            ("bytes=-30", One(0..10)),
            ("bytes=9-99999999999999999999999999", One(9..10)),
            ("BYTES=0-1", One(0..2)),
            ("bytes= 0-1 ,, ", One(0..2)),
            ("bytes=10-", Nothing),
            ("bytes=-0", Nothing),
            ("bytes=99999999999999999999999999-", Nothing),
            ("bytes=10-12,-0", Nothing),
            ("bytes=0-1,10-12", One(0..2)),
            ("bytes=0-1,4-5", Many(vec![0..2, 4..6])),
            ("bytes=4-5,0-1", Many(vec![4..6, 0..2])),
            ("bytes=0-1,2-3", Many(vec![0..2, 2..4])),
            ("bytes=0-4,4-5", Whole),
            ("bytes=0-,0-", Whole),
            ("bytes=5-2", Whole),
            ("bytes=", Whole),
            ("bytes=,", Whole),
            ("bytes=a-b", Whole),
            ("bytes=1", Whole),
            ("bytes=--1", Whole),
            ("bytes=0-1;2-3", Whole),
            ("bytes=0 - 1", Whole),
            ("items=0-1", Whole),
            ("0-1", Whole),
        ] {
            assert_eq!(asked(text, 10), expected, "{text}");
        }
    }

    #[test]
    fn nothing_of_an_empty_object_can_be_asked_for() {
        for text in ["bytes=0-", "bytes=-1", "bytes=0-0"] {
            assert_eq!(asked(text, 0), Asked::Nothing, "{text}");
        }
    }

    #[test]
    fn too_many_ranges_get_the_whole() {
        let ranges = |n: u64| (0..n).map(|i| format!("{0}-{0}", 2 * i)).collect::<Vec<_>>().join(",");
        let many = MAX_RANGES as u64;
        assert!(matches!(asked(&format!("bytes={}", ranges(many)), 1000), Asked::Many(all) if all.len() == MAX_RANGES));
        assert_eq!(asked(&format!("bytes={}", ranges(many + 1)), 1000), Asked::Whole);
    }

    #[test]
    fn two_range_headers_are_ignored() {
        let mut headers = HeaderMap::new();
        headers.append(header::RANGE, "bytes=0-1".parse().unwrap());
        headers.append(header::RANGE, "bytes=4-5".parse().unwrap());
        assert_eq!(read(&headers, 10), Asked::Whole);
    }
}
