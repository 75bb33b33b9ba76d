//! How does a session come to stand somewhere? The rules must know first what is seen from there. What they do not know yet is read
//! beside the scene's task, which waits for no store; the steps of one session stay in their order.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use belvedere_live::{
    Ms,
    event::{Event, Hello, SessionId},
    motion::LONGEST_EXTRAPOLATION_MS,
    pace::Bucket,
    world::{Seen, Sent, Unknown, Visitor},
};
use tokio::sync::watch;

use super::{Person, Stage};
use crate::{
    live::{
        LiveError,
        ids::avatar_of,
        message::{Entry, Message, Reply, StageHandle, Step},
        statics::{self, View},
        terrain::Sight,
    },
    published::{Published, ReadError},
};

/// Poses a session may send at once, and a second.
const POSES: (f64, f64) = (60.0, 60.0);

/// What could not be read of what lies ahead is tried again after so long.
const LOOK_AGAIN: Duration = Duration::from_secs(5);

/// For each session of which a step is looked up, those that come after it.
pub(super) type Waiting = BTreeMap<SessionId, VecDeque<Step>>;

impl Stage {
    /// Refuses a pose that comes too fast, and keeps the newest of them.
    pub(super) fn pose(
        &mut self,
        session: SessionId,
        sent: Sent,
        reply: Reply<Result<Seen, LiveError>>,
        handle: &StageHandle,
    ) {
        if let Some(person) = self.people.get_mut(&session) {
            let now_ms = self.live.now_ms();
            person.outbox.sign();
            if !person.poses.take(1.0, now_ms) {
                self.late.insert(session, sent);
                self.live.0.tally.floods.fetch_add(1, Ordering::Relaxed);
                let retry_ms = person.poses.wait_ms(1.0);
                _ = reply.send(Err(LiveError::Flooded { retry_ms }));
                return;
            }
            self.late.remove(&session);
        }
        self.step(Step::Pose { session, sent, reply }, handle);
    }

    /// Takes the newest of the poses that came too fast, of all who wait for no earlier one.
    pub(super) fn step_late(&mut self, handle: &StageHandle) {
        let (waiting, late) = (&self.waiting, &mut self.late);
        let now = late.extract_if(.., |session, _| !waiting.contains_key(session));
        for (session, sent) in now.collect::<Vec<_>>() {
            // It was refused once already; what is wrong with it would have been told then.
            let (reply, _) = tokio::sync::oneshot::channel();
            self.step_at_once(Step::Pose { session, sent, reply }, handle);
        }
    }

    /// Takes a step, after those of its session that wait.
    pub(super) fn step(&mut self, step: Step, handle: &StageHandle) {
        match self.waiting.get_mut(&step.session()) {
            Some(waiting) => {
                // Of whoever has gone away nothing piles up.
                waiting.retain(|step| !step.is_forsaken());
                waiting.push_back(step);
            }
            None => self.step_at_once(step, handle),
        }
    }

    /// Takes a step, or has what is not known of it looked up.
    fn step_at_once(&mut self, step: Step, handle: &StageHandle) {
        let unknown = match &step {
            Step::Enter(entry) => {
                let visitor = &entry.visitor;
                self.world.unknown_at(visitor.pose.position, visitor.max_speed_mps)
            }
            Step::Pose { session, sent, .. } => self.world.unknown_to(*session, sent.position),
            Step::Aoi { .. } | Step::Close { .. } | Step::PartFrom { .. } => Vec::new(),
        };
        if unknown.is_empty() {
            self.take_step(step, handle);
            return;
        }
        self.waiting.entry(step.session()).or_default();
        self.look_up(unknown, Some(step), handle);
    }

    /// Takes a step of which all is known.
    fn take_step(&mut self, step: Step, handle: &StageHandle) {
        match step {
            Step::Enter(entry) => self.enter(*entry, handle),
            Step::Pose { session, sent, reply } => _ = reply.send(self.stand(session, sent)),
            Step::Aoi { session, aoi, reply } => {
                let set = self.world.set_aoi(session, aoi, self.live.now_ms());
                self.has_moved(session);
                self.show_statics(session, false);
                _ = reply.send(set.map_err(LiveError::from));
            }
            Step::Close { session, reply } => {
                self.close(session);
                _ = reply.send(());
            }
            Step::PartFrom { session, reply } => {
                self.part_from(session);
                _ = reply.send(());
            }
        }
    }

    /// Has looked up what is seen from cells that people come to on their way between their poses; until that is known they look
    /// from where they were.
    pub(super) fn learn_ahead(&mut self, handle: &StageHandle) {
        let unknown = self.world.unknown_ahead();
        if !unknown.is_empty() && !self.learning_ahead {
            self.learning_ahead = true;
            self.look_up(unknown, None, handle);
        }
    }

    /// Reads what is seen from cells, beside the scene's task.
    fn look_up(&self, unknown: Unknown, step: Option<Step>, handle: &StageHandle) {
        let (terrain, handle) = (self.terrain.clone(), handle.clone());
        tokio::spawn(async move {
            let sights = terrain.sights(unknown).await;
            if step.is_none() && sights.is_err() {
                tokio::time::sleep(LOOK_AGAIN).await;
            }
            let published = terrain.published;
            // Who has ended takes no steps.
            _ = handle
                .send(Message::Learned {
                    published,
                    sights,
                    step,
                })
                .await;
        });
    }

    /// What was not known of a step, or of what lies ahead, is known now.
    pub(super) fn learned(
        &mut self,
        published: &Arc<Published>,
        sights: Result<Vec<Sight>, ReadError>,
        step: Option<Step>,
        handle: &StageHandle,
    ) {
        // Cells of another revision are other cells.
        if let (Ok(sights), true) = (&sights, Arc::ptr_eq(published, &self.terrain.published)) {
            let now_ms = self.live.now_ms();
            // Many who come at once ask for the same.
            for (cell, sees) in sights {
                if !self.world.knows(*cell) {
                    self.world.teach(*cell, sees, now_ms);
                }
            }
        }
        let Some(step) = step else {
            self.learning_ahead = false;
            if let Err(error) = sights {
                tracing::warn!(scene = %self.scene, %error, "what people come to see cannot be read");
            }
            return;
        };
        let behind = self.waiting.remove(&step.session()).unwrap_or_default();
        match sights {
            // Who went away while this was looked up has gone already.
            Ok(_) if matches!(&step, Step::Enter(entry) if entry.reply.is_closed()) => {}
            Ok(_) => self.step_at_once(step, handle),
            Err(error) => self.fail(step, error.into(), handle),
        }
        behind.into_iter().for_each(|step| self.step(step, handle));
    }

    /// Answers that a step cannot be taken, for want of what must be known; who ends need know nothing.
    fn fail(&mut self, step: Step, error: LiveError, handle: &StageHandle) {
        match step {
            Step::Enter(entry) => _ = entry.reply.send(Err(error)),
            Step::Pose { reply, .. } => _ = reply.send(Err(error)),
            Step::Aoi { .. } | Step::Close { .. } | Step::PartFrom { .. } => self.take_step(step, handle),
        }
    }

    fn enter(&mut self, entry: Entry, handle: &StageHandle) {
        let Entry {
            session,
            object,
            visitor,
            outbox,
            with_statics,
            reply,
        } = entry;
        let (position, aoi) = (visitor.pose.position, visitor.aoi);
        // Until a stream is opened nobody does.
        let visitor = Visitor {
            listens: false,
            ..visitor
        };
        let now_ms = self.live.now_ms();
        self.adopt(object);
        let seen = match self.world.open(session, object, visitor, now_ms) {
            Ok(seen) => seen,
            Err(refusal) => {
                _ = reply.send(Err(refusal.into()));
                return;
            }
        };
        if with_statics {
            let (view, seen) = watch::channel(View {
                published: self.terrain.published.clone(),
                closed: self.world.closed(),
                position,
                enter_m: aoi.enter_m,
                round: 0,
            });
            let (outbox, stopping) = (outbox.clone(), self.live.0.stopping.clone());
            tokio::spawn(async move { stopping.run_until_cancelled(statics::tell(seen, outbox)).await });
            self.views.insert(session, view);
        }
        let person = Person {
            outbox,
            poses: Bucket::full(POSES.0, POSES.1, now_ms),
            listens: false,
            wakeable: false,
            moved: false,
        };
        self.people.insert(session, person);
        // A reader may have come while what is seen from here was looked up.
        handle.note_readers_changed();
        _ = reply.send(Ok((seen, now_ms)));
    }

    /// What a session is told first.
    pub(super) fn hello(&self, session: SessionId) -> Option<Event> {
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

    fn stand(&mut self, session: SessionId, sent: Sent) -> Result<Seen, LiveError> {
        let seen = self.world.pose(session, sent, self.live.now_ms())?;
        self.moved = true;
        self.has_moved(session);
        self.show_statics(session, false);
        Ok(seen)
    }
}
