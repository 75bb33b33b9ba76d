//! What outlives the server? Movers that were created to stay, and how doors stand: kept in the catalogue as they change, and
//! put back where they were when their scene comes to life again.
//!
//! A mover is kept before whoever creates it hears of it, and forgotten before whoever deletes it does. Where it is follows a
//! second behind.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Context;
use belvedere_live::{
    Ms,
    world::{NewMover, Sent, Visitor},
};
use belvedere_scene::{BlobName, ObjectId, Revision, SceneName};
use futures_util::FutureExt;
use tokio::{sync::mpsc, task::JoinHandle};

use super::{Door, LiveError, Token, message::Reply};
use crate::db::{Catalogue, KeptDoor, KeptMover};

/// Between two times that poses are kept.
const PAUSE_MS: Ms = 1_000;
/// So many doors may wait for the catalogue.
const DOORS: usize = 256;

/// The movers of a scene that stay, and where they have moved since that was kept.
#[derive(Debug)]
pub(super) struct Keeping {
    staying: BTreeSet<ObjectId>,
    moved: BTreeMap<ObjectId, Sent>,
    kept_at_ms: Ms,
    writing: Option<Writing>,
    /// The last poses could not be kept.
    failing: bool,
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
            failing: false,
            doors,
        }
    }

    /// Where how a door stands is left, to be kept after all doors before, beside the scene's task. None while too many wait.
    pub(super) fn place_for_door(&self) -> Option<mpsc::OwnedPermit<DoorToKeep>> {
        self.doors.clone().try_reserve_owned().ok()
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

    /// Keeps where movers are, now and then, beside the scene's task. What cannot be kept is tried again.
    pub(super) fn keep(&mut self, catalogue: &Catalogue, now_ms: Ms) {
        let catalogue = catalogue.clone();
        self.keep_with(now_ms, |poses| async move {
            let kept = catalogue.keep_poses(&poses).await;
            kept.map_err(|error| anyhow::anyhow!(catalogue.why(&error)))
        });
    }

    fn keep_with<F>(&mut self, now_ms: Ms, write: impl FnOnce(Vec<(ObjectId, String)>) -> F)
    where
        F: Future<Output = anyhow::Result<()>> + Send + 'static,
    {
        if let Some(mut writing) = self.writing.take() {
            match (&mut writing.task).now_or_never() {
                None => {
                    self.writing = Some(writing);
                    return;
                }
                Some(written) => self.take_back(written.map_err(anyhow::Error::from).flatten(), writing.moved),
            }
        }
        if self.moved.is_empty() || now_ms - self.kept_at_ms < PAUSE_MS {
            return;
        }
        self.kept_at_ms = now_ms;
        let moved = std::mem::take(&mut self.moved);
        let poses = moved.iter().map(|(object, sent)| (*object, json(sent)));
        let task = tokio::spawn(write(poses.collect()));
        self.writing = Some(Writing { task, moved });
    }

    /// What was not written, for whatever reason, waits again, but where movers have gone on since.
    fn take_back(&mut self, written: anyhow::Result<()>, moved: BTreeMap<ObjectId, Sent>) {
        let failed_before = std::mem::replace(&mut self.failing, written.is_err());
        let Err(error) = written else {
            return;
        };
        if !failed_before {
            tracing::error!(%error, "where movers are cannot be kept, and is tried again");
        }
        for (object, sent) in moved {
            if self.staying.contains(&object) {
                self.moved.entry(object).or_insert(sent);
            }
        }
    }
}

/// Who writes where movers were.
#[derive(Debug)]
struct Writing {
    task: JoinHandle<anyhow::Result<()>>,
    moved: BTreeMap<ObjectId, Sent>,
}

/// Keeps a mover; says whether its id was free, and its scene is published still.
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

/// Those of these movers that stay, each where it was last, and its scene.
pub(super) async fn movers_anywhere(
    catalogue: &Catalogue,
    objects: &[ObjectId],
) -> anyhow::Result<BTreeMap<ObjectId, (SceneName, Token, NewMover)>> {
    let kept = catalogue.movers_anywhere(objects).await?.into_iter();
    kept.map(|(scene, kept)| Ok((kept.object, (scene, kept.token.parse()?, as_it_was(&kept)?))))
        .collect()
}

/// What those need who outlive the server and wear models of revisions that may be gone by now.
pub async fn worn(catalogue: &Catalogue) -> anyhow::Result<BTreeSet<BlobName>> {
    let (movers, sessions) = catalogue.kept_looks().await?;
    let movers = movers
        .iter()
        .map(|kept| Ok(serde_json::from_str::<NewMover>(kept)?.look));
    let sessions = sessions
        .iter()
        .map(|kept| Ok(serde_json::from_str::<Visitor>(kept)?.look));
    let looks = movers.chain(sessions).collect::<anyhow::Result<Vec<_>>>();
    let looks = looks.context("what a kept mover or session wears cannot be read")?;
    let mut names = BTreeSet::new();
    for model in looks.iter().filter_map(|look| look.model.as_deref()) {
        for level in &model.levels {
            names.insert(level.url.clone());
            names.extend(level.textures.iter().map(|texture| texture.url.clone()));
            names.extend(level.pack.iter().map(|pack| pack.url.clone()));
        }
        if let Some(impostor) = &model.impostor {
            names.extend([impostor.colour.url.clone(), impostor.shape.url.clone()]);
        }
    }
    Ok(names)
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use sqlx::{Connection, Executor, SqliteConnection};

    use super::*;
    use crate::db::FILE_NAME;

    fn there() -> Sent {
        Sent {
            t_ms: None,
            position: [1.0, 2.0, 3.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
            acceleration: None,
        }
    }

    #[tokio::test]
    async fn poses_whose_writer_panics_are_not_taken_for_written() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let mut keeping = Keeping::new(&catalogue, &"row".parse().unwrap());
        let [stays, goes] = [1 << 30, 1 << 30 | 1].map(ObjectId);
        for object in [stays, goes] {
            keeping.stay(object);
            keeping.moved(object, there());
        }
        keeping.keep_with(PAUSE_MS, |_| async { panic!("it breaks") });
        keeping.forget(goes);
        while !keeping.failing {
            tokio::time::sleep(Duration::from_millis(1)).await;
            keeping.keep_with(PAUSE_MS, |_| async { Ok(()) });
        }
        assert_eq!(keeping.moved, BTreeMap::from([(stays, there())]), "it is tried again");
    }

    #[tokio::test]
    async fn where_a_mover_is_that_could_not_be_kept_is_tried_again() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let (scene, object): (SceneName, _) = ("row".parse().unwrap(), ObjectId(1 << 30));
        let kept = KeptMover {
            object,
            token: Token::random().unwrap().reveal(),
            mover: "{}".into(),
            pose: None,
        };
        catalogue.publish_nothing(&scene).await;
        assert!(catalogue.keep_mover(&scene, &kept).await.unwrap());
        let file = format!("sqlite:{}", data.path().join(FILE_NAME).display());
        let mut beside = SqliteConnection::connect(&file).await.unwrap();
        let full = "CREATE TRIGGER full BEFORE UPDATE ON kept_movers BEGIN SELECT RAISE(ABORT, 'full'); END";
        beside.execute(full).await.unwrap();
        let mut keeping = Keeping::new(&catalogue, &scene);
        keeping.stay(object);
        let sent = there();
        keeping.moved(object, sent);
        keeping.keep(&catalogue, PAUSE_MS);
        assert!(keeping.moved.is_empty(), "it is on its way");
        for now_ms in 2.. {
            keeping.keep(&catalogue, now_ms * PAUSE_MS);
            if keeping.failing {
                break;
            }
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        beside.execute("DROP TRIGGER full").await.unwrap();
        for now_ms in 1_000_000.. {
            keeping.keep(&catalogue, now_ms * PAUSE_MS);
            if keeping.writing.is_none() {
                break;
            }
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        let kept = catalogue.kept_movers(&scene).await.unwrap();
        assert_eq!(kept[0].pose.as_deref(), Some(json(&sent).as_str()));
    }
}
