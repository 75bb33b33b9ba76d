//! Is what a session was told of a mover what came in, and does what it extrapolates from that stay near it? Asked of each telling at
//! once, and of all that it goes on to believe after each tick.
//!
//! A pose is to be sent when what is extrapolated has gone wrong by more than shows ([`pace`]), no sooner than the session was told
//! that poses of that mover would come, and as far as its bytes go. While these are used up nothing is said of what waits.

use belvedere_live::{
    Ms,
    cells::distance_m,
    event::SessionId,
    motion::Pose,
    pace::{self, TOLERANCE_RAD},
    world::POSE_BYTES,
};
use belvedere_scene::ObjectId;
use serde::Serialize;
use serde_json::Value;

use super::account::{Account, Person};

/// What is due is told within so many ticks.
const TICKS_TO_TELL: Ms = 2;
/// Poses of a mover of which nobody was told how often they come may be so many ticks apart.
const LONGEST_PERIOD_TICKS: Ms = 16;
/// The server measures the distance by which it goes where the mover is, and not where it is believed to be: by so much at most
/// that is more.
const BEYOND: f64 = 1.01;
/// What is computed from the same numbers differs by no more.
pub(super) const ROUNDING: f64 = 1e-6;

/// What a session knows of a mover.
#[derive(Debug, Clone)]
pub(super) struct Shown {
    /// None where what it was told was no pose.
    pose: Option<Pose>,
    told_ms: Ms,
    /// Poses are so far apart, if it was told that.
    period_ms: Option<Ms>,
    /// What it extrapolates is wrong since then.
    wrong_since_ms: Option<Ms>,
}

/// A session was told what is not so, or goes on to believe it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Untrue {
    /// Unix time of the server.
    pub(super) at_ms: Ms,
    pub(super) session: SessionId,
    pub(super) object: ObjectId,
    /// By which event it was told so; none where it was not told better.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) event: Option<&'static str>,
    /// By how much that is wrong, where it is a place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) off_m: Option<f64>,
    pub(super) why: &'static str,
}

/// What an event says of one mover's pose.
fn pose(said: &Value) -> Option<Pose> {
    let acceleration = said.get("acceleration");
    Some(Pose {
        t_ms: said["t_ms"].as_i64()?,
        position: numbers(&said["position"])?,
        orientation: numbers(&said["orientation"])?,
        velocity: numbers(&said["velocity"])?,
        acceleration: acceleration.map_or(Some([0.0; 3]), numbers)?,
    })
}

fn numbers<const N: usize>(said: &Value) -> Option<[f64; N]> {
    let all: Option<Vec<_>> = said.as_array()?.iter().map(Value::as_f64).collect();
    all?.try_into().ok()
}

impl Account {
    /// A session is told of a pose of a mover; says what is wrong with it.
    pub(super) fn tell_pose(
        &mut self,
        (session, object): (SessionId, ObjectId),
        event: &'static str,
        said: &Value,
        now_ms: Ms,
    ) -> Option<Untrue> {
        let (person, mover) = (self.people.get_mut(&session)?, self.movers.get(&object)?);
        let told = pose(if event == "object-info" { &said["pose"] } else { said });
        let before = person.shown.get(&object).and_then(|shown| shown.period_ms);
        let shown = Shown {
            pose: told,
            told_ms: now_ms,
            period_ms: said["period_ms"].as_i64().or(before),
            wrong_since_ms: None,
        };
        person.shown.insert(object, shown);
        if event == "object-pos" {
            // Whether there were as many left is for the rules to look after.
            person.bytes.take(POSE_BYTES, now_ms);
        }
        let wrong = match told {
            None => Some(("it is no pose", None)),
            Some(told) => mover.belies(&told, now_ms),
        };
        wrong.map(|(why, off_m)| Untrue {
            at_ms: now_ms,
            session,
            object,
            event: Some(event),
            off_m,
            why,
        })
    }

    /// A session is told how far apart the poses of a mover will be.
    pub(super) fn tell_period(&mut self, session: SessionId, object: ObjectId, said: &Value) {
        let person = self.people.get_mut(&session);
        if let Some(shown) = person.and_then(|person| person.shown.get_mut(&object)) {
            shown.period_ms = said["period_ms"].as_i64().or(shown.period_ms);
        }
    }

    /// After a tick: what has been believed wrongly for longer than it takes to be told better.
    pub(super) fn drifted(&mut self, now_ms: Ms) -> Vec<Untrue> {
        let (movers, rules) = (&self.movers, &self.rules);
        let mut found = Vec::new();
        for (session, person) in &mut self.people {
            let Some(avatar) = movers.get(&person.avatar).filter(|_| person.hears()) else {
                continue;
            };
            let (eye, starves) = (avatar.position(now_ms), starves(person, now_ms));
            for (object, shown) in &mut person.shown {
                let (Some(mover), Some(told)) = (movers.get(object), shown.pose) else {
                    continue;
                };
                let ((off_m, off_rad), believed) = (mover.off(&told, now_ms), told.position_at(now_ms));
                let shows_m = BEYOND * pace::tolerance_m(distance_m(eye, believed)) + ROUNDING;
                if starves || off_m <= shows_m && off_rad <= TOLERANCE_RAD + ROUNDING {
                    shown.wrong_since_ms = None;
                    continue;
                }
                let since_ms = *shown.wrong_since_ms.get_or_insert(now_ms);
                let period_ms = shown.period_ms.unwrap_or(LONGEST_PERIOD_TICKS * rules.tick_ms);
                let due_ms = since_ms.max(shown.told_ms + period_ms);
                if now_ms - due_ms > TICKS_TO_TELL * rules.tick_ms {
                    // Once for as long as it takes.
                    shown.wrong_since_ms = Some(now_ms);
                    let why = "it has gone on otherwise, and nothing was told of that";
                    let off_m = Some(off_m);
                    found.push(Untrue {
                        at_ms: now_ms,
                        session: *session,
                        object: *object,
                        event: None,
                        off_m,
                        why,
                    });
                }
            }
        }
        found
    }
}

/// Whether a session may be told of no more poses now.
fn starves(person: &Person, now_ms: Ms) -> bool {
    let mut bytes = person.bytes;
    !bytes.take(2.0 * POSE_BYTES, now_ms)
}
