//! Which address does what? The whole table.

use axum::{
    Router, middleware,
    routing::{MethodRouter, delete, get, post, put},
};

use tower_http::catch_panic::CatchPanicLayer;

use super::{
    AppState, around, bundle, documents,
    error::ApiError,
    health, immutable,
    live::{doors, movers, sessions},
    metrics, openapi, queries, rollback, uploads, viewer, visible,
};

/// The routes and their handlers.
fn table() -> Vec<(&'static str, MethodRouter<AppState>)> {
    vec![
        ("/v1/scenes", get(documents::scenes)),
        ("/v1/scenes/index.json", get(documents::scenes)),
        (SCENE, get(documents::scene).put(uploads::upload)),
        ("/v1/scenes/{scene}/index.json", get(documents::scene)),
        ("/v1/scenes/{scene}/cells", get(queries::cell_at)),
        ("/v1/scenes/{scene}/cells/{cell}", get(queries::cell)),
        ("/v1/scenes/{scene}/cells/{cell}/visible", get(queries::visible)),
        ("/v1/scenes/{scene}/visible", post(visible::from_anywhere)),
        ("/v1/scenes/{scene}/objects", get(queries::objects)),
        ("/v1/scenes/{scene}/objects/{object}", get(queries::object)),
        ("/v1/scenes/{scene}/objects/{object}/lods/{level}", get(queries::level)),
        ("/v1/scenes/{scene}/sessions", post(sessions::open)),
        ("/v1/sessions/{session}", delete(sessions::close)),
        ("/v1/sessions/{session}/pose", put(sessions::pose)),
        ("/v1/sessions/{session}/aoi", put(sessions::aoi)),
        ("/v1/sessions/{session}/quality", put(sessions::quality)),
        ("/v1/sessions/{session}/events", get(sessions::events)),
        ("/v1/scenes/{scene}/movers", post(movers::create)),
        ("/v1/scenes/{scene}/movers/poses", post(movers::poses)),
        ("/v1/movers/{object}", delete(movers::destroy)),
        ("/v1/movers/{object}/pose", put(movers::pose)),
        ("/v1/scenes/{scene}/doors/{object}", get(doors::get).put(doors::set)),
        ("/v1/scenes/{scene}/rollback", post(rollback::roll)),
        ("/v1/jobs/{job}", get(uploads::job).delete(uploads::cancel)),
        ("/v1/jobs/{job}/events", get(uploads::events)),
        (IMMUTABLE_OBJECT, get(immutable::object)),
        (BUNDLE, get(bundle::bundle)),
        ("/healthz", get(health::alive)),
        ("/readyz", get(health::ready)),
        ("/metrics", get(metrics::metrics)),
        ("/openapi.json", get(openapi::openapi)),
        ("/", get(viewer::file)),
    ]
}

/// The routes with what happens around them.
pub fn router(state: AppState) -> Router {
    let routes = table()
        .into_iter()
        .fold(Router::new(), |router, (path, methods)| router.route(path, methods));
    routes
        .fallback(viewer::file)
        .method_not_allowed_fallback(async || ApiError::MethodNotAllowed)
        .layer(CatchPanicLayer::custom(around::panicked))
        .layer(middleware::from_fn_with_state(state.clone(), around::around))
        .with_state(state)
}

/// What no route template covers, in metrics and in the log.
pub(super) const UNMATCHED: &str = "unmatched";

/// The template of immutable objects.
pub(super) const IMMUTABLE_OBJECT: &str = "/o/{name}";

/// The template of bundles.
pub(super) const BUNDLE: &str = "/o/bundle/{members}";

/// The template of a scene's pointer, and of uploads.
pub(super) const SCENE: &str = "/v1/scenes/{scene}";

/// The templates, as they label metrics.
pub(super) const TEMPLATES: [&str; 32] = [
    IMMUTABLE_OBJECT,
    BUNDLE,
    "/v1/scenes",
    "/v1/scenes/index.json",
    SCENE,
    "/v1/scenes/{scene}/index.json",
    "/v1/scenes/{scene}/cells",
    "/v1/scenes/{scene}/cells/{cell}",
    "/v1/scenes/{scene}/cells/{cell}/visible",
    "/v1/scenes/{scene}/visible",
    "/v1/scenes/{scene}/objects",
    "/v1/scenes/{scene}/objects/{object}",
    "/v1/scenes/{scene}/objects/{object}/lods/{level}",
    "/v1/scenes/{scene}/sessions",
    "/v1/sessions/{session}",
    "/v1/sessions/{session}/pose",
    "/v1/sessions/{session}/aoi",
    "/v1/sessions/{session}/quality",
    "/v1/sessions/{session}/events",
    "/v1/scenes/{scene}/movers",
    "/v1/scenes/{scene}/movers/poses",
    "/v1/movers/{object}",
    "/v1/movers/{object}/pose",
    "/v1/scenes/{scene}/doors/{object}",
    "/v1/scenes/{scene}/rollback",
    "/v1/jobs/{job}",
    "/v1/jobs/{job}/events",
    "/healthz",
    "/readyz",
    "/metrics",
    "/openapi.json",
    "/",
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_table_the_templates_and_the_openapi_document_name_the_same_routes() {
        let table: BTreeSet<_> = table().into_iter().map(|(path, _)| path).collect();
        assert_eq!(table, TEMPLATES.into_iter().collect());
        let openapi: serde_json::Value = serde_json::from_str(super::super::OPENAPI_JSON).unwrap();
        let described: BTreeSet<_> = openapi["paths"]
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .collect();
        assert_eq!(table, described);
    }
}
