//! The task that owns a scene: the only one that touches its rules.
//!
//! It takes messages, ticks, follows new revisions and ends leases. Poses that come too fast are refused, and the newest
//! of them is taken in the next tick. What moves when nothing was told for a tick is told at once. What changes the
//! rules' world goes through its [`Journal`], so that all of it can be recorded. Once it runs it waits for neither store nor
//! catalogue: what it needs from there is read beside it and comes in as a message.

mod abroad;
mod deliver;
mod ground;
mod steps;
mod tick;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Instant,
};

use belvedere_live::{
    event::SessionId,
    journal::Journal,
    pace::Bucket,
    world::{Moved, Sent},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::{
    sync::{mpsc, watch},
    time::MissedTickBehavior,
};

use self::{abroad::Abroad, steps::Waiting};
use super::{
    Live, LiveError, Token,
    door_pace::DoorPace,
    keeping::{DoorToKeep, Keeping},
    message::{Message, StageHandle, Step},
    outbox::Outbox,
    screens,
    statics::View,
    terrain::Terrain,
};

/// Starts the task of a scene.
pub(super) fn start(live: Live, scene: SceneName) -> StageHandle {
    let (handle, inbox) = StageHandle::new(scene.clone());
    let ours = handle.clone();
    tokio::spawn(async move {
        let stopping = live.0.stopping.clone();
        let ended = stopping.run_until_cancelled(run(&live, &scene, &ours, inbox)).await;
        if let Some(Err(error)) = ended {
            tracing::error!(%scene, %error, "the live part of a scene has ended");
        }
        live.0.registry.end_stage(&ours);
    });
    handle
}

async fn run(
    live: &Live,
    scene: &SceneName,
    handle: &StageHandle,
    mut inbox: mpsc::Receiver<Message>,
) -> Result<(), LiveError> {
    let missing = || LiveError::NotFound(format!("scene `{scene}`"));
    let terrain = Terrain {
        published: live.0.sources.publications.scene(scene).ok_or_else(missing)?,
    };
    let (ground, rules) = (terrain.ground().await?, live.0.settings.rules());
    let records = live.0.sources.recorder.is_some();
    let mut stage = Stage {
        world: Journal::begin(scene.clone(), &ground, rules, records, live.now_ms()),
        live: live.clone(),
        scene: scene.clone(),
        terrain,
        people: BTreeMap::new(),
        views: BTreeMap::new(),
        late: BTreeMap::new(),
        waiting: Waiting::new(),
        learning_ahead: false,
        unreadable: None,
        following: false,
        outside: Vec::new(),
        doors_to_come: Vec::new(),
        destroyed: None,
        proving: false,
        no_screens: screens::Unreadable::default(),
        ticked: false,
        moved: false,
        told_at: Instant::now(),
        people_counted: Instant::now(),
        movers_counted: Instant::now(),
        stands_kept: Instant::now(),
        keeping: Keeping::new(&live.0.sources.catalogue, scene),
        door_pace: DoorPace::default(),
        abroad: None,
    };
    stage.abroad = Abroad::begin(live, &stage.scene, &stage.terrain, handle);
    stage.restore(handle).await;
    let mut ticks = tokio::time::interval(live.0.settings.tick);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut rounds = tokio::time::interval(live.0.settings.tick / abroad::ROUNDS);
    rounds.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            message = inbox.recv() => match message {
                Some(message) => {
                    stage.take(message, handle).await;
                    for message in stage.let_in() {
                        stage.take(message, handle).await;
                    }
                    // What comes together is told together.
                    if inbox.is_empty() && stage.hurries() {
                        stage.tick(handle).await;
                        ticks.reset();
                    }
                }
                None => return Ok(()),
            },
            _ = ticks.tick(), if !stage.world.is_empty() => stage.tick(handle).await,
            _ = rounds.tick(), if stage.abroad.is_some() => stage.exchange(handle),
        }
        stage.find_screens(handle);
        stage.deliver().await;
        if stage.ticked {
            stage.let_statics_go();
        }
        stage.record().await;
        handle.count(stage.world.counts());
    }
}

struct Stage {
    live: Live,
    scene: SceneName,
    terrain: Terrain,
    world: Journal,
    people: BTreeMap<SessionId, Person>,
    /// From where those look who are told of what does not move.
    views: BTreeMap<SessionId, watch::Sender<View>>,
    /// The newest of the poses of each session that came too fast.
    late: BTreeMap<SessionId, Sent>,
    waiting: Waiting,
    /// Somebody reads what is seen from cells that people are on their way to.
    learning_ahead: bool,
    /// A newer revision that could not be read, and when that was tried.
    unreadable: Option<(Revision, Instant)>,
    /// Somebody is reading a newer revision.
    following: bool,
    /// Who comes in, and waits for that one.
    outside: Vec<Message>,
    /// Doors of that one, and who moves them.
    doors_to_come: Vec<(DoorToKeep, Token)>,
    /// While somebody reads which movers were kept: those that were destroyed meanwhile.
    destroyed: Option<BTreeSet<ObjectId>>,
    /// Somebody is finding out what closed doors hide.
    proving: bool,
    /// What cannot be read for that.
    no_screens: screens::Unreadable,
    /// Something has been written for which a tick has passed.
    ticked: bool,
    /// Somebody has moved since the last tick.
    moved: bool,
    /// When something was told last, or might have been told at once.
    told_at: Instant,
    /// When silent sessions were looked for.
    people_counted: Instant,
    /// When silent movers were looked for.
    movers_counted: Instant,
    /// When it was kept where people stand.
    stands_kept: Instant,
    keeping: Keeping,
    door_pace: DoorPace,
    /// Other nodes, where there may be some.
    abroad: Option<Abroad>,
}

/// What the task keeps of a session beside the rules.
struct Person {
    outbox: Arc<Outbox>,
    poses: Bucket,
    /// What the rules know of whether somebody listens.
    listens: bool,
    /// And of whether somebody hears at once.
    wakeable: bool,
    /// Where it stands, or how far it looks, has changed since that was kept.
    moved: bool,
}

impl Stage {
    async fn take(&mut self, message: Message, handle: &StageHandle) {
        if message.comes_in() && self.is_outdated(handle) {
            self.outside.retain(|waiting| !waiting.is_forsaken());
            self.outside.push(message);
            return;
        }
        // Whoever has stopped waiting for an answer needs none; a newcomer says itself that it goes.
        match message {
            Message::Step(Step::Pose { session, sent, reply }) => self.pose(session, sent, reply, handle),
            Message::Step(step) => self.step(step, handle),
            Message::Learned {
                published,
                sights,
                step,
            } => self.learned(&published, sights, step, handle),
            Message::Create {
                object,
                owner,
                new,
                stays,
                reply,
            } => {
                let created = self.world.create(object, owner, new, self.live.now_ms());
                if stays && created.is_ok() {
                    self.stay(object);
                }
                _ = reply.send(created.map_err(LiveError::from));
            }
            Message::TakeOver { object, new, reply } => _ = reply.send(self.take_over(object, new)),
            Message::Move { moves, reply } => {
                let moved = moves.into_iter().map(|(object, sent)| self.move_to(object, sent));
                _ = reply.send(moved.collect());
            }
            Message::Destroy { object, reply } => {
                if let Some(destroyed) = &mut self.destroyed {
                    destroyed.insert(object);
                }
                self.forget(object);
                self.world.destroy(object, self.live.now_ms());
                _ = reply.send(());
            }
            Message::Door {
                revision,
                door,
                who,
                reply,
            } => {
                self.move_door(DoorToKeep { revision, door, reply }, who, handle);
            }
            Message::IsOpen { door, reply } => _ = reply.send(self.world.is_open(door)),
            Message::Ready { reply } => _ = reply.send(()),
            Message::Newer { terrain, read } => self.go_on(terrain, read, handle).await,
            Message::Kept(movers) => {
                let destroyed = self.destroyed.take().unwrap_or_default();
                let there = movers.into_iter().filter(|(object, ..)| !destroyed.contains(object));
                self.put_back(there.collect(), handle);
            }
            Message::Heard { revision, said } => self.hear(revision, *said),
            Message::Screen { revision, screen } => self.screen(revision, screen),
        }
    }

    fn move_to(&mut self, object: ObjectId, sent: Sent) -> Result<Moved, LiveError> {
        let moved = self.world.move_to(object, sent, self.live.now_ms())?;
        self.moved = true;
        self.keeping.moved(object, sent);
        Ok(moved)
    }

    /// Moves a door, as soon as it is one of the revision that visitors are in.
    fn move_door(&mut self, asked: DoorToKeep, who: Token, handle: &StageHandle) {
        let current = self.terrain.published.pointer.revision;
        if asked.revision == current {
            self.set_door(asked, who);
        } else if self.follow(handle) {
            self.doors_to_come.retain(|(asked, _)| !asked.reply.is_closed());
            self.doors_to_come.push((asked, who));
        } else {
            _ = asked.reply.send(Err(if self.is_unreadable(asked.revision) {
                LiveError::Unreadable
            } else {
                LiveError::Moved { current }
            }));
        }
    }

    /// Moves a door of this revision, unless that cannot be kept.
    fn set_door(&mut self, asked: DoorToKeep, who: Token) {
        let (door, now_ms) = (asked.door, self.live.now_ms());
        let Some(place) = self.keeping.place_for_door() else {
            _ = asked.reply.send(Err(LiveError::Behind));
            return;
        };
        if let Err(retry_ms) = self.door_pace.take(who, door.object, now_ms) {
            _ = asked.reply.send(Err(LiveError::Rattled { retry_ms }));
            return;
        }
        place.send(asked);
        self.world.set_door(door.object, &door.bounds, door.open, now_ms);
        self.show_statics_to_all();
        if let Some(abroad) = &mut self.abroad {
            abroad.exchange.set_door(door.object, &door.bounds, door.open);
        }
    }

    fn has_moved(&mut self, session: SessionId) {
        if let Some(person) = self.people.get_mut(&session) {
            person.moved = true;
        }
    }

    fn show_statics_to_all(&mut self) {
        let sessions: Vec<_> = self.views.keys().copied().collect();
        sessions
            .into_iter()
            .for_each(|session| self.show_statics(session, false));
    }

    fn show_statics(&mut self, session: SessionId, anew: bool) {
        let Some(view) = self.views.get(&session) else {
            return;
        };
        if let Some((position, aoi)) = self.world.standpoint(session) {
            view.send_modify(|view| {
                view.position = position;
                view.enter_m = aoi.enter_m;
                view.published = self.terrain.published.clone();
                view.closed = self.world.closed();
                view.round += u64::from(anew);
            });
        }
    }

    /// Has those told of what does not move who have been told of all who do.
    fn let_statics_go(&self) {
        for session in self.views.keys() {
            if let Some(person) = self.people.get(session) {
                let free = person.listens && self.world.is_informed(*session);
                person.outbox.let_aside_go(free);
            }
        }
    }

    /// A session ends.
    fn close(&mut self, session: SessionId) {
        self.live.0.ledger.end(session);
        self.part_from(session);
    }

    /// A session is here no more.
    fn part_from(&mut self, session: SessionId) {
        self.live.0.ledger.part(session);
        self.world.close(session, self.live.now_ms());
        self.people.remove(&session);
        self.views.remove(&session);
        self.late.remove(&session);
        self.live.0.registry.end_session(session);
    }
}
