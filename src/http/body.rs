//! How is a body read? Of the media types that are taken, up to a size, in the shape that is asked for.

use std::{error::Error, fmt, marker::PhantomData, time::Duration};

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::Request,
    http::{HeaderMap, HeaderValue, header},
};
use http_body_util::LengthLimitError;
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, MapAccess, Visitor, value::MapAccessDeserializer},
};
use serde_path_to_error::{Path, Segment};

use super::{error::ApiError, extract::shortened};

pub(super) const JSON: &str = "application/json";
/// The size of a usual body.
const MAX_BODY_BYTES: usize = 64 << 10;
/// So many characters of what is wrong with it are told.
const MOST_TOLD: usize = 300;
/// How long a body may take: less than a request, so that it is told from an answer that takes long.
const PATIENCE: Duration = Duration::from_secs(20);

/// The body, of one of these media types or of none that is stated.
pub(super) async fn body(request: Request, types: &[&str], most_bytes: usize) -> Result<Bytes, ApiError> {
    let headers = request.headers();
    let taken = headers.get(header::CONTENT_TYPE).is_none_or(|kind| {
        let mut parts = kind.to_str().unwrap_or_default().split(';').map(str::trim);
        let essence = parts.next().unwrap_or_default();
        types.iter().any(|taken| essence.eq_ignore_ascii_case(taken)) && parts.all(is_utf8)
    });
    if !(taken && is_unwrapped(headers)) {
        return Err(ApiError::UnsupportedMediaType);
    }
    whole(request.into_body(), most_bytes, PATIENCE).await
}

/// Whether a body is what it stands for, not compressed.
pub(super) fn is_unwrapped(headers: &HeaderMap) -> bool {
    let is_identity = |coding: &HeaderValue| {
        let coding = coding.as_bytes().trim_ascii();
        coding.is_empty() || coding.eq_ignore_ascii_case(b"identity")
    };
    headers.get_all(header::CONTENT_ENCODING).iter().all(is_identity)
}

/// Whether a parameter of a media type names no other charset.
fn is_utf8(parameter: &str) -> bool {
    let (name, value) = parameter.split_once('=').unwrap_or((parameter, ""));
    let value = value.trim_matches('"');
    !name.eq_ignore_ascii_case("charset") || ["utf-8", "us-ascii"].iter().any(|one| value.eq_ignore_ascii_case(one))
}

/// All of a body that is no larger and takes no longer.
async fn whole(body: Body, most_bytes: usize, patience: Duration) -> Result<Bytes, ApiError> {
    let too_large = || ApiError::BodyTooLarge {
        most_bytes: most_bytes as u64,
    };
    // Nobody is told to go on (100) with what will not be taken.
    if body.size_hint().lower() > most_bytes as u64 {
        return Err(too_large());
    }
    let read = tokio::time::timeout(patience, axum::body::to_bytes(body, most_bytes)).await;
    let too_slow = |_| ApiError::BodyTooSlow {
        most_s: patience.as_secs(),
    };
    read.map_err(too_slow)?.map_err(|error| {
        if error.source().is_some_and(|cause| cause.is::<LengthLimitError>()) {
            too_large()
        } else {
            ApiError::bad_request("the body broke off, or says wrongly where it ends")
        }
    })
}

/// A JSON body of this shape.
pub(super) async fn json_body<T: DeserializeOwned>(request: Request, shape: &str) -> Result<T, ApiError> {
    json(&body(request, &[JSON], MAX_BODY_BYTES).await?, shape)
}

/// A JSON object of this shape.
pub(super) fn json<T: DeserializeOwned>(text: &[u8], shape: &str) -> Result<T, ApiError> {
    let mut reader = serde_json::Deserializer::from_slice(text);
    let read = serde_path_to_error::deserialize(&mut reader);
    let read = read.map(|Object(value)| value).map_err(|error| {
        let pointer = pointer(error.path());
        (pointer, error.into_inner())
    });
    let read = read.and_then(|value| reader.end().map(|()| value).map_err(|error| (String::new(), error)));
    read.map_err(|(pointer, error)| {
        let wrong = shortened(&error.to_string(), MOST_TOLD);
        ApiError::bad_body(pointer, format!("the body must be JSON, {shape}: {wrong}"))
    })
}

/// What is read from an object, and from nothing else: by itself serde takes an array of the members' values for the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Object<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Members<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
            type Value = Object<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<Object<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(members)).map(Object)
            }
        }

        deserializer.deserialize_map(Members(PhantomData))
    }
}

/// A JSON pointer (RFC 6901) to where reading ended, as far as names are of a usual length.
fn pointer(path: &Path) -> String {
    let names = path.iter().map_while(|segment| match segment {
        Segment::Seq { index } => Some(index.to_string()),
        Segment::Map { key } if key.len() <= MOST_TOLD => Some(key.replace('~', "~0").replace('/', "~1")),
        Segment::Map { .. } | Segment::Enum { .. } | Segment::Unknown => None,
    });
    names.flat_map(|name| ["/".to_owned(), name]).collect()
}

#[cfg(test)]
mod tests {
    use futures_util::stream;

    use super::*;

    #[tokio::test]
    async fn what_is_wrapped_or_written_otherwise_is_refused_by_its_headers() {
        let read = async |name: &str, value: &str| {
            let request = Request::builder().header(name, value).body(Body::from("{}")).unwrap();
            body(request, &[JSON], 9).await.is_ok()
        };
        for kind in [
            "application/json",
            "Application/JSON; charset=UTF-8",
            "application/json;charset=\"utf-8\"",
        ] {
            assert!(read("content-type", kind).await, "{kind}");
        }
        for kind in ["text/plain", "application/json; charset=utf-16", "application/jsonx"] {
            assert!(!read("content-type", kind).await, "{kind}");
        }
        assert!(read("content-encoding", "Identity ").await);
        assert!(!read("content-encoding", "gzip").await);
    }

    #[test]
    fn long_nonsense_is_not_said_back() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[expect(dead_code, reason = "it is only read")]
        struct Asked {
            object: belvedere_scene::ObjectId,
        }
        let long = "x".repeat(60_000);
        for text in [format!(r#"{{"object": "{long}"}}"#), format!(r#"{{"{long}": 1}}"#)] {
            let problem = json::<Asked>(text.as_bytes(), "{…}").unwrap_err().problem();
            let told = problem.detail.len() + problem.pointer.map_or(0, |pointer| pointer.len());
            assert!((20..1_000).contains(&told), "{told}");
        }
    }

    #[tokio::test]
    async fn half_a_body_is_not_waited_for_for_ever() {
        let half = Body::from_stream(stream::pending::<Result<Bytes, std::io::Error>>());
        let read = whole(half, 9, Duration::from_millis(10)).await;
        assert!(matches!(read, Err(ApiError::BodyTooSlow { .. })));
    }
}
