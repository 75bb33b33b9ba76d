//! How does what the catalogue says become what is served? In one step where little has changed. Where a scene has become private
//! or has got another key, that counts as soon as it is known what that scene needs, and what takes long to read is read afterwards.

use std::{
    pin::pin,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use belvedere_scene::{SceneName, pointer::Pointer};
use tokio::sync::watch;

use super::{
    Document, Privacy, Published, SceneReader, Snapshot, pointer_bytes,
    privacy::{Needs, Reading},
    reader::DecodedCache,
};
use crate::{
    db::{Catalogue, PATIENCE, PrivateScene, in_time},
    store::BlobStore,
};

/// So long a scene that has become private may wait for it to be known what it needs. Without that nothing is for everybody.
const HIDING: Duration = Duration::from_millis(800);
/// Between two times that this is asked for, where the catalogue says nothing.
const ASKING_AGAIN: Duration = Duration::from_millis(50);

/// What is served, for the one task that changes it.
#[derive(Debug)]
pub(super) struct Shown {
    snapshot: watch::Sender<Arc<Snapshot>>,
    pub(super) all_public: Arc<AtomicBool>,
    blobs: BlobStore,
    decoded: Arc<DecodedCache>,
}

impl Shown {
    pub(super) fn new(
        blobs: BlobStore,
        pointers: Vec<Pointer>,
        privacy: Privacy,
    ) -> (Self, watch::Receiver<Arc<Snapshot>>) {
        let decoded = Arc::new(DecodedCache::default());
        let all_public = Arc::new(AtomicBool::new(privacy.is_empty()));
        let first = snapshot(pointers, Arc::new(privacy), None, &blobs, &decoded);
        let (snapshot, current) = watch::channel(Arc::new(first));
        let shown = Self {
            snapshot,
            all_public,
            blobs,
            decoded,
        };
        (shown, current)
    }

    /// Serves what the catalogue says now; gives how many scenes that are if something has changed. While that is read, what
    /// becomes private is looked for, each time after this pause.
    pub(super) async fn follow(&self, catalogue: &Catalogue, pause: Duration) -> anyhow::Result<Option<usize>> {
        let mut read = in_time(PATIENCE, Reading::of(catalogue)).await?;
        if self.last().shows(&read) {
            return Ok(None);
        }
        let needs = loop {
            self.hide(catalogue, &read.private, HIDING).await?;
            let found = |scene: &SceneName, blobs| {
                let known = self.last().privacy.clone();
                if !known.is_known() {
                    self.show_privacy(Privacy::clone(&known).knowing(scene, blobs));
                }
            };
            let scenes = read.unknown_first(&self.last().privacy);
            let mut reading = pin!(Needs::read(catalogue, scenes, found));
            let newer = loop {
                tokio::select! {
                    needs = &mut reading => break Ok(needs?),
                    newer = hidden_meanwhile(catalogue, &read, pause) => {
                        if !newer.hides_as(&read) {
                            break Err(newer);
                        }
                        self.hide(catalogue, &newer.private, HIDING).await?;
                        read.private = newer.private;
                    }
                }
            };
            match newer {
                Ok(needs) => break needs,
                // Other scenes are private now, so other needs are to be known.
                Err(newer) => read = newer,
            }
        };
        let privacy = Privacy::of(&read, &needs)?;
        let scenes = read.pointers.len();
        self.show(read.pointers, privacy);
        Ok(Some(scenes))
    }

    fn last(&self) -> Arc<Snapshot> {
        self.snapshot.borrow().clone()
    }

    /// These are private from now on. What those need that have become so is read first, for a catalogue that goes away
    /// meanwhile would leave nothing for everybody; once that has taken too long, they are private all the same.
    async fn hide(&self, catalogue: &Catalogue, scenes: &[PrivateScene], patience: Duration) -> anyhow::Result<()> {
        let Some(mut hiding) = self.last().privacy.hiding(scenes)? else {
            return Ok(());
        };
        let unknown: Vec<_> = hiding.unknown_scenes().cloned().collect();
        let mut found = Vec::new();
        let reading = async {
            for scene in unknown {
                let blobs = loop {
                    match catalogue.blobs_of_scene(&scene).await {
                        Ok(blobs) => break Arc::new(blobs),
                        // Whoever reads all that is needed tells of it.
                        Err(_) => tokio::time::sleep(ASKING_AGAIN).await,
                    }
                };
                found.push((scene, blobs));
            }
        };
        // What has been found by then counts.
        _ = tokio::time::timeout(patience, reading).await;
        for (scene, blobs) in found {
            hiding = hiding.knowing(&scene, blobs);
        }
        self.show_privacy(hiding);
        Ok(())
    }

    fn show_privacy(&self, privacy: Privacy) {
        let pointers = self.last().scenes.values().map(|scene| scene.pointer.clone()).collect();
        self.show(pointers, privacy);
    }

    fn show(&self, pointers: Vec<Pointer>, privacy: Privacy) {
        let all_public = privacy.is_empty();
        let new = snapshot(
            pointers,
            Arc::new(privacy),
            Some(&self.last()),
            &self.blobs,
            &self.decoded,
        );
        // What has become private is so before anybody hears of it.
        self.all_public.fetch_and(all_public, Ordering::Release);
        self.snapshot.send_replace(Arc::new(new));
        self.all_public.store(all_public, Ordering::Release);
    }
}

/// Waits until other scenes are private than were, or the same with other keys.
async fn hidden_meanwhile(catalogue: &Catalogue, read: &Reading, pause: Duration) -> Reading {
    loop {
        tokio::time::sleep(pause).await;
        // Whoever reads beside this hears of a catalogue that does not answer.
        if let Ok(newer) = in_time(PATIENCE, Reading::of(catalogue)).await
            && newer.private_is_other(read)
        {
            return newer;
        }
    }
}

/// Scenes whose pointer did not move are taken over from the last snapshot.
fn snapshot(
    pointers: Vec<Pointer>,
    privacy: Arc<Privacy>,
    last: Option<&Snapshot>,
    blobs: &BlobStore,
    decoded: &Arc<DecodedCache>,
) -> Snapshot {
    let publish = |pointer: Pointer| {
        let known = last.and_then(|last| last.scenes.get(&pointer.scene));
        let published = known
            .filter(|known| known.pointer == pointer)
            .cloned()
            .unwrap_or_else(|| {
                Arc::new(Published {
                    document: Document::new(pointer_bytes(&pointer)),
                    reader: SceneReader::new(pointer.manifest.clone(), blobs.clone(), decoded.clone()),
                    pointer,
                })
            });
        (published.pointer.scene.clone(), published)
    };
    let mut snapshot = Snapshot {
        list: Document::new(vec![]),
        scenes: pointers.into_iter().map(publish).collect(),
        privacy,
    };
    snapshot.list = snapshot.list_of(|scene| !snapshot.privacy.is_private(scene));
    snapshot
}

#[cfg(test)]
mod tests {
    use belvedere_scene::BlobName;

    use super::*;
    use crate::db::{NewRevision, silence};

    fn blob(name: &str) -> BlobName {
        BlobName::of(name.as_bytes(), "glb").unwrap()
    }

    /// A catalogue where the cellar needs a barrel, and what is served of it: all, to everybody.
    async fn cellar(data: &std::path::Path) -> (Catalogue, Shown, watch::Receiver<Arc<Snapshot>>) {
        let catalogue = Catalogue::open(data).await.unwrap();
        let pointer = serde_json::json!({
            "scene": "cellar", "title": "Cellar", "revision": "0".repeat(16), "manifest": blob("manifest"),
            "bounds": {"min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 1.0]}, "up": "+Y", "unit": "m",
            "cells": 0, "objects": 0, "models": 0, "triangles": 0, "bytes": {}, "viewpoints": [],
        });
        let pointer: Pointer = serde_json::from_value(pointer).unwrap();
        let blobs = [(blob("barrel"), 7)];
        let new = NewRevision {
            pointer: &pointer,
            source_key: "",
            sources: &[],
            report: &serde_json::Value::Null,
            blobs: &blobs,
            claim: None,
        };
        catalogue.publish(&new).await.unwrap();
        let blobs = BlobStore::open_folder(data, 1 << 20).await.unwrap();
        let (shown, current) = Shown::new(blobs, vec![pointer], Privacy::default());
        let name = "cellar".parse().unwrap();
        assert!(
            catalogue
                .make_private(&name, &"01".repeat(32).as_str().into())
                .await
                .unwrap()
        );
        (catalogue, shown, current)
    }

    #[tokio::test]
    async fn a_scene_that_becomes_private_takes_its_own_objects_from_everybody_and_no_others() {
        let data = tempfile::tempdir().unwrap();
        let (catalogue, shown, current) = cellar(data.path()).await;
        let private = catalogue.private_scenes().await.unwrap();
        shown.hide(&catalogue, &private, PATIENCE).await.unwrap();
        let privacy = current.borrow().privacy.clone();
        assert!(privacy.is_private(&"cellar".parse().unwrap()) && !shown.all_public.load(Ordering::Relaxed));
        assert!(privacy.is_known() && privacy.is_public(&blob("tree")) && !privacy.is_public(&blob("barrel")));
    }

    #[tokio::test]
    async fn a_scene_is_private_though_nobody_says_what_it_needs() {
        let data = tempfile::tempdir().unwrap();
        let (catalogue, shown, mut current) = cellar(data.path()).await;
        let private = catalogue.private_scenes().await.unwrap();
        let held = silence(&catalogue).await;
        shown.hide(&catalogue, &private, Duration::ZERO).await.unwrap();
        drop(held);
        let privacy = current.borrow_and_update().privacy.clone();
        assert!(privacy.is_private(&"cellar".parse().unwrap()));
        assert!(!privacy.is_known() && !privacy.is_public(&blob("tree")));
        // The same again is no news.
        shown.hide(&catalogue, &private, PATIENCE).await.unwrap();
        assert!(!current.has_changed().unwrap());
        shown.follow(&catalogue, PATIENCE).await.unwrap();
        assert!(current.borrow_and_update().privacy.is_known());
        // Opened, it is for everybody when all is known again, and until then nothing is new.
        shown.hide(&catalogue, &[], PATIENCE).await.unwrap();
        assert!(!current.has_changed().unwrap());
    }
}
