//! What is not for everybody, at one moment?
//!
//! An object is named by its content, so one object may belong to several scenes. The rule asks for the scene, never for the
//! hash alone: an object is for everybody when a public scene needs it, and for the visitors of a private scene when that one
//! does. What no scene needs, or none yet, is for nobody. Knowing a hash opens nothing, then: whoever has a file could
//! compute it, and documents of one scene could name objects of another.
//!
//! A catalogue of many blobs takes its time to say what each scene needs. A scene that has become private is so before all that
//! is read ([`Privacy::hiding`]). As long as it is not even known what that scene itself needs, nothing is for everybody.
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
#[derive(Debug, Clone, Default)]
pub struct Privacy {
    private: BTreeMap<SceneName, Private>,
    /// What the public scenes needed when that was read; none where everything was for everybody.
    public_blobs: Option<Arc<HashSet<BlobName>>>,
    /// What each scene needs that has become private since then, as far as that is known.
    hidden_since: Vec<Arc<HashSet<BlobName>>>,
    /// Whether of some private scene it is not known what it needs. Every object asks for this, so no scene is looked at for it.
    unknown: bool,
    /// How many revisions all this was read of.
    revisions: i64,
}

#[derive(Debug, Clone)]
struct Private {
    link_key: LinkKey,
    /// What it needs; none while that is not known.
    blobs: Option<Arc<HashSet<BlobName>>>,
}

impl Privacy {
    /// What is known at once where these are the private scenes: what was known before, of those too that are no longer private,
    /// and nothing of those that have become so. None where that changes nothing.
    pub(super) fn hiding(&self, scenes: &[PrivateScene]) -> anyhow::Result<Option<Self>> {
        let is_as_known = |scene: &PrivateScene| {
            let known = self.private.get(&scene.scene);
            known.is_some_and(|known| *known.link_key.secret() == scene.link_key)
        };
        if scenes.iter().all(is_as_known) {
            return Ok(None);
        }
        let mut new = self.clone();
        for scene in scenes {
            let link_key = key_of(scene)?;
            match new.private.get_mut(&scene.scene) {
                Some(known) => known.link_key = link_key,
                None => {
                    new.unknown = true;
                    new.private
                        .insert(scene.scene.clone(), Private { link_key, blobs: None });
                }
            }
        }
        Ok(Some(new))
    }

    /// The same, and it is known what this scene needs, if that was not known before.
    pub(super) fn knowing(mut self, scene: &SceneName, blobs: Arc<HashSet<BlobName>>) -> Self {
        if let Some(private) = self.private.get_mut(scene)
            && private.blobs.is_none()
        {
            private.blobs = Some(blobs.clone());
            self.hidden_since.push(blobs);
            self.unknown = is_any_unknown(&self.private);
        }
        self
    }

    /// The private scenes of which it is not known what they need.
    pub(super) fn unknown_scenes(&self) -> impl Iterator<Item = &SceneName> {
        let unknown = self.private.iter().filter(|(_, private)| private.blobs.is_none());
        unknown.map(|(scene, _)| scene)
    }

    /// All that is read of the catalogue, where these are the private scenes and that is what they need.
    pub(super) fn of(reading: &Reading, needs: &Needs) -> anyhow::Result<Self> {
        let private = reading.private.iter().map(|scene| {
            let private = Private {
                link_key: key_of(scene)?,
                blobs: needs.private.get(&scene.scene).cloned(),
            };
            anyhow::Ok((scene.scene.clone(), private))
        });
        let private = private.collect::<Result<_, _>>()?;
        Ok(Self {
            unknown: is_any_unknown(&private),
            private,
            public_blobs: needs.public.clone(),
            hidden_since: Vec::new(),
            revisions: reading.revisions,
        })
    }

    /// Whether these, and no others, are the private scenes, with the same keys, and no revision came or went.
    pub(super) fn is_of(&self, reading: &Reading) -> bool {
        let is_whole = self.is_known() && self.hidden_since.is_empty();
        is_whole && self.revisions == reading.revisions && self.hides(&reading.private)
    }

    /// Whether these, and no others, are the private scenes, with the same keys.
    fn hides(&self, scenes: &[PrivateScene]) -> bool {
        let same = |(name, known): (&SceneName, &Private), scene: &PrivateScene| {
            *name == scene.scene && *known.link_key.secret() == scene.link_key
        };
        self.private.len() == scenes.len() && self.private.iter().zip(scenes).all(|(known, scene)| same(known, scene))
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

    /// Whether it is known what each private scene needs. Until it is, nothing is for everybody.
    #[must_use]
    pub fn is_known(&self) -> bool {
        !self.unknown
    }

    /// Whether everybody may read this object.
    #[must_use]
    pub fn is_public(&self, blob: &BlobName) -> bool {
        let was_public = self.public_blobs.as_ref().is_none_or(|public| public.contains(blob));
        was_public && self.is_known() && !self.hidden_since.iter().any(|blobs| blobs.contains(blob))
    }

    /// The private scenes that need this object.
    pub fn private_scenes_with(&self, blob: &BlobName) -> impl Iterator<Item = &SceneName> {
        self.private.keys().filter(move |scene| self.needs(scene, blob))
    }

    fn needs(&self, scene: &SceneName, blob: &BlobName) -> bool {
        let blobs = self.private.get(scene).and_then(|private| private.blobs.as_ref());
        blobs.is_some_and(|blobs| blobs.contains(blob))
    }
}

fn is_any_unknown(private: &BTreeMap<SceneName, Private>) -> bool {
    private.values().any(|private| private.blobs.is_none())
}

fn key_of(scene: &PrivateScene) -> anyhow::Result<LinkKey> {
    let key = scene.link_key.reveal().parse();
    key.with_context(|| format!("of private scene `{}`", scene.scene))
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

    /// Whether other scenes are private, or the same with other keys.
    pub(super) fn private_is_other(&self, other: &Self) -> bool {
        let keys = |reading: &Self| -> Vec<_> {
            let private = reading.private.iter();
            private.map(|one| (one.scene.clone(), one.link_key.clone())).collect()
        };
        keys(self) != keys(other)
    }

    /// Whether the same scenes are private, with whatever keys.
    pub(super) fn hides_as(&self, other: &Self) -> bool {
        let names = |reading: &Self| -> Vec<_> { reading.private.iter().map(|one| one.scene.clone()).collect() };
        names(self) == names(other)
    }

    /// The private scenes, first those of which it is not known what they need.
    pub(super) fn unknown_first(&self, known: &Privacy) -> Vec<SceneName> {
        let is_known = |scene: &SceneName| known.private.get(scene).is_some_and(|private| private.blobs.is_some());
        let mut scenes: Vec<_> = self.private.iter().map(|private| private.scene.clone()).collect();
        scenes.sort_by_key(is_known);
        scenes
    }
}

/// What scenes need.
#[derive(Debug, Default)]
pub(super) struct Needs {
    private: BTreeMap<SceneName, Arc<HashSet<BlobName>>>,
    public: Option<Arc<HashSet<BlobName>>>,
}

impl Needs {
    /// Reads it. `found` hears of each private scene, in this order, as soon as it is known what that needs.
    pub(super) async fn read(
        catalogue: &Catalogue,
        private: Vec<SceneName>,
        found: impl Fn(&SceneName, Arc<HashSet<BlobName>>),
    ) -> anyhow::Result<Self> {
        let mut needs = Self::default();
        if private.is_empty() {
            return Ok(needs);
        }
        for scene in private {
            let blobs = Arc::new(catalogue.blobs_of_scene(&scene).await?);
            found(&scene, blobs.clone());
            needs.private.insert(scene, blobs);
        }
        needs.public = Some(Arc::new(catalogue.public_blobs().await?));
        Ok(needs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn private(scene: &str, key: u8) -> PrivateScene {
        PrivateScene {
            scene: scene.parse().unwrap(),
            link_key: format!("{key:02x}").repeat(32).as_str().into(),
            since: String::new(),
        }
    }

    fn blob(name: &str) -> BlobName {
        BlobName::of(name.as_bytes(), "glb").unwrap()
    }

    fn blobs(names: &[&str]) -> Arc<HashSet<BlobName>> {
        Arc::new(names.iter().map(|name| blob(name)).collect())
    }

    #[test]
    fn a_scene_is_private_at_once_and_what_it_needs_is_for_nobody_before_that_is_known() {
        let all_public = Privacy::default();
        assert!(all_public.is_public(&blob("wall")) && all_public.is_known());
        let cellar: SceneName = "cellar".parse().unwrap();
        let hiding = all_public.hiding(&[private("cellar", 1)]).unwrap().unwrap();
        assert!(hiding.is_private(&cellar) && hiding.link_key(&cellar).is_some() && !hiding.is_known());
        assert!(!hiding.is_public(&blob("wall")), "the cellar may need it");
        let knowing = hiding.clone().knowing(&cellar, blobs(&["barrel", "wall"]));
        assert!(knowing.is_known() && knowing.is_public(&blob("tree")));
        assert!(!knowing.is_public(&blob("barrel")) && !knowing.is_public(&blob("wall")));
        assert_eq!(
            knowing.private_scenes_with(&blob("barrel")).collect::<Vec<_>>(),
            [&cellar]
        );
        let reading = Reading {
            pointers: Vec::new(),
            private: vec![private("cellar", 1)],
            revisions: 2,
        };
        assert!(!knowing.is_of(&reading), "what public scenes need is to be read still");
        let needs = Needs {
            private: BTreeMap::from([(cellar.clone(), blobs(&["barrel", "wall"]))]),
            public: Some(blobs(&["wall", "tree"])),
        };
        let read = Privacy::of(&reading, &needs).unwrap();
        assert!(read.is_of(&reading) && read.is_public(&blob("wall")) && !read.is_public(&blob("barrel")));
        assert!(!read.is_public(&blob("nobody's")));
    }

    #[test]
    fn one_scene_more_leaves_what_was_known_and_a_new_key_counts_at_once() {
        let [cellar, attic]: [SceneName; 2] = ["cellar", "attic"].map(|name| name.parse().unwrap());
        let reading = Reading {
            pointers: Vec::new(),
            private: vec![private("cellar", 1)],
            revisions: 2,
        };
        let needs = Needs {
            private: BTreeMap::from([(cellar.clone(), blobs(&["barrel"]))]),
            public: Some(blobs(&["wall", "trunk"])),
        };
        let before = Privacy::of(&reading, &needs).unwrap();
        let hiding = before
            .hiding(&[private("attic", 3), private("cellar", 2)])
            .unwrap()
            .unwrap();
        assert_ne!(
            hiding.link_key(&cellar).unwrap().secret(),
            before.link_key(&cellar).unwrap().secret()
        );
        assert!(!hiding.is_public(&blob("wall")));
        assert_eq!(
            hiding.private_scenes_with(&blob("barrel")).collect::<Vec<_>>(),
            [&cellar]
        );
        let knowing = hiding.knowing(&attic, blobs(&["trunk"]));
        assert!(knowing.is_public(&blob("wall")) && !knowing.is_public(&blob("trunk")));
        // One that is for everybody again is so when it is known what it needs; until then all stays as it was.
        assert!(before.hiding(&[]).unwrap().is_none());
        assert!(before.is_private(&cellar) && before.is_public(&blob("wall")) && !before.is_public(&blob("barrel")));
        assert!(before.hiding(&[private("cellar", 1)]).unwrap().is_none());
    }

    #[test]
    fn of_several_scenes_that_become_private_each_is_to_be_known() {
        let [attic, cellar]: [SceneName; 2] = ["attic", "cellar"].map(|name| name.parse().unwrap());
        let hiding = Privacy::default().hiding(&[private("attic", 1), private("cellar", 2)]);
        let hiding = hiding.unwrap().unwrap();
        assert_eq!(hiding.unknown_scenes().collect::<Vec<_>>(), [&attic, &cellar]);
        let one = hiding.knowing(&cellar, blobs(&["barrel"]));
        assert!(!one.is_known() && !one.is_public(&blob("wall")));
        let again = one.knowing(&cellar, blobs(&[]));
        assert!(!again.is_known());
        let both = again.knowing(&attic, blobs(&["trunk"]));
        assert!(both.is_known() && both.is_public(&blob("wall")));
        assert!(!both.is_public(&blob("barrel")) && !both.is_public(&blob("trunk")));
    }
}
