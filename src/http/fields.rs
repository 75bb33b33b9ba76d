//! How is a header field of a request looked up, whoever has parsed it?
//!
//! Conditions, ranges and encodings have one rule each. hyper hands them a map, the way in front of it a list that still
//! lies where it was read.

use axum::http::{HeaderMap, HeaderName, HeaderValue};

/// The header fields of one request.
pub(super) trait Fields {
    /// Every value of a field, in the order in which they came.
    fn all(&self, name: &HeaderName) -> impl Iterator<Item = &[u8]>;

    /// Whether there is such a field.
    fn has(&self, name: &HeaderName) -> bool {
        self.all(name).next().is_some()
    }
}

impl Fields for HeaderMap {
    fn all(&self, name: &HeaderName) -> impl Iterator<Item = &[u8]> {
        self.get_all(name).iter().map(HeaderValue::as_bytes)
    }
}

/// Fields as they were read.
#[derive(Debug)]
pub(super) struct Listed<'a>(pub(super) &'a [httparse::Header<'a>]);

impl Fields for Listed<'_> {
    fn all(&self, name: &HeaderName) -> impl Iterator<Item = &[u8]> {
        let named = self
            .0
            .iter()
            .filter(|field| field.name.eq_ignore_ascii_case(name.as_str()));
        named.map(|field| field.value)
    }
}

/// A value as text; what is not visible ASCII is none.
pub(super) fn text(value: &[u8]) -> Option<&str> {
    let visible = value.iter().all(|byte| matches!(byte, b' '..=b'~' | b'\t'));
    visible.then(|| str::from_utf8(value).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use axum::http::header;

    use super::*;

    #[test]
    fn both_kinds_of_fields_say_the_same() {
        let listed =
            [("Range", "a"), ("X-A", "b"), ("RANGE", "c"), ("range", "")].map(|(name, value)| httparse::Header {
                name,
                value: value.as_bytes(),
            });
        let mut map = HeaderMap::new();
        for field in &listed {
            let name = HeaderName::from_bytes(field.name.as_bytes()).unwrap();
            map.append(name, HeaderValue::from_bytes(field.value).unwrap());
        }
        for name in [header::RANGE, header::IF_RANGE, HeaderName::from_static("x-a")] {
            let (of_list, of_map) = (Listed(&listed), map.all(&name));
            assert!(of_list.all(&name).eq(of_map), "{name}");
            assert_eq!(of_list.has(&name), map.has(&name), "{name}");
        }
    }

    #[test]
    fn text_is_what_a_header_value_calls_text() {
        for byte in (0..=u8::MAX).filter(|byte| HeaderValue::from_bytes(&[*byte]).is_ok()) {
            let value = HeaderValue::from_bytes(&[byte]).unwrap();
            assert_eq!(text(&[byte]), value.to_str().ok(), "{byte}");
        }
    }
}
