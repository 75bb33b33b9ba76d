//! Whose request is it? Writing routes want an API key, in `Authorization: Bearer` and nowhere else: never in an
//! address, which logs and histories keep.

use axum::{
    extract::{FromRef, FromRequestParts},
    http::{header, request::Parts},
};
use belvedere_scene::SceneName;

use super::{AppState, error::ApiError, pace::Pace, peer::Peer};
use crate::keys::{ApiKey, Grant, Keys, Scope};

/// The owner of a valid key.
#[derive(Debug)]
pub(super) struct Owner(Grant);

impl FromRequestParts<AppState> for Owner {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let shown = parts.headers.get(header::AUTHORIZATION).ok_or(ApiError::NoKey)?;
        let bearer = shown.to_str().ok().and_then(|text| text.split_once(' '));
        let text = bearer
            .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
            .map(|(_, key)| key.trim());
        let key: Option<ApiKey> = text.and_then(|text| text.parse().ok());
        let grant = match key {
            Some(key) => Keys::from_ref(state).grant(&key).await.map_err(ApiError::Unavailable)?,
            None => None,
        };
        let pace = Pace::from_ref(state);
        let Some(grant) = grant else {
            if let Some(peer) = parts.extensions.get::<Peer>() {
                pace.wrong_key(peer)?;
            }
            return Err(ApiError::WrongKey);
        };
        pace.write(&grant.id)?;
        Ok(Self(grant))
    }
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
