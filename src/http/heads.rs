//! What stands at the head of answers with one stored form? Made once per form: as fields for hyper, and as they go over
//! the wire for the way in front of it.

use std::sync::OnceLock;

use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{around, direct::head_lines, immutable::IMMUTABLE};
use crate::{
    media,
    store::{Coding, Representations},
};

/// The header fields of one form as an immutable object, complete: cloned for each answer.
#[derive(Debug)]
pub(super) struct Heads {
    pub(super) whole: HeaderMap,
    /// Of a 304.
    pub(super) unchanged: HeaderMap,
    written: OnceLock<Written>,
}

/// The same as HTTP/1.1 writes them, without what each answer adds: the end, and the length and range of a slice.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) whole: Bytes,
    pub(super) slice: Bytes,
    pub(super) unchanged: Bytes,
}

impl Heads {
    pub(super) fn of(name: &BlobName, forms: &Representations, coding: Option<Coding>) -> Self {
        let form = forms.of(coding).expect("heads are made of stored forms");
        // With room for what a slice adds.
        let mut unchanged = HeaderMap::with_capacity(16);
        let etag = HeaderValue::from_maybe_shared(form.etag.clone()).expect("a tag is quoted hex digits");
        unchanged.insert(header::ETAG, etag);
        unchanged.insert(header::CACHE_CONTROL, IMMUTABLE);
        if forms.has_variants() {
            insert(&mut unchanged, header::VARY, "Accept-Encoding");
        }
        let mut whole = unchanged.clone();
        around::for_everybody(StatusCode::NOT_MODIFIED, &mut unchanged);
        around::for_everybody(StatusCode::OK, &mut whole);
        insert(&mut whole, header::CONTENT_TYPE, media::kind(name.ext()));
        insert(&mut whole, header::ACCEPT_RANGES, "bytes");
        if let Some(coding) = coding {
            insert(&mut whole, header::CONTENT_ENCODING, coding.token());
        }
        whole.insert(header::CONTENT_LENGTH, form.bytes.len().into());
        Self {
            whole,
            unchanged,
            written: OnceLock::new(),
        }
    }

    pub(super) fn written(&self) -> &Written {
        self.written.get_or_init(|| {
            let mut slice = self.whole.clone();
            slice.remove(header::CONTENT_LENGTH);
            Written {
                whole: head_lines(StatusCode::OK, &self.whole).into(),
                slice: head_lines(StatusCode::PARTIAL_CONTENT, &slice).into(),
                unchanged: head_lines(StatusCode::NOT_MODIFIED, &self.unchanged).into(),
            }
        })
    }
}

fn insert(headers: &mut HeaderMap, name: HeaderName, value: &'static str) {
    headers.insert(name, HeaderValue::from_static(value));
}
