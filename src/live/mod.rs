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
//! * `moving`: movers move, also those whose home was another node.
//! * `record`: what happens, kept in a file. [`Recording`]: the same read again.
//! * `statics`: infos of objects that do not move, for clients that read no cells.
//! * `keeping`: movers and doors that outlive the server. `ledger`: sessions that do; `together`: how many at once ask for them.
//! * [`nodes`]: the way to other servers that have sessions in the same scenes.
//! * `registry`, `token`: who is where, and who may do what. `newcomer`: who comes in and does not wait for the answer. `door_pace`: how often they may move doors.

mod clock;
mod door_pace;
mod entering;
mod error;
mod ids;
mod keeping;
mod ledger;
mod line;
mod message;
mod moving;
mod newcomer;
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
mod shares;
mod stage;
mod statics;
mod terrain;
mod together;
mod token;

use std::net::IpAddr;
use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use belvedere_live::{
    Ms,
    world::{Counts, Moved, NewMover},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::sync::oneshot;
use tokio_util::sync::CancellationToken;

use self::{
    clock::Clock,
    entering::Turns,
    ids::Ids,
    ledger::Ledger,
    message::{Message, StageHandle},
    newcomer::{Newcomer, Who},
    nodes::{NodeCounts, Nodes},
    registry::Registry,
    token::Signet,
};
pub use self::{
    error::LiveError,
    keeping::worn,
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
    tally: Arc<Tally>,
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
    resyncs: Resyncs<AtomicU64>,
    streams: StreamEnds<AtomicU64>,
    floods: AtomicU64,
    expired: AtomicU64,
    taken_up: AtomicU64,
    unscreened: AtomicU64,
    crowded: AtomicU64,
}

/// Readers that were told everything anew, by why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Resyncs<T> {
    /// They were away or too slow for longer than events are kept.
    pub missed: T,
    /// They said nothing of what they know.
    pub unknown: T,
}

/// Event streams that have ended, by why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StreamEnds<T> {
    /// The connection ended, by whomever.
    pub cut: T,
    /// Another stream of the same session took its place.
    pub replaced: T,
    /// The session ended.
    pub over: T,
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
    /// Readers that were told everything anew.
    pub resyncs: Resyncs<u64>,
    /// Event streams that have ended.
    pub streams: StreamEnds<u64>,
    /// Poses that came too fast.
    pub floods: u64,
    /// Sessions whose lease ran out.
    pub expired: u64,
    /// Sessions that came here when the server that held them was gone.
    pub taken_up: u64,
    /// Questions what closed doors hide that had no answer, since what hides cannot be read.
    pub unscreened: u64,
    /// Sessions and movers that were refused, since their address had its share.
    pub crowded: u64,
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
            tally: Arc::default(),
        }));
        if let Err(error) = live.0.ids.lay_in().await {
            // What is published is served all the same.
            tracing::warn!(
                error = format!("{error:#}"),
                "nobody is let in until the catalogue can be written"
            );
        }
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
        let (resyncs, streams) = (&tally.resyncs, &tally.streams);
        LiveCounts {
            now: self.0.registry.counts(),
            quality: self.0.registry.quality(),
            events: tally.events.load(Ordering::Relaxed),
            at_once: tally.at_once.load(Ordering::Relaxed),
            resyncs: Resyncs {
                missed: resyncs.missed.load(Ordering::Relaxed),
                unknown: resyncs.unknown.load(Ordering::Relaxed),
            },
            streams: StreamEnds {
                cut: streams.cut.load(Ordering::Relaxed),
                replaced: streams.replaced.load(Ordering::Relaxed),
                over: streams.over.load(Ordering::Relaxed),
            },
            floods: tally.floods.load(Ordering::Relaxed),
            expired: tally.expired.load(Ordering::Relaxed),
            taken_up: tally.taken_up.load(Ordering::Relaxed),
            unscreened: tally.unscreened.load(Ordering::Relaxed),
            crowded: tally.crowded.load(Ordering::Relaxed),
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
        from: Option<IpAddr>,
    ) -> Result<(Moved, Token), LiveError> {
        let settings = &self.0.settings;
        if let (true, Some(operator)) = (stays, settings.operator) {
            let shown = token.ok_or(LiveError::NoOperator)?;
            operator.admit(Some(shown), || {
                "the operator, who alone makes persistent movers here".to_owned()
            })?;
        }
        let is_operator = self.is_operator(token);
        let token = token.filter(|_| !is_operator);
        let stage = self.stage(scene);
        let owner = token
            .map(|token| self.0.registry.session_of(&stage, token))
            .transpose()?;
        // The operator answers for itself.
        let from = from.filter(|_| !is_operator);
        // Whoever finds no room takes no id.
        self.count_crowded(self.0.registry.check_movers(stays, from, settings))?;
        let object = self.0.ids.draw().await?;
        let token = self
            .0
            .registry
            .new_mover(&stage, (object, token), stays, from, settings);
        let token = self.count_crowded(token)?;
        let mut newcomer = Newcomer::new(self, &stage, Who::Mover(object, stays.then_some(token)));
        let kept = stays.then(|| new.clone());
        let message = |reply| Message::Create {
            object,
            owner,
            new,
            stays,
            reply,
        };
        let moved = newcomer.heed(ask(&stage, message).await?)?;
        if let Some(new) = kept {
            let kept = keeping::keep_mover(&self.0.sources.catalogue, scene, (object, token), &new).await;
            if !kept.map_err(LiveError::Unkept)? {
                let cause = anyhow::anyhow!("the id {object} was drawn twice, or the scene was removed meanwhile");
                return Err(LiveError::Unkept(cause));
            }
        }
        newcomer.stay();
        Ok((moved, token))
    }

    /// Counts whoever is refused since its address has its share.
    fn count_crowded<T>(&self, entered: Result<T, LiveError>) -> Result<T, LiveError> {
        if matches!(entered, Err(LiveError::Crowded { .. })) {
            self.0.tally.crowded.fetch_add(1, Ordering::Relaxed);
        }
        entered
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
