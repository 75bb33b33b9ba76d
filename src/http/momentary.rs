//! How is something answered that holds for this moment only?

use axum::{
    Json,
    http::{HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;

const NO_STORE: (HeaderName, HeaderValue) = (header::CACHE_CONTROL, HeaderValue::from_static("no-store"));

/// An answer that no cache keeps.
pub(super) fn now<T: Serialize>(status: StatusCode, answer: &T) -> Response {
    (status, [NO_STORE], Json(answer)).into_response()
}

/// Done; there is nothing to say.
pub(super) fn done() -> Response {
    (StatusCode::NO_CONTENT, [NO_STORE]).into_response()
}
