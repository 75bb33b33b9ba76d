//! How does a scene go back to what it was? Its pointer moves to an earlier revision, whose objects are all there still.

use axum::{
    extract::{Request, State},
    http::StatusCode,
    response::Response,
};
use belvedere_scene::{Revision, SceneName};
use serde::Deserialize;

use super::{
    body::{JSON, body, json},
    error::ApiError,
    extract::Path,
    momentary::now,
    owner::Owner,
};
use crate::{db::Catalogue, keys::Scope, publish::rollback::roll_back, published::Publications, store::BlobStore};

const MAX_BODY_BYTES: usize = 1 << 10;

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    revision: Option<Revision>,
}

/// `POST /v1/scenes/{scene}/rollback`: to a revision, or to the one before the current one.
pub(super) async fn roll(
    State(catalogue): State<Catalogue>,
    State(blobs): State<BlobStore>,
    State(publications): State<Publications>,
    Path(scene): Path<SceneName>,
    owner: Owner,
    request: Request,
) -> Result<Response, ApiError> {
    let grant = owner.may(Scope::Rollback, &scene)?;
    let text = body(request, &[JSON], MAX_BODY_BYTES).await?;
    let asked: Asked = match &*text {
        [] => Asked::default(),
        text => json(text, r#"{"revision": "8c1f0a52b7d94e36"}, {} or nothing"#)?,
    };
    let moved = roll_back(&catalogue, &blobs, &scene, asked.revision).await?;
    tracing::info!(%scene, from = %moved.from, to = %moved.revision, key = grant.id, "a scene was rolled back");
    // Whoever reads the scene next, because of this answer, shall see it.
    publications.refresh().await;
    Ok(now(StatusCode::OK, &moved))
}
