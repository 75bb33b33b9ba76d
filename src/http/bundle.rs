//! How are many small things answered at once? As a bundle, which never changes, of what the store has.
//!
//! `/o/bundle/{member}+{member}…`: [`belvedere_scene::bundle`] is the format, `docs/FORMAT.md` its description.

use std::{ops::Range, sync::LazyLock};

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    response::Response,
};
use belvedere_scene::bundle::{self, Member};
use bytes::Bytes;

use super::{
    AppState, around,
    blob_body::{BlobBody, Keeping, Pieces},
    conditional::{self, Verdict},
    direct::head_lines,
    error::ApiError,
    extract::Path,
    fields::Fields,
    immutable::IMMUTABLE,
    rungs,
    visitor::Visitor,
};
use crate::store::BlobStore;

/// To cut slices out of more than this would load the store.
const MAX_READ_BYTES: u64 = 256 << 20;
/// A tag tells versions of one address apart (RFC 9110 §8.8.3). Of a bundle there is one, in this format.
const ETAG: &str = "\"bvbn-1\"";
const _: () = assert!(bundle::VERSION == 1, "the tag is that of version 1");

/// Which bytes of the whole a member is.
fn part(member: &Member, identity: &[u8]) -> Result<Range<usize>, ApiError> {
    let whole = identity.len();
    match member {
        Member::Whole(_) => Ok(0..whole),
        Member::Rung(rung) => rungs::part(*rung, identity),
        Member::Slice(_, range) if range.end <= whole as u64 => Ok(range.start as usize..range.end as usize),
        Member::Slice(name, range) => Err(ApiError::NotFound(format!(
            "byte {} of `{name}`; it has {whole}",
            range.end - 1
        ))),
    }
}

fn members(text: &str) -> Result<Vec<Member>, ApiError> {
    bundle::members(text).map_err(|cause| ApiError::bad_request(cause.to_string()))
}

/// What is known of a bundle so far.
struct Gathered {
    head: bundle::Head,
    read: u64,
}

impl Gathered {
    fn new(members: usize) -> Self {
        Self {
            head: bundle::Head::of(members),
            read: 0,
        }
    }

    /// Takes up a member; says which bytes it is.
    fn add(&mut self, member: &Member, identity: &Bytes) -> Result<Range<usize>, ApiError> {
        self.read += identity.len() as u64;
        if self.read > MAX_READ_BYTES {
            return Err(ApiError::bad_request(format!(
                "the objects that a bundle is cut from have at most {MAX_READ_BYTES} bytes together; ask for fewer at once"
            )));
        }
        let part = part(member, identity)?;
        self.head
            .add(part.len() as u64)
            .map_err(|cause| ApiError::bad_request(cause.to_string()))?;
        Ok(part)
    }

    /// How long the answer is; none when the client has it.
    fn length(&self, fields: &impl Fields) -> Result<Option<u64>, ApiError> {
        match conditional::evaluate(fields, ETAG.as_bytes()) {
            Verdict::Failed => Err(ApiError::PreconditionFailed),
            Verdict::NotModified => Ok(None),
            Verdict::Proceed => Ok(Some(self.head.answer_bytes())),
        }
    }
}

/// A bundle as it is answered.
#[derive(Debug)]
pub(super) struct Bundle {
    /// None when the client has it.
    pub(super) length: Option<u64>,
    pub(super) pieces: Pieces,
}

impl Bundle {
    pub(super) fn status(&self) -> StatusCode {
        status(self.length)
    }

    /// The first lines of its head as HTTP/1.1 writes them, without its length.
    pub(super) fn written(&self) -> &'static Bytes {
        static WHOLE: LazyLock<Bytes> = LazyLock::new(|| head_lines(StatusCode::OK, &head(StatusCode::OK)).into());
        static UNCHANGED: LazyLock<Bytes> =
            LazyLock::new(|| head_lines(StatusCode::NOT_MODIFIED, &head(StatusCode::NOT_MODIFIED)).into());
        match self.length {
            Some(_) => &WHOLE,
            None => &UNCHANGED,
        }
    }

    pub(super) fn response(self, blobs: &BlobStore) -> Response<BlobBody> {
        respond(self.length, self.pieces.kept(blobs))
    }
}

fn status(length: Option<u64>) -> StatusCode {
    length.map_or(StatusCode::NOT_MODIFIED, |_| StatusCode::OK)
}

fn respond(length: Option<u64>, body: BlobBody) -> Response<BlobBody> {
    let status = status(length);
    let mut headers = head(status);
    if let Some(length) = length {
        headers.insert(header::CONTENT_LENGTH, length.into());
    }
    let mut response = Response::new(body);
    (*response.status_mut(), *response.headers_mut()) = (status, headers);
    response
}

/// What all bundles say of themselves.
fn head(status: StatusCode) -> HeaderMap {
    let mut headers = HeaderMap::with_capacity(8);
    headers.insert(header::CACHE_CONTROL, IMMUTABLE);
    headers.insert(header::ETAG, HeaderValue::from_static(ETAG));
    if status == StatusCode::OK {
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(bundle::MEDIA_TYPE));
    }
    around::for_everybody(status, &mut headers);
    headers
}

/// `GET /o/bundle/{members}`: many small things in one answer.
pub(super) async fn bundle(
    visitor: Visitor,
    Path(text): Path<String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let members = members(&text)?;
    let mut gathered = Gathered::new(members.len());
    // The next member may have to be waited for.
    let mut body = Keeping::new(visitor.blobs());
    for member in members {
        let blob = member.blob();
        let identity = visitor.identity(&blob).await?;
        let identity = identity.ok_or_else(|| ApiError::NotFound(format!("object `{blob}`")))?;
        let part = gathered.add(&member, &identity)?;
        body.add(&blob, 0, &identity, part);
    }
    let length = gathered.length(&headers)?;
    let body = if length.is_none() || method == Method::HEAD {
        BlobBody::default()
    } else {
        body.done_after(gathered.head.into_bytes().into())
    };
    Ok(respond(length, body).map(Body::new))
}

/// The same without waiting, when all members are public and in memory and nothing about the request needs an explanation.
pub(super) fn bundle_in_memory(
    state: &AppState,
    (method, path): (&Method, &str),
    fields: &impl Fields,
) -> Option<Bundle> {
    if !matches!(*method, Method::GET | Method::HEAD) {
        return None;
    }
    let text = path.strip_prefix(bundle::PATH)?;
    // What was got with a key is not for caches, public or not.
    if fields.has(&header::AUTHORIZATION) {
        return None;
    }
    let members = bundle::members(text).ok()?;
    let mut gathered = Gathered::new(members.len());
    let mut pieces = Pieces::with_capacity(1 + members.len());
    // Members often come from one blob.
    let mut last = None;
    for member in members {
        let blob = member.blob();
        let identity = match last.take() {
            Some((name, identity)) if name == blob => identity,
            _ => state
                .publications
                .is_public(&blob)
                .then(|| state.blobs.in_memory(&blob))??,
        };
        let part = gathered.add(&member, &identity).ok()?;
        pieces.push(&blob, 0, &identity, part);
        last = Some((blob, identity));
    }
    let length = gathered.length(fields).ok()?;
    if length.is_none() || *method == Method::HEAD {
        pieces = Pieces::default();
    } else {
        pieces.begin_with(gathered.head.into_bytes().into());
    }
    Some(Bundle { length, pieces })
}
