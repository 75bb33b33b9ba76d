//! Who reads, and what is there for them? What is public is there for everybody; of a private scene everything, its name
//! too, is there for those alone who come through its link or show an API key that may read it. For all others it is not
//! there: they are answered word for word as if there were no such scene or object.

use axum::{
    extract::{FromRef, FromRequestParts},
    http::{HeaderMap, HeaderValue, header, request::Parts},
};
use belvedere_scene::{BlobName, SceneName};
use std::{convert::Infallible, sync::Arc};

use super::{AppState, error::ApiError, links::Link, owner, peer::Peer};
use crate::{
    keys::{Grant, Scope},
    published::{Document, Published},
    store::Representations,
};

/// Whoever asks.
#[derive(Debug)]
pub(super) struct Visitor {
    state: AppState,
    link: Option<Link>,
    peer: Option<Peer>,
    /// An API key as it was shown.
    key: Option<String>,
}

impl FromRequestParts<AppState> for Visitor {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, Infallible> {
        Ok(Self {
            state: AppState::from_ref(state),
            link: parts.extensions.get().cloned(),
            peer: parts.extensions.get().cloned(),
            key: owner::key_shown(&parts.headers).map(str::to_owned),
        })
    }
}

impl Visitor {
    /// A scene that is published now.
    pub(super) async fn scene(&self, scene: &SceneName) -> Result<Arc<Published>, ApiError> {
        let current = self.state.publications.current();
        let missing = || ApiError::NotFound(format!("scene `{scene}`"));
        let published = current.scenes.get(scene);
        if let Some(published) = published.filter(|_| !current.privacy.is_private(scene)) {
            return Ok(published.clone());
        }
        // A wrong key is wrong whether there is such a scene or not.
        let may = self.came_to(scene)
            || self
                .grant()
                .await?
                .is_some_and(|grant| grant.covers(Scope::Read, scene));
        published.filter(|_| may).cloned().ok_or_else(missing)
    }

    /// An immutable object, if it is stored and some scene that may be seen needs it.
    pub(super) async fn blob(&self, blob: &BlobName) -> Result<Option<Arc<Representations>>, ApiError> {
        let forms = self.state.blobs.get(blob).await?;
        let privacy = self.state.publications.current().privacy.clone();
        if forms.is_some() && privacy.is_public(blob) {
            return Ok(forms);
        }
        let mut with = privacy.private_scenes_with(blob);
        if with.any(|scene| self.came_to(scene)) {
            return Ok(forms);
        }
        let grant = self.grant().await?;
        let covers = |scene: &SceneName| grant.as_ref().is_some_and(|grant| grant.covers(Scope::Read, scene));
        Ok(forms.filter(|_| privacy.private_scenes_with(blob).any(covers)))
    }

    /// The list of scenes: of a link its own; else the public ones, and what a key may read.
    pub(super) async fn list(&self) -> Result<Document, ApiError> {
        let current = self.state.publications.current();
        if let Some(Link::Open { scene: own, .. }) = &self.link {
            return Ok(current.list_of(|scene| scene == own));
        }
        Ok(match self.grant().await? {
            Some(grant) => {
                current.list_of(|scene| !current.privacy.is_private(scene) || grant.covers(Scope::Read, scene))
            }
            None => current.list.clone(),
        })
    }

    fn came_to(&self, scene: &SceneName) -> bool {
        matches!(&self.link, Some(Link::Open { scene: open, .. }) if open == scene)
    }

    async fn grant(&self) -> Result<Option<Grant>, ApiError> {
        match &self.key {
            Some(key) => owner::grant(&self.state, self.peer.as_ref(), Some(key)).await.map(Some),
            None => Ok(None),
        }
    }
}

/// What was answered to whoever showed a key is for nobody else.
pub(super) fn keep_from_others(headers: &mut HeaderMap) {
    let kept = headers.get(header::CACHE_CONTROL).and_then(|kept| kept.to_str().ok());
    if let Some(kept) = kept.and_then(|kept| HeaderValue::try_from(kept.replace("public", "private")).ok()) {
        headers.insert(header::CACHE_CONTROL, kept);
    }
}
