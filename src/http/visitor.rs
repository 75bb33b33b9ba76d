//! Who reads, and what is there for them? What is public is there for everybody; of a private scene everything, its name
//! too, is there for those alone who come through its link or show an API key that may read it. For all others it is not
//! there: they are answered word for word as if there were no such scene or object.

use std::{convert::Infallible, pin::Pin, sync::Arc, time::Duration};

use axum::{
    extract::{FromRef, FromRequestParts},
    http::{HeaderMap, HeaderValue, header, request::Parts},
};
use belvedere_scene::{BlobName, SceneName};
use bytes::Bytes;
use tokio::{
    sync::{OnceCell, watch},
    time::timeout,
};

use super::{AppState, error::ApiError, links::Link, owner, peer::Peer};
use crate::{
    keys::{Grant, Scope},
    published::{Document, Published, Snapshot},
    secret::Secret,
    store::{BlobStore, Coding, Representations},
};

/// A key that is revoked is noticed after so long by whoever is answered for longer.
const KEY_AGAIN: Duration = Duration::from_secs(60);

/// Whoever asks.
#[derive(Debug, Clone)]
pub(super) struct Visitor {
    state: AppState,
    link: Option<Link>,
    peer: Option<Peer>,
    /// An API key as it was shown …
    key: Option<Secret>,
    /// … and what it grants, once that was asked.
    granted: OnceCell<Grant>,
}

impl FromRequestParts<AppState> for Visitor {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, Infallible> {
        Ok(Self {
            state: AppState::from_ref(state),
            link: parts.extensions.get().cloned(),
            peer: parts.extensions.get().cloned(),
            key: owner::key_shown(&parts.headers).map(Secret::from),
            granted: OnceCell::new(),
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

    /// The forms of an immutable object, if it is stored and some scene that may be seen needs it; one of them is in memory, the
    /// one that is wished for if there is one.
    pub(super) async fn blob(
        &self,
        blob: &BlobName,
        wished: Option<Coding>,
    ) -> Result<Option<Arc<Representations>>, ApiError> {
        // Asked first: strangers are told nothing of the store either.
        if self.may_read(blob).await? {
            Ok(self.or_missing(blob, self.state.blobs.forms(blob, wished).await?))
        } else {
            Ok(None)
        }
    }

    /// The bytes of the same.
    pub(super) async fn identity(&self, blob: &BlobName) -> Result<Option<Bytes>, ApiError> {
        if self.may_read(blob).await? {
            Ok(self.or_missing(blob, self.state.blobs.get(blob).await?))
        } else {
            Ok(None)
        }
    }

    /// Takes note of what the store does not have.
    fn or_missing<T>(&self, blob: &BlobName, stored: Option<T>) -> Option<T> {
        if stored.is_none() {
            self.state.missing.note(&self.state.catalogue, blob);
        }
        stored
    }

    /// Where objects are.
    pub(super) fn blobs(&self) -> &BlobStore {
        &self.state.blobs
    }

    async fn may_read(&self, blob: &BlobName) -> Result<bool, ApiError> {
        let privacy = self.state.publications.privacy().await;
        if privacy.is_public(blob) || privacy.private_scenes_with(blob).any(|scene| self.came_to(scene)) {
            return Ok(true);
        }
        let grant = self.grant().await?;
        let covers = |scene: &SceneName| grant.is_some_and(|grant| grant.covers(Scope::Read, scene));
        Ok(privacy.private_scenes_with(blob).any(covers))
    }

    /// Ends when a scene is no longer there for this visitor: its link has expired or got another key, its API key was
    /// revoked, or the scene has become private. For whoever is answered for longer than a moment; of most of these, who show
    /// nothing, next to nothing is kept.
    pub(super) fn refused(self, scene: SceneName) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        if self.link.is_none() && self.key.is_none() {
            Box::pin(hidden(self.state.publications.changes(), scene))
        } else {
            Box::pin(self.not_admitted(scene))
        }
    }

    async fn not_admitted(self, scene: SceneName) {
        let mut changes = self.state.publications.changes();
        loop {
            let at_most = match (&self.link, &self.key) {
                (Some(link), _) => Some(link.left()),
                (None, Some(_)) => Some(KEY_AGAIN),
                (None, None) => None,
            };
            let changed = async {
                if changes.changed().await.is_err() {
                    // The server stops, and ends all streams in its own way.
                    std::future::pending::<()>().await;
                }
            };
            match at_most {
                Some(at_most) => _ = timeout(at_most, changed).await,
                None => changed.await,
            }
            let holds = match &self.link {
                Some(link) => link.holds(&self.state.publications),
                None => true,
            };
            // Of a key nobody remembers what it granted. It is no guess, so other wrong ones of the same address do not count: they
            // would keep the answer from being that it is revoked.
            let again = Self {
                granted: OnceCell::new(),
                peer: None,
                ..self.clone()
            };
            // A catalogue that does not answer refuses nobody. Boxed: it takes no room while nothing has changed.
            let refused = matches!(
                Box::pin(again.scene(&scene)).await,
                Err(ApiError::NotFound(_) | ApiError::WrongKey)
            );
            if !holds || refused {
                return;
            }
        }
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

    /// What its key grants; asked once for all that one request wants.
    async fn grant(&self) -> Result<Option<&Grant>, ApiError> {
        let Some(key) = &self.key else { return Ok(None) };
        let ask = || owner::grant(&self.state, self.peer.as_ref(), Some(key.reveal()));
        self.granted.get_or_try_init(ask).await.map(Some)
    }
}

/// Ends when a scene is no longer there for everybody.
async fn hidden(mut changes: watch::Receiver<Arc<Snapshot>>, scene: SceneName) {
    while changes.changed().await.is_ok() {
        let current = changes.borrow();
        if !current.scenes.contains_key(&scene) || current.privacy.is_private(&scene) {
            return;
        }
    }
    // The server stops, and ends all streams in its own way.
    std::future::pending().await
}

/// What was answered to whoever showed a key is for nobody else.
pub(super) fn keep_from_others(headers: &mut HeaderMap) {
    let kept = headers.get(header::CACHE_CONTROL).and_then(|kept| kept.to_str().ok());
    if let Some(kept) = kept.and_then(|kept| HeaderValue::try_from(kept.replace("public", "private")).ok()) {
        headers.insert(header::CACHE_CONTROL, kept);
        headers.append(header::VARY, HeaderValue::from_static("authorization"));
    }
}
