//! How do movers fall silent, and what wakes them?
//!
//! Steps 1, 4 and 5 of Sudarsky & Gotsman's algorithm (§3): a mover that nobody watches gets a volume and is registered
//! where that is; a volume that is exposed or expires is taken away again, and the mover counts as awake until nobody
//! watches it. A volume here is only as large as one that touches no watched cell.
//!
//! Volumes of owners that can be woken are *probabilistic* (§2.2): they are as large as has proved useful and last for
//! long, though the mover could leave them; an owner whose mover does says so, and the volume has ended. So who stays in a
//! corner says nothing at all, and costs nothing. Volumes of all others end when their mover could leave them.
//!
//! Who is told of movers itself looks from where it spoke last. So its volume lies in the cells that it looks from: wherever it
//! goes in there without a word, nothing is seen that it is not told of.

use belvedere_scene::{Bounds, CellId, ObjectId};

use super::{
    World,
    mover::{Mover, State},
    sight::Sight,
};
use crate::{
    Ms,
    event::{Event, Gone, Hush, SessionId},
    tbv::{Tbv, Validity},
};

/// A volume touches at most so many cells: to register it in more would cost more than the messages that it saves.
const MOST_CELLS: usize = 128;

impl World {
    /// Puts a mover away when nobody watches it; says what its owner may rely on, if it is away.
    pub(super) fn settle(&mut self, object: ObjectId, now_ms: Ms) -> Option<Hush> {
        let mover = self.movers.get(&object)?;
        if mover.is_awake() && !mover.abroad && !self.is_watched(&mover.cells, mover.owner) {
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

    /// A volume ends that nobody has watched, and the mover is still inside. Who says when it leaves may rely on the same one
    /// again, so that many movers that stay somewhere cost next to nothing; all others get a larger one.
    pub(super) fn renew(&mut self, object: ObjectId, tbv: Tbv, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        if mover.is_heard_when_it_leaves(&self.sessions) {
            let until_ms = now_ms + self.rules.longest_tbv_ms;
            self.enter(object, State::Hushed { tbv, until_ms });
        } else {
            mover.validity.lengthen();
            self.rouse(object, now_ms);
        }
    }

    /// Finds the largest volume, up to what has proved useful, that touches no watched cell and not too many others. A
    /// mover that has none stays awake.
    fn hush(&mut self, object: ObjectId, now_ms: Ms) {
        if self.rules.longest_tbv_ms == 0 {
            return;
        }
        let mover = &self.movers[&object];
        let is_heard = mover.is_heard_when_it_leaves(&self.sessions);
        let most_ms = if is_heard || mover.way.is_some() {
            self.rules.longest_tbv_ms
        } else {
            self.rules.longest_unheard_tbv_ms
        };
        let mut reach_ms = mover.validity.ms().min(most_ms);
        while reach_ms >= Validity::SHORTEST_MS {
            let (tbv, cells) = self.volume(mover, now_ms, now_ms + reach_ms);
            let small = cells.len() <= MOST_CELLS || reach_ms < 2 * Validity::SHORTEST_MS;
            if small && !self.is_watched(&cells, mover.owner) && self.looks_from_all_of(mover, object, &tbv) {
                let lasts_ms = if is_heard {
                    reach_ms.max(self.rules.longest_tbv_ms)
                } else {
                    reach_ms
                };
                let until_ms = now_ms + lasts_ms;
                self.end_showing(object, now_ms);
                self.register(object, cells);
                self.enter(object, State::Hushed { tbv, until_ms });
                if let Some(mover) = self.movers.get_mut(&object) {
                    mover.validity.fit(reach_ms);
                }
                return;
            }
            reach_ms /= 2;
        }
    }

    /// Whether a participant looks from all cells in which its avatar may be within a volume, if it is told of what it sees.
    fn looks_from_all_of(&self, avatar: &Mover, object: ObjectId, tbv: &Tbv) -> bool {
        let session = avatar.owner.and_then(|owner| self.sessions.get(&owner));
        let looks = session.filter(|session| session.object == object && session.hears());
        looks.is_none_or(|session| {
            let inside = self.cells.under(&tbv.grown(0.0));
            inside.iter().all(|cell| session.eye.cells.binary_search(cell).is_ok())
        })
    }

    /// Whether a participant looks from elsewhere by now than when its avatar was given its volume, so that it would see from there what
    /// it is not told of.
    pub(super) fn strays(&self, object: ObjectId) -> bool {
        self.movers.get(&object).is_some_and(|mover| match mover.state {
            State::Hushed { tbv, .. } => !self.looks_from_all_of(mover, object, &tbv),
            State::Awake | State::Asked { .. } => false,
        })
    }

    /// Whether how a mover moves, as it says now, allows a volume that is at most half as large and serves as long.
    pub(super) fn knows_better(&self, object: ObjectId, tbv: &Tbv, now_ms: Ms) -> bool {
        let mover = &self.movers[&object];
        let until_ms = now_ms + mover.validity.ms();
        mover.velocity_is_said
            && mover.max_acceleration_mps2.is_some()
            && 2.0 * self.ball(mover, now_ms, until_ms).radius_m <= tbv.radius_m
    }

    /// Whether a mover was heard of lately. Who has been silent for longer is where the extrapolation says: it would have spoken
    /// otherwise.
    fn is_fresh(&self, mover: &Mover, now_ms: Ms) -> bool {
        now_ms - mover.pose.t_ms <= self.rules.grace_ms
    }

    /// Where a mover that follows no known way can be until then.
    fn ball(&self, mover: &Mover, now_ms: Ms, until_ms: Ms) -> Tbv {
        let fresh = self.is_fresh(mover, now_ms);
        let (position, since_ms) = if fresh {
            (mover.pose.position, mover.pose.t_ms)
        } else {
            (mover.position_at(now_ms), now_ms)
        };
        let elapsed_ms = until_ms - since_ms;
        let by_speed = Tbv::around(position, mover.max_speed_mps, elapsed_ms);
        let moving = mover.max_acceleration_mps2.filter(|_| fresh && mover.velocity_is_said);
        let by_acceleration = moving.map(|most_mps2| Tbv::ahead(position, mover.pose.velocity, most_mps2, elapsed_ms));
        by_acceleration
            .filter(|tbv| tbv.radius_m < by_speed.radius_m)
            .unwrap_or(by_speed)
    }

    /// Where a mover can be until then, and the cells that this touches.
    fn volume(&self, mover: &Mover, now_ms: Ms, until_ms: Ms) -> (Tbv, Vec<CellId>) {
        let tbv = self.ball(mover, now_ms, until_ms);
        // Who leaves it, and whose volume ends, has gone on before that is noticed in a tick, as far as who is awake.
        let margin_m = mover.radius_m + self.rules.tick_reach_m(mover);
        let Some(way) = &mover.way else {
            let ball = tbv.grown(margin_m);
            let cells = if self.is_fresh(mover, now_ms) {
                self.cells.under(&ball)
            } else {
                // It may have stopped before what it is extrapolated through.
                let (_, last) = self.rules.mover_balls(mover, now_ms);
                self.cells.under_any(&[ball, last])
            };
            return (tbv, cells);
        };
        let mut cells: Vec<_> = way
            .swept(now_ms, until_ms)
            .iter()
            .flat_map(|passed| {
                let grown = Bounds {
                    min: passed.min.map(|x| x - margin_m),
                    max: passed.max.map(|x| x + margin_m),
                };
                self.cells.meeting(&grown)
            })
            .collect();
        if cells.is_empty() {
            cells = self.cells.under(&tbv.grown(margin_m));
        }
        cells.sort_unstable();
        cells.dedup();
        (tbv, cells)
    }

    /// A session has started to watch a cell of a mover that was put away. Whoever can be woken is, and has a round trip to say
    /// where its mover is by now; of all others, and of who does not answer, the last pose counts.
    pub(super) fn expose(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        let until_ms = now_ms + self.rules.round_trip_ms;
        match mover.state {
            State::Awake => return,
            State::Asked { until_ms: before } => {
                let until_ms = until_ms.min(before);
                return self.enter(object, State::Asked { until_ms });
            }
            State::Hushed { .. } => mover.validity.shorten(),
        }
        let fresh = now_ms - mover.pose.t_ms <= 2 * self.rules.tick_ms;
        let is_heard = mover.max_speed_mps > 0.0 && mover.is_heard_when_it_leaves(&self.sessions);
        self.revoke(object);
        if fresh || !is_heard {
            self.rouse(object, now_ms);
        } else {
            self.enter(object, State::Asked { until_ms });
        }
    }

    /// The owner of a mover hears that what was promised is void. Who was asked already knows, and who cannot move need not.
    pub(super) fn revoke(&mut self, object: ObjectId) {
        let Some(mover) = self.movers.get(&object) else {
            return;
        };
        let promised = matches!(mover.state, State::Hushed { .. }) && mover.way.is_none() && mover.max_speed_mps > 0.0;
        if let Some(owner) = mover.owner.filter(|_| promised) {
            self.say(owner, Event::Wake { object });
        }
    }

    /// From now on nobody says when a mover of this session leaves its volume: the last pose counts. Who comes back to what it
    /// was told finds there that the promise has ended.
    pub(super) fn end_promises(&mut self, id: SessionId, now_ms: Ms) {
        let Some(session) = self.sessions.get(&id) else {
            return;
        };
        let driven: Vec<_> = [session.object]
            .into_iter()
            .chain(session.driven.iter().copied())
            .collect();
        let comes_back = session.listens;
        for object in driven {
            let mover = self.movers.get(&object);
            if mover.is_none_or(|mover| mover.is_awake() || mover.way.is_some()) {
                continue;
            }
            if comes_back {
                self.revoke(object);
            }
            self.rouse(object, now_ms);
            self.settle(object, now_ms);
        }
    }

    /// A volume has expired, or an owner that was asked has said nothing.
    pub(super) fn alarm(&mut self, object: ObjectId, now_ms: Ms) {
        let Some(mover) = self.movers.get_mut(&object) else {
            return;
        };
        let expired = matches!(mover.state, State::Hushed { .. });
        let is_heard = mover.is_heard_when_it_leaves(&self.sessions);
        if expired && !is_heard {
            mover.validity.lengthen();
        }
        let spoken = now_ms - mover.pose.t_ms <= 2 * self.rules.tick_ms;
        if expired && is_heard && !spoken && mover.max_speed_mps > 0.0 {
            // The owner knows when.
            let until_ms = now_ms + self.rules.grace_ms;
            self.enter(object, State::Asked { until_ms });
            return;
        }
        self.rouse(object, now_ms);
        if let (Some(hush), Some(owner)) = (self.settle(object, now_ms), self.movers[&object].owner) {
            self.say(owner, Event::Hush(hush));
        }
    }

    /// Nobody is told of a mover any more that has been put away.
    pub(super) fn end_showing(&mut self, object: ObjectId, now_ms: Ms) {
        let shown_to = self.movers[&object].shown_to.clone();
        for id in shown_to {
            let reason = match self.sight(&self.sessions[&id], &self.movers[&object], None, now_ms) {
                Sight::Unseen(reason) => reason,
                Sight::Seen => Gone::Hidden,
            };
            self.hide(id, object, reason);
        }
    }
}
