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

/// `GET /readyz`: the catalogue and the store answer, and the catalogue can be written. A node that is cut off from others
/// serves on, and says so.
pub(super) async fn ready(
    State(catalogue): State<Catalogue>,
    State(blobs): State<BlobStore>,
    State(live): State<Live>,
) -> Result<Response, ApiError> {
    let pointers = async { catalogue.pointers().await.map(drop) };
    answers("the catalogue does not answer", pointers).await?;
    let writable = catalogue.writable().await;
    writable.map_err(|cause| ApiError::Away {
        what: "the catalogue cannot be written",
        cause,
    })?;
    answers("the store does not answer", async { Ok(blobs.probe().await?) }).await?;
    Ok(plain(match live.counts().nodes {
        None => "ready\n",
        Some(nodes) if nodes.connected => "ready\nnats: answers\n",
        Some(_) => "ready\nnats: away, live sessions go on within this node\n",
    }))
}

async fn answers(what: &'static str, asking: impl Future<Output = anyhow::Result<()>>) -> Result<(), ApiError> {
    const PATIENCE: Duration = Duration::from_secs(2);
    let answered = tokio::time::timeout(PATIENCE, asking).await;
    answered
        .unwrap_or_else(|_| Err(anyhow::anyhow!("no answer within {PATIENCE:?}")))
        .map_err(|cause| ApiError::Away { what, cause })
}

fn plain(text: &'static str) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, text).into_response()
}
