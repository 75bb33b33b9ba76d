//! Who may see what? Decided here and nowhere else.
//!
//! A participant sees into the cells that can be seen from its own cell, and from those that it may have reached before
//! the next event arrives: within its speed times a round trip, from where it was heard of last and from where it said that it goes,
//! which is looked at each tick ([`World::look_on`]). A mover is in the cells that its ball touches, widened
//! by what it moves in a tick, where its pose leads and where it was when it was heard of last. The mover is told of when one
//! of its cells is seen into and it is inside the area of interest. What closed doors hide is left out ([`doors`](super::doors)).
//! Seen cells that the area reaches are *watched*; a mover in no watched cell concerns nobody.
//!
//! Conservative as far as the scene's sets are: a mover that is not told of is seen neither where its pose leads nor where it was
//! heard of last, but for a round trip in which an owner is woken.

use std::{
    collections::{BTreeMap, BTreeSet, btree_map::Entry},
    sync::Arc,
};

use belvedere_scene::CellId;

use super::{Rules, World, mover::Mover, session::Session};
use crate::{
    Ms,
    cells::{Ball, Cells, distance_m},
    crowd::{Crowd, Spot},
    event::{Gone, SessionId},
};

/// From where a participant looks, and what of it sees.
#[derive(Debug, Clone, Default)]
pub(super) struct Eye {
    /// Where the participant was taken to be when it looked: it does with each pose, and on its way.
    pub(super) position: [f64; 3],
    /// Cells that the participant may be in, rising.
    pub(super) cells: Vec<CellId>,
    /// Cells that can be seen into from these, rising.
    pub(super) sees: Arc<[CellId]>,
    /// Those of them that the area of interest reaches, rising.
    pub(super) watched: Vec<CellId>,
}

/// How far around their middles movers may be seen, with what they move in a tick.
#[derive(Debug, Default)]
pub(super) struct Reaches {
    /// How many reach so far, by the bits of the length, which rise with it.
    of: BTreeMap<u64, usize>,
    /// By so much participants look further than their areas of interest: as far as anybody reaches, or did a moment ago.
    looked_m: f64,
    looked_at_ms: Ms,
}

/// Once in so long participants look less far where those who reached furthest have gone.
const LESS_FAR_MS: Ms = 1_000;

impl Reaches {
    pub(super) fn looked_m(&self) -> f64 {
        self.looked_m
    }

    pub(super) fn remove(&mut self, reach_m: f64) {
        if let Entry::Occupied(mut many) = self.of.entry(reach_m.to_bits()) {
            *many.get_mut() -= 1;
            if *many.get() == 0 {
                many.remove();
            }
        }
    }
}

/// How a session stands to a mover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sight {
    /// It is told of it.
    Seen,
    /// It is not.
    Unseen(Gone),
}

impl Rules {
    /// Where a participant may be before it hears what is sent now.
    pub(super) fn eye_ball(&self, position: [f64; 3], max_speed_mps: f64) -> Ball {
        Ball {
            center: position,
            radius_m: max_speed_mps * self.round_trip_ms as f64 * 1e-3,
        }
    }

    /// The same of one that is taken to be somewhere, and of where it was heard of last: it may have stopped before a wall.
    pub(super) fn eye_balls(&self, avatar: &Mover, position: [f64; 3]) -> (Ball, Ball) {
        let around = |center| self.eye_ball(center, avatar.max_speed_mps);
        (around(position), around(avatar.pose.position))
    }

    /// Everything that a mover may touch until the next tick, where it is taken to be by now and where it was heard of last:
    /// whoever extrapolates knows of no walls, and it may have stopped before one.
    pub(super) fn mover_balls(&self, mover: &Mover, now_ms: Ms) -> (Ball, Ball) {
        let around = |center| Ball {
            center,
            radius_m: self.reach_m(mover),
        };
        (around(mover.position_at(now_ms)), around(mover.pose.position))
    }

    /// How far from its middle a mover may touch something until the next tick.
    pub(super) fn reach_m(&self, mover: &Mover) -> f64 {
        mover.radius_m + self.tick_reach_m(mover)
    }

    /// How far a mover comes in a tick.
    pub(super) fn tick_reach_m(&self, mover: &Mover) -> f64 {
        mover.max_speed_mps * self.tick_ms as f64 * 1e-3
    }
}

impl Eye {
    /// Looks from the middle of the first of two balls, and from the cells under both. `beyond_m` is how far the largest mover reaches:
    /// one whose middle is inside the area may be seen in a cell that is this much further away.
    pub(super) fn look(&self, cells: &Cells, balls: (Ball, Ball), leave_m: f64, beyond_m: f64) -> Self {
        let (under, position) = (cells.under_either(balls), balls.0.center);
        let sees = if under == self.cells {
            self.sees.clone()
        } else {
            cells.seen_from(&under)
        };
        let reaches = |cell: &CellId| {
            let shape = cells.cell(*cell);
            shape.is_some_and(|shape| shape.bounds.distance_m(position) <= leave_m + beyond_m)
        };
        Self {
            watched: sees.iter().copied().filter(reaches).collect(),
            position,
            cells: under,
            sees,
        }
    }

    /// Whether it sees into one of these cells, which rise. A large mover touches many more cells than most participants see.
    fn sees_any(&self, cells: &[CellId]) -> bool {
        let [few, many] = if self.sees.len() < cells.len() {
            [&self.sees, cells]
        } else {
            [cells, &self.sees]
        };
        few.iter().any(|cell| many.binary_search(cell).is_ok())
    }
}

/// By what it is decided who sees whom, beside the two themselves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judge<'a> {
    pub(super) rules: &'a Rules,
    pub(super) crowd: Option<&'a Crowd>,
    pub(super) now_ms: Ms,
}

impl Judge<'_> {
    /// How a session stands to a mover that it does not drive itself and that is `at` this place now, which is that [spot](Self::spot)
    /// of the crowd. `since_ms` is when it was told of it first, if it is told of it.
    pub(super) fn sight(
        &self,
        session: &Session,
        mover: &Mover,
        (at, spot): ([f64; 3], Option<&Spot>),
        since_ms: Option<Ms>,
    ) -> Sight {
        let away_m = distance_m(session.eye.position, at);
        let inside = session
            .aoi
            .holds(away_m, since_ms, self.now_ms, self.rules.shortest_stay_ms);
        let seen = mover.is_awake()
            && session.eye.sees_any(&mover.cells)
            && !self.is_lost_in_crowd(session, spot, since_ms.is_some());
        match (seen, inside) {
            (true, true) => Sight::Seen,
            (false, _) if away_m <= session.aoi.leave_m => Sight::Unseen(Gone::Hidden),
            _ => Sight::Unseen(Gone::Left),
        }
    }
}

impl World {
    /// How a session stands to a mover that it does not drive itself.
    pub(super) fn sight(&self, session: &Session, mover: &Mover, since_ms: Option<Ms>, now_ms: Ms) -> Sight {
        let (rules, crowd) = (&self.rules, self.crowd.as_ref());
        let judge = Judge { rules, crowd, now_ms };
        let at = mover.position_at(now_ms);
        judge.sight(session, mover, (at, judge.spot(at).as_ref()), since_ms)
    }

    /// A mover has come that reaches so far: all who look must look as far.
    pub(super) fn look_further(&mut self, reach_m: f64, now_ms: Ms) {
        *self.reaches.of.entry(reach_m.to_bits()).or_default() += 1;
        if reach_m > self.reaches.looked_m {
            self.look_beyond(reach_m, now_ms);
        }
    }

    /// Where those who reached furthest have gone, nobody looks for them any more; not at once, since more of them may come.
    pub(super) fn look_less_far(&mut self, now_ms: Ms) {
        let furthest_m = self
            .reaches
            .of
            .last_key_value()
            .map_or(0.0, |(bits, _)| f64::from_bits(*bits));
        if furthest_m < self.reaches.looked_m && now_ms - self.reaches.looked_at_ms >= LESS_FAR_MS {
            self.look_beyond(furthest_m, now_ms);
        }
    }

    fn look_beyond(&mut self, reach_m: f64, now_ms: Ms) {
        self.reaches.looked_m = reach_m;
        self.reaches.looked_at_ms = now_ms;
        let all: Vec<_> = self.sessions.keys().copied().collect();
        all.into_iter().for_each(|session| self.look(session, now_ms));
    }

    /// Whether any session but its owner's watches one of these cells, on this node or on another.
    pub(super) fn is_watched(&self, cells: &[CellId], owner: Option<SessionId>) -> bool {
        let others = |watchers: &BTreeSet<SessionId>| watchers.iter().any(|session| Some(*session) != owner);
        cells
            .iter()
            .any(|cell| others(&self.watchers[cell.index()]) || self.watched_abroad.contains(cell))
    }
}
