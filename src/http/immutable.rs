//! How is a content-addressed object answered?
//!
//! Forms, tags and lengths were made at publish time; here only headers are put together. A `Range` is cut from the
//! identity; everything else is negotiated. One [`BlobResponse`] serves `/o/{name}` and, with a shorter life and a
//! `Content-Location`, routes whose answer is such an object.

use std::{ops::Range, sync::Arc};

use axum::{
    body::Body,
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use belvedere_scene::{BlobName, rung::RungName};
use bytes::Bytes;

use super::{
    AppState,
    blob_body::{BlobBody, Part as BodyPart, Pieces, Source},
    conditional::{self, Verdict},
    error::ApiError,
    extract::Path,
    fields::Fields,
    heads::Heads,
    negotiate::{self, Choice},
    ranges::{self, Asked},
    rungs,
    visitor::Visitor,
};
use crate::{
    media,
    store::{BlobStore, Coding, Representation, Representations, StoreError},
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
    let Some(rung) = rung else {
        let forms = visitor.blob(&blob, wished(&headers)).await?.ok_or_else(unknown)?;
        let object = BlobResponse {
            blobs: visitor.blobs(),
            name: &blob,
            forms: &forms,
            from: 0,
            life: Life::Immutable,
        };
        return object.answer(&forms, &method, &headers).await;
    };
    let whole = visitor.identity(&blob).await?.ok_or_else(unknown)?;
    let (from, cut) = rungs::cut(rung, &whole)?;
    let cut = Arc::new(cut);
    let object = BlobResponse {
        blobs: visitor.blobs(),
        name: &blob,
        forms: &cut,
        from,
        life: Life::Immutable,
    };
    object.answer(&cut, &method, &headers).await
}

/// The same without waiting, when the object is public and in memory, or at hand, and nothing about the request needs an explanation.
pub(super) fn object_now<A>(
    state: &AppState,
    (method, path): (&Method, &str),
    fields: &impl Fields,
    answer: impl FnOnce(&BlobResponse, &Chosen) -> A,
) -> Option<A> {
    if !matches!(*method, Method::GET | Method::HEAD) {
        return None;
    }
    let name = path.strip_prefix("/o/")?;
    let rung = RungName::from_file_name(name);
    let blob = match rung {
        Some(rung) => rung.whole(),
        None => name.parse().ok()?,
    };
    let blobs = &state.blobs;
    let forms = blobs.known(&blob)?;
    if !state.publications.is_public(&blob) {
        return None;
    }
    let mut read = false;
    let mut load = |coding| {
        read = true;
        blobs.load_now(&blob, &forms, coding).then_some(())
    };
    if rung.is_some() && forms.of(None).is_none() {
        load(None)?;
    }
    let cut = match rung {
        Some(rung) => Some(rungs::cut(rung, &forms.of(None)?.bytes).ok()?),
        None => None,
    };
    let (from, forms) = cut.as_ref().map_or((0, &*forms), |(from, cut)| (*from, cut));
    let object = BlobResponse {
        blobs,
        name: &blob,
        forms,
        from,
        life: Life::Immutable,
    };
    let chosen = loop {
        match object.choose(method, fields).ok()? {
            Ok(chosen) => break chosen,
            Err(NotInMemory(coding)) => load(coding)?,
        }
    };
    if !read {
        blobs.was_in_memory();
    }
    Some(answer(&object, &chosen))
}

/// Which form will most likely be sent, of whatever object.
pub(super) fn wished(fields: &impl Fields) -> Option<Coding> {
    if fields.has(&header::RANGE) {
        None
    } else {
        negotiate::wished(fields)
    }
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

/// A blob and how it is to be sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlobResponse<'a> {
    pub(super) blobs: &'a BlobStore,
    pub(super) name: &'a BlobName,
    pub(super) forms: &'a Representations,
    /// Where their bytes begin in what is stored.
    pub(super) from: usize,
    pub(super) life: Life,
}

/// What of a blob is sent.
#[derive(Debug)]
pub(super) struct Chosen<'a> {
    pub(super) form: &'a Representation,
    pub(super) coding: Option<Coding>,
    pub(super) heads: &'a Heads,
    pub(super) part: Part,
}

/// The form that was chosen is not in memory yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct NotInMemory(pub(super) Option<Coding>);

/// Which part of a form.
#[derive(Debug)]
pub(super) enum Part {
    Whole,
    One(Range<u64>),
    Many(Vec<Range<u64>>),
    /// None: the client has it.
    Unchanged,
}

impl<'a> BlobResponse<'a> {
    /// What a GET or HEAD gets, if the form that it is made of is in memory.
    pub(super) fn choose(
        &self,
        method: &Method,
        fields: &impl Fields,
    ) -> Result<Result<Chosen<'a>, NotInMemory>, ApiError> {
        // A range means the identity, and HEAD has none (RFC 9110 §14.2).
        let (asked, len) = if method == Method::GET && fields.has(&header::RANGE) && negotiate::takes_identity(fields) {
            let Some(identity) = self.forms.of(None) else {
                return Ok(Err(NotInMemory(None)));
            };
            let len = identity.bytes.len() as u64;
            let applies = conditional::range_applies(fields, &identity.etag);
            (
                if applies {
                    ranges::read(fields, len)
                } else {
                    Asked::Whole
                },
                len,
            )
        } else {
            (Asked::Whole, 0)
        };
        let coding = match asked {
            Asked::Whole => match negotiate::choose(fields, self.forms) {
                Choice::Form(coding) => coding,
                Choice::NotAcceptable => return Err(ApiError::NotAcceptable),
            },
            _ => None,
        };
        let Some(form) = self.forms.of(coding) else {
            return Ok(Err(NotInMemory(coding)));
        };
        let heads = form
            .derived
            .get_or_make(|| Heads::of(self.name, form, coding, self.forms.has_variants()));
        let part = match (conditional::evaluate(fields, &form.etag), asked) {
            (Verdict::Failed, _) => return Err(ApiError::PreconditionFailed),
            (Verdict::NotModified, _) => Part::Unchanged,
            (Verdict::Proceed, Asked::Whole) => Part::Whole,
            (Verdict::Proceed, Asked::One(slice)) => Part::One(slice),
            (Verdict::Proceed, Asked::Many(slices)) => Part::Many(slices),
            (Verdict::Proceed, Asked::Nothing) => {
                let varies = self.forms.has_variants();
                return Err(ApiError::RangeNotSatisfiable { len, varies });
            }
        };
        Ok(Ok(Chosen {
            form,
            coding,
            heads,
            part,
        }))
    }

    /// Answers a GET or HEAD with the form that is chosen of these, which is read for it.
    pub(super) async fn answer(
        &self,
        forms: &Arc<Representations>,
        method: &Method,
        fields: &HeaderMap,
    ) -> Result<Response, ApiError> {
        loop {
            match self.choose(method, fields)? {
                Ok(chosen) => return Ok(self.respond(method, &chosen).map(Body::new)),
                // One that proves damaged is not chosen again.
                Err(NotInMemory(coding)) => match self.blobs.load(self.name, forms, coding).await {
                    Err(StoreError::Missing(name)) => return Err(ApiError::NotFound(format!("object `{name}`"))),
                    loaded => loaded?,
                },
            }
        }
    }

    /// The answer with what was chosen.
    pub(super) fn respond(&self, method: &Method, chosen: &Chosen) -> Response<BlobBody> {
        let Chosen { form, heads, part, .. } = chosen;
        let body = |range| BlobBody::One(BodyPart::of(self.source(chosen), &form.bytes, range));
        let mut response = match part {
            Part::Unchanged => respond(StatusCode::NOT_MODIFIED, heads.unchanged().clone(), BlobBody::default()),
            Part::Whole => respond(StatusCode::OK, heads.whole().clone(), body(0..form.bytes.len())),
            Part::One(slice) => {
                let body = body(slice.start as usize..slice.end as usize);
                respond(StatusCode::PARTIAL_CONTENT, slice_head(form, heads, slice), body)
            }
            Part::Many(slices) => {
                let (headers, pieces) = self.slices(form, heads, slices);
                respond(StatusCode::PARTIAL_CONTENT, headers, pieces.kept(self.blobs))
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
        response
    }

    /// Where the bytes of what was chosen lie.
    pub(super) fn source<'s>(&self, chosen: &Chosen<'s>) -> Source<'s>
    where
        'a: 's,
    {
        Source {
            blobs: self.blobs,
            name: self.name,
            variant: chosen.coding.map(|coding| (coding, chosen.form)),
            from: self.from,
        }
    }

    /// The head and the pieces of an answer with many slices.
    pub(super) fn slices(&self, form: &Representation, heads: &Heads, slices: &[Range<u64>]) -> (HeaderMap, Pieces) {
        // Derived from the content's own hash, which nothing can contain but by breaking SHA-256.
        let boundary = format!("belvedere-{}", &self.name.hash().to_string()[..40]);
        let media_type = media::kind(self.name.ext());
        let mut pieces = Pieces::with_capacity(2 * slices.len() + 1);
        for (i, slice) in slices.iter().enumerate() {
            let line_end = if i == 0 { "" } else { "\r\n" };
            let range = content_range(slice, form.bytes.len());
            let head =
                format!("{line_end}--{boundary}\r\nContent-Type: {media_type}\r\nContent-Range: {range}\r\n\r\n");
            pieces.push_own(Bytes::from(head));
            pieces.push(
                self.name,
                self.from,
                &form.bytes,
                slice.start as usize..slice.end as usize,
            );
        }
        pieces.push_own(format!("\r\n--{boundary}--\r\n").into());
        let mut headers = heads.whole().clone();
        let content_type = HeaderValue::try_from(format!("multipart/byteranges; boundary={boundary}"));
        headers.insert(
            header::CONTENT_TYPE,
            content_type.expect("a boundary is letters and digits"),
        );
        headers.insert(header::CONTENT_LENGTH, pieces.len().into());
        (headers, pieces)
    }
}

fn slice_head(form: &Representation, heads: &Heads, slice: &Range<u64>) -> HeaderMap {
    let mut headers = heads.whole().clone();
    let content_range = content_range(slice, form.bytes.len());
    let content_range = HeaderValue::try_from(content_range).expect("digits and punctuation");
    headers.insert(header::CONTENT_RANGE, content_range);
    headers.insert(header::CONTENT_LENGTH, (slice.end - slice.start).into());
    headers
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

pub(super) fn content_range(slice: &Range<u64>, len: usize) -> String {
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
