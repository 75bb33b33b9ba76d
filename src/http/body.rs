//! How is a body read? Of the media types that are taken, up to a size, in the shape that is asked for.

use std::{error::Error, fmt, marker::PhantomData, time::Duration};

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::Request,
    http::header,
};
use http_body_util::LengthLimitError;
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, MapAccess, Visitor, value::MapAccessDeserializer},
};
use serde_path_to_error::{Path, Segment};

use super::error::ApiError;

pub(super) const JSON: &str = "application/json";
/// The size of a usual body.
const MAX_BODY_BYTES: usize = 64 << 10;
/// How long a body may take: less than a request, so that it is told from an answer that takes long.
const PATIENCE: Duration = Duration::from_secs(20);

/// The body, of one of these media types or of none that is stated.
pub(super) async fn body(request: Request, types: &[&str], most_bytes: usize) -> Result<Bytes, ApiError> {
    let taken = request.headers().get(header::CONTENT_TYPE).is_none_or(|kind| {
        let essence = kind.to_str().unwrap_or_default().split(';').next().unwrap_or_default();
        types.iter().any(|taken| essence.trim().eq_ignore_ascii_case(taken))
    });
    if !taken {
        return Err(ApiError::UnsupportedMediaType);
    }
    whole(request.into_body(), most_bytes, PATIENCE).await
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
    read.map_err(|(pointer, error)| ApiError::bad_body(pointer, format!("the body must be JSON, {shape}: {error}")))
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

/// A JSON pointer (RFC 6901) to where reading ended.
fn pointer(path: &Path) -> String {
    let names = path.iter().map_while(|segment| match segment {
        Segment::Seq { index } => Some(index.to_string()),
        Segment::Map { key } => Some(key.replace('~', "~0").replace('/', "~1")),
        Segment::Enum { .. } | Segment::Unknown => None,
    });
    names.flat_map(|name| ["/".to_owned(), name]).collect()
}

#[cfg(test)]
mod tests {
    use futures_util::stream;

    use super::*;

    #[tokio::test]
    async fn half_a_body_is_not_waited_for_for_ever() {
        let half = Body::from_stream(stream::pending::<Result<Bytes, std::io::Error>>());
        let read = whole(half, 9, Duration::from_millis(10)).await;
        assert!(matches!(read, Err(ApiError::BodyTooSlow { .. })));
    }
}
