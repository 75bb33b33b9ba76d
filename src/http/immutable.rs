//! How is a content-addressed object answered?
//!
//! Forms, tags and lengths were made at publish time; here only headers are put together. A `Range` is cut from the
//! identity; everything else is negotiated. One [`BlobResponse`] serves `/o/{name}` and, with a shorter life and a
//! `Content-Location`, routes whose answer is such an object.

use std::{
    collections::VecDeque,
    convert::Infallible,
    ops::Range,
    pin::Pin,
    task::{Context, Poll},
};

use axum::{
    body::{Body, HttpBody},
    extract::State,
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use belvedere_scene::BlobName;
use bytes::{Buf, Bytes};
use hyper::body::{Frame, SizeHint};

use super::{
    conditional::{self, Verdict},
    error::ApiError,
    extract::Path,
    negotiate::{self, Choice},
    ranges::{self, Asked},
};
use crate::store::{BlobStore, Coding, Representation, Representations};

/// `GET /o/{name}`: an immutable object.
pub(super) async fn object(
    State(blobs): State<BlobStore>,
    Path(name): Path<String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let unknown = || ApiError::NotFound(format!("object `{}`", name.chars().take(80).collect::<String>()));
    let blob: BlobName = name.parse().map_err(|_| unknown())?;
    let forms = blobs.get(&blob).await?.ok_or_else(unknown)?;
    BlobResponse {
        name: &blob,
        forms: &forms,
        life: Life::Immutable,
    }
    .answer(&method, &headers)
}

/// How long an answer may be kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Life {
    /// For ever: the address names the content.
    Immutable,
    /// Seconds: the address names something of the current revision.
    Current,
}

/// Caching of what names the current revision.
pub(super) const CURRENT: HeaderValue = HeaderValue::from_static("public, max-age=2, stale-while-revalidate=30");
const IMMUTABLE: HeaderValue = HeaderValue::from_static("public, max-age=31536000, immutable");

/// A blob and how it is to be sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlobResponse<'a> {
    pub(super) name: &'a BlobName,
    pub(super) forms: &'a Representations,
    pub(super) life: Life,
}

impl BlobResponse<'_> {
    /// Answers a GET or HEAD.
    pub(super) fn answer(&self, method: &Method, headers: &HeaderMap) -> Result<Response, ApiError> {
        let identity = &self.forms.identity;
        let len = identity.bytes.len() as u64;
        // A range means the identity, and HEAD has none (RFC 9110 §14.2).
        let asked = if method == Method::GET
            && headers.contains_key(header::RANGE)
            && negotiate::takes_identity(headers)
            && conditional::range_applies(headers, &identity.etag)
        {
            ranges::read(headers, len)
        } else {
            Asked::Whole
        };
        let coding = match asked {
            Asked::Whole => match negotiate::choose(headers, self.forms) {
                Choice::Form(coding) => coding,
                Choice::NotAcceptable => return Err(ApiError::NotAcceptable),
            },
            _ => None,
        };
        let form = self.forms.of(coding).expect("only stored forms are chosen");
        match conditional::evaluate(headers, &form.etag) {
            Verdict::Failed => return Err(ApiError::PreconditionFailed),
            Verdict::NotModified => return Ok((StatusCode::NOT_MODIFIED, self.common(form)).into_response()),
            Verdict::Proceed => {}
        }
        match asked {
            Asked::Whole => Ok(self.whole(form, coding)),
            Asked::One(slice) => Ok(self.slice(slice)),
            Asked::Many(slices) => Ok(self.slices(&slices)),
            Asked::Nothing => {
                let mut refused = ApiError::RangeNotSatisfiable { len }.into_response();
                if self.forms.has_variants() {
                    insert(refused.headers_mut(), header::VARY, "Accept-Encoding");
                }
                Ok(refused)
            }
        }
    }

    /// What a 304 has as well.
    fn common(&self, form: &Representation) -> HeaderMap {
        let mut headers = HeaderMap::with_capacity(16);
        let etag = HeaderValue::from_maybe_shared(form.etag.clone()).expect("a tag is quoted hex digits");
        headers.insert(header::ETAG, etag);
        match self.life {
            Life::Immutable => headers.insert(header::CACHE_CONTROL, IMMUTABLE),
            Life::Current => headers.insert(header::CACHE_CONTROL, CURRENT),
        };
        if self.life == Life::Current {
            let location = HeaderValue::try_from(self.name.url()).expect("a blob's URL is hex digits and an extension");
            headers.insert(header::CONTENT_LOCATION, location);
        }
        if self.forms.has_variants() {
            insert(&mut headers, header::VARY, "Accept-Encoding");
        }
        headers
    }

    fn whole(&self, form: &Representation, coding: Option<Coding>) -> Response {
        let mut headers = self.common(form);
        insert(&mut headers, header::CONTENT_TYPE, media_type(self.name.ext()));
        insert(&mut headers, header::ACCEPT_RANGES, "bytes");
        if let Some(coding) = coding {
            insert(&mut headers, header::CONTENT_ENCODING, coding.token());
        }
        headers.insert(header::CONTENT_LENGTH, form.bytes.len().into());
        (StatusCode::OK, headers, Body::from(form.bytes.clone())).into_response()
    }

    fn slice(&self, slice: Range<u64>) -> Response {
        let form = &self.forms.identity;
        let mut headers = self.common(form);
        insert(&mut headers, header::CONTENT_TYPE, media_type(self.name.ext()));
        insert(&mut headers, header::ACCEPT_RANGES, "bytes");
        let content_range = content_range(&slice, form.bytes.len());
        let content_range = HeaderValue::try_from(content_range).expect("digits and punctuation");
        headers.insert(header::CONTENT_RANGE, content_range);
        headers.insert(header::CONTENT_LENGTH, (slice.end - slice.start).into());
        let body = Body::from(form.bytes.slice(slice.start as usize..slice.end as usize));
        (StatusCode::PARTIAL_CONTENT, headers, body).into_response()
    }

    fn slices(&self, slices: &[Range<u64>]) -> Response {
        let form = &self.forms.identity;
        // Derived from the content's own hash, which nothing can contain but by breaking SHA-256.
        let boundary = format!("belvedere-{}", &self.name.hash().to_string()[..40]);
        let media_type = media_type(self.name.ext());
        let mut parts = VecDeque::with_capacity(2 * slices.len() + 1);
        for (i, slice) in slices.iter().enumerate() {
            let line_end = if i == 0 { "" } else { "\r\n" };
            let range = content_range(slice, form.bytes.len());
            let head =
                format!("{line_end}--{boundary}\r\nContent-Type: {media_type}\r\nContent-Range: {range}\r\n\r\n");
            parts.push_back(Bytes::from(head));
            parts.push_back(form.bytes.slice(slice.start as usize..slice.end as usize));
        }
        parts.push_back(format!("\r\n--{boundary}--\r\n").into());
        let body = Parted(parts);
        let mut headers = self.common(form);
        let content_type = HeaderValue::try_from(format!("multipart/byteranges; boundary={boundary}"));
        headers.insert(
            header::CONTENT_TYPE,
            content_type.expect("a boundary is letters and digits"),
        );
        insert(&mut headers, header::ACCEPT_RANGES, "bytes");
        headers.insert(header::CONTENT_LENGTH, body.len().into());
        (StatusCode::PARTIAL_CONTENT, headers, Body::new(body)).into_response()
    }
}

/// Answers with a small mutable document: a pointer, a list, the result of a query.
pub(super) fn json_answer(headers: &HeaderMap, etag: Bytes, bytes: Bytes) -> Result<Response, ApiError> {
    let mut answer = HeaderMap::with_capacity(8);
    let tag = HeaderValue::from_maybe_shared(etag.clone()).expect("a tag is quoted hex digits");
    answer.insert(header::ETAG, tag);
    answer.insert(header::CACHE_CONTROL, CURRENT);
    match conditional::evaluate(headers, &etag) {
        Verdict::Failed => Err(ApiError::PreconditionFailed),
        Verdict::NotModified => Ok((StatusCode::NOT_MODIFIED, answer).into_response()),
        Verdict::Proceed => {
            insert(&mut answer, header::CONTENT_TYPE, "application/json");
            answer.insert(header::CONTENT_LENGTH, bytes.len().into());
            Ok((StatusCode::OK, answer, Body::from(bytes)).into_response())
        }
    }
}

fn content_range(slice: &Range<u64>, len: usize) -> String {
    format!("bytes {}-{}/{len}", slice.start, slice.end - 1)
}

fn insert(headers: &mut HeaderMap, name: HeaderName, value: &'static str) {
    headers.insert(name, HeaderValue::from_static(value));
}

/// The media type of an extension below `/o/`.
pub(super) fn media_type(ext: &str) -> &'static str {
    match ext {
        "json" => "application/json",
        "glb" => "model/gltf-binary",
        "cell" => "application/vnd.belvedere.cell",
        "slod" => "application/vnd.belvedere.slod",
        "pack" => "application/vnd.belvedere.pack",
        "dcg" => "text/plain; charset=utf-8",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ktx2" => "image/ktx2",
        _ => "application/octet-stream",
    }
}

/// A body of several slices that are sent without being copied together.
#[derive(Debug)]
struct Parted(VecDeque<Bytes>);

impl Parted {
    fn len(&self) -> u64 {
        self.0.iter().map(|part| part.remaining() as u64).sum()
    }
}

impl HttpBody for Parted {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        Poll::Ready(self.0.pop_front().map(|part| Ok(Frame::data(part))))
    }

    fn is_end_stream(&self) -> bool {
        self.0.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.len())
    }
}
