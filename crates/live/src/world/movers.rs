//! How do movers come, move, fall silent and go?

use std::collections::BTreeSet;

use belvedere_scene::{CellId, ObjectId};

use super::{
    Look, Moved, Refusal, Sent, World, check,
    clock::SenderClock,
    mover::{Mover, State},
    sight::Sight,
};
use crate::{
    Ms,
    event::{Event, Gone, Hush, SessionId},
    motion::{Pose, Trajectory},
    tbv::{Tbv, Validity},
};

/// A mover that is to be.
#[derive(Debug, Clone)]
pub struct NewMover {
    /// Its id, which nothing else ever had.
    pub object: ObjectId,
    /// The session that drives it, hears `hush` and `wake`, and is not told of it.
    pub owner: Option<SessionId>,
    /// Where it is.
    pub pose: Sent,
    /// A promise.
    pub max_speed_mps: f64,
    /// A ball of this radius around its position holds it.
    pub radius_m: f64,
    /// What it looks like.
    pub look: Look,
    /// A way that it follows by itself.
    pub way: Option<Trajectory>,
}

/// A pose that exceeds what was promised by less than this breaks no promise.
const SLACK_M: f64 = 0.1;
const SLACK: f64 = 1.05;
/// A volume that ends so soon has done its work.
const RENEWAL_TICKS: Ms = 3;
/// A volume touches at most so many cells: to register it in more would cost more than the messages that it saves.
const MOST_CELLS: usize = 128;

impl World {
    /// Adds a mover.
    ///
    /// # Errors
    /// When something about it cannot be.
    pub fn create(&mut self, new: NewMover, now_ms: Ms) -> Result<Moved, Refusal> {
        let object = new.object;
        self.add(new, now_ms)?;
        Ok(Moved {
            object,
            hush: self.settle(object, now_ms),
            teleported: false,
        })
    }

    /// Adds a mover that nobody has looked at yet.
    pub(super) fn add(&mut self, new: NewMover, now_ms: Ms) -> Result<(), Refusal> {
        let sent = new.pose.checked(&self.reach)?;
        let (max_speed_mps, radius_m) = (check::speed(new.max_speed_mps)?, check::radius(new.radius_m)?);
        if self.cells.is_empty() {
            return Err(Refusal::NoCells);
        }
        let mut pose = Pose::resting(now_ms, sent.position, sent.orientation);
        pose.velocity = sent.velocity.unwrap_or_default();
        pose.acceleration = sent.acceleration.unwrap_or_default();
        let heard = new.owner.is_some() || new.way.is_some();
        let longest_ms = if heard {
            self.rules.longest_tbv_ms
        } else {
            self.rules.longest_unheard_tbv_ms
        };
        let mover = Mover {
            owner: new.owner,
            look: new.look,
            radius_m,
            max_speed_mps,
            pose: new.way.as_ref().map_or(pose, |way| way.pose_at(now_ms)),
            way: new.way,
            clock: SenderClock::new(sent.t_ms, now_ms),
            state: State::Awake,
            cells: Vec::new(),
            shown_to: BTreeSet::new(),
            validity: Validity::new(longest_ms),
        };
        let reach_m = radius_m + self.rules.tick_reach_m(&mover);
        self.movers.insert(new.object, mover);
        self.rouse(new.object, now_ms);
        if reach_m > self.largest_m {
            self.largest_m = reach_m;
            let all: Vec<_> = self.sessions.keys().copied().collect();
            all.into_iter().for_each(|session| self.look(session, now_ms));
        }
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
        let estimate = || match elapsed_s {
            _ if teleported => [0.0; 3],
            0.0 => last.velocity,
            1.0.. => [0.0; 3],
            _ => step.map(|x| x / elapsed_s),
        };
        mover.pose = Pose {
            t_ms,
            position: sent.position,
            orientation: sent.orientation,
            velocity: sent.velocity.unwrap_or_else(estimate),
            acceleration: sent.acceleration.unwrap_or_default(),
        };
        match mover.state {
            State::Hushed { tbv, until_ms } if now_ms < until_ms && tbv.holds(sent.position) => {
                // Who speaks just before the end gets the next promise with the answer.
                if until_ms - now_ms <= RENEWAL_TICKS * self.rules.tick_ms {
                    mover.validity.lengthen();
                    self.rouse(object, now_ms);
                }
            }
            State::Hushed { .. } => {
                mover.validity.shorten();
                self.rouse(object, now_ms);
            }
            State::Asked { .. } => self.rouse(object, now_ms),
            State::Awake => self.place(object, now_ms),
        }
        Ok(teleported)
    }

    /// Puts a mover away when nobody watches it; says what its owner may rely on, if it is away.
    pub(super) fn settle(&mut self, object: ObjectId, now_ms: Ms) -> Option<Hush> {
        let mover = self.movers.get(&object)?;
        if mover.is_awake() && !self.is_watched(&mover.cells, mover.owner) {
            self.hush(object, now_ms);
        }
        self.promise(object)
    }

    /// What the owner of a hushed mover may rely on.
    fn promise(&self, object: ObjectId) -> Option<Hush> {
        let mover = self.movers.get(&object)?;
        match mover.state {
            State::Hushed { tbv, until_ms } if mover.way.is_none() => Some(Hush {
                object,
                tbv,
                until_ms: mover.clock.theirs(until_ms),
            }),
            _ => None,
        }
    }

    /// Finds the longest volume, up to what has proved useful, that touches no watched cell and not too many others. A
    /// mover that has none stays awake.
    fn hush(&mut self, object: ObjectId, now_ms: Ms) {
        let mover = &self.movers[&object];
        let mut lasts_ms = mover.validity.ms();
        while lasts_ms >= Validity::SHORTEST_MS {
            let until_ms = now_ms + lasts_ms;
            let (tbv, cells) = self.volume(mover, now_ms, until_ms);
            let small = cells.len() <= MOST_CELLS || lasts_ms < 2 * Validity::SHORTEST_MS;
            if small && !self.is_watched(&cells, mover.owner) {
                self.end_showing(object, now_ms);
                self.register(object, cells);
                self.enter(object, State::Hushed { tbv, until_ms });
                if let Some(mover) = self.movers.get_mut(&object) {
                    mover.validity.fit(lasts_ms);
                }
                return;
            }
            lasts_ms /= 2;
        }
    }

    /// Where a mover can be until then, and the cells that this touches.
    fn volume(&self, mover: &Mover, now_ms: Ms, until_ms: Ms) -> (Tbv, Vec<CellId>) {
        // Who has been silent for longer is where the extrapolation says: it would have spoken otherwise.
        let fresh = now_ms - mover.pose.t_ms <= self.rules.grace_ms;
        let (position, since_ms) = if fresh {
            (mover.pose.position, mover.pose.t_ms)
        } else {
            (mover.pose.position_at(now_ms), now_ms)
        };
        let tbv = Tbv::around(position, mover.max_speed_mps, until_ms - since_ms);
        let Some(way) = &mover.way else {
            return (tbv, self.cells.under(&tbv.grown(mover.radius_m)));
        };
        let mut cells: Vec<_> = way
            .swept(now_ms, until_ms)
            .iter()
            .flat_map(|passed| {
                let grown = belvedere_scene::Bounds {
                    min: passed.min.map(|x| x - mover.radius_m),
                    max: passed.max.map(|x| x + mover.radius_m),
                };
                self.cells.meeting(&grown)
            })
            .collect();
        if cells.is_empty() {
            cells = self.cells.under(&tbv.grown(mover.radius_m));
        }
        cells.sort_unstable();
        cells.dedup();
        (tbv, cells)
    }

    /// A session has started to watch a cell of a hushed mover.
    pub(super) fn expose(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        if !matches!(mover.state, State::Hushed { .. }) {
            return;
        }
        mover.validity.shorten();
        let known = mover.way.is_some() || mover.max_speed_mps == 0.0;
        let (owner, fresh) = (mover.owner, now_ms - mover.pose.t_ms <= 2 * self.rules.tick_ms);
        if let Some(owner) = owner.filter(|_| !known) {
            self.say(owner, Event::Wake { object });
        }
        if known || fresh {
            self.rouse(object, now_ms);
        } else {
            let until_ms = now_ms + self.rules.grace_ms;
            self.enter(object, State::Asked { until_ms });
        }
    }

    /// A volume has expired, or an owner that was asked has said nothing.
    pub(super) fn alarm(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        let expired = matches!(mover.state, State::Hushed { .. });
        if expired {
            mover.validity.lengthen();
        }
        let spoken = now_ms - mover.pose.t_ms <= 2 * self.rules.tick_ms;
        if expired && mover.way.is_none() && !spoken && mover.max_speed_mps > 0.0 {
            // The owner knows when, and is about to speak.
            let until_ms = now_ms + self.rules.grace_ms;
            self.enter(object, State::Asked { until_ms });
            return;
        }
        self.rouse(object, now_ms);
        if let (Some(hush), Some(owner)) = (self.settle(object, now_ms), self.movers[&object].owner) {
            self.say(owner, Event::Hush(hush));
        }
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
        if let Some(way) = &mover.way {
            mover.pose = way.pose_at(now_ms);
        }
        let ball = self.rules.mover_ball(&self.movers[&object], now_ms);
        let cells = self.cells.under(&ball);
        self.register(object, cells);
        self.stirred_movers.insert(object);
    }

    fn enter(&mut self, object: ObjectId, state: State) {
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
            }
            None => {
                self.awake.insert(object);
            }
        }
    }

    fn register(&mut self, object: ObjectId, cells: Vec<CellId>) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        if mover.cells == cells {
            return;
        }
        let before = std::mem::replace(&mut mover.cells, cells);
        for cell in &before {
            self.movers_in[cell.index()].remove(&object);
        }
        for cell in &mover.cells {
            self.movers_in[cell.index()].insert(object);
        }
    }

    /// Nobody is told of a mover any more that has been put away.
    fn end_showing(&mut self, object: ObjectId, now_ms: Ms) {
        let shown_to = self.movers[&object].shown_to.clone();
        for id in shown_to {
            let reason = match self.sight(&self.sessions[&id], &self.movers[&object], None, now_ms) {
                Sight::Unseen(reason) => reason,
                Sight::Seen => Gone::Hidden,
            };
            self.hide(id, object, reason);
        }
    }

    /// Removes a mover.
    pub fn destroy(&mut self, object: ObjectId) {
        let Some(mover) = self.movers.remove(&object) else {
            return;
        };
        if let Some(at_ms) = mover.alarm_ms() {
            self.alarms.remove(&(at_ms, object));
        }
        self.awake.remove(&object);
        self.stirred_movers.remove(&object);
        for cell in &mover.cells {
            self.movers_in[cell.index()].remove(&object);
        }
        for id in mover.shown_to {
            if let Some(session) = self.sessions.get_mut(&id) {
                session.shown.remove(&object);
                self.gone.entry((id, Gone::Destroyed)).or_default().push(object);
            }
        }
    }
}
