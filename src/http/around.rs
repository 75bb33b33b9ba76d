//! What happens around every request?
//!
//! From the outside in: limits on the head, preflights, the time limit, a panic caught; then on the way out problem
//! details get their body, CORS headers are set, and the request is counted and logged. Query strings are not logged:
//! they may hold tokens.
//!
//! tower-http catches panics. Its `CorsLayer` takes every OPTIONS for a preflight, which would hide
//! our 405; its `TimeoutLayer` and `RequestBodyLimitLayer` answer without a problem; its `TraceLayer` logs before the
//! problem's cause is known, and its request ids are sent with every answer. Those stay ours.

use std::{
    any::Any,
    sync::{
        LazyLock,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use axum::{
    body::{Body, HttpBody},
    extract::{MatchedPath, Request, State},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri, Version, header, uri::Authority},
    middleware::Next,
    response::{IntoResponse, Response},
};

use belvedere_scene::SceneName;

use super::{
    AppState, cors,
    error::{ApiError, Problem},
    links::Link,
    owner,
    peer::Peer,
    routes::{IMMUTABLE_OBJECT, SCENE, TEMPLATES, UNMATCHED},
    visitor,
};
use crate::{epoch::since_1970, traces::RequestSpan};

pub(super) const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

const MAX_URI_BYTES: usize = 8 << 10;
const MAX_HEADERS_BYTES: usize = 16 << 10;
/// A GET or HEAD has no use for a body; a small one is ignored.
const MAX_IGNORED_BODY_BYTES: u64 = 64 << 10;

/// The layer.
pub(super) async fn around(State(state): State<AppState>, mut request: Request, next: Next) -> Response {
    let started = Instant::now();
    let (method, uri) = (request.method().clone(), request.uri().clone());
    let theirs = request.headers().get(X_REQUEST_ID);
    let wanted = theirs.is_some();
    let id = theirs.filter(|id| can_be_an_id(id)).cloned().unwrap_or_else(made_id);
    let matched = request.extensions().get::<MatchedPath>().map(MatchedPath::as_str);
    let route = matched
        .and_then(|m| TEMPLATES.into_iter().find(|t| *t == m))
        .unwrap_or(UNMATCHED);
    let span = request.extensions_mut().remove::<RequestSpan>();
    let scene = span.as_ref().and_then(|_| scene_in(route, uri.path()));
    let link: Option<Link> = request.extensions().get().cloned();
    let peer: Option<Peer> = request.extensions().get().cloned();
    let by_key = owner::key_shown(request.headers()).is_some();
    let mut response = match refused(&request) {
        Some(error) => error.into_response(),
        None if is_preflight(&request) => cors::preflight(),
        None if let Err(error) = paced(&state, peer.as_ref(), route) => error.into_response(),
        None if matches!(link, Some(Link::Expired)) => ApiError::LinkExpired.into_response(),
        // An upload has its own measure of time.
        None if route == SCENE && method == Method::PUT => next.run(request).await,
        None => answered(next.run(request), state.limits.timeout).await,
    };
    if route == IMMUTABLE_OBJECT
        && response.status() == StatusCode::NOT_FOUND
        && let Some(peer) = &peer
    {
        state.pace.no_object(peer);
    }
    let problem = response.extensions_mut().remove::<Problem>();
    if let Some(problem) = &problem {
        write_problem(&mut response, problem, &uri);
    }
    if let Some(link) = link {
        link.mark(response.headers_mut());
    }
    if by_key {
        visitor::keep_from_others(response.headers_mut());
    }
    let status = response.status();
    for_everybody(status, response.headers_mut());
    // Answers outlive their request in caches, so they carry its number only for who sent one or must report an error.
    if wanted || problem.is_some() {
        response.headers_mut().insert(X_REQUEST_ID, id.clone());
    }
    let (status, took) = (status.as_u16(), started.elapsed());
    let body_bytes = if method == Method::HEAD {
        0
    } else {
        response.body().size_hint().lower()
    };
    state.metrics.request(route, status, body_bytes, took);
    if let Some(span) = &span {
        let met = (route != UNMATCHED).then_some(route);
        span.end(met, scene.as_ref(), response.status());
    }
    let trace = span.map(|span| tracing::field::display(span.trace_id()));
    let ms = took.as_secs_f64() * 1e3;
    let id = id.to_str().unwrap_or_default();
    match problem.and_then(|problem| problem.cause) {
        Some(cause) => {
            tracing::error!(%method, route, path = uri.path(), status, ms, id, trace, error = state.catalogue.why(&cause), "request failed");
        }
        None => tracing::debug!(%method, route, path = uri.path(), status, body_bytes, ms, id, trace, "request"),
    }
    response
}

/// The scene that an address is of.
fn scene_in(route: &str, path: &str) -> Option<SceneName> {
    let below = route.starts_with(SCENE).then(|| path.strip_prefix("/v1/scenes/"))??;
    below.split('/').next()?.parse().ok()
}

/// What every answer has. A 304 leaves out what its reader has from the answer that it confirms, but not that pages may read its
/// fields: one that sends `If-None-Match` itself gets the 304, and asks it for its `ETag`.
pub(super) fn for_everybody(status: StatusCode, headers: &mut HeaderMap) {
    cors::allow_reading(headers);
    if status == StatusCode::NOT_MODIFIED {
        return;
    }
    cors::tell_time(headers);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
}

/// Whether an id of somebody else's is one to send back and to write into a log.
fn can_be_an_id(id: &HeaderValue) -> bool {
    const MAX_ID_BYTES: usize = 128;
    !id.is_empty() && id.len() <= MAX_ID_BYTES && id.as_bytes().iter().all(u8::is_ascii_graphic)
}

/// Names a request that came without an id: when this process first made one, and a count.
fn made_id() -> HeaderValue {
    static SINCE_MS: LazyLock<u128> = LazyLock::new(|| since_1970().as_millis());
    static COUNT: AtomicU64 = AtomicU64::new(1);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    HeaderValue::try_from(format!("{:x}-{count:x}", *SINCE_MS)).expect("hex digits")
}

pub(super) fn refused<B>(request: &axum::http::Request<B>) -> Option<ApiError> {
    if !names_its_host(request) {
        let detail = "a request names one host in one `Host` field, such as `example.org:8080`";
        return Some(ApiError::bad_request(detail));
    }
    let uri = request.uri();
    let uri_bytes = uri.path().len() + uri.query().map_or(0, str::len);
    if uri_bytes > MAX_URI_BYTES {
        return Some(ApiError::UriTooLong);
    }
    let headers = request.headers();
    let headers_bytes: usize = headers
        .iter()
        .map(|(name, value)| name.as_str().len() + value.len())
        .sum();
    if headers_bytes > MAX_HEADERS_BYTES {
        return Some(ApiError::HeadersTooLarge);
    }
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    (reads && announced_bytes(headers) > MAX_IGNORED_BODY_BYTES).then_some(ApiError::BodyTooLarge {
        most_bytes: MAX_IGNORED_BODY_BYTES,
    })
}

/// Whether there is the one `Host` that HTTP/1.1 demands, and none that is no host (RFC 9112 §3.2).
fn names_its_host<B>(request: &axum::http::Request<B>) -> bool {
    let mut hosts = request
        .headers()
        .get_all(header::HOST)
        .iter()
        .map(HeaderValue::as_bytes);
    match (hosts.next(), hosts.next()) {
        (Some(host), None) => host.is_empty() || (!host.contains(&b'@') && Authority::try_from(host).is_ok()),
        (None, _) => request.version() != Version::HTTP_11,
        (Some(_), Some(_)) => false,
    }
}

/// Objects that are there are cheaper to answer than to count, and probes must not be held up.
fn paced(state: &AppState, peer: Option<&Peer>, route: &str) -> Result<(), ApiError> {
    let free = ["/healthz", "/readyz", "/metrics"].contains(&route);
    match peer {
        Some(peer) if route == IMMUTABLE_OBJECT => state.pace.object(peer),
        Some(peer) if !free => state.pace.request(peer),
        _ => Ok(()),
    }
}

fn announced_bytes(headers: &HeaderMap) -> u64 {
    let length = headers
        .get(header::CONTENT_LENGTH)
        .and_then(|value| value.to_str().ok());
    length.map_or(0, |length| length.parse().unwrap_or(0))
}

fn is_preflight(request: &Request) -> bool {
    *request.method() == Method::OPTIONS && request.headers().contains_key(header::ACCESS_CONTROL_REQUEST_METHOD)
}

async fn answered(answering: impl Future<Output = Response>, patience: Duration) -> Response {
    match tokio::time::timeout(patience, answering).await {
        Ok(response) => response,
        Err(_) => ApiError::TimedOut.into_response(),
    }
}

/// The answer of a handler that panicked.
pub(super) fn panicked(panic: Box<dyn Any + Send>) -> Response {
    ApiError::Internal(anyhow::anyhow!("a handler panicked: {}", panic_text(&*panic))).into_response()
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

fn write_problem(response: &mut Response, problem: &Problem, uri: &Uri) {
    let json = problem.json(uri.path());
    let headers = response.headers_mut();
    headers.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static("application/problem+json"),
    );
    headers.insert(header::CONTENT_LENGTH, json.len().into());
    *response.body_mut() = Body::from(json);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_500_that_keeps_its_message_to_itself() {
        let response = panicked(Box::new("secret"));
        assert_eq!(response.status(), StatusCode::INTERNAL_SERVER_ERROR);
        let problem = response.extensions().get::<Problem>().unwrap();
        assert!(!String::from_utf8(problem.json("/x")).unwrap().contains("secret"));
        assert!(problem.cause.as_ref().unwrap().to_string().contains("secret"));
    }

    #[test]
    fn a_request_names_one_host() {
        let named = |version, hosts: &[&str]| {
            let mut request = axum::http::Request::new(());
            *request.version_mut() = version;
            for host in hosts {
                request.headers_mut().append(header::HOST, host.parse().unwrap());
            }
            names_its_host(&request)
        };
        for hosts in [&["t"][..], &["a.b:80"], &["[::1]:8080"], &[""]] {
            assert!(named(Version::HTTP_11, hosts), "{hosts:?}");
        }
        for hosts in [&["t", "t"][..], &["t", "u"], &["a b"], &["a/b"], &["me@t"]] {
            assert!(
                !named(Version::HTTP_11, hosts) && !named(Version::HTTP_10, hosts),
                "{hosts:?}"
            );
        }
        assert!(!named(Version::HTTP_11, &[]));
        assert!(named(Version::HTTP_10, &[]) && named(Version::HTTP_2, &[]));
    }

    #[tokio::test]
    async fn a_handler_that_hangs_is_a_503() {
        let response = answered(std::future::pending(), Duration::from_millis(10)).await;
        assert_eq!(response.status(), StatusCode::SERVICE_UNAVAILABLE);
    }
}
