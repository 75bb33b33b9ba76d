//! How is the task of a scene asked?

use std::sync::{
    Arc, Mutex, MutexGuard,
    atomic::{AtomicBool, Ordering},
};

use belvedere_live::{
    Ms,
    aoi::Aoi,
    event::SessionId,
    nodes::message::Said,
    world::{Counts, Moved, NewMover, Seen, Sent, Visitor},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::sync::{mpsc, oneshot};

use super::{
    LiveError,
    outbox::Outbox,
    registry::Door,
    screens::Screen,
    terrain::{Prospect, Sight, Terrain},
    token::Token,
};
use crate::published::{Published, ReadError};

/// So many messages may wait for a scene.
const MESSAGES: usize = 1024;

pub(super) type Reply<T> = oneshot::Sender<T>;

/// What a scene's task can be asked.
#[derive(Debug)]
pub(super) enum Message {
    /// Something of one session, in its order.
    Step(Step),
    /// What is seen from where a session comes to stand with this step, or where some are on their way to, in this revision.
    Learned {
        published: Arc<Published>,
        sights: Result<Vec<Sight>, ReadError>,
        step: Option<Step>,
    },
    Create {
        object: ObjectId,
        owner: Option<SessionId>,
        new: NewMover,
        /// It outlives the server.
        stays: bool,
        reply: Reply<Result<Moved, LiveError>>,
    },
    /// A mover that stays has its home here from now on.
    TakeOver {
        object: ObjectId,
        new: NewMover,
        reply: Reply<Result<(), LiveError>>,
    },
    Move {
        moves: Vec<(ObjectId, Sent)>,
        reply: Reply<Vec<Result<Moved, LiveError>>>,
    },
    Destroy {
        object: ObjectId,
        reply: Reply<()>,
    },
    Door {
        revision: Revision,
        door: Door,
        /// Whoever moves it.
        who: Token,
        /// When it is kept.
        reply: Reply<Result<(), LiveError>>,
    },
    /// How a door stands.
    IsOpen {
        door: ObjectId,
        reply: Reply<bool>,
    },
    /// Whatever outlived the server is back.
    Ready {
        reply: Reply<()>,
    },
    /// A newer revision, as far as it can be read.
    Newer {
        terrain: Terrain,
        read: Result<Box<Prospect>, ReadError>,
    },
    /// The movers of the scene that stay, as they were kept.
    Kept(Vec<(ObjectId, Token, NewMover)>),
    /// Another node that has the same revision says something.
    Heard {
        revision: Revision,
        said: Box<Said>,
    },
    /// What closed doors hide from a cell that was asked about, if that can be said.
    Screen {
        revision: Revision,
        screen: Result<Option<Screen>, ReadError>,
    },
}

impl Message {
    /// Whether a session or a mover begins with it.
    pub(super) fn comes_in(&self) -> bool {
        matches!(self, Self::Step(Step::Enter(_)) | Self::Create { .. })
    }

    /// Whether nobody waits any more for what begins with it.
    pub(super) fn is_forsaken(&self) -> bool {
        match self {
            Self::Step(step) => step.is_forsaken(),
            Self::Create { reply, .. } => reply.is_closed(),
            _ => false,
        }
    }
}

/// What one session does, one after the other. Before it stands somewhere it must be known what is seen from there.
#[derive(Debug)]
pub(super) enum Step {
    Enter(Box<Entry>),
    Pose {
        session: SessionId,
        sent: Sent,
        reply: Reply<Result<Seen, LiveError>>,
    },
    Aoi {
        session: SessionId,
        aoi: Aoi,
        reply: Reply<Result<(), LiveError>>,
    },
    Close {
        session: SessionId,
        reply: Reply<()>,
    },
    /// The session goes on at another node, and ends here only.
    PartFrom {
        session: SessionId,
        reply: Reply<()>,
    },
}

/// A session that is opened.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) session: SessionId,
    pub(super) object: ObjectId,
    pub(super) visitor: Visitor,
    pub(super) outbox: Arc<Outbox>,
    pub(super) with_statics: bool,
    pub(super) reply: Reply<Result<(Seen, Ms), LiveError>>,
}

impl Step {
    pub(super) fn session(&self) -> SessionId {
        match self {
            Self::Enter(entry) => entry.session,
            Self::Pose { session, .. }
            | Self::Aoi { session, .. }
            | Self::Close { session, .. }
            | Self::PartFrom { session, .. } => *session,
        }
    }

    /// Whether nobody waits for it any more, and it need not be.
    pub(super) fn is_forsaken(&self) -> bool {
        match self {
            Self::Enter(entry) => entry.reply.is_closed(),
            Self::Pose { reply, .. } => reply.is_closed(),
            Self::Aoi { reply, .. } => reply.is_closed(),
            Self::Close { .. } | Self::PartFrom { .. } => false,
        }
    }
}

/// A way to ask a scene's task. Cheap to clone.
#[derive(Debug, Clone)]
pub(super) struct StageHandle {
    messages: mpsc::Sender<Message>,
    shared: Arc<Shared>,
}

/// What a scene's task and those who ask it both know.
#[derive(Debug)]
struct Shared {
    scene: SceneName,
    counts: Mutex<Counts>,
    /// A reader of one of the sessions has come, gone or missed something since the task looked last.
    readers_changed: Arc<AtomicBool>,
}

impl StageHandle {
    /// A way to ask about a scene, and what is asked.
    pub(super) fn new(scene: SceneName) -> (Self, mpsc::Receiver<Message>) {
        let (messages, inbox) = mpsc::channel(MESSAGES);
        let shared = Arc::new(Shared {
            scene,
            counts: Mutex::default(),
            readers_changed: Arc::default(),
        });
        (Self { messages, shared }, inbox)
    }

    /// The scene.
    pub(super) fn scene(&self) -> &SceneName {
        &self.shared.scene
    }

    /// Has the task look at readers in the next tick.
    pub(super) fn note_readers_changed(&self) {
        self.shared.readers_changed.store(true, Ordering::Release);
    }

    /// Takes note of what there is.
    pub(super) fn count(&self, counts: Counts) {
        *self.lock_counts() = counts;
    }

    /// An outbox for a session of the scene that was taken up so often.
    pub(super) fn outbox(&self, taken: u64) -> Outbox {
        Outbox::new(self.shared.readers_changed.clone(), taken)
    }

    /// Whether a reader may have come, gone or missed something since the last call.
    pub(super) fn take_readers_changed(&self) -> bool {
        self.shared.readers_changed.swap(false, Ordering::AcqRel)
    }

    pub(super) async fn send(&self, message: Message) -> Result<(), LiveError> {
        self.messages.send(message).await.map_err(|_| LiveError::Stopped)
    }

    /// Whether it still takes messages.
    pub(super) fn runs(&self) -> bool {
        !self.messages.is_closed()
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        self.messages.same_channel(&other.messages)
    }

    pub(super) fn counts(&self) -> Counts {
        *self.lock_counts()
    }

    fn lock_counts(&self) -> MutexGuard<'_, Counts> {
        self.shared
            .counts
            .lock()
            .expect("nobody panics while holding this lock")
    }
}
