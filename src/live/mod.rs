//! Who is in a scene right now, and how do they hear of each other?
//!
//! One task owns each scene that has visitors ([`stage`]); it feeds the pure rules of `belvedere-live` with what comes in
//! and with the time, and puts what they say into one [`outbox::Outbox`] for each session. Whoever wants something of a scene
//! sends its task a message over a bounded channel and waits for the answer. What the rules need of the scene is read
//! from what was published, as a client reads it.
//!
//! * [`Live`]: the front door: finds the scene of a mover, and checks tokens. [`SessionHandle`]: what the holder of a session may
//!   ask. `entering`: how it comes by one, also after the server was gone that held it.
//! * `stage`: the task that owns a scene; `message`: how it is asked. `terrain`: what it reads of the published scene.
//! * `outbox`: what a session has not heard yet, bounded however slow its reader; `poses`: written once for all of them.
//!   `reader`: the stream that a session hears; `line`: how it is told without being woken; `sending`: many lines at once.
//! * `screens`: what closed doors hide from a cell, proved beside that task.
//! * `record`: what happens, kept in a file. [`Recording`]: the same read again.
//! * `statics`: infos of objects that do not move, for clients that read no cells.
//! * `keeping`: movers and doors that outlive the server. `ledger`: sessions that do; `together`: how many at once ask for them.
//! * [`nodes`]: the way to other servers that have sessions in the same scenes.
//! * `registry`, `token`: who is where, and who may do what. `door_pace`: how often they may move doors.

mod clock;
mod door_pace;
mod entering;
mod error;
mod ids;
mod keeping;
mod ledger;
mod line;
mod message;
pub mod nodes;
mod outbox;
mod poses;
mod quality;
mod reader;
mod record;
mod registry;
mod screens;
mod sending;
mod session;
mod settings;
mod stage;
mod statics;
mod terrain;
mod together;
mod token;

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use belvedere_live::{
    Ms,
    world::{Counts, Moved, NewMover, Refusal, Sent},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::sync::oneshot;
use tokio_util::sync::CancellationToken;

use self::{
    clock::Clock,
    entering::Turns,
    ids::Ids,
    keeping::Undo,
    ledger::Ledger,
    message::{Message, StageHandle},
    nodes::{NodeCounts, Nodes},
    registry::Registry,
    token::Signet,
};
pub use self::{
    error::LiveError,
    line::{Held, Line, Taken, Turn},
    quality::{NoShare, Quality},
    reader::{EventReader, Shortcut},
    record::{Block, Recorder, Recording, RecordingError},
    registry::{Door, Opened},
    session::SessionHandle,
    settings::LiveSettings,
    token::{NotAToken, Token},
};
use crate::{db::Catalogue, published::Publications};

/// Everything live. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Live(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    sources: Sources,
    settings: LiveSettings,
    registry: Registry,
    ids: Ids,
    signet: Signet,
    ledger: Ledger,
    turns: Turns,
    clock: Clock,
    stopping: CancellationToken,
    tally: Tally,
}

/// What live sessions read and write.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The scenes.
    pub publications: Publications,
    /// Where sessions and movers are kept that outlive the server.
    pub catalogue: Catalogue,
    /// What happens is recorded, if there is a recorder.
    pub recorder: Option<Recorder>,
    /// Other servers with sessions in the same scenes, if there may be some.
    pub nodes: Option<Nodes>,
}

/// What has been counted since the start.
#[derive(Debug, Default)]
struct Tally {
    events: AtomicU64,
    at_once: AtomicU64,
    resyncs: AtomicU64,
    floods: AtomicU64,
    expired: AtomicU64,
    taken_up: AtomicU64,
}

/// What there is, and what has been counted since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LiveCounts {
    /// Now.
    pub now: Counts,
    /// Events put into outboxes.
    pub events: u64,
    /// Events written into connections without waking the tasks that own them.
    pub at_once: u64,
    /// Readers that had missed too much.
    pub resyncs: u64,
    /// Poses that came too fast.
    pub floods: u64,
    /// Sessions whose lease ran out.
    pub expired: u64,
    /// Sessions that came here when the server that held them was gone.
    pub taken_up: u64,
    /// What participants see of what there is to see, as far as they say it.
    pub quality: Quality,
    /// How it stands with other nodes, where there may be some.
    pub nodes: Option<NodeCounts>,
}

impl Live {
    /// Nobody is there yet. Streams end when `stopping` is cancelled.
    ///
    /// # Errors
    /// When the catalogue cannot be read, or the system gives no random numbers.
    pub async fn new(sources: Sources, settings: LiveSettings, stopping: CancellationToken) -> anyhow::Result<Self> {
        let live = Self(Arc::new(Inner {
            ids: Ids::new(sources.catalogue.clone()),
            signet: Signet::of(&sources.catalogue).await?,
            ledger: Ledger::new(sources.catalogue.clone(), sources.nodes.clone())?,
            turns: Turns::default(),
            sources,
            settings,
            registry: Registry::default(),
            clock: Clock::start(),
            stopping: stopping.clone(),
            tally: Tally::default(),
        }));
        tokio::spawn(stopping.run_until_cancelled_owned(ledger::keep(live.clone())));
        Ok(live)
    }

    /// Brings back whatever outlived the server, but of scenes that cannot be read: theirs comes back with them.
    ///
    /// # Errors
    /// When the catalogue cannot be read.
    pub async fn restore(&self) -> anyhow::Result<()> {
        let Sources {
            catalogue,
            publications,
            ..
        } = &self.0.sources;
        for scene in catalogue.scenes_with_kept().await? {
            if publications.scene(&scene).is_some()
                && let Err(error) = ask(&self.stage(&scene), |reply| Message::Ready { reply }).await
            {
                tracing::warn!(%scene, %error, "what was kept of the scene is not back; it comes when the scene can be read");
            }
        }
        Ok(())
    }

    /// The server stops: its sessions may go on elsewhere.
    pub async fn leave(&self) {
        self.0.ledger.close().await;
    }

    /// What there is.
    #[must_use]
    pub fn counts(&self) -> LiveCounts {
        let tally = &self.0.tally;
        LiveCounts {
            now: self.0.registry.counts(),
            quality: self.0.registry.quality(),
            events: tally.events.load(Ordering::Relaxed),
            at_once: tally.at_once.load(Ordering::Relaxed),
            resyncs: tally.resyncs.load(Ordering::Relaxed),
            floods: tally.floods.load(Ordering::Relaxed),
            expired: tally.expired.load(Ordering::Relaxed),
            taken_up: tally.taken_up.load(Ordering::Relaxed),
            nodes: self.0.sources.nodes.as_ref().map(Nodes::counts),
        }
    }

    /// Server time: Unix milliseconds, those of every event.
    #[must_use]
    pub fn now_ms(&self) -> Ms {
        self.0.clock.now_ms()
    }

    /// The task of a scene, started when nobody was there.
    fn stage(&self, scene: &SceneName) -> StageHandle {
        self.0
            .registry
            .stage(scene, || stage::start(self.clone(), scene.clone()))
    }

    /// Adds a program-driven mover, which outlives the server if it `stays`. Who shows a session's token drives it through
    /// that session. Where there is an operator, only movers of the operator stay.
    ///
    /// # Errors
    /// When there is no room, the token is not the operator's where it must be, or the rules refuse it.
    pub async fn create(
        &self,
        scene: &SceneName,
        new: NewMover,
        stays: bool,
        token: Option<Token>,
    ) -> Result<(Moved, Token), LiveError> {
        let settings = &self.0.settings;
        if let (true, Some(operator)) = (stays, settings.operator) {
            operator.admit(token, || {
                "the operator, who alone makes persistent movers here".to_owned()
            })?;
        }
        let token = token.filter(|_| !self.is_operator(token));
        let stage = self.stage(scene);
        let owner = token
            .map(|token| self.0.registry.session_of(&stage, token))
            .transpose()?;
        let object = self.0.ids.draw().await?;
        let (token, reserved) = self.0.registry.new_mover(&stage, (object, token), stays, settings)?;
        let kept = stays.then(|| new.clone());
        let message = |reply| Message::Create {
            object,
            owner,
            new,
            stays,
            reply,
        };
        let moved = ask(&stage, message).await??;
        if let Some(new) = kept {
            let undo = Undo::of(&self.0.sources.catalogue, &stage, (object, token));
            let kept = keeping::keep_mover(&self.0.sources.catalogue, scene, (object, token), &new).await;
            if !kept.map_err(LiveError::Unkept)? {
                return Err(LiveError::Unkept(anyhow::anyhow!("the id {object} was drawn twice")));
            }
            undo.forget();
        }
        reserved.keep();
        Ok((moved, token))
    }

    /// Moves a mover, for whoever has its token.
    ///
    /// # Errors
    /// When there is none, the token is not its own, or the rules refuse it.
    pub async fn move_to(&self, object: ObjectId, token: Option<Token>, sent: Sent) -> Result<Moved, LiveError> {
        let moved = self.try_move(object, token, sent).await;
        // It may have gone to another node between two steps, and comes back from there.
        let gone = self.0.sources.nodes.is_some() && matches!(moved, Err(LiveError::Refused(Refusal::NoMover)));
        if gone {
            self.try_move(object, token, sent).await
        } else {
            moved
        }
    }

    async fn try_move(&self, object: ObjectId, token: Option<Token>, sent: Sent) -> Result<Moved, LiveError> {
        let stage = self.mover(object, token).await?;
        let moves = vec![(object, sent)];
        let mut moved = ask(&stage, |reply| Message::Move { moves, reply }).await?;
        moved.pop().unwrap_or(Err(LiveError::Stopped))
    }

    /// Moves many movers of one scene. The answers are in the order of the moves.
    ///
    /// # Errors
    /// When the scene's task does not answer; else each move has its own.
    pub async fn move_all(
        &self,
        scene: &SceneName,
        moves: Vec<(ObjectId, Option<Token>, Sent)>,
    ) -> Result<Vec<Result<Moved, LiveError>>, LiveError> {
        let stage = self.stage(scene);
        let mut answers = Vec::with_capacity(moves.len());
        let mut admitted = Vec::with_capacity(moves.len());
        for (object, token, sent) in moves {
            let here = self.mover(object, token).await.and_then(|theirs| {
                let ours = theirs.is(&stage);
                ours.then_some(())
                    .ok_or_else(|| LiveError::NotFound(format!("mover {object} in scene `{scene}`")))
            });
            if here.is_ok() {
                admitted.push((object, sent));
            }
            answers.push(here);
        }
        let mut moved = ask(&stage, |reply| Message::Move { moves: admitted, reply })
            .await?
            .into_iter();
        let answer =
            |admitted: Result<(), LiveError>| admitted.and_then(|()| moved.next().unwrap_or(Err(LiveError::Stopped)));
        Ok(answers.into_iter().map(answer).collect())
    }

    /// The scene of a mover, for whoever has its token. One that stays, and has its home on another node, gets it here.
    async fn mover(&self, object: ObjectId, token: Option<Token>) -> Result<StageHandle, LiveError> {
        let Sources { catalogue, nodes, .. } = &self.0.sources;
        let found = self.0.registry.mover(object, token);
        if nodes.is_none() || !matches!(found, Err(LiveError::NotFound(_))) {
            return found;
        }
        let kept = keeping::kept_mover(catalogue, object).await;
        let Some((scene, own, new)) = kept.map_err(LiveError::Unkept)? else {
            return found;
        };
        own.admit(token, || format!("mover {object}"))?;
        let stage = self.stage(&scene);
        ask(&stage, |reply| Message::TakeOver { object, new, reply }).await??;
        self.0.registry.restore_mover(&stage, object, own);
        self.0.registry.mover(object, token)
    }

    fn is_operator(&self, token: Option<Token>) -> bool {
        token.is_some() && token == self.0.settings.operator
    }

    /// Removes a mover, for whoever has its token, and for the operator.
    ///
    /// # Errors
    /// When there is none, or the token is not its own.
    pub async fn destroy(&self, object: ObjectId, token: Option<Token>) -> Result<(), LiveError> {
        let stage = if self.is_operator(token) {
            self.0.registry.scene_of(object)?
        } else {
            self.mover(object, token).await?
        };
        if let Some(token) = self.0.registry.kept_token(object) {
            let forgotten = self.0.sources.catalogue.forget_mover(object, &token.reveal()).await;
            forgotten.map_err(LiveError::Unkept)?;
        }
        ask(&stage, |reply| Message::Destroy { object, reply }).await?;
        self.0.registry.end_mover(object);
        Ok(())
    }

    /// Whether a door is open.
    ///
    /// # Errors
    /// When the scene's task does not answer.
    pub async fn door_is_open(&self, scene: &SceneName, door: ObjectId) -> Result<bool, LiveError> {
        ask(&self.stage(scene), |reply| Message::IsOpen { door, reply }).await
    }

    /// Opens or closes a door of a revision, for whoever has a token of the scene.
    ///
    /// # Errors
    /// When the token is none of the scene's or moves doors too often, or how the door stands cannot be kept.
    pub async fn set_door(
        &self,
        scene: &SceneName,
        revision: Revision,
        door: Door,
        token: Option<Token>,
    ) -> Result<(), LiveError> {
        let stage = self.stage(scene);
        let who = self.0.registry.anybody(&stage, token)?;
        let message = |reply| Message::Door {
            revision,
            door,
            who,
            reply,
        };
        ask(&stage, message).await?
    }
}

/// Asks the task of a scene and waits for its answer.
async fn ask<T>(stage: &StageHandle, message: impl FnOnce(oneshot::Sender<T>) -> Message) -> Result<T, LiveError> {
    let (reply, answer) = oneshot::channel();
    stage.send(message(reply)).await?;
    answer.await.map_err(|_| LiveError::Stopped)
}
