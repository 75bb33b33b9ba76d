//! What outlives the server? Movers that were created to stay, and how doors stand: kept in the catalogue as they change, and
//! put back where they were when their scene comes to life again.
//!
//! A mover is kept before whoever creates it hears of it, and forgotten before whoever deletes it does. Where it is follows a
//! second behind.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{
    Ms,
    world::{NewMover, Sent},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::{sync::mpsc, task::JoinHandle};

use super::{
    Door, LiveError, Token, ask,
    message::{Message, Reply, StageHandle},
};
use crate::db::{Catalogue, KeptDoor, KeptMover};

/// Between two times that poses are kept.
const PAUSE_MS: Ms = 1_000;
/// So many doors may wait for the catalogue before the scene does.
const DOORS: usize = 256;

/// The movers of a scene that stay, and where they have moved since that was kept.
#[derive(Debug)]
pub(super) struct Keeping {
    staying: BTreeSet<ObjectId>,
    moved: BTreeMap<ObjectId, Sent>,
    kept_at_ms: Ms,
    writing: Option<JoinHandle<()>>,
    doors: mpsc::Sender<DoorToKeep>,
}

/// How a door stands, and who waits until that is kept.
#[derive(Debug)]
pub(super) struct DoorToKeep {
    pub(super) revision: Revision,
    pub(super) door: Door,
    pub(super) reply: Reply<Result<(), LiveError>>,
}

impl Keeping {
    /// No mover of the scene stays yet.
    pub(super) fn new(catalogue: &Catalogue, scene: &SceneName) -> Self {
        let (doors, waiting) = mpsc::channel(DOORS);
        tokio::spawn(keep_doors(catalogue.clone(), scene.clone(), waiting));
        Self {
            staying: BTreeSet::new(),
            moved: BTreeMap::new(),
            kept_at_ms: 0,
            writing: None,
            doors,
        }
    }

    /// Keeps how a door stands, after all doors before, beside the scene's task.
    pub(super) async fn keep_door(&self, door: DoorToKeep) {
        // When nobody writes any more, whoever waits hears that.
        _ = self.doors.send(door).await;
    }

    /// From now on a mover stays.
    pub(super) fn stay(&mut self, object: ObjectId) {
        self.staying.insert(object);
    }

    pub(super) fn forget(&mut self, object: ObjectId) {
        self.staying.remove(&object);
        self.moved.remove(&object);
    }

    /// A mover is somewhere else.
    pub(super) fn moved(&mut self, object: ObjectId, sent: Sent) {
        if self.staying.contains(&object) {
            // Times are those of a clock that may be another after a restart, and so is the motion.
            let sent = Sent {
                t_ms: None,
                velocity: None,
                acceleration: None,
                ..sent
            };
            self.moved.insert(object, sent);
        }
    }

    /// Keeps where movers are, now and then, beside the scene's task.
    pub(super) fn keep(&mut self, catalogue: &Catalogue, now_ms: Ms) {
        let busy = self.writing.as_ref().is_some_and(|writing| !writing.is_finished());
        if self.moved.is_empty() || busy || now_ms - self.kept_at_ms < PAUSE_MS {
            return;
        }
        self.kept_at_ms = now_ms;
        let moved = std::mem::take(&mut self.moved).into_iter();
        let poses: Vec<_> = moved.map(|(object, sent)| (object, json(&sent))).collect();
        let catalogue = catalogue.clone();
        self.writing = Some(tokio::spawn(async move {
            if let Err(error) = catalogue.keep_poses(&poses).await {
                tracing::error!(%error, "where movers are cannot be kept");
            }
        }));
    }
}

/// A mover that goes again when nobody waits until it is kept.
pub(super) struct Undo(Option<(Catalogue, StageHandle, ObjectId, Token)>);

impl Undo {
    pub(super) fn of(catalogue: &Catalogue, stage: &StageHandle, (object, token): (ObjectId, Token)) -> Self {
        Self(Some((catalogue.clone(), stage.clone(), object, token)))
    }

    /// It is kept.
    pub(super) fn forget(mut self) {
        self.0 = None;
    }
}

impl Drop for Undo {
    fn drop(&mut self) {
        let Some((catalogue, stage, object, token)) = self.0.take() else {
            return;
        };
        tokio::spawn(async move {
            // A scene that has ended holds no mover.
            _ = ask(&stage, |reply| Message::Destroy { object, reply }).await;
            if let Err(error) = catalogue.forget_mover(object, &token.reveal()).await {
                tracing::error!(%object, %error, "a mover that nobody waited for comes back after a restart");
            }
        });
    }
}

/// Keeps a mover; says whether its id was free.
pub(super) async fn keep_mover(
    catalogue: &Catalogue,
    scene: &SceneName,
    (object, token): (ObjectId, Token),
    new: &NewMover,
) -> anyhow::Result<bool> {
    let kept = KeptMover {
        object,
        token: token.reveal(),
        mover: json(new),
        pose: None,
    };
    catalogue.keep_mover(scene, &kept).await
}

/// The movers of a scene that stay, where they were last.
pub(super) async fn kept_movers(
    catalogue: &Catalogue,
    scene: &SceneName,
) -> anyhow::Result<Vec<(ObjectId, Token, NewMover)>> {
    let kept = catalogue.kept_movers(scene).await?.into_iter();
    kept.map(|kept| Ok((kept.object, kept.token.parse()?, as_it_was(&kept)?)))
        .collect()
}

/// A mover that stays, where it was last, and its scene.
pub(super) async fn kept_mover(
    catalogue: &Catalogue,
    object: ObjectId,
) -> anyhow::Result<Option<(SceneName, Token, NewMover)>> {
    let Some((scene, kept)) = catalogue.kept_mover(object).await? else {
        return Ok(None);
    };
    Ok(Some((scene, kept.token.parse()?, as_it_was(&kept)?)))
}

fn as_it_was(kept: &KeptMover) -> anyhow::Result<NewMover> {
    let mut new: NewMover = serde_json::from_str(&kept.mover)?;
    // Its sender's clock may be another by now.
    new.pose.t_ms = None;
    if let Some(pose) = &kept.pose {
        new.pose = serde_json::from_str(pose)?;
    }
    Ok(new)
}

/// Keeps how doors stand, one after the other, as long as the scene's task runs.
async fn keep_doors(catalogue: Catalogue, scene: SceneName, mut waiting: mpsc::Receiver<DoorToKeep>) {
    while let Some(DoorToKeep { revision, door, reply }) = waiting.recv().await {
        let kept = KeptDoor {
            object: door.object,
            bounds: json(&door.bounds),
            open: door.open,
        };
        let kept = catalogue.keep_door(&scene, revision, &kept).await;
        // Whoever has stopped waiting does not mind.
        _ = reply.send(kept.map_err(LiveError::Unkept));
    }
}

/// How the doors of a revision stand.
pub(super) async fn kept_doors(
    catalogue: &Catalogue,
    scene: &SceneName,
    revision: Revision,
) -> anyhow::Result<Vec<Door>> {
    let kept = catalogue.kept_doors(scene, revision).await?.into_iter();
    kept.map(|kept| {
        Ok(Door {
            object: kept.object,
            bounds: serde_json::from_str(&kept.bounds)?,
            open: kept.open,
        })
    })
    .collect()
}

fn json<T: serde::Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("what is kept holds nothing that JSON cannot say")
}
