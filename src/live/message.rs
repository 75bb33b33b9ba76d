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

use super::{LiveError, outbox::Outbox, registry::Door, screens::Screen, token::Token};

/// So many messages may wait for a scene.
const MESSAGES: usize = 1024;

pub(super) type Reply<T> = oneshot::Sender<T>;

/// What a scene's task can be asked.
#[derive(Debug)]
pub(super) enum Message {
    Open {
        session: SessionId,
        object: ObjectId,
        visitor: Visitor,
        outbox: Arc<Outbox>,
        with_statics: bool,
        reply: Reply<Result<(Seen, Ms), LiveError>>,
    },
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
    /// Another node that has the same revision says something.
    Heard {
        revision: Revision,
        said: Box<Said>,
    },
    /// What closed doors hide from a cell.
    Screen(Screen),
    /// All questions that were asked are answered.
    ScreensFound,
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
