//! Was anybody told of what nobody can see from there, or not told of what is in plain view? Asked after each tick.
//!
//! A *leak*: a session was told of a mover although it is proved that no sight line leads from any cell that its participant
//! may look from into any cell that the mover may touch, margins for time included. Cells are the grain, as in the visible sets
//! that are published: who stands in a hidden corner of a cell that is seen into is no leak. Where neither a sight line nor a
//! proof was found the telling is *undecided*.
//!
//! A *miss*: a mover is in plain view of a participant, well inside the area of interest, and for a few ticks on end the
//! session was not told of it. Who says nothing is where it said last: that is what others are to be told until it speaks.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{Ms, cells::distance_m, event::SessionId};
use belvedere_scene::{Bounds, CellId, ObjectId};
use belvedere_verify::between::Sight;
use rayon::prelude::*;
use serde::Serialize;

use super::{
    account::{Account, Person},
    sights::Sights,
};

/// What a closed door hides is told of for so long at most after it was closed, or after somebody has come into a cell.
const DOOR_GRACE_MS: Ms = 2_000;
/// Who comes into view is told of within so many ticks.
const TICKS_TO_TELL: Ms = 3;
/// What is in plain view shows at least so much around its middle.
const PLAIN_M: f64 = 0.02;

/// A wrong that was done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Finding {
    /// Unix time of the server.
    pub(super) at_ms: Ms,
    pub(super) session: SessionId,
    pub(super) object: ObjectId,
    /// Where the participant was.
    pub(super) eye: [f64; 3],
    /// Where the mover was.
    pub(super) position: [f64; 3],
    /// Cells that the participant may have looked from.
    pub(super) eye_cells: Vec<CellId>,
    /// Cells that the mover may have touched.
    pub(super) cells: Vec<CellId>,
}

/// What was found of a scene, and what was looked at.
#[derive(Debug, Default)]
pub(super) struct Judge {
    pub(super) leaks: Vec<Finding>,
    pub(super) undecided: Vec<Finding>,
    pub(super) misses: Vec<Finding>,
    /// Times that a session was told of a mover.
    pub(super) told: u64,
    /// Pairs of a participant and a mover that it was not told of that were looked at.
    pub(super) untold: u64,
    /// In plain view and not told of, since when.
    suspects: BTreeMap<(SessionId, ObjectId), Ms>,
    ticks: u64,
}

impl Judge {
    /// Looks at a scene after a tick; at who was not told only each so many ticks.
    pub(super) fn look(&mut self, account: &mut Account, sights: &mut Sights, now_ms: Ms, every: u64) {
        for (session, object) in std::mem::take(&mut account.told) {
            self.told += 1;
            // Who is gone by now was told of while it was there.
            let Some(found) = finding(account, session, object, now_ms) else {
                continue;
            };
            match could_see(account, sights, &found) {
                Sight::Seen => {}
                Sight::NotFound => self.undecided.push(found),
                Sight::Hidden => self.leaks.push(found),
            }
        }
        self.ticks += 1;
        if self.ticks.is_multiple_of(every) {
            self.suspect(account, sights, now_ms);
        }
        self.convict(account, sights, now_ms);
    }

    fn suspect(&mut self, account: &Account, sights: &Sights, now_ms: Ms) {
        let people: Vec<_> = account.people.iter().filter(|(_, person)| person.hears()).collect();
        let untold = |(session, person): &(&SessionId, &Person)| {
            let others = account
                .movers
                .keys()
                .filter(|object| is_due(account, **session, person, **object, now_ms));
            let others: Vec<_> = others.copied().collect();
            let seen = others
                .iter()
                .filter(|object| in_view(account, sights, person, **object, now_ms));
            let seen: Vec<_> = seen.map(|object| (**session, *object)).collect();
            (others.len() as u64, seen)
        };
        let found: Vec<_> = people.par_iter().map(untold).collect();
        for (looked_at, seen) in found {
            self.untold += looked_at;
            for pair in seen {
                self.suspects.entry(pair).or_insert(now_ms);
            }
        }
    }

    fn convict(&mut self, account: &Account, sights: &Sights, now_ms: Ms) {
        // An owner that was woken has a round trip to say where its mover is.
        let in_time_ms = TICKS_TO_TELL * account.rules.tick_ms + account.rules.round_trip_ms;
        let suspects = std::mem::take(&mut self.suspects);
        for ((session, object), since_ms) in suspects {
            let Some(person) = account.people.get(&session) else {
                continue;
            };
            let still =
                is_due(account, session, person, object, now_ms) && in_view(account, sights, person, object, now_ms);
            if !still {
                continue;
            }
            if now_ms - since_ms > in_time_ms {
                self.misses.extend(finding(account, session, object, now_ms));
            } else {
                self.suspects.insert((session, object), since_ms);
            }
        }
    }
}

fn finding(account: &Account, session: SessionId, object: ObjectId, now_ms: Ms) -> Option<Finding> {
    let person = account.people.get(&session)?;
    let mover = account.movers.get(&object)?;
    Some(Finding {
        at_ms: now_ms,
        session,
        object,
        eye: account.movers.get(&person.avatar)?.position(now_ms),
        position: mover.position(now_ms),
        eye_cells: person.eyes.0.clone(),
        cells: mover.cells(&account.cells, now_ms, account.rules.tick_ms),
    })
}

/// Whether what a session was told of may be seen from where its participant may be.
fn could_see(account: &Account, sights: &mut Sights, told: &Finding) -> Sight {
    // Whoever is in no cell is served as if in the nearest one, of which nothing can be proved.
    let is_in_a_cell = |place: [f64; 3]| account.cells.at(place).is_some_and(|place| place.distance_m == 0.0);
    let proves = is_in_a_cell(told.eye) && is_in_a_cell(told.position);
    match seen_from_cells(account, sights, told) {
        Sight::Hidden if !proves => Sight::NotFound,
        sight => sight,
    }
}

/// The same, for whoever is in the cells that are looked from.
fn seen_from_cells(account: &Account, sights: &mut Sights, told: &Finding) -> Sight {
    let open = sights.any_sees_any(&told.eye_cells, &told.cells, &BTreeSet::new());
    let settled = |since_ms: Ms| told.at_ms - since_ms > DOOR_GRACE_MS;
    let closed = account.closed.iter().filter(|(_, door)| settled(door.since_ms));
    let closed: BTreeSet<_> = closed.map(|(object, _)| *object).collect();
    let stands = settled(account.people[&told.session].eyes.1);
    if open != Sight::Seen || !stands || closed.is_empty() {
        return open;
    }
    sights.any_sees_any(&told.eye_cells, &told.cells, &closed)
}

/// Whether a session ought to be told of a mover if it is in view, and is not.
fn is_due(account: &Account, session: SessionId, person: &Person, object: ObjectId, now_ms: Ms) -> bool {
    let (Some(avatar), Some(mover)) = (account.movers.get(&person.avatar), account.movers.get(&object)) else {
        return false;
    };
    let tick_ms = account.rules.tick_ms;
    let (eye, there) = (avatar.position(now_ms), mover.position(now_ms));
    let margin_m = avatar.ball(now_ms, tick_ms).radius_m + mover.ball(now_ms, tick_ms).radius_m;
    mover.owner != Some(session)
        && person.hears()
        && !person.shown.contains(&object)
        && distance_m(eye, there) < person.aoi.enter_m - margin_m
}

fn in_view(account: &Account, sights: &Sights, person: &Person, object: ObjectId, now_ms: Ms) -> bool {
    let (Some(avatar), Some(mover)) = (account.movers.get(&person.avatar), account.movers.get(&object)) else {
        return false;
    };
    let (eye, there) = (avatar.position(now_ms), mover.position(now_ms));
    let in_a_cell = |point| account.cells.at(point).is_some_and(|place| place.distance_m == 0.0);
    let closed: Vec<Bounds> = account.closed.values().map(|door| door.bounds).collect();
    in_a_cell(eye) && in_a_cell(there) && sights.in_plain_view(eye, there, PLAIN_M.min(0.5 * mover.radius_m), &closed)
}
