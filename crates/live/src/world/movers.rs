//! How do movers come, move and go?

use std::{collections::BTreeSet, sync::Weak};

use belvedere_scene::{CellId, ObjectId};
use serde::{Deserialize, Serialize};

use super::{
    Look, Moved, Refusal, Sent, World,
    check::{self, SLACK},
    clock::SenderClock,
    mover::{Mover, State},
};
use crate::{
    Ms,
    event::{Gone, SessionId},
    motion::{Pose, Trajectory},
    tbv::Validity,
};

/// A mover that is to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NewMover {
    /// Where it is.
    pub pose: Sent,
    /// A promise.
    pub max_speed_mps: f64,
    /// Another one, if it is made; it counts where poses say their velocity.
    #[serde(default)]
    pub max_acceleration_mps2: Option<f64>,
    /// A ball of this radius around its position holds it.
    pub radius_m: f64,
    /// What it looks like.
    pub look: Look,
    /// A way that it follows by itself.
    pub way: Option<Trajectory>,
}

/// Poses further apart than this say nothing of the speed, and who has not been heard of for so long stands.
pub(super) const LONGEST_STEP_MS: Ms = 1_000;
/// A pose that exceeds what was promised by less than this, and by less than [`SLACK`], breaks no promise.
const SLACK_M: f64 = 0.1;
/// A volume that ends so soon has done its work.
const RENEWAL_TICKS: Ms = 3;

impl World {
    /// Adds a mover; nothing else ever had its id. The session that drives it, if there is one, hears `hush` and `wake`,
    /// and is not told of it.
    ///
    /// # Errors
    /// When something about it cannot be.
    pub fn create(
        &mut self,
        object: ObjectId,
        owner: Option<SessionId>,
        new: NewMover,
        now_ms: Ms,
    ) -> Result<Moved, Refusal> {
        self.add(object, owner, new, now_ms)?;
        Ok(Moved {
            object,
            hush: self.settle(object, now_ms),
            teleported: false,
        })
    }

    /// Adds a mover that nobody has looked at yet.
    pub(super) fn add(
        &mut self,
        object: ObjectId,
        owner: Option<SessionId>,
        new: NewMover,
        now_ms: Ms,
    ) -> Result<(), Refusal> {
        // Its pose is that of its first key, and the key is what was sent.
        new.way.as_ref().map_or(Ok(()), |way| check::way(way, &self.reach))?;
        let sent = new.pose.checked(&self.reach)?;
        // Who follows a known way keeps to that way's speed, whatever was promised.
        let promised_mps = new.way.as_ref().map_or(new.max_speed_mps, Trajectory::fastest_mps);
        let (max_speed_mps, radius_m) = (check::speed(promised_mps)?, check::radius(new.radius_m)?);
        let max_acceleration_mps2 = check::acceleration(new.max_acceleration_mps2)?;
        if self.cells.is_empty() {
            return Err(Refusal::NoCells);
        }
        let mut pose = Pose::resting(now_ms, sent.position, sent.orientation);
        pose.velocity = sent.velocity_within(max_speed_mps).unwrap_or_default();
        pose.acceleration = sent.acceleration_within(max_acceleration_mps2, pose.velocity, max_speed_mps);
        let heard = owner.is_some() || new.way.is_some();
        let longest_ms = if heard {
            self.rules.longest_tbv_ms
        } else {
            self.rules.longest_unheard_tbv_ms
        };
        let mover = Mover {
            owner,
            abroad: false,
            look: new.look,
            radius_m,
            max_speed_mps,
            max_acceleration_mps2,
            velocity_is_said: sent.velocity.is_some(),
            pose: new.way.as_ref().map_or(pose, |way| way.pose_at(now_ms)),
            way: new.way,
            clock: SenderClock::new(sent.t_ms, now_ms),
            state: State::Awake,
            cells: Vec::new(),
            shown_to: BTreeSet::new(),
            told: Weak::new(),
            validity: Validity::new(longest_ms),
        };
        let reach_m = self.rules.reach_m(&mover);
        if let Some(session) = owner.and_then(|owner| self.sessions.get_mut(&owner)) {
            session.driven.insert(object);
        }
        self.movers.insert(object, Box::new(mover));
        self.rouse(object, now_ms);
        self.look_further(reach_m, now_ms);
        Ok(())
    }

    /// Takes a pose of a mover that is no avatar.
    ///
    /// # Errors
    /// When it cannot be; then nothing has changed.
    pub fn move_to(&mut self, object: ObjectId, sent: Sent, now_ms: Ms) -> Result<Moved, Refusal> {
        let teleported = self.shift(object, sent, now_ms)?;
        Ok(Moved {
            object,
            hush: self.settle(object, now_ms),
            teleported,
        })
    }

    /// Moves a mover; says whether it broke its promise.
    pub(super) fn shift(&mut self, object: ObjectId, sent: Sent, now_ms: Ms) -> Result<bool, Refusal> {
        let sent = sent.checked(&self.reach)?;
        let mover = self.movers.get_mut(&object).ok_or(Refusal::NoMover)?;
        if mover.way.is_some() {
            return Err(Refusal::OnTrajectory);
        }
        let last_ms = mover.clock.last_ms();
        let t_ms = mover
            .clock
            .read(sent.t_ms, now_ms)
            .ok_or(Refusal::Backwards { last_ms })?;
        let (last, elapsed_s) = (mover.pose, (t_ms - mover.pose.t_ms) as f64 * 1e-3);
        let moved_m = crate::cells::distance_m(last.position, sent.position);
        let teleported = moved_m > SLACK * mover.max_speed_mps * elapsed_s + SLACK_M;
        let step: [f64; 3] = std::array::from_fn(|a| sent.position[a] - last.position[a]);
        // Two poses that come within a moment of each other say little of the speed; no more than was promised.
        let per_s = (1.0 / elapsed_s).min(mover.max_speed_mps / moved_m.max(f64::MIN_POSITIVE));
        let estimate = || match elapsed_s {
            _ if teleported => [0.0; 3],
            0.0 => last.velocity,
            _ if t_ms - last.t_ms >= LONGEST_STEP_MS => [0.0; 3],
            _ => step.map(|x| x * per_s),
        };
        let velocity = sent.velocity_within(mover.max_speed_mps).unwrap_or_else(estimate);
        mover.pose = Pose {
            t_ms,
            position: sent.position,
            orientation: sent.orientation,
            velocity,
            acceleration: sent.acceleration_within(mover.max_acceleration_mps2, velocity, mover.max_speed_mps),
        };
        mover.velocity_is_said = sent.velocity.is_some();
        match mover.state {
            State::Hushed { tbv, until_ms } if mover.keeps_to((&tbv, until_ms), &self.sessions, now_ms) => {
                // Who speaks just before the end gets the next promise with the answer.
                if until_ms - now_ms <= RENEWAL_TICKS * self.rules.tick_ms {
                    self.renew(object, tbv, now_ms);
                } else if self.knows_better(object, &tbv, now_ms) {
                    // The caller has it settle again.
                    self.rouse(object, now_ms);
                }
            }
            State::Hushed { .. } => {
                // It has gone out of its volume: that was too small, unless this was no walk.
                if teleported {
                    mover.validity.shorten();
                } else {
                    mover.validity.lengthen();
                }
                self.rouse(object, now_ms);
            }
            State::Asked { .. } => self.rouse(object, now_ms),
            State::Awake => self.place(object, now_ms),
        }
        Ok(teleported)
    }

    /// From now on the pose counts.
    pub(super) fn rouse(&mut self, object: ObjectId, now_ms: Ms) {
        self.enter(object, State::Awake);
        self.place(object, now_ms);
    }

    /// Registers an awake mover where it is now.
    pub(super) fn place(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        match &mover.way {
            Some(way) => mover.pose = way.pose_at(now_ms),
            None => mover.rest(now_ms),
        }
        let (now, last) = self.rules.mover_balls(mover, now_ms);
        let cells = self.cells.under_either((now, last));
        if let Some(crowd) = &mut self.crowd {
            crowd.put(object, now.center, mover.look.hides_m(mover.radius_m));
        }
        self.register(object, cells);
        self.stirred_movers.insert(object);
        self.restless.insert(object);
    }

    pub(super) fn enter(&mut self, object: ObjectId, state: State) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        if let Some(at_ms) = mover.alarm_ms() {
            self.alarms.remove(&(at_ms, object));
        }
        mover.state = state;
        match mover.alarm_ms() {
            Some(at_ms) => {
                self.alarms.insert((at_ms, object));
                self.awake.remove(&object);
                self.restless.remove(&object);
                self.leave_crowd(object);
            }
            None => {
                self.awake.insert(object);
            }
        }
    }

    /// Whom nobody sees hides nobody.
    fn leave_crowd(&mut self, object: ObjectId) {
        if let Some(crowd) = &mut self.crowd {
            crowd.take(object);
        }
    }

    pub(super) fn register(&mut self, object: ObjectId, cells: Vec<CellId>) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        if mover.cells == cells {
            return;
        }
        self.somebody_came = true;
        let before = std::mem::replace(&mut mover.cells, cells);
        for cell in &before {
            self.movers_in[cell.index()].remove(&object);
        }
        for cell in &mover.cells {
            self.movers_in[cell.index()].insert(object);
        }
    }

    /// Removes a mover.
    pub fn destroy(&mut self, object: ObjectId) {
        let Some(mover) = self.movers.remove(&object) else {
            return;
        };
        self.reaches.remove(self.rules.reach_m(&mover));
        if let Some(at_ms) = mover.alarm_ms() {
            self.alarms.remove(&(at_ms, object));
        }
        if let Some(session) = mover.owner.and_then(|owner| self.sessions.get_mut(&owner)) {
            session.driven.remove(&object);
        }
        self.awake.remove(&object);
        self.restless.remove(&object);
        self.abroad -= usize::from(mover.abroad);
        self.leave_crowd(object);
        self.stirred_movers.remove(&object);
        self.somebody_came = true;
        for cell in &mover.cells {
            self.movers_in[cell.index()].remove(&object);
        }
        for id in mover.shown_to {
            if let Some(session) = self.sessions.get_mut(&id) {
                let shown = session.shown.remove(&object);
                if shown.is_some_and(|shown| shown.known) {
                    self.gone.entry((id, Gone::Destroyed)).or_default().push(object);
                }
            }
        }
    }
}
