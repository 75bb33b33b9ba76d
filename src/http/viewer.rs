//! How is the viewer's page answered? Each file with its tag, in the form that the browser prefers; without the page `/`
//! says how to build it.

use axum::{
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header},
    response::{IntoResponse, Response},
};

use super::{
    conditional::{self, Verdict},
    error::ApiError,
    negotiate::{self, Choice},
    policy::PagePolicy,
};
use crate::{media, page};

const PLACEHOLDER: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Belvedere</title>\
<h1>Belvedere</h1><p>This server was built without its viewer. Build it with <code>npm ci &amp;&amp; npm run build</code> \
in <code>viewer/</code>, then build the server again. What is published: <a href=\"/v1/scenes\">/v1/scenes</a>; \
what can be asked: <a href=\"/openapi.json\">/openapi.json</a>.</p></html>";

/// Whether a file of the page is at this address.
pub(super) fn has(path: &str) -> bool {
    path.strip_prefix('/').is_some_and(page::has)
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
    let Some(forms) = page::forms(path).await else {
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
    let Choice::Form(coding) = negotiate::choose(&headers, forms) else {
        return Err(ApiError::NotAcceptable);
    };
    let form = forms.of(coding).expect("only forms that there are are chosen");
    let mut answer = page_headers(media::kind(path), media::life(path), &policy);
    let etag = HeaderValue::from_maybe_shared(form.etag.clone()).expect("a tag is quoted hex digits");
    answer.insert(header::ETAG, etag);
    if forms.has_variants() {
        answer.insert(header::VARY, HeaderValue::from_static("Accept-Encoding"));
    }
    match conditional::evaluate(&headers, &form.etag) {
        Verdict::Failed => Err(ApiError::PreconditionFailed),
        Verdict::NotModified => {
            answer.remove(header::CONTENT_TYPE);
            Ok((StatusCode::NOT_MODIFIED, answer).into_response())
        }
        Verdict::Proceed => {
            if let Some(coding) = coding {
                answer.insert(header::CONTENT_ENCODING, HeaderValue::from_static(coding.token()));
            }
            Ok((answer, Body::from(form.bytes.clone())).into_response())
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
