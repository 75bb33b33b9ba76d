//! How are many small things answered at once? As a bundle: one address that names objects, rungs and slices, and one
//! answer that holds them and never changes.
//!
//! `/o/bundle/{member}+{member}…`, where a member is `{hash}.{ext}`, a rung `{hash}.r{n}.slod`, or the bytes from `from`
//! up to `to` of an object, `{hash}.{ext}@{from}-{to}`. The answer is `BVBN`, a version, the number of members, where
//! each ends, and their bytes (`docs/FORMAT.md`).

use std::{collections::VecDeque, ops::Range, str::FromStr};

use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use belvedere_scene::{BlobHash, BlobName, rung::RungName};
use bytes::Bytes;

use super::{
    blob_body::BlobBody,
    conditional::{self, Verdict},
    error::ApiError,
    extract::Path,
    immutable::IMMUTABLE,
    rungs,
    visitor::Visitor,
};
use crate::store::Representations;

/// A bundle holds at most so many members.
const MAX_MEMBERS: usize = 64;
/// What is larger gains nothing.
const MAX_BYTES: u64 = 8 << 20;
/// … and to cut slices out of more than this would load the store.
const MAX_READ_BYTES: u64 = 256 << 20;
const MAGIC: &[u8; 4] = b"BVBN";
const VERSION: u16 = 1;
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
            let (from, to) = range.split_once('-').ok_or(())?;
            let range = number(from).ok_or(())?..number(to).ok_or(())?;
            let name = name.parse().map_err(drop)?;
            return if range.is_empty() {
                Err(())
            } else {
                Ok(Self::Slice(name, range))
            };
        }
        match RungName::from_file_name(text) {
            Some(rung) => Ok(Self::Rung(rung)),
            None => text.parse().map(Self::Whole).map_err(drop),
        }
    }
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

    /// Its bytes.
    fn bytes(&self, forms: &Representations) -> Result<Bytes, ApiError> {
        let whole = &forms.identity.bytes;
        match self {
            Self::Whole(_) => Ok(whole.clone()),
            Self::Rung(rung) => Ok(alone(&rungs::cut(*rung, forms)?.identity.bytes, whole)),
            Self::Slice(_, range) if range.end <= whole.len() as u64 => {
                Ok(alone(&whole.slice(range.start as usize..range.end as usize), whole))
            }
            Self::Slice(name, range) => Err(ApiError::NotFound(format!(
                "byte {} of `{name}`; it has {}",
                range.end - 1,
                whole.len()
            ))),
        }
    }
}

/// A part of a blob that does not keep the blob in memory as long as somebody reads it, unless it is most of it.
fn alone(part: &Bytes, whole: &Bytes) -> Bytes {
    if part.len() < whole.len() / 2 {
        Bytes::copy_from_slice(part)
    } else {
        part.clone()
    }
}

fn members(text: &str) -> Result<Vec<Member>, ApiError> {
    if text.split('+').count() > MAX_MEMBERS {
        return Err(ApiError::bad_request(format!(
            "a bundle has at most {MAX_MEMBERS} members"
        )));
    }
    let read = |member: &str| {
        let shown: String = member.chars().take(100).collect();
        member.parse().map_err(|()| {
            ApiError::bad_request(format!(
                "`{shown}` is no member of a bundle: it must be {{hash}}.{{ext}}, {{hash}}.r{{n}}.slod or \
                 {{hash}}.{{ext}}@{{from}}-{{to}}; `+` stands between members"
            ))
        })
    };
    text.split('+').map(read).collect()
}

/// `GET /o/bundle/{members}`: many small things in one answer.
pub(super) async fn bundle(
    visitor: Visitor,
    Path(text): Path<String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let (mut parts, mut length, mut read) = (VecDeque::new(), 0u64, 0u64);
    let members = members(&text)?;
    let mut head = Vec::with_capacity(8 + 4 * members.len());
    head.extend_from_slice(MAGIC);
    head.extend_from_slice(&VERSION.to_le_bytes());
    head.extend_from_slice(&(members.len() as u16).to_le_bytes());
    for member in members {
        let blob = member.blob();
        let forms = visitor.blob(&blob).await?;
        let forms = forms.ok_or_else(|| ApiError::NotFound(format!("object `{blob}`")))?;
        read += forms.identity.bytes.len() as u64;
        if read > MAX_READ_BYTES {
            return Err(ApiError::bad_request(format!(
                "the objects that a bundle is cut from have at most {MAX_READ_BYTES} bytes together; ask for fewer at once"
            )));
        }
        let bytes = member.bytes(&forms)?;
        length += bytes.len() as u64;
        if length > MAX_BYTES {
            return Err(ApiError::bad_request(format!(
                "a bundle has at most {MAX_BYTES} bytes; fetch what is large alone"
            )));
        }
        head.extend_from_slice(&(length as u32).to_le_bytes());
        parts.push_back(bytes);
    }
    parts.push_front(head.into());
    // The address names the content, so a hash of it is as good as one of the bytes.
    let etag = format!("\"{}\"", &BlobHash::of(text.as_bytes()).to_string()[..32]);
    let mut answer = HeaderMap::with_capacity(8);
    answer.insert(header::CACHE_CONTROL, IMMUTABLE);
    answer.insert(
        header::ETAG,
        HeaderValue::try_from(&etag).expect("a tag is quoted hex digits"),
    );
    match conditional::evaluate(&headers, etag.as_bytes()) {
        Verdict::Failed => Err(ApiError::PreconditionFailed),
        Verdict::NotModified => Ok((StatusCode::NOT_MODIFIED, answer).into_response()),
        Verdict::Proceed => {
            let body = BlobBody::Many(parts);
            answer.insert(header::CONTENT_TYPE, MEDIA_TYPE);
            answer.insert(header::CONTENT_LENGTH, body.len().into());
            let body = if method == Method::HEAD {
                Body::empty()
            } else {
                Body::new(body)
            };
            Ok((answer, body).into_response())
        }
    }
}

#[cfg(test)]
mod tests {
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
