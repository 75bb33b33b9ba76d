//! What is a session told of the poses that it would extrapolate wrongly? The most urgent first, within its bytes.
//!
//! Many sessions are told the same of the same movers, so what was found for one is at hand for the next: the movers, and the list of
//! poses itself, which they share.

use std::{collections::BTreeMap, sync::Arc};

use belvedere_scene::ObjectId;

use super::{World, among, each_session, mover::Mover, session::Session};
use crate::{
    Ms,
    cells::distance_m,
    crowd::{Crowd, Spot},
    event::{Event, ObjectPose, Period, SessionId},
    motion::Pose,
    pace,
};

/// About what a pose takes in the stream, and counts of what a session may be told.
pub const POSE_BYTES: f64 = 200.0;
/// As many movers are at hand as are awake, but no fewer …
const FEW_AT_HAND: usize = 1 << 6;
/// … and no more than this.
const MANY_AT_HAND: usize = 1 << 14;

impl World {
    /// Sends poses to the sessions for which something may have changed.
    pub(super) fn tell_poses(&mut self, now_ms: Ms) {
        let mut unsettled = std::mem::take(&mut self.unsettled);
        unsettled.sort_unstable();
        let mut teller = Teller {
            now_ms,
            tick_ms: self.rules.tick_ms,
            movers: Lately {
                all: &self.movers,
                crowd: self.crowd.as_ref(),
                now_ms,
                some: vec![None; at_hand(self.awake.len())],
            },
            due: Vec::new(),
            poses: Vec::new(),
            last: None,
            events: &mut self.events,
        };
        let still = &mut self.unsettled;
        each_session(&mut self.sessions, &unsettled, |id, session| {
            teller.tell(id, session);
            if session.restless {
                still.push(id);
            }
        });
    }
}

/// A mover that a session is to be told of, and how urgently.
type Due = (f64, ObjectId, Pose);

/// Tells one session after the other.
struct Teller<'a> {
    now_ms: Ms,
    tick_ms: Ms,
    movers: Lately<'a>,
    due: Vec<Due>,
    poses: Vec<ObjectPose>,
    /// What the last session was told.
    last: Option<Arc<[ObjectPose]>>,
    events: &'a mut Vec<(SessionId, Event)>,
}

impl Teller<'_> {
    fn tell(&mut self, id: SessionId, session: &mut Session) {
        let eye = session.eye.position;
        let from = session.among.is_none().then_some(eye);
        let stays = from.is_some() && session.told_from == from;
        session.told_from = from;
        // What rests is left alone until something stirs; a crowd is looked at each tick.
        session.restless = from.is_none() && !session.shown.is_empty();
        self.due.clear();
        let mut rates = Vec::new();
        for (object, shown) in &mut session.shown {
            if !shown.known || stays && shown.rests {
                continue;
            }
            let Found { mover, position, spot } = self.movers.get(*object);
            let away_m = distance_m(eye, *position);
            let seen = among::visibility(session.among.as_deref(), spot.as_ref());
            // It changes only when the mover is well beyond the border.
            let [nearer, further] = [0.9, 1.1].map(|x| among::attention(mover, x * away_m, seen, self.tick_ms));
            // Of whom its reader does not know yet that it is there again, nothing else is said before.
            if shown.sent.is_some() && nearer.is_like(&further) && !nearer.is_like(&shown.attention) {
                shown.attention = nearer;
                rates.push(Period {
                    object: *object,
                    attention: nearer,
                });
            }
            let Some(sent) = shown.sent else {
                self.due.push((f64::INFINITY, *object, mover.pose));
                continue;
            };
            // What is told is extrapolated by its readers as it is, so it is held against the same.
            let believed = sent.position_at(self.now_ms);
            let wrong = distance_m(believed, mover.pose.position_at(self.now_ms)) > pace::tolerance_m(away_m)
                || sent.turned_rad(&mover.pose) > pace::TOLERANCE_RAD;
            shown.rests = !wrong && sent.is_resting() && mover.pose.is_resting();
            if wrong {
                shown.priority += seen.unwrap_or(1.0) * pace::priority(away_m, mover.radius_m);
                // Ticks do not come to the millisecond.
                let since_ms = self.now_ms - shown.sent_at_ms + self.tick_ms / 2;
                if since_ms >= shown.attention.period_ms {
                    self.due.push((shown.priority, *object, mover.pose));
                    continue;
                }
            }
            session.restless |= !shown.rests;
        }
        if !rates.is_empty() {
            self.events.push((id, Event::Rate { objects: rates }));
        }
        self.send_due(id, session);
    }

    /// Sends what is due, as much as there are bytes for.
    fn send_due(&mut self, id: SessionId, session: &mut Session) {
        self.due.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.poses.clear();
        for (_, object, pose) in &self.due {
            if !session.bytes.take(POSE_BYTES, self.now_ms) {
                session.restless = true;
                break;
            }
            let (object, pose) = (*object, *pose);
            self.poses.push(ObjectPose { object, pose });
            if let Some(shown) = session.shown.get_mut(&object) {
                shown.sent = Some(pose);
                shown.sent_at_ms = self.now_ms;
                shown.priority = 0.0;
                shown.rests = pose.is_resting();
                session.restless |= !shown.rests;
            }
        }
        if !self.poses.is_empty() {
            let (t_ms, objects) = (self.now_ms, self.shared());
            self.events.push((id, Event::ObjectPos { t_ms, objects }));
        }
    }

    /// The poses, held once where the last session was told the same.
    fn shared(&mut self) -> Arc<[ObjectPose]> {
        match &self.last {
            Some(last) if **last == *self.poses => last.clone(),
            _ => self.last.insert(self.poses.as_slice().into()).clone(),
        }
    }
}

/// Movers of which some were looked up lately.
struct Lately<'a> {
    all: &'a BTreeMap<ObjectId, Box<Mover>>,
    crowd: Option<&'a Crowd>,
    now_ms: Ms,
    /// By the last digits of their ids.
    some: Vec<Option<(ObjectId, Found<'a>)>>,
}

/// What was found of a mover.
#[derive(Clone)]
struct Found<'a> {
    mover: &'a Mover,
    /// Where it is by now, and where that is in the crowd.
    position: [f64; 3],
    spot: Option<Spot>,
}

/// So many are at hand where so many are awake.
fn at_hand(awake: usize) -> usize {
    awake.next_power_of_two().clamp(FEW_AT_HAND, MANY_AT_HAND)
}

impl<'a> Lately<'a> {
    fn get(&mut self, object: ObjectId) -> &Found<'a> {
        let many = self.some.len();
        let place = &mut self.some[object.0 as usize % many];
        if place.as_ref().is_some_and(|(held, _)| *held != object) {
            *place = None;
        }
        let (_, found) = place.get_or_insert_with(|| {
            let mover = &*self.all[&object];
            let position = mover.position_at(self.now_ms);
            let spot = self.crowd.map(|crowd| crowd.spot(position));
            (object, Found { mover, position, spot })
        });
        found
    }
}
