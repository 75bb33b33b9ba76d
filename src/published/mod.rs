//! What is published right now, and what does it say?
//!
//! [`Publications::follow`] polls the catalogue and swaps a snapshot, so that a new revision appears without a restart
//! and a request never waits for SQL. A [`SceneReader`] answers questions about one revision from its blobs alone,
//! exactly as a client would.

mod hiding;
mod question;
mod reader;
mod screening;

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use belvedere_scene::{
    BlobHash, SceneName,
    pointer::{Pointer, SceneList},
};
use bytes::Bytes;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

pub use hiding::{Hiding, Plane};
pub use question::{Blockers, NoDoor, NotHidden, Question};
pub use reader::{DecodedCache, ObjectPage, ReadError, SceneReader, VisibleObject, VisiblePage};

use crate::{db::Catalogue, store::BlobStore};

/// The bytes of a scene's pointer document, the same on the server and in a static tree.
#[must_use]
pub fn pointer_bytes(pointer: &Pointer) -> Vec<u8> {
    serde_json::to_vec(pointer).expect("a pointer holds nothing that JSON cannot say")
}

/// The bytes of the list of scenes, the same on the server and in a static tree.
#[must_use]
pub fn scene_list_bytes(scenes: &SceneList) -> Vec<u8> {
    serde_json::to_vec(scenes).expect("a scene list holds nothing that JSON cannot say")
}

/// A small mutable document, ready to be sent.
#[derive(Debug, Clone)]
pub struct Document {
    /// JSON.
    pub bytes: Bytes,
    /// A strong entity tag with its quotes, made from the bytes.
    pub etag: Bytes,
}

impl Document {
    fn new(bytes: Vec<u8>) -> Self {
        let hash = BlobHash::of(&bytes).to_string();
        Self {
            bytes: bytes.into(),
            etag: format!("\"{}\"", &hash[..32]).into(),
        }
    }
}

/// One scene of a snapshot.
#[derive(Debug)]
pub struct Published {
    /// Its pointer.
    pub pointer: Pointer,
    /// The pointer as it is sent.
    pub document: Document,
    /// Answers questions about the revision.
    pub reader: SceneReader,
}

/// Every scene at one moment.
#[derive(Debug)]
pub struct Snapshot {
    /// The list of scenes as it is sent.
    pub list: Document,
    /// The scenes by name.
    pub scenes: BTreeMap<SceneName, Arc<Published>>,
}

/// What is published, always current. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Publications {
    current: watch::Receiver<Arc<Snapshot>>,
    up_to_date: Arc<AtomicBool>,
}

impl Publications {
    /// Reads the catalogue once, then again every `poll` until `stopping`. While the catalogue does not answer, the
    /// last snapshot stays.
    ///
    /// # Errors
    /// When the first read fails.
    pub async fn follow(
        catalogue: Catalogue,
        blobs: BlobStore,
        poll: Duration,
        stopping: CancellationToken,
    ) -> anyhow::Result<Self> {
        let decoded = Arc::new(DecodedCache::default());
        let first = snapshot(catalogue.pointers().await?, None, &blobs, &decoded);
        let (sender, current) = watch::channel(Arc::new(first));
        let up_to_date = Arc::new(AtomicBool::new(true));
        let answers = up_to_date.clone();
        let polling = async move {
            loop {
                tokio::time::sleep(poll).await;
                match catalogue.pointers().await {
                    Ok(pointers) => {
                        if !answers.swap(true, Ordering::Relaxed) {
                            tracing::info!("the catalogue answers again");
                        }
                        let last = sender.borrow().clone();
                        if !last.shows(&pointers) {
                            tracing::info!(scenes = pointers.len(), "what is published has changed");
                            sender.send_replace(Arc::new(snapshot(pointers, Some(&last), &blobs, &decoded)));
                        }
                    }
                    Err(error) => {
                        if answers.swap(false, Ordering::Relaxed) {
                            tracing::error!(
                                error = format!("{error:#}"),
                                "cannot read the catalogue; serving what was known"
                            );
                        }
                    }
                }
            }
        };
        tokio::spawn(async move { stopping.run_until_cancelled(polling).await });
        Ok(Self { current, up_to_date })
    }

    /// Whether the catalogue has answered when it was last asked, so that nothing newer is published.
    #[must_use]
    pub fn up_to_date(&self) -> bool {
        self.up_to_date.load(Ordering::Relaxed)
    }

    /// The newest snapshot.
    #[must_use]
    pub fn current(&self) -> Arc<Snapshot> {
        self.current.borrow().clone()
    }

    /// A scene of the newest snapshot.
    #[must_use]
    pub fn scene(&self, name: &SceneName) -> Option<Arc<Published>> {
        self.current.borrow().scenes.get(name).cloned()
    }
}

impl Snapshot {
    fn shows(&self, pointers: &[Pointer]) -> bool {
        self.scenes.len() == pointers.len() && self.scenes.values().zip(pointers).all(|(scene, p)| scene.pointer == *p)
    }
}

/// Scenes whose pointer did not move are taken over from the last snapshot.
fn snapshot(
    pointers: Vec<Pointer>,
    last: Option<&Snapshot>,
    blobs: &BlobStore,
    decoded: &Arc<DecodedCache>,
) -> Snapshot {
    let list = Document::new(scene_list_bytes(&crate::db::scene_list(&pointers)));
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
    Snapshot {
        list,
        scenes: pointers.into_iter().map(publish).collect(),
    }
}
