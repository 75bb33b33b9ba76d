//! Whose request is it? Writing routes want an API key, in `Authorization: Bearer` and nowhere else: never in an
//! address, which logs and histories keep.

use axum::{
    extract::{FromRef, FromRequestParts},
    http::{HeaderMap, HeaderValue, header, request::Parts},
};
use belvedere_scene::SceneName;

use super::{AppState, error::ApiError, pace::Pace, peer::Peer};
use crate::keys::{ApiKey, Grant, Keys, PREFIX, Scope};

/// The owner of a valid key.
#[derive(Debug)]
pub(super) struct Owner(Grant);

impl FromRequestParts<AppState> for Owner {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let shown = parts.headers.get(header::AUTHORIZATION).ok_or(ApiError::NoKey)?;
        let grant = grant(state, parts.extensions.get(), bearer(shown)).await?;
        Pace::from_ref(state).write(&grant.id)?;
        Ok(Self(grant))
    }
}

fn bearer(shown: &HeaderValue) -> Option<&str> {
    let (scheme, text) = shown.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| text.trim())
}

/// What is shown in the place of an API key, if it looks like one; tokens of sessions are shown there, too.
pub(super) fn key_shown(headers: &HeaderMap) -> Option<&str> {
    let shown = headers.get(header::AUTHORIZATION).and_then(bearer)?;
    shown.starts_with(PREFIX).then_some(shown)
}

/// What a key grants. An address that shows wrong ones is held up.
pub(super) async fn grant(state: &AppState, peer: Option<&Peer>, shown: Option<&str>) -> Result<Grant, ApiError> {
    let key: Option<ApiKey> = shown.and_then(|text| text.parse().ok());
    let pace = Pace::from_ref(state);
    let grant = match key {
        Some(key) => {
            let _turn = pace.turn(peer).await;
            Keys::from_ref(state).grant(&key).await.map_err(ApiError::Unavailable)?
        }
        None => None,
    };
    match (&grant, peer) {
        (None, Some(peer)) => pace.wrong_key(peer)?,
        (Some(_), Some(peer)) => pace.right_key(peer),
        (_, None) => {}
    }
    grant.ok_or(ApiError::WrongKey)
}

impl Owner {
    /// What the key grants, if that covers this.
    pub(super) fn may(self, scope: Scope, scene: &SceneName) -> Result<Grant, ApiError> {
        if self.0.covers(scope, scene) {
            return Ok(self.0);
        }
        Err(ApiError::NotGranted(format!(
            "it does not cover `{scope}` in scene `{scene}`"
        )))
    }
}
