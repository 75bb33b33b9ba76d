//! What stands at the head of answers with one stored form? Made when it is first needed, once per form: as fields for hyper, and as
//! they go over the wire for the way in front of it. Whoever is sent a form that is soon thrown out again waits for no more than that.

use std::sync::OnceLock;

use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{around, direct::head_lines, immutable::IMMUTABLE};
use crate::{
    media,
    store::{Coding, Representation},
};

/// The heads of one form as an immutable object. Fields are complete, and cloned for each answer; lines are without what each answer adds:
/// the end, and the length and range of a slice.
#[derive(Debug)]
pub(super) struct Heads {
    etag: HeaderValue,
    kind: &'static str,
    coding: Option<Coding>,
    /// Whether there are other forms.
    varies: bool,
    length: usize,
    whole: OnceLock<HeaderMap>,
    unchanged: OnceLock<HeaderMap>,
    written_whole: OnceLock<Bytes>,
    written_slice: OnceLock<Bytes>,
    written_unchanged: OnceLock<Bytes>,
}

impl Heads {
    pub(super) fn of(name: &BlobName, form: &Representation, coding: Option<Coding>, varies: bool) -> Self {
        Self {
            etag: HeaderValue::from_maybe_shared(form.etag.clone()).expect("a tag is quoted hex digits"),
            kind: media::kind(name.ext()),
            coding,
            varies,
            length: form.bytes.len(),
            whole: OnceLock::new(),
            unchanged: OnceLock::new(),
            written_whole: OnceLock::new(),
            written_slice: OnceLock::new(),
            written_unchanged: OnceLock::new(),
        }
    }

    pub(super) fn whole(&self) -> &HeaderMap {
        self.whole.get_or_init(|| self.fields_of_whole())
    }

    /// Of a 304.
    pub(super) fn unchanged(&self) -> &HeaderMap {
        self.unchanged.get_or_init(|| self.fields_of_unchanged())
    }

    pub(super) fn written_whole(&self) -> &Bytes {
        let written = || head_lines(StatusCode::OK, &self.fields_of_whole()).into();
        self.written_whole.get_or_init(written)
    }

    pub(super) fn written_slice(&self) -> &Bytes {
        self.written_slice.get_or_init(|| {
            let mut slice = self.fields_of_whole();
            slice.remove(header::CONTENT_LENGTH);
            head_lines(StatusCode::PARTIAL_CONTENT, &slice).into()
        })
    }

    pub(super) fn written_unchanged(&self) -> &Bytes {
        let written = || head_lines(StatusCode::NOT_MODIFIED, &self.fields_of_unchanged()).into();
        self.written_unchanged.get_or_init(written)
    }

    fn fields_of_whole(&self) -> HeaderMap {
        let mut whole = self.fields_of_all();
        around::for_everybody(StatusCode::OK, &mut whole);
        insert(&mut whole, header::CONTENT_TYPE, self.kind);
        insert(&mut whole, header::ACCEPT_RANGES, "bytes");
        if let Some(coding) = self.coding {
            insert(&mut whole, header::CONTENT_ENCODING, coding.token());
        }
        whole.insert(header::CONTENT_LENGTH, self.length.into());
        whole
    }

    fn fields_of_unchanged(&self) -> HeaderMap {
        let mut unchanged = self.fields_of_all();
        around::for_everybody(StatusCode::NOT_MODIFIED, &mut unchanged);
        unchanged
    }

    fn fields_of_all(&self) -> HeaderMap {
        // With room for what a slice adds.
        let mut fields = HeaderMap::with_capacity(16);
        fields.insert(header::ETAG, self.etag.clone());
        fields.insert(header::CACHE_CONTROL, IMMUTABLE);
        if self.varies {
            insert(&mut fields, header::VARY, "Accept-Encoding");
        }
        fields
    }
}

fn insert(headers: &mut HeaderMap, name: HeaderName, value: &'static str) {
    headers.insert(name, HeaderValue::from_static(value));
}
