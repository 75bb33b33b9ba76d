//! Is the server alive, and can it do its work?

use std::time::Duration;

use axum::{
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};

use super::error::ApiError;
use crate::{db::Catalogue, live::Live, store::BlobStore};

/// `GET /healthz`: the process answers.
pub(super) async fn alive() -> Response {
    plain("ok\n")
}

/// `GET /readyz`: the catalogue and the store answer. A node that is cut off from others serves on, and says so.
pub(super) async fn ready(
    State(catalogue): State<Catalogue>,
    State(blobs): State<BlobStore>,
    State(live): State<Live>,
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
    Ok(plain(match live.counts().nodes {
        None => "ready\n",
        Some(nodes) if nodes.connected => "ready\nnats: answers\n",
        Some(_) => "ready\nnats: away, live sessions go on within this node\n",
    }))
}

fn plain(text: &'static str) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, text).into_response()
}
