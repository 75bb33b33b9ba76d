//! How is publishing undone? The scene's pointer moves to a revision that was kept, if all of it is still there.

use belvedere_scene::{BlobName, Revision, SceneName};
use futures_util::{StreamExt, TryStreamExt, stream};
use serde::Serialize;

use crate::{
    db::{Catalogue, KeptRevision},
    store::{BlobStore, StoreError},
};

/// A pointer that was moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Moved {
    /// What is current now.
    pub(crate) revision: Revision,
    /// What was current before.
    pub(crate) from: Revision,
}

/// Why a pointer stays where it is.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RollbackError {
    /// Nothing of this name was ever published.
    #[error("there is no scene `{0}`")]
    NoScene(SceneName),
    /// It was never published, or `gc` has removed it.
    #[error("scene `{scene}` has no revision {revision}; kept are {kept}")]
    NoRevision {
        scene: SceneName,
        revision: Revision,
        kept: String,
    },
    /// The current one is the oldest.
    #[error("scene `{0}` has no earlier revision than the current one")]
    NoEarlier(SceneName),
    /// A part of it is gone.
    #[error("revision {revision} of scene `{scene}` is not whole: {cause}")]
    NotWhole {
        scene: SceneName,
        revision: Revision,
        cause: StoreError,
    },
    /// The catalogue or the store does not answer.
    #[error(transparent)]
    Unavailable(#[from] anyhow::Error),
}

/// Moves a scene's pointer to a revision, or to the one that was published before the current one. A preview is none of these: it is
/// of the bake that went on after it, which may be the very one that is to be undone.
pub(crate) async fn roll_back(
    catalogue: &Catalogue,
    store: &BlobStore,
    scene: &SceneName,
    to: Option<Revision>,
) -> Result<Moved, RollbackError> {
    let kept = catalogue.kept_revisions(scene).await?;
    let current = kept.iter().position(|kept| kept.current);
    let current = current.ok_or_else(|| RollbackError::NoScene(scene.clone()))?;
    let from = kept[current].revision;
    let revision = match to {
        Some(revision) if kept.iter().any(|kept| kept.revision == revision) => revision,
        Some(revision) => return Err(no_revision(scene, revision, &kept)),
        // Newest first, so the next one is the one before.
        None => {
            let before = kept[current + 1..].iter().find(|kept| !kept.preview);
            before.ok_or_else(|| RollbackError::NoEarlier(scene.clone()))?.revision
        }
    };
    let blobs = catalogue.blobs_of(scene, revision).await?;
    whole(store, &blobs).await.map_err(|cause| match cause {
        StoreError::Missing(_) => RollbackError::NotWhole {
            scene: scene.clone(),
            revision,
            cause,
        },
        cause => RollbackError::Unavailable(cause.into()),
    })?;
    // `gc` may have taken it meanwhile; then the pointer does not move.
    if !catalogue.make_current(scene, revision).await? {
        return Err(no_revision(scene, revision, &kept));
    }
    Ok(Moved { revision, from })
}

fn no_revision(scene: &SceneName, revision: Revision, kept: &[KeptRevision]) -> RollbackError {
    let kept: Vec<_> = kept.iter().map(|kept| kept.revision.to_string()).collect();
    RollbackError::NoRevision {
        scene: scene.clone(),
        revision,
        kept: kept.join(", "),
    }
}

/// Whether every blob is stored with its size; names one that is not.
pub(super) async fn whole(store: &BlobStore, blobs: &[(BlobName, u64)]) -> Result<(), StoreError> {
    /// A bucket answers each question in milliseconds, and a revision has thousands of blobs.
    const AT_ONCE: usize = 32;
    stream::iter(blobs)
        .map(Ok)
        .try_for_each_concurrent(AT_ONCE, async |(blob, bytes)| {
            let stored = store.stored_bytes(blob).await?;
            (stored == Some(*bytes))
                .then_some(())
                .ok_or_else(|| StoreError::Missing(blob.clone()))
        })
        .await
}
