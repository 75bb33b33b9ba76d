//! Which stored encoding does a client get? RFC 9110 §12.5.3, with quality values.
//!
//! The highest quality wins; at equal quality zstd, then gzip, then the identity. The identity is acceptable unless it
//! is excluded by name or by `*;q=0`, but when it is not named, anything acceptable goes before it.

use axum::http::header;

use super::fields::{Fields, text};
use crate::store::{Coding, Representations};

/// What the client gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// One of the stored forms; `None` is the identity.
    Form(Option<Coding>),
    /// The client excludes all of them.
    NotAcceptable,
}

/// Chooses among the stored forms.
pub(super) fn choose(headers: &impl Fields, forms: &Representations) -> Choice {
    best(headers, |coding| forms.has(coding))
}

/// What is chosen of a blob that has all forms.
pub(super) fn wished(headers: &impl Fields) -> Option<Coding> {
    match best(headers, |_| true) {
        Choice::Form(coding) => coding,
        Choice::NotAcceptable => None,
    }
}

fn best(headers: &impl Fields, has: impl Fn(Option<Coding>) -> bool) -> Choice {
    let accept = Accept::read(headers);
    let mut best: Option<(u16, Option<Coding>)> = None;
    for coding in [Some(Coding::Zstd), Some(Coding::Gzip), None] {
        let Some(quality) = accept.quality(coding).filter(|_| has(coding)) else {
            continue;
        };
        if best.is_none_or(|(other, _)| quality > other) {
            best = Some((quality, coding));
        }
    }
    best.map_or(Choice::NotAcceptable, |(_, coding)| Choice::Form(coding))
}

/// Whether the client would take the identity.
pub(super) fn takes_identity(headers: &impl Fields) -> bool {
    Accept::read(headers).quality(None).is_some()
}

/// Qualities in thousandths.
#[derive(Debug, Default)]
struct Accept {
    zstd: Option<u16>,
    gzip: Option<u16>,
    identity: Option<u16>,
    any: Option<u16>,
}

impl Accept {
    fn read(headers: &impl Fields) -> Self {
        let mut accept = Self::default();
        for value in headers.all(&header::ACCEPT_ENCODING) {
            // A field that is not text says nothing that we understand.
            let Some(value) = text(value) else { continue };
            for element in value.split(',') {
                accept.add(element);
            }
        }
        accept
    }

    fn add(&mut self, element: &str) {
        let mut parts = element.split(';');
        let coding = parts.next().unwrap_or_default().trim();
        let mut quality = Some(1000);
        for parameter in parts {
            let (name, value) = parameter.split_once('=').unwrap_or((parameter, ""));
            if name.trim().eq_ignore_ascii_case("q") {
                quality = thousandths(value.trim());
            }
        }
        let slot = if coding.eq_ignore_ascii_case("zstd") {
            &mut self.zstd
        } else if coding.eq_ignore_ascii_case("gzip") || coding.eq_ignore_ascii_case("x-gzip") {
            &mut self.gzip
        } else if coding.eq_ignore_ascii_case("identity") {
            &mut self.identity
        } else if coding == "*" {
            &mut self.any
        } else {
            return;
        };
        if let Some(quality) = quality {
            *slot = Some(quality);
        }
    }

    /// `None` when it is not acceptable.
    fn quality(&self, coding: Option<Coding>) -> Option<u16> {
        let quality = match coding {
            Some(Coding::Zstd) => self.zstd.or(self.any).unwrap_or(0),
            Some(Coding::Gzip) => self.gzip.or(self.any).unwrap_or(0),
            None => match (self.identity, self.any) {
                (Some(quality), _) => quality,
                (None, Some(0)) => 0,
                // Acceptable, but anything that was asked for goes first.
                (None, _) => return Some(0),
            },
        };
        (quality > 0).then_some(quality)
    }
}

/// `0`, `1`, `0.125`; at most three decimals.
fn thousandths(text: &str) -> Option<u16> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
    if decimals.len() > 3 || !decimals.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let decimals: u16 = format!("{decimals:0<3}").parse().ok()?;
    match (whole, decimals) {
        ("0", decimals) => Some(decimals),
        ("1", 0) => Some(1000),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderMap;

    use super::*;

    fn choice(accept: Option<&str>, variants: bool) -> &'static str {
        let headers: HeaderMap = accept
            .map(|a| (header::ACCEPT_ENCODING, a.parse().unwrap()))
            .into_iter()
            .collect();
        match best(&headers, |coding| coding.is_none() || variants) {
            Choice::NotAcceptable => "406",
            Choice::Form(coding) => coding.map_or("identity", Coding::token),
        }
    }

    #[test]
    fn the_best_acceptable_encoding_is_chosen() {
        for (accept, expected) in [
            (None, "identity"),
            (Some(""), "identity"),
            (Some("gzip"), "gzip"),
            (Some("x-gzip"), "gzip"),
            (Some("GZIP"), "gzip"),
            (Some("gzip, deflate, br, zstd"), "zstd"),
            (Some("br"), "identity"),
            (Some("zstd;q=0.5, gzip;q=0.8"), "gzip"),
            (Some("zstd;q=0, gzip;q=0"), "identity"),
            (Some("zstd;q=0, *"), "gzip"),
            (Some("*"), "zstd"),
            (Some("*;q=0.1, identity"), "identity"),
            (Some("*;q=0"), "406"),
            (Some("*;q=0, identity;q=0.001"), "identity"),
            (Some("identity;q=0"), "406"),
            (Some("identity;q=0, gzip;q=0.001"), "gzip"),
            (Some("gzip;q=0.5, identity;q=0.9"), "identity"),
            (Some("gzip;q=2, zstd;q=x, ;;,"), "identity"),
            (Some("zstd ; Q=1.000"), "zstd"),
        ] {
            assert_eq!(choice(accept, true), expected, "{accept:?}");
        }
    }

    #[test]
    fn a_blob_without_variants_is_sent_as_it_is_unless_that_is_excluded() {
        for (accept, expected) in [
            (Some("zstd, gzip"), "identity"),
            (Some("identity;q=0"), "406"),
            (Some("gzip, *;q=0"), "406"),
        ] {
            assert_eq!(choice(accept, false), expected, "{accept:?}");
        }
    }
}
