//! What happens in a tick? Volumes expire, what is awake moves on, so do those who look, relations that may have changed are judged anew, and
//! sessions are told what they cannot deduce.

use belvedere_scene::ObjectId;

use super::{
    World, each_session,
    sight::{Judge, Sight},
};
use crate::{
    Ms,
    cells::distance_m,
    event::{Event, SessionId},
};

impl World {
    /// Brings everything up to date.
    pub fn tick(&mut self, now_ms: Ms) {
        self.tell_gone();
        self.expire(now_ms);
        // Before: who is only seen from where somebody has come to stays awake.
        self.look_on(now_ms);
        self.look_less_far(now_ms);
        self.advance(now_ms);
        self.look_around(now_ms);
        self.judge(now_ms);
        self.tell_infos(now_ms);
        self.tell_gone();
        self.tell_poses(now_ms);
    }

    fn expire(&mut self, now_ms: Ms) {
        while let Some((at_ms, object)) = self.alarms.first().copied().filter(|(at_ms, _)| *at_ms <= now_ms) {
            self.alarms.remove(&(at_ms, object));
            self.alarm(object, now_ms);
        }
    }

    /// Whatever is awake is where its pose says by now; what nobody watches any more is put away.
    fn advance(&mut self, now_ms: Ms) {
        let restless: Vec<_> = self.restless.iter().copied().collect();
        for object in restless {
            let mover = &self.movers[&object];
            if mover.way.is_some() || !mover.pose.is_resting() {
                self.place(object, now_ms);
            } else if mover.abroad || self.is_watched(&mover.cells, mover.owner) {
                // Nothing more will become of it until it moves or is watched less.
                self.restless.remove(&object);
                continue;
            }
            let owner = self.movers[&object].owner;
            if let (Some(hush), Some(owner)) = (self.settle(object, now_ms), owner) {
                self.say(owner, Event::Hush(hush));
            }
        }
    }

    fn judge(&mut self, now_ms: Ms) {
        for id in std::mem::take(&mut self.stirred_sessions) {
            self.unsettle(id);
            let Some(session) = self.sessions.get(&id) else {
                continue;
            };
            let watched = session.eye.watched.iter();
            let near = watched.flat_map(|cell| self.movers_in[cell.index()].iter().copied());
            let mut objects: Vec<_> = near.chain(session.shown.keys().copied()).collect();
            objects.sort_unstable();
            objects.dedup();
            for object in objects {
                self.judge_pairs(object, &[id], now_ms);
            }
        }
        for object in std::mem::take(&mut self.stirred_movers) {
            let Some(mover) = self.movers.get(&object) else {
                continue;
            };
            let near = mover
                .cells
                .iter()
                .flat_map(|cell| self.watchers[cell.index()].iter().copied());
            let mut sessions: Vec<_> = near.chain(mover.shown_to.iter().copied()).collect();
            sessions.sort_unstable();
            sessions.dedup();
            self.judge_pairs(object, &sessions, now_ms);
        }
    }

    /// Something that a session sees, or how it looks, may have changed.
    fn unsettle(&mut self, id: SessionId) {
        if let Some(session) = self.sessions.get_mut(&id) {
            session.unsettle(id, &mut self.unsettled);
        }
    }

    /// Judges how sessions, rising, stand to a mover from now on.
    fn judge_pairs(&mut self, object: ObjectId, sessions: &[SessionId], now_ms: Ms) {
        let mover = &self.movers[&object];
        let at = mover.position_at(now_ms);
        let judge = Judge {
            rules: &self.rules,
            crowd: self.crowd.as_ref(),
            now_ms,
        };
        let spot = judge.spot(at);
        let first = sessions.first().into_iter();
        let mut shown_to = first.flat_map(|first| mover.shown_to.range(first..)).peekable();
        let mut changed = Vec::new();
        each_session(&mut self.sessions, sessions, |id, session| {
            if mover.owner == Some(id) {
                session.unsettle(id, &mut self.unsettled);
                return;
            }
            while shown_to.next_if(|other| **other < id).is_some() {}
            let is_shown = shown_to.next_if(|other| **other == id).is_some();
            let shown = if is_shown { session.shown.get_mut(&object) } else { None };
            let since_ms = shown.map(|shown| {
                shown.rests = false;
                shown.since_ms
            });
            let sight = judge.sight(session, mover, (at, spot.as_ref()), since_ms);
            if is_shown || sight == Sight::Seen {
                session.unsettle(id, &mut self.unsettled);
            }
            match (sight, since_ms) {
                (Sight::Seen, None) => changed.push((id, None)),
                (Sight::Unseen(reason), Some(_)) => changed.push((id, Some(reason))),
                // Who is beyond the area and only stays for the shortest stay must be looked at again.
                (Sight::Seen, Some(_)) if distance_m(session.eye.position, at) > session.aoi.leave_m => {
                    self.stirred_sessions.insert(id);
                }
                _ => {}
            }
        });
        for (id, gone) in changed {
            match gone {
                None => self.show(id, object, now_ms),
                Some(reason) => self.hide(id, object, reason),
            }
        }
    }

    /// From a participant to a mover, metres.
    pub(super) fn away_m(&self, id: SessionId, object: ObjectId, now_ms: Ms) -> f64 {
        distance_m(
            self.sessions[&id].eye.position,
            self.movers[&object].position_at(now_ms),
        )
    }
}
