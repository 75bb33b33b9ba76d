//! Where do the viewer's page and scripts come from? They are part of the program, taken from `viewer/dist` when it was
//! built; without them `/` says how to build them.

use std::borrow::Cow;

use axum::{
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header},
    response::{IntoResponse, Response},
};
use bytes::Bytes;
use rust_embed::RustEmbed;

use super::{
    conditional::{self, Verdict},
    error::ApiError,
    policy::PagePolicy,
};
use crate::media;

#[derive(RustEmbed)]
#[folder = "viewer/dist"]
#[allow_missing = true]
struct Dist;

const PLACEHOLDER: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Belvedere</title>\
<h1>Belvedere</h1><p>This server was built without its viewer. Build it with <code>npm ci &amp;&amp; npm run build</code> \
in <code>viewer/</code>, then build the server again. What is published: <a href=\"/v1/scenes\">/v1/scenes</a>; \
what can be asked: <a href=\"/openapi.json\">/openapi.json</a>.</p></html>";

/// The viewer's files by path, for a static tree; empty when the program was built without the viewer.
pub fn viewer_files() -> impl Iterator<Item = (Cow<'static, str>, Cow<'static, [u8]>)> {
    Dist::iter().filter_map(|path| Dist::get(&path).map(|file| (path, file.data)))
}

/// Whether one of them is at this address.
pub(super) fn has(path: &str) -> bool {
    path.strip_prefix('/').is_some_and(|file| Dist::get(file).is_some())
}

/// `GET /` and every address that no other route has: a file of the viewer.
pub(super) async fn file(
    State(policy): State<PagePolicy>,
    method: Method,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let path = match uri.path() {
        "/" => "index.html",
        path => path.trim_start_matches('/'),
    };
    let Some(file) = Dist::get(path) else {
        return if path == "index.html" && uri.path() == "/" {
            Ok((
                page_headers("text/html; charset=utf-8", media::PAGE, &policy),
                PLACEHOLDER,
            )
                .into_response())
        } else {
            Err(ApiError::NoRoute)
        };
    };
    if method != Method::GET && method != Method::HEAD {
        return Err(ApiError::MethodNotAllowed);
    }
    let life = media::life(path);
    let hash = belvedere_scene::BlobHash(file.metadata.sha256_hash());
    let etag = format!("\"{hash}\"");
    let mut answer = page_headers(media::kind(path), life, &policy);
    answer.insert(
        header::ETAG,
        HeaderValue::try_from(&etag).expect("a tag is quoted hex digits"),
    );
    match conditional::evaluate(&headers, etag.as_bytes()) {
        Verdict::Failed => Err(ApiError::PreconditionFailed),
        Verdict::NotModified => {
            answer.remove(header::CONTENT_TYPE);
            Ok((StatusCode::NOT_MODIFIED, answer).into_response())
        }
        Verdict::Proceed => {
            let bytes = match file.data {
                Cow::Borrowed(bytes) => Bytes::from_static(bytes),
                Cow::Owned(bytes) => Bytes::from(bytes),
            };
            Ok((answer, Body::from(bytes)).into_response())
        }
    }
}

fn page_headers(content_type: &'static str, life: &'static str, policy: &PagePolicy) -> HeaderMap {
    [
        (header::CONTENT_TYPE, HeaderValue::from_static(content_type)),
        (header::CACHE_CONTROL, HeaderValue::from_static(life)),
        (header::CONTENT_SECURITY_POLICY, policy.header()),
        (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    ]
    .into_iter()
    .collect()
}
