//! The task that owns a scene: the only one that touches its rules.
//!
//! It takes messages, ticks, follows new revisions and ends leases. Poses that come too fast are refused, and the newest
//! of them is taken in the next tick. What moves when nothing was told for a tick is told at once. What changes the
//! rules' world goes through its [`Journal`], so that all of it can be recorded.

mod abroad;
mod deliver;
mod ground;
mod tick;

use std::{
    collections::BTreeMap,
    sync::{Arc, atomic::Ordering},
    time::Instant,
};

use belvedere_live::{
    Ms,
    event::{Event, Hello, SessionId},
    journal::Journal,
    motion::LONGEST_EXTRAPOLATION_MS,
    pace::Bucket,
    world::{Moved, Seen, Sent, Visitor},
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::{
    sync::{mpsc, watch},
    time::MissedTickBehavior,
};

use self::abroad::Abroad;
use super::{
    Live, LiveError,
    door_pace::DoorPace,
    ids::avatar_of,
    keeping::{DoorToKeep, Keeping},
    message::{Message, StageHandle},
    outbox::Outbox,
    statics::{self, View},
    terrain::Terrain,
};

/// Poses a session may send at once, and a second.
const POSES: (f64, f64) = (60.0, 60.0);

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
        late: BTreeMap::new(),
        unreadable: None,
        proving: false,
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
                    stage.take(message).await;
                    // What comes together is told together.
                    if inbox.is_empty() && stage.hurries() {
                        stage.tick(handle).await;
                        ticks.reset();
                    }
                }
                None => return Ok(()),
            },
            _ = ticks.tick(), if !stage.world.is_empty() => stage.tick(handle).await,
            _ = rounds.tick(), if stage.abroad.is_some() => stage.exchange(handle).await,
        }
        stage.find_screens(handle);
        stage.deliver().await;
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
    /// The newest of the poses of each session that came too fast.
    late: BTreeMap<SessionId, Sent>,
    /// A newer revision that could not be read.
    unreadable: Option<Revision>,
    /// Somebody is finding out what closed doors hide.
    proving: bool,
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
    view: Option<watch::Sender<View>>,
    /// What the rules know of whether somebody listens.
    listens: bool,
    /// And of whether somebody hears at once.
    wakeable: bool,
    /// Where it stands, or how far it looks, has changed since that was kept.
    moved: bool,
}

impl Stage {
    async fn take(&mut self, message: Message) {
        // Whoever has stopped waiting for an answer needs none, and has nothing.
        match message {
            Message::Open {
                session,
                object,
                visitor,
                outbox,
                with_statics,
                reply,
            } => {
                let opened = self.open((session, object), visitor, outbox, with_statics).await;
                if reply.send(opened).is_err() {
                    self.close(session);
                }
            }
            Message::Pose { session, sent, reply } => _ = reply.send(self.pose(session, sent).await),
            Message::Aoi { session, aoi, reply } => {
                let set = self.world.set_aoi(session, aoi, self.live.now_ms());
                self.has_moved(session);
                self.show_statics(session, false);
                _ = reply.send(set.map_err(LiveError::from));
            }
            Message::Close { session, reply } => {
                self.close(session);
                _ = reply.send(());
            }
            Message::PartFrom { session, reply } => {
                self.part_from(session);
                _ = reply.send(());
            }
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
                if reply.send(created.map_err(LiveError::from)).is_err() {
                    self.forget(object);
                    self.world.destroy(object, self.live.now_ms());
                }
            }
            Message::TakeOver { object, new, reply } => _ = reply.send(self.take_over(object, new)),
            Message::Move { moves, reply } => {
                let moved = moves.into_iter().map(|(object, sent)| self.move_to(object, sent));
                _ = reply.send(moved.collect());
            }
            Message::Destroy { object, reply } => {
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
                let now_ms = self.live.now_ms();
                if let Err(retry_ms) = self.door_pace.take(who, door.object, now_ms) {
                    _ = reply.send(Err(LiveError::Rattled { retry_ms }));
                    return;
                }
                self.world.set_door(door.object, &door.bounds, door.open, now_ms);
                self.show_statics_to_all(false);
                if let Some(abroad) = &mut self.abroad {
                    abroad.exchange.set_door(door.object, &door.bounds, door.open);
                }
                self.keeping.keep_door(DoorToKeep { revision, door, reply }).await;
            }
            Message::IsOpen { door, reply } => _ = reply.send(self.world.is_open(door)),
            Message::Ready { reply } => _ = reply.send(()),
            Message::Heard { revision, said } => self.hear(revision, *said),
            Message::Screen(screen) => self.screen(&screen),
            Message::ScreensFound => self.proving = false,
        }
    }

    fn move_to(&mut self, object: ObjectId, sent: Sent) -> Result<Moved, LiveError> {
        let moved = self.world.move_to(object, sent, self.live.now_ms())?;
        self.moved = true;
        self.keeping.moved(object, sent);
        Ok(moved)
    }

    async fn open(
        &mut self,
        (session, object): (SessionId, ObjectId),
        visitor: Visitor,
        outbox: Arc<Outbox>,
        with_statics: bool,
    ) -> Result<(Seen, Ms), LiveError> {
        let (position, aoi) = (visitor.pose.position, visitor.aoi);
        // Until a stream is opened nobody does.
        let visitor = Visitor {
            listens: false,
            ..visitor
        };
        self.learn(self.world.unknown_at(position, visitor.max_speed_mps))
            .await?;
        let now_ms = self.live.now_ms();
        self.adopt(object);
        let seen = self.world.open(session, object, visitor, now_ms)?;
        if let Some(hello) = self.hello(session) {
            outbox.push(&hello);
        }
        let view = with_statics.then(|| {
            let (view, seen) = watch::channel(View {
                published: self.terrain.published.clone(),
                closed: self.world.closed(),
                position,
                enter_m: aoi.enter_m,
                round: 0,
            });
            let (outbox, stopping) = (outbox.clone(), self.live.0.stopping.clone());
            tokio::spawn(async move { stopping.run_until_cancelled(statics::tell(seen, outbox)).await });
            view
        });
        let person = Person {
            outbox,
            poses: Bucket::full(POSES.0, POSES.1, now_ms),
            view,
            listens: false,
            wakeable: false,
            moved: false,
        };
        self.people.insert(session, person);
        Ok((seen, now_ms))
    }

    /// What a session is told first.
    fn hello(&self, session: SessionId) -> Option<Event> {
        let settings = &self.live.0.settings;
        Some(Event::Hello(Hello {
            session,
            object: avatar_of(session)?,
            scene: self.scene.clone(),
            revision: self.terrain.published.pointer.revision,
            cell: self.world.place_of(session).ok()?.cell,
            now_ms: self.live.now_ms(),
            tick_ms: settings.tick.as_millis() as Ms,
            lease_ms: settings.lease.as_millis() as Ms,
            extrapolate_ms: LONGEST_EXTRAPOLATION_MS,
            network: self.network(),
        }))
    }

    async fn pose(&mut self, session: SessionId, sent: Sent) -> Result<Seen, LiveError> {
        let now_ms = self.live.now_ms();
        if let Some(person) = self.people.get_mut(&session) {
            person.outbox.sign();
            if !person.poses.take(1.0, now_ms) {
                self.late.insert(session, sent);
                self.live.0.tally.floods.fetch_add(1, Ordering::Relaxed);
                let retry_ms = person.poses.wait_ms(1.0);
                return Err(LiveError::Flooded { retry_ms });
            }
            self.late.remove(&session);
        }
        self.apply(session, sent).await
    }

    async fn apply(&mut self, session: SessionId, sent: Sent) -> Result<Seen, LiveError> {
        self.learn(self.world.unknown_to(session, sent.position)).await?;
        let seen = self.world.pose(session, sent, self.live.now_ms())?;
        self.moved = true;
        self.has_moved(session);
        self.show_statics(session, false);
        Ok(seen)
    }

    fn has_moved(&mut self, session: SessionId) {
        if let Some(person) = self.people.get_mut(&session) {
            person.moved = true;
        }
    }

    fn show_statics_to_all(&mut self, anew: bool) {
        let sessions: Vec<_> = self.people.keys().copied().collect();
        sessions
            .into_iter()
            .for_each(|session| self.show_statics(session, anew));
    }

    fn show_statics(&mut self, session: SessionId, anew: bool) {
        let Some(view) = self.people.get(&session).and_then(|person| person.view.as_ref()) else {
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

    /// A session ends.
    fn close(&mut self, session: SessionId) {
        self.live.0.ledger.end(session);
        self.part_from(session);
    }

    /// A session is here no more.
    fn part_from(&mut self, session: SessionId) {
        self.world.close(session, self.live.now_ms());
        self.people.remove(&session);
        self.late.remove(&session);
        self.live.0.registry.end_session(session);
    }
}
