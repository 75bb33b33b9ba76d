//! How are many small things answered at once? As a bundle: one address that names objects, rungs and slices, and one
//! answer that holds them and never changes.
//!
//! `/o/bundle/{member}+{member}…`, where a member is `{hash}.{ext}`, a rung `{hash}.r{n}.slod`, or the bytes from `from`
//! up to `to` of an object, `{hash}.{ext}@{from}-{to}`. The answer is `BVBN`, a version, the number of members, where
//! each ends, and their bytes (`docs/FORMAT.md`).

use std::{ops::Range, str::FromStr, sync::LazyLock};

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    response::Response,
};
use belvedere_scene::{BlobName, rung::RungName};
use bytes::Bytes;

use super::{
    AppState, around,
    blob_body::{BlobBody, Keep, Pieces},
    conditional::{self, Verdict},
    direct::head_lines,
    error::ApiError,
    extract::Path,
    fields::Fields,
    immutable::IMMUTABLE,
    rungs,
    visitor::Visitor,
};

/// What addresses of bundles begin with.
pub(super) const PATH: &str = "/o/bundle/";
/// A bundle holds at most so many members.
const MAX_MEMBERS: usize = 64;
/// For so many there is room at once.
const USUAL_MEMBERS: usize = 16;
/// What is larger gains nothing.
const MAX_BYTES: u64 = 8 << 20;
/// … and to cut slices out of more than this would load the store.
const MAX_READ_BYTES: u64 = 256 << 20;
/// What is no longer is copied rather than shared with the blob's other readers.
const COPIED_BYTES: usize = 16 << 10;
const MAGIC: &[u8; 4] = b"BVBN";
const VERSION: u16 = 1;
/// A tag tells versions of one address apart (RFC 9110 §8.8.3). Of a bundle there is one, in this format.
const ETAG: &str = "\"bvbn-1\"";
const MEDIA_TYPE: HeaderValue = HeaderValue::from_static("application/vnd.belvedere.bundle");

/// One thing in a bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Member {
    Whole(BlobName),
    Rung(RungName),
    /// Never empty.
    Slice(BlobName, Range<u64>),
}

impl FromStr for Member {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        if let Some((name, range)) = text.split_once('@') {
            return Ok(Self::Slice(name.parse().map_err(drop)?, slice(range)?));
        }
        match RungName::from_file_name(text) {
            Some(rung) => Ok(Self::Rung(rung)),
            None => text.parse().map(Self::Whole).map_err(drop),
        }
    }
}

/// The bytes of an object that are meant; never none.
fn slice(text: &str) -> Result<Range<u64>, ()> {
    let (from, to) = text.split_once('-').ok_or(())?;
    let range = number(from).ok_or(())?..number(to).ok_or(())?;
    if range.is_empty() { Err(()) } else { Ok(range) }
}

/// A number has one spelling, so that an answer has one address.
fn number(text: &str) -> Option<u64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit()) && (text == "0" || !text.starts_with('0'));
    text.parse().ok().filter(|_| plain)
}

impl Member {
    fn blob(&self) -> BlobName {
        match self {
            Self::Whole(name) | Self::Slice(name, _) => name.clone(),
            Self::Rung(rung) => rung.whole(),
        }
    }

    /// Which bytes of the whole it is.
    fn part(&self, identity: &[u8]) -> Result<Range<usize>, ApiError> {
        let whole = identity.len();
        match self {
            Self::Whole(_) => Ok(0..whole),
            Self::Rung(rung) => rungs::part(*rung, identity),
            Self::Slice(_, range) if range.end <= whole as u64 => Ok(range.start as usize..range.end as usize),
            Self::Slice(name, range) => Err(ApiError::NotFound(format!(
                "byte {} of `{name}`; it has {whole}",
                range.end - 1
            ))),
        }
    }
}

fn members(text: &str) -> Result<Vec<Member>, ApiError> {
    let mut members = Vec::with_capacity(USUAL_MEMBERS);
    // Slices often come from one object, whose name is then read once.
    let mut last: Option<(&str, BlobName)> = None;
    for member in text.split('+') {
        if members.len() == MAX_MEMBERS {
            return Err(ApiError::bad_request(format!(
                "a bundle has at most {MAX_MEMBERS} members"
            )));
        }
        let read = match (member.split_once('@'), &last) {
            (Some((name, range)), Some((before, blob))) if name == *before => {
                slice(range).map(|range| Member::Slice(blob.clone(), range))
            }
            (named, _) => {
                let read = member.parse();
                last = named
                    .zip(read.as_ref().ok().map(Member::blob))
                    .map(|((name, _), blob)| (name, blob));
                read
            }
        };
        members.push(read.map_err(|()| {
            let shown: String = member.chars().take(100).collect();
            ApiError::bad_request(format!(
                "`{shown}` is no member of a bundle: it must be {{hash}}.{{ext}}, {{hash}}.r{{n}}.slod or \
                 {{hash}}.{{ext}}@{{from}}-{{to}}; `+` stands between members"
            ))
        })?);
    }
    Ok(members)
}

/// The parts of a bundle that are there so far.
struct Gathered {
    head: Vec<u8>,
    pieces: Pieces,
    length: u64,
    read: u64,
}

impl Gathered {
    fn new(members: usize) -> Self {
        let mut head = Vec::with_capacity(8 + 4 * members);
        head.extend_from_slice(MAGIC);
        head.extend_from_slice(&VERSION.to_le_bytes());
        head.extend_from_slice(&(members as u16).to_le_bytes());
        Self {
            head,
            pieces: Pieces::with_capacity(1 + members),
            length: 0,
            read: 0,
        }
    }

    fn add(&mut self, member: &Member, identity: &Bytes) -> Result<(), ApiError> {
        let whole = identity.len();
        self.read += whole as u64;
        if self.read > MAX_READ_BYTES {
            return Err(ApiError::bad_request(format!(
                "the objects that a bundle is cut from have at most {MAX_READ_BYTES} bytes together; ask for fewer at once"
            )));
        }
        let part = member.part(identity)?;
        let bytes = part.len();
        self.length += bytes as u64;
        if self.length > MAX_BYTES {
            return Err(ApiError::bad_request(format!(
                "a bundle has at most {MAX_BYTES} bytes; fetch what is large alone"
            )));
        }
        self.head.extend_from_slice(&(self.length as u32).to_le_bytes());
        // A part of a blob shall not keep the blob in memory as long as somebody reads it, unless it is most of it.
        let keep = if bytes <= COPIED_BYTES || bytes < whole / 2 {
            Keep::Copied
        } else {
            Keep::Shared
        };
        self.pieces.push(identity, part, keep);
        Ok(())
    }

    /// The answer with all of them.
    fn answer(mut self, method: &Method, fields: &impl Fields) -> Result<Bundle, ApiError> {
        let length = match conditional::evaluate(fields, ETAG.as_bytes()) {
            Verdict::Failed => return Err(ApiError::PreconditionFailed),
            Verdict::NotModified => None,
            Verdict::Proceed => Some(self.head.len() as u64 + self.length),
        };
        if length.is_none() || *method == Method::HEAD {
            self.pieces = Pieces::default();
        } else {
            self.pieces.begin_with(self.head.into());
        }
        Ok(Bundle {
            length,
            pieces: self.pieces,
        })
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
        self.length.map_or(StatusCode::NOT_MODIFIED, |_| StatusCode::OK)
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

    pub(super) fn response(self) -> Response<BlobBody> {
        let status = self.status();
        let mut headers = head(status);
        if let Some(length) = self.length {
            headers.insert(header::CONTENT_LENGTH, length.into());
        }
        let mut response = Response::new(self.pieces.kept());
        (*response.status_mut(), *response.headers_mut()) = (status, headers);
        response
    }
}

/// What all bundles say of themselves.
fn head(status: StatusCode) -> HeaderMap {
    let mut headers = HeaderMap::with_capacity(8);
    headers.insert(header::CACHE_CONTROL, IMMUTABLE);
    headers.insert(header::ETAG, HeaderValue::from_static(ETAG));
    if status == StatusCode::OK {
        headers.insert(header::CONTENT_TYPE, MEDIA_TYPE);
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
    for member in members {
        let blob = member.blob();
        let identity = visitor.identity(&blob).await?;
        let identity = identity.ok_or_else(|| ApiError::NotFound(format!("object `{blob}`")))?;
        gathered.add(&member, &identity)?;
        // The next one may have to be waited for.
        gathered.pieces.let_go();
    }
    let bundle = gathered.answer(&method, &headers)?;
    Ok(bundle.response().map(Body::new))
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
    let text = path.strip_prefix(PATH)?;
    // What was got with a key is not for caches, public or not.
    if fields.has(&header::AUTHORIZATION) {
        return None;
    }
    let members = members(text).ok()?;
    let mut gathered = Gathered::new(members.len());
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
        gathered.add(&member, &identity).ok()?;
        last = Some((blob, identity));
    }
    gathered.answer(method, fields).ok()
}

#[cfg(test)]
mod tests {
    use belvedere_scene::BlobHash;

    use super::*;

    #[test]
    fn a_member_has_one_spelling() {
        let hash = BlobHash::of(b"x");
        let name = BlobName::new(hash, "glb").unwrap();
        assert_eq!(format!("{name}").parse(), Ok(Member::Whole(name.clone())));
        assert_eq!(
            format!("{name}@0-4096").parse(),
            Ok(Member::Slice(name.clone(), 0..4096))
        );
        assert_eq!(
            format!("{hash}.r3.slod").parse(),
            Ok(Member::Rung(RungName { hash, number: 3 }))
        );
        for wrong in [
            "@",
            "@1-1",
            "@2-1",
            "@01-2",
            "@0-",
            "@-1",
            "@0-1-2",
            "@+0-1",
            "@0-18446744073709551616",
            "/x",
        ] {
            assert_eq!(format!("{name}{wrong}").parse::<Member>(), Err(()), "{wrong}");
        }
        assert!(members(&vec![name.to_string(); MAX_MEMBERS].join("+")).is_ok());
        assert!(members(&vec![name.to_string(); MAX_MEMBERS + 1].join("+")).is_err());
        assert!(members("").is_err() && members(&format!("{name}+")).is_err());
    }
}
