//! Is the server alive, and can it do its work?

use std::time::Duration;

use axum::{
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};

use super::error::ApiError;
use crate::{db::Catalogue, store::BlobStore};

/// `GET /healthz`: the process answers.
pub(super) async fn alive() -> Response {
    plain("ok\n")
}

/// `GET /readyz`: the catalogue and the store answer.
pub(super) async fn ready(
    State(catalogue): State<Catalogue>,
    State(blobs): State<BlobStore>,
) -> Result<Response, ApiError> {
    const PATIENCE: Duration = Duration::from_secs(2);
    let asking = async {
        catalogue.pointers().await?;
        blobs.probe().await?;
        Ok(())
    };
    let answered = tokio::time::timeout(PATIENCE, asking).await;
    answered
        .unwrap_or_else(|_| {
            Err(anyhow::anyhow!(
                "the catalogue or the store did not answer within {PATIENCE:?}"
            ))
        })
        .map_err(ApiError::Unavailable)?;
    Ok(plain("ready\n"))
}

fn plain(text: &'static str) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, text).into_response()
}
