//! Does the client have it already? RFC 9110 §13 for strong entity tags; dates are never used.

use axum::http::{HeaderName, header};

use super::fields::Fields;

/// What the preconditions say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Answer as asked.
    Proceed,
    /// 304: the client has it.
    NotModified,
    /// 412: `If-Match` names something else.
    Failed,
}

/// Evaluates `If-Match`, then `If-None-Match`, against the tag of the selected representation.
pub(super) fn evaluate(headers: &impl Fields, etag: &[u8]) -> Verdict {
    if headers.has(&header::IF_MATCH) && !any_matches(headers, &header::IF_MATCH, etag, Compare::Strong) {
        return Verdict::Failed;
    }
    if any_matches(headers, &header::IF_NONE_MATCH, etag, Compare::Weak) {
        return Verdict::NotModified;
    }
    Verdict::Proceed
}

/// Whether a `Range` still means these bytes: there is no `If-Range`, or it is this very strong tag. A date never is.
pub(super) fn range_applies(headers: &impl Fields, etag: &[u8]) -> bool {
    let mut values = headers.all(&header::IF_RANGE);
    match (values.next(), values.next()) {
        (None, _) => true,
        (Some(value), None) => value.trim_ascii() == etag,
        (Some(_), Some(_)) => false,
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Compare {
    Strong,
    Weak,
}

fn any_matches(headers: &impl Fields, name: &HeaderName, etag: &[u8], compare: Compare) -> bool {
    headers.all(name).any(|value| {
        let value = value.trim_ascii();
        value == b"*" || tags(value).any(|(weak, tag)| tag == etag && (compare == Compare::Weak || !weak))
    })
}

/// The tags of a list, quotes included, each with whether it is weak. Reading ends at the first malformed one.
fn tags(mut rest: &[u8]) -> impl Iterator<Item = (bool, &[u8])> {
    std::iter::from_fn(move || {
        while let [b' ' | b'\t' | b',', after @ ..] = rest {
            rest = after;
        }
        let (weak, opaque) = match rest.strip_prefix(b"W/") {
            Some(opaque) => (true, opaque),
            None => (false, rest),
        };
        let inside = opaque.strip_prefix(b"\"")?;
        let end = inside.iter().position(|b| *b == b'"')? + 2;
        let (tag, after) = opaque.split_at(end);
        rest = after;
        Some((weak, tag))
    })
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderMap;

    use super::*;

    const TAG: &[u8] = b"\"abc\"";

    fn with(name: HeaderName, value: &str) -> HeaderMap {
        [(name, value.parse().unwrap())].into_iter().collect()
    }

    #[test]
    fn if_none_match_compares_weakly_and_reads_lists() {
        for (value, has_it) in [
            ("\"abc\"", true),
            ("W/\"abc\"", true),
            ("\"x\", \"abc\"", true),
            ("\"x\",,\t\"abc\" ,", true),
            ("\"a,b\", \"abc\"", true),
            ("*", true),
            ("abc", false),
            ("\"ab\"", false),
            ("\"abc", false),
            ("", false),
            ("\"abc-zstd\"", false),
        ] {
            let expected = if has_it { Verdict::NotModified } else { Verdict::Proceed };
            assert_eq!(evaluate(&with(header::IF_NONE_MATCH, value), TAG), expected, "{value}");
        }
    }

    #[test]
    fn if_match_compares_strongly_and_goes_first() {
        for (value, expected) in [
            ("\"abc\"", Verdict::Proceed),
            ("*", Verdict::Proceed),
            ("W/\"abc\"", Verdict::Failed),
            ("\"x\"", Verdict::Failed),
        ] {
            assert_eq!(evaluate(&with(header::IF_MATCH, value), TAG), expected, "{value}");
        }
        let mut both = with(header::IF_MATCH, "\"x\"");
        both.insert(header::IF_NONE_MATCH, "\"abc\"".parse().unwrap());
        assert_eq!(evaluate(&both, TAG), Verdict::Failed);
    }

    #[test]
    fn only_the_same_strong_tag_keeps_a_range() {
        assert!(range_applies(&HeaderMap::new(), TAG));
        assert!(range_applies(&with(header::IF_RANGE, "\"abc\""), TAG));
        for value in [
            "W/\"abc\"",
            "\"x\"",
            "Sat, 21 Nov 2026 00:00:00 GMT",
            "*",
            "\"abc\", \"abc\"",
        ] {
            assert!(!range_applies(&with(header::IF_RANGE, value), TAG), "{value}");
        }
    }
}
