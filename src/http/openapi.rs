//! What can the server be asked, for machines? A description written by hand beside the routes; tests compare the two.

use axum::{
    http::header,
    response::{IntoResponse, Response},
};

/// The OpenAPI 3.1 document.
pub const OPENAPI_JSON: &str = include_str!("openapi.json");

/// `GET /openapi.json`.
pub(super) async fn openapi() -> Response {
    let headers = [
        (header::CONTENT_TYPE, "application/json"),
        (header::CACHE_CONTROL, "public, max-age=60"),
    ];
    (headers, OPENAPI_JSON).into_response()
}
