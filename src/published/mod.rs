//! What is published right now, and what does it say?
//!
//! [`Publications::follow`] polls the catalogue and swaps a snapshot, so that a new revision appears without a restart
//! and a request never waits for SQL. A [`SceneReader`] answers questions about one revision from its blobs alone,
//! exactly as a client would.

mod asking;
mod hiding;
mod privacy;
mod question;
mod reader;
mod screening;
mod shown;

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use belvedere_scene::{
    BlobHash, BlobName, SceneName,
    pointer::{Pointer, SceneList},
};
use bytes::Bytes;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

pub use hiding::{Hiding, Plane};
pub use privacy::Privacy;
pub use question::{Blockers, NoDoor, NotHidden, Question};
pub use reader::{DecodedCache, ObjectPage, ReadError, SceneReader, VisibleObject, VisiblePage};

use crate::{db::Catalogue, store::BlobStore};
use asking::Asking;
use privacy::{Needs, Reading};
use shown::Shown;

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
    /// The list of public scenes as it is sent.
    pub list: Document,
    /// The scenes by name, private ones too.
    pub scenes: BTreeMap<SceneName, Arc<Published>>,
    /// What of it is not for everybody.
    pub privacy: Arc<Privacy>,
}

/// What is published, always current. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Publications {
    current: watch::Receiver<Arc<Snapshot>>,
    /// Whether nothing is private; asked for at every request, so it is no lock.
    all_public: Arc<AtomicBool>,
    up_to_date: Arc<AtomicBool>,
    asking: Asking,
}

impl Publications {
    /// Reads the catalogue once, then again every `poll`, and whenever somebody asks for it, until `stopping`. While the catalogue does not answer, the
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
        let first = Reading::of(&catalogue).await?;
        let needs = Needs::read(&catalogue, first.unknown_first(&Privacy::default()), |_, _| {}).await?;
        let privacy = Privacy::of(&first, &needs)?;
        let (shown, current) = Shown::new(blobs, first.pointers, privacy);
        let all_public = shown.all_public.clone();
        let up_to_date = Arc::new(AtomicBool::new(true));
        let answers = up_to_date.clone();
        let (asking, mut asked) = asking::asking();
        let polling = async move {
            loop {
                let _waiting = asked.wait(poll).await;
                match shown.follow(&catalogue, poll).await {
                    Ok(changed) => {
                        if !answers.swap(true, Ordering::Relaxed) {
                            tracing::info!("the catalogue answers again");
                        }
                        if let Some(scenes) = changed {
                            tracing::info!(scenes, "what is published has changed");
                        }
                    }
                    Err(error) => {
                        if answers.swap(false, Ordering::Relaxed) {
                            tracing::error!(
                                error = catalogue.why(&error),
                                "cannot read the catalogue; serving what was known"
                            );
                        }
                    }
                }
            }
        };
        tokio::spawn(async move { stopping.run_until_cancelled(polling).await });
        Ok(Self {
            current,
            all_public,
            up_to_date,
            asking,
        })
    }

    /// Reads the catalogue now, for what is in it already to be served from here on. A catalogue that does not answer holds
    /// this up for a second.
    pub async fn refresh(&self) {
        self.asking.ask().await;
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

    /// Wakes at each change.
    #[must_use]
    pub fn changes(&self) -> watch::Receiver<Arc<Snapshot>> {
        let mut changes = self.current.clone();
        changes.mark_unchanged();
        changes
    }

    /// Whether everybody may read this object.
    #[must_use]
    pub fn is_public(&self, blob: &BlobName) -> bool {
        self.all_public.load(Ordering::Acquire) || self.current.borrow().privacy.is_public(blob)
    }

    /// Who may read what, once that is known: a scene that has become private a moment ago is private before it is known what
    /// it needs.
    pub async fn privacy(&self) -> Arc<Privacy> {
        let mut current = self.current.clone();
        match current.wait_for(|snapshot| snapshot.privacy.is_known()).await {
            Ok(snapshot) => snapshot.privacy.clone(),
            // The server stops.
            Err(_) => self.current().privacy.clone(),
        }
    }

    /// A scene of the newest snapshot, private or not.
    #[must_use]
    pub fn scene(&self, name: &SceneName) -> Option<Arc<Published>> {
        self.current.borrow().scenes.get(name).cloned()
    }
}

impl Snapshot {
    fn shows(&self, read: &Reading) -> bool {
        let pointers = &read.pointers;
        self.scenes.len() == pointers.len()
            && self.scenes.values().zip(pointers).all(|(scene, p)| scene.pointer == *p)
            && self.privacy.is_of(read)
    }

    /// The list of those scenes that somebody may see.
    #[must_use]
    pub fn list_of(&self, may_see: impl Fn(&SceneName) -> bool) -> Document {
        let pointers = self.scenes.values().map(|scene| &scene.pointer);
        let seen: Vec<_> = pointers.filter(|pointer| may_see(&pointer.scene)).cloned().collect();
        Document::new(scene_list_bytes(&crate::db::scene_list(&seen)))
    }
}
