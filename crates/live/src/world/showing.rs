//! Who is told first that somebody is there, and how fast? A crowd is many infos, and who reads slowly must not be told more than it takes.
//!
//! So many infos are told at once ([`ROOM`]); the others wait until the host says that the reader has taken what
//! was waiting for it ([`World::make_room`]). The nearest come first; who waits comes nearer, as it were, so that nobody waits for ever.
//! Of whom a session does not know yet it is told nothing else either: who is gone before was never there.

use belvedere_scene::ObjectId;

use super::{
    World,
    session::{ROOM, Shown},
};
use crate::{
    Ms,
    cells::distance_m,
    event::{Event, Gone, SessionId},
};

impl World {
    /// From now on a session is told of a mover.
    pub(super) fn show(&mut self, id: SessionId, object: ObjectId, now_ms: Ms) {
        let away_m = self.away_m(id, object, now_ms);
        let attention = self.attention(id, &self.movers[&object], away_m, now_ms);
        let (Some(session), Some(mover)) = (self.sessions.get_mut(&id), self.movers.get_mut(&object)) else {
            return;
        };
        let known = session.recall(object);
        if !known {
            self.uninformed.insert(id);
        }
        let shown = Shown {
            since_ms: now_ms,
            known,
            sent: None,
            sent_at_ms: now_ms,
            attention,
            priority: 0.0,
            rests: false,
        };
        session.shown.insert(object, shown);
        mover.shown_to.insert(id);
    }

    /// From now on it is not.
    pub(super) fn hide(&mut self, id: SessionId, object: ObjectId, reason: Gone) {
        if let Some(mover) = self.movers.get_mut(&object) {
            mover.shown_to.remove(&id);
        }
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let shown = session.shown.remove(&object);
        if shown.is_some_and(|shown| !shown.known) {
            return;
        }
        if reason == Gone::Hidden {
            session.remember(object);
        }
        self.gone.entry((id, reason)).or_default().push(object);
    }

    /// Tells what has gone.
    pub(super) fn tell_gone(&mut self) {
        let gone = std::mem::take(&mut self.gone);
        for ((session, reason), objects) in gone {
            self.say(session, Event::ObjectGone { objects, reason });
        }
    }

    /// Tells sessions of whom they do not know yet.
    pub(super) fn tell_infos(&mut self, now_ms: Ms) {
        let uninformed: Vec<_> = self.uninformed.iter().copied().collect();
        uninformed.into_iter().for_each(|id| self.inform(id, now_ms));
    }

    /// Sessions that wait for more room.
    pub fn wants_room(&self) -> impl Iterator<Item = SessionId> {
        let full = |id: &SessionId| self.sessions.get(id).is_some_and(|session| session.room == 0);
        self.uninformed.iter().copied().filter(move |id| full(id))
    }

    /// Whether a session knows of all whom it sees.
    #[must_use]
    pub fn is_informed(&self, id: SessionId) -> bool {
        !self.uninformed.contains(&id)
    }

    /// The reader of a session has taken all that it was told: more may be.
    pub fn make_room(&mut self, id: SessionId) {
        if let Some(session) = self.sessions.get_mut(&id) {
            session.room = ROOM;
        }
    }

    /// Tells a session of whom it does not know yet, as far as there is room.
    pub(super) fn inform(&mut self, id: SessionId, now_ms: Ms) {
        let Some(session) = self.sessions.get(&id).filter(|session| session.room > 0) else {
            return;
        };
        let eye = session.eye.position;
        let unknown = session.shown.iter().filter(|(_, shown)| !shown.known);
        let mut waiting: Vec<_> = unknown
            .map(|(object, shown)| {
                let away_m = distance_m(eye, self.movers[object].position_at(now_ms));
                let waits_s = (now_ms - shown.since_ms) as f64 * 1e-3;
                (away_m / (1.0 + waits_s), *object)
            })
            .collect();
        waiting.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (room, many) = (session.room, waiting.len());
        for (_, object) in waiting.into_iter().take(room) {
            self.introduce(id, object, now_ms);
        }
        if many <= room {
            self.uninformed.remove(&id);
        }
    }

    /// Tells a session who somebody is.
    fn introduce(&mut self, id: SessionId, object: ObjectId, now_ms: Ms) {
        let away_m = self.away_m(id, object, now_ms);
        let attention = self.attention(id, &self.movers[&object], away_m, now_ms);
        let (Some(session), Some(mover)) = (self.sessions.get_mut(&id), self.movers.get_mut(&object)) else {
            return;
        };
        session.room -= 1;
        session.unsettle(id, &mut self.unsettled);
        if let Some(shown) = session.shown.get_mut(&object) {
            shown.known = true;
            shown.sent = Some(mover.pose);
            shown.sent_at_ms = now_ms;
            shown.attention = attention;
            shown.rests = false;
        }
        let told = Box::new(mover.told(object, attention));
        self.events.push((id, Event::ObjectInfo(told)));
    }
}
