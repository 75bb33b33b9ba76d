//! What happens in a tick? Volumes expire, what is awake moves on, relations that may have changed are judged anew, and
//! sessions are told what they cannot deduce.

use belvedere_scene::ObjectId;

use super::{World, among, mover::Mover, movers::LONGEST_STEP_MS, session::Session, sight::Sight};
use crate::{
    Ms,
    cells::distance_m,
    event::{Event, ObjectPose, Period, SessionId},
    motion::Pose,
    pace,
};

/// About what a pose takes in the stream.
const POSE_BYTES: f64 = 200.0;

impl World {
    /// Brings everything up to date.
    pub fn tick(&mut self, now_ms: Ms) {
        self.tell_gone();
        self.expire(now_ms);
        self.advance(now_ms);
        self.look_around(now_ms);
        self.judge(now_ms);
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
            self.rest(object, now_ms);
            let mover = &self.movers[&object];
            if mover.way.is_some() || mover.pose.velocity != [0.0; 3] {
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

    /// Who fell silent, and never said how fast it goes, has stopped where it was heard of last.
    fn rest(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        let silent = now_ms - mover.pose.t_ms >= LONGEST_STEP_MS;
        if silent && mover.way.is_none() && !mover.velocity_is_said {
            mover.pose = Pose::resting(mover.pose.t_ms, mover.pose.position, mover.pose.orientation);
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
                self.judge_pair(id, object, now_ms);
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
            for id in sessions {
                self.judge_pair(id, object, now_ms);
            }
        }
    }

    /// Something that a session sees, or how it looks, may have changed.
    fn unsettle(&mut self, id: SessionId) {
        if let Some(session) = self.sessions.get_mut(&id)
            && !session.restless
        {
            session.restless = true;
            self.unsettled.push(id);
        }
    }

    fn judge_pair(&mut self, id: SessionId, object: ObjectId, now_ms: Ms) {
        self.unsettle(id);
        let (session, mover) = (&self.sessions[&id], &self.movers[&object]);
        if mover.owner == Some(id) {
            return;
        }
        let since_ms = session.shown.get(&object).map(|shown| shown.since_ms);
        match (self.sight(session, mover, since_ms, now_ms), since_ms) {
            (Sight::Seen, None) => self.show(id, object, now_ms),
            (Sight::Unseen(reason), Some(_)) => self.hide(id, object, reason),
            // Who is beyond the area and only stays for the shortest stay must be looked at again.
            (Sight::Seen, Some(_)) if away_m(session, mover, now_ms) > session.aoi.leave_m => {
                self.stirred_sessions.insert(id);
            }
            _ => {}
        }
    }

    /// From a participant to a mover, metres.
    pub(super) fn away_m(&self, id: SessionId, object: ObjectId, now_ms: Ms) -> f64 {
        away_m(&self.sessions[&id], &self.movers[&object], now_ms)
    }

    /// Sends the poses that sessions would extrapolate wrongly, the most urgent first, within their bytes.
    fn tell_poses(&mut self, now_ms: Ms) {
        let mut unsettled = std::mem::take(&mut self.unsettled);
        unsettled.sort_unstable();
        for id in unsettled {
            let Some(session) = self.sessions.get_mut(&id) else {
                continue;
            };
            if session.shown.is_empty() {
                session.restless = false;
                continue;
            }
            let eye = session.eye.position;
            let from = session.among.is_none().then_some(eye);
            let stays = from.is_some() && session.told_from == from;
            session.told_from = from;
            // What is found settled is so until something stirs.
            session.restless = from.is_none();
            let (mut due, mut rates) = (Vec::new(), Vec::new());
            for (object, shown) in &mut session.shown {
                let mover = &self.movers[object];
                if stays && shown.is_settled(mover) {
                    continue;
                }
                session.restless = true;
                let position = mover.pose.position_at(now_ms);
                let away_m = distance_m(eye, position);
                let seen = among::visibility(session.among.as_deref(), self.crowd.as_ref(), position);
                // It changes only when the mover is well beyond the border.
                let [nearer, further] =
                    [0.9, 1.1].map(|x| among::attention(mover, x * away_m, seen, self.rules.tick_ms));
                if nearer.is_like(&further) && !nearer.is_like(&shown.attention) {
                    shown.attention = nearer;
                    rates.push(Period {
                        object: *object,
                        attention: nearer,
                    });
                }
                let Some(sent) = shown.sent else {
                    due.push((f64::INFINITY, *object, mover.pose));
                    continue;
                };
                let wrong = distance_m(sent.position_at(now_ms), position) > pace::tolerance_m(away_m)
                    || sent.turned_rad(&mover.pose) > pace::TOLERANCE_RAD;
                if wrong {
                    shown.priority += seen.unwrap_or(1.0) * pace::priority(away_m, mover.radius_m);
                    // Ticks do not come to the millisecond.
                    let since_ms = now_ms - shown.sent_at_ms + self.rules.tick_ms / 2;
                    if since_ms >= shown.attention.period_ms {
                        due.push((shown.priority, *object, mover.pose));
                    }
                }
            }
            if !rates.is_empty() {
                self.events.push((id, Event::Rate { objects: rates }));
            }
            due.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let mut objects = Vec::new();
            for (_, object, pose) in due {
                if !session.bytes.take(POSE_BYTES, now_ms) {
                    break;
                }
                objects.push(ObjectPose { object, pose });
                if let Some(shown) = session.shown.get_mut(&object) {
                    shown.sent = Some(pose);
                    shown.sent_at_ms = now_ms;
                    shown.priority = 0.0;
                }
            }
            if !objects.is_empty() {
                let t_ms = now_ms;
                self.events.push((id, Event::ObjectPos { t_ms, objects }));
            }
            if session.restless {
                self.unsettled.push(id);
            }
        }
    }
}

/// From a participant to a mover, metres.
fn away_m(session: &Session, mover: &Mover, now_ms: Ms) -> f64 {
    distance_m(session.eye.position, mover.pose.position_at(now_ms))
}
