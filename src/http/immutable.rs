//! How is a content-addressed object answered?
//!
//! Forms, tags and lengths were made at publish time; here only headers are put together. A `Range` is cut from the
//! identity; everything else is negotiated. One [`BlobResponse`] serves `/o/{name}` and, with a shorter life and a
//! `Content-Location`, routes whose answer is such an object.

use std::{
    collections::VecDeque,
    convert::Infallible,
    mem,
    ops::Range,
    pin::Pin,
    task::{Context, Poll},
};

use axum::{
    body::{Body, HttpBody},
    http::{HeaderMap, HeaderName, HeaderValue, Method, Request, StatusCode, header},
    response::{IntoResponse, Response},
};
use belvedere_scene::{BlobName, rung::RungName};
use bytes::Bytes;
use hyper::body::{Frame, SizeHint};

use super::{
    AppState, around,
    conditional::{self, Verdict},
    error::ApiError,
    extract::Path,
    negotiate::{self, Choice},
    ranges::{self, Asked},
    rungs,
    visitor::Visitor,
};
use crate::{
    media,
    store::{Coding, Representation, Representations},
};

/// `GET /o/{name}`: an immutable object, or a rung of one.
pub(super) async fn object(
    visitor: Visitor,
    Path(name): Path<String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let unknown = || ApiError::NotFound(format!("object `{}`", name.chars().take(80).collect::<String>()));
    let rung = RungName::from_file_name(&name);
    let blob = match rung {
        Some(rung) => rung.whole(),
        None => name.parse().map_err(|_| unknown())?,
    };
    let forms = visitor.blob(&blob).await?.ok_or_else(unknown)?;
    answer_immutable(&blob, rung, &forms, &method, &headers).map(|response| response.map(Body::new))
}

/// The same without waiting, when the object is public and in memory and nothing about the request needs an explanation.
pub(super) fn object_in_memory<B>(state: &AppState, request: &Request<B>) -> Option<Response<BlobBody>> {
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        return None;
    }
    let name = request.uri().path().strip_prefix("/o/")?;
    let rung = RungName::from_file_name(name);
    let blob = match rung {
        Some(rung) => rung.whole(),
        None => name.parse().ok()?,
    };
    let forms = state.blobs.in_memory(&blob)?;
    if !state.publications.is_public(&blob) {
        return None;
    }
    answer_immutable(&blob, rung, &forms, request.method(), request.headers()).ok()
}

/// Answers with a stored object, or with just a rung of it.
fn answer_immutable(
    name: &BlobName,
    rung: Option<RungName>,
    forms: &Representations,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Response<BlobBody>, ApiError> {
    let cut = rung.map(|rung| rungs::cut(rung, forms)).transpose()?;
    let response = BlobResponse {
        name,
        forms: cut.as_ref().unwrap_or(forms),
        life: Life::Immutable,
    };
    response.answer(method, headers)
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
pub(super) const CURRENT: HeaderValue = HeaderValue::from_static(media::CURRENT);
pub(super) const IMMUTABLE: HeaderValue = HeaderValue::from_static(media::FOR_EVER);

/// The header fields of one form as an immutable object, complete: made once, cloned for each answer.
#[derive(Debug)]
struct Heads {
    whole: HeaderMap,
    /// Of a 304.
    unchanged: HeaderMap,
}

impl Heads {
    fn of(name: &BlobName, forms: &Representations, coding: Option<Coding>) -> Self {
        let form = forms.of(coding).expect("heads are made of stored forms");
        // With room for what a slice adds.
        let mut unchanged = HeaderMap::with_capacity(16);
        let etag = HeaderValue::from_maybe_shared(form.etag.clone()).expect("a tag is quoted hex digits");
        unchanged.insert(header::ETAG, etag);
        unchanged.insert(header::CACHE_CONTROL, IMMUTABLE);
        if forms.has_variants() {
            insert(&mut unchanged, header::VARY, "Accept-Encoding");
        }
        around::for_everybody(&mut unchanged);
        let mut whole = unchanged.clone();
        insert(&mut whole, header::CONTENT_TYPE, media::kind(name.ext()));
        insert(&mut whole, header::ACCEPT_RANGES, "bytes");
        if let Some(coding) = coding {
            insert(&mut whole, header::CONTENT_ENCODING, coding.token());
        }
        whole.insert(header::CONTENT_LENGTH, form.bytes.len().into());
        Self { whole, unchanged }
    }
}

/// A blob and how it is to be sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlobResponse<'a> {
    pub(super) name: &'a BlobName,
    pub(super) forms: &'a Representations,
    pub(super) life: Life,
}

impl BlobResponse<'_> {
    /// Answers a GET or HEAD.
    pub(super) fn answer(&self, method: &Method, headers: &HeaderMap) -> Result<Response<BlobBody>, ApiError> {
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
        let heads = form.derived.get_or_make(|| Heads::of(self.name, self.forms, coding));
        let mut response = match (conditional::evaluate(headers, &form.etag), asked) {
            (Verdict::Failed, _) => return Err(ApiError::PreconditionFailed),
            (Verdict::NotModified, _) => {
                respond(StatusCode::NOT_MODIFIED, heads.unchanged.clone(), BlobBody::default())
            }
            (Verdict::Proceed, Asked::Whole) => self.whole(heads, form),
            (Verdict::Proceed, Asked::One(slice)) => self.slice(heads, slice),
            (Verdict::Proceed, Asked::Many(slices)) => self.slices(heads, &slices),
            (Verdict::Proceed, Asked::Nothing) => {
                let varies = self.forms.has_variants();
                return Err(ApiError::RangeNotSatisfiable { len, varies });
            }
        };
        if self.life == Life::Current {
            let headers = response.headers_mut();
            headers.insert(header::CACHE_CONTROL, CURRENT);
            let location = HeaderValue::try_from(self.name.url()).expect("a blob's URL is hex digits and an extension");
            headers.insert(header::CONTENT_LOCATION, location);
        }
        if *method == Method::HEAD {
            *response.body_mut() = BlobBody::default();
        }
        Ok(response)
    }

    fn whole(&self, heads: &Heads, form: &Representation) -> Response<BlobBody> {
        respond(StatusCode::OK, heads.whole.clone(), BlobBody::One(form.bytes.clone()))
    }

    fn slice(&self, heads: &Heads, slice: Range<u64>) -> Response<BlobBody> {
        let form = &self.forms.identity;
        let mut headers = heads.whole.clone();
        let content_range = content_range(&slice, form.bytes.len());
        let content_range = HeaderValue::try_from(content_range).expect("digits and punctuation");
        headers.insert(header::CONTENT_RANGE, content_range);
        headers.insert(header::CONTENT_LENGTH, (slice.end - slice.start).into());
        let body = BlobBody::One(form.bytes.slice(slice.start as usize..slice.end as usize));
        respond(StatusCode::PARTIAL_CONTENT, headers, body)
    }

    fn slices(&self, heads: &Heads, slices: &[Range<u64>]) -> Response<BlobBody> {
        let form = &self.forms.identity;
        // Derived from the content's own hash, which nothing can contain but by breaking SHA-256.
        let boundary = format!("belvedere-{}", &self.name.hash().to_string()[..40]);
        let media_type = media::kind(self.name.ext());
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
        let body = BlobBody::Many(parts);
        let mut headers = heads.whole.clone();
        let content_type = HeaderValue::try_from(format!("multipart/byteranges; boundary={boundary}"));
        headers.insert(
            header::CONTENT_TYPE,
            content_type.expect("a boundary is letters and digits"),
        );
        headers.insert(header::CONTENT_LENGTH, body.len().into());
        respond(StatusCode::PARTIAL_CONTENT, headers, body)
    }
}

/// Answers with a small mutable document: a pointer, a list, the result of a query.
pub(super) fn json_answer(headers: &HeaderMap, etag: Bytes, bytes: Bytes) -> Result<Response, ApiError> {
    current_answer(headers, etag, "application/json", bytes)
}

/// Answers with what was made of the current revision for this request.
pub(super) fn current_answer(
    headers: &HeaderMap,
    etag: Bytes,
    media_type: &'static str,
    bytes: Bytes,
) -> Result<Response, ApiError> {
    let mut answer = HeaderMap::with_capacity(8);
    let tag = HeaderValue::from_maybe_shared(etag.clone()).expect("a tag is quoted hex digits");
    answer.insert(header::ETAG, tag);
    answer.insert(header::CACHE_CONTROL, CURRENT);
    match conditional::evaluate(headers, &etag) {
        Verdict::Failed => Err(ApiError::PreconditionFailed),
        Verdict::NotModified => Ok((StatusCode::NOT_MODIFIED, answer).into_response()),
        Verdict::Proceed => {
            insert(&mut answer, header::CONTENT_TYPE, media_type);
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

fn respond(status: StatusCode, headers: HeaderMap, body: BlobBody) -> Response<BlobBody> {
    let mut response = Response::new(body);
    *response.status_mut() = status;
    *response.headers_mut() = headers;
    response
}

/// A body of slices that are sent without being copied together.
#[derive(Debug, Default)]
pub(super) enum BlobBody {
    #[default]
    Empty,
    One(Bytes),
    Many(VecDeque<Bytes>),
}

impl BlobBody {
    /// How many bytes are still to be sent.
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Empty => 0,
            Self::One(bytes) => bytes.len() as u64,
            Self::Many(parts) => parts.iter().map(|part| part.len() as u64).sum(),
        }
    }
}

impl HttpBody for BlobBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let next = match &mut *self {
            Self::Many(parts) => parts.pop_front(),
            one => match mem::take(one) {
                Self::One(bytes) => Some(bytes),
                _ => None,
            },
        };
        Poll::Ready(next.map(|part| Ok(Frame::data(part))))
    }

    fn is_end_stream(&self) -> bool {
        self.len() == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.len())
    }
}
