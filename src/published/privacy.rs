//! What is not for everybody, at one moment?
//!
//! An object is named by its content, so one object may belong to several scenes. The rule asks for the scene, never for the
//! hash alone: an object is for everybody when a public scene needs it, and for the visitors of a private scene when that one
//! does. What no scene needs, or none yet, is for nobody. Knowing a hash opens nothing, then: whoever has a file could
//! compute it, and documents of one scene could name objects of another.
//!
//! Without private scenes all this is empty, and every object that is stored is for everybody.

use std::{
    collections::{BTreeMap, HashSet},
    sync::Arc,
};

use anyhow::Context;
use belvedere_scene::{BlobName, SceneName};

use crate::{
    db::{Catalogue, PrivateScene},
    links::LinkKey,
};

/// Who may read what.
#[derive(Debug, Default)]
pub struct Privacy {
    private: BTreeMap<SceneName, Private>,
    /// What the public scenes need.
    public_blobs: HashSet<BlobName>,
    /// How many revisions all this was read of.
    revisions: i64,
}

#[derive(Debug)]
struct Private {
    link_key: LinkKey,
    blobs: HashSet<BlobName>,
}

impl Privacy {
    /// Reads what the private scenes and the public ones need.
    async fn read(catalogue: &Catalogue, reading: &Reading) -> anyhow::Result<Self> {
        let mut private = BTreeMap::new();
        for scene in &reading.private {
            let link_key = scene.link_key.reveal().parse();
            let known = Private {
                link_key: link_key.with_context(|| format!("of private scene `{}`", scene.scene))?,
                blobs: catalogue.blobs_of_scene(&scene.scene).await?,
            };
            private.insert(scene.scene.clone(), known);
        }
        let public_blobs = if private.is_empty() {
            HashSet::new()
        } else {
            catalogue.public_blobs().await?
        };
        Ok(Self {
            private,
            public_blobs,
            revisions: reading.revisions,
        })
    }

    /// Whether these, and no others, are the private scenes, with the same keys, and no revision came or went.
    pub(super) fn is_of(&self, reading: &Reading) -> bool {
        let scenes = &reading.private;
        let same = |(name, known): (&SceneName, &Private), scene: &PrivateScene| {
            *name == scene.scene && *known.link_key.secret() == scene.link_key
        };
        self.revisions == reading.revisions
            && self.private.len() == scenes.len()
            && self.private.iter().zip(scenes).all(|(known, scene)| same(known, scene))
    }

    /// Whether there is nothing to keep from anybody.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.private.is_empty()
    }

    /// Whether this scene is private.
    #[must_use]
    pub fn is_private(&self, scene: &SceneName) -> bool {
        self.private.contains_key(scene)
    }

    /// What the links of a private scene are signed with.
    #[must_use]
    pub fn link_key(&self, scene: &SceneName) -> Option<&LinkKey> {
        self.private.get(scene).map(|private| &private.link_key)
    }

    /// Whether everybody may read this object.
    #[must_use]
    pub fn is_public(&self, blob: &BlobName) -> bool {
        self.is_empty() || self.public_blobs.contains(blob)
    }

    /// The private scenes that need this object.
    pub fn private_scenes_with(&self, blob: &BlobName) -> impl Iterator<Item = &SceneName> {
        let with = self.private.iter().filter(|(_, private)| private.blobs.contains(blob));
        with.map(|(scene, _)| scene)
    }
}

/// What is read of the catalogue at once.
#[derive(Debug)]
pub(super) struct Reading {
    pub(super) pointers: Vec<belvedere_scene::pointer::Pointer>,
    pub(super) private: Vec<PrivateScene>,
    /// How many are kept, where any scene is private: `gc` takes some away and moves no pointer.
    revisions: i64,
}

impl Reading {
    /// The pointers first: a scene that was made private and then published is never seen without the first.
    pub(super) async fn of(catalogue: &Catalogue) -> anyhow::Result<Self> {
        let pointers = catalogue.pointers().await?;
        let private = catalogue.private_scenes().await?;
        let revisions = if private.is_empty() {
            0
        } else {
            catalogue.count_revisions().await?
        };
        Ok(Self {
            pointers,
            private,
            revisions,
        })
    }

    /// What it says of who may read what.
    pub(super) async fn privacy(&self, catalogue: &Catalogue) -> anyhow::Result<Arc<Privacy>> {
        Privacy::read(catalogue, self).await.map(Arc::new)
    }
}
