//! How does one come into a scene? By the list of scenes, or its name, along its pointer to a revision.

use std::sync::Arc;

use belvedere_scene::{
    SceneName,
    pointer::{Pointer, SceneList},
};

use crate::{
    ByteSource, Error, Scene,
    document::{fresh, named, pointer_of, pointer_path, stale, verified},
};

/// Follows the pointers of one published tree.
#[derive(Debug)]
pub struct Client<S> {
    source: Arc<S>,
}

impl<S: ByteSource> Client<S> {
    /// A client of this tree.
    pub fn new(source: S) -> Self {
        Self {
            source: Arc::new(source),
        }
    }

    /// The scenes of the tree.
    ///
    /// # Errors
    /// When the list cannot be fetched or read.
    pub async fn scenes(&self) -> Result<SceneList, Error> {
        named(&*self.source, "/v1/scenes/index.json").await
    }

    /// Follows the pointer of a scene to its current revision.
    ///
    /// # Errors
    /// When there is no such scene, or its pointer or manifest cannot be fetched or read.
    pub async fn open(&self, scene: &SceneName) -> Result<Scene<S>, Error> {
        let mut pointer = pointer_of(&*self.source, scene).await?;
        let mut answer = verified(&*self.source, &pointer.manifest, None).await;
        if matches!(answer, Err(Error::Missing(_))) {
            // The pointer may have been older than what was cleaned up since, as a copy in a cache is.
            let path = pointer_path(scene);
            let newer: Pointer = fresh(&*self.source, &path).await?;
            if newer.manifest != pointer.manifest {
                pointer = newer;
                answer = verified(&*self.source, &pointer.manifest, None).await;
            }
        }
        let bytes = answer.map_err(|cause| stale(scene, cause))?;
        Scene::read(self.source.clone(), pointer, &bytes)
    }
}
