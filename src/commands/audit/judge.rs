//! Was anybody told of what nobody can see from there, or not told of what is in plain view? Asked after each tick.
//!
//! A *leak*: a session was told of a mover although it is proved that no sight line leads from any cell that its participant
//! may look from into any cell that the mover may touch, margins for time included. Cells are the grain, as in the visible sets
//! that are published: who stands in a hidden corner of a cell that is seen into is no leak. Where neither a sight line nor a
//! proof was found the telling is *undecided*.
//!
//! A *miss*: somebody sees into where a mover may be whose owner was told to be silent, and was not woken
//! ([`promises`](super::promises)). Or a mover is in plain view of a participant, well inside the area of interest, and for a few ticks on end the
//! session was not told of it. (Doors are asked for alike, in [`doors`](super::doors).) Who says nothing is where it said last: that is what others are to be told until it speaks. Whom a
//! crowd hides is no miss where the rules leave such people out ([`crowd`](super::crowd)), and counted apart. Nor is one as long as the
//! session has been told so many infos that it waits for its stream; these are counted apart too, and when there is room again,
//! the time goes on that they had waited before.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{Ms, cells::distance_m, event::SessionId};
use belvedere_scene::{Bounds, CellId, ObjectId};
use belvedere_verify::between::Sight;
use rayon::prelude::*;
use serde::Serialize;

use super::{
    account::{Account, Person},
    crowd::Press,
    poses::Untrue,
    sights::Sights,
    suspect::Suspect,
    telling::{Astray, Telling, Wrong},
};

/// What a closed door hides is told of for so long at most after it was closed, or after somebody has come into a cell.
pub(super) const DOOR_GRACE_MS: Ms = 2_000;
/// Who comes into view is told of within so many ticks.
pub(super) const TICKS_TO_TELL: Ms = 3;
/// What is in plain view shows at least so much around its middle.
pub(super) const PLAIN_M: f64 = 0.02;

/// A wrong that was done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Finding {
    /// Unix time of the server.
    pub(super) at_ms: Ms,
    pub(super) session: SessionId,
    pub(super) object: ObjectId,
    /// By which event it was told of it, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) event: Option<&'static str>,
    /// Where the participant was.
    pub(super) eye: [f64; 3],
    /// Where the mover was.
    pub(super) position: [f64; 3],
    /// Cells that the participant may have looked from.
    pub(super) eye_cells: Vec<CellId>,
    /// Cells that the mover may have touched.
    pub(super) cells: Vec<CellId>,
    /// What brought it about, where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) why: Option<&'static str>,
}

/// What was found of a scene, and what was looked at.
#[derive(Debug, Default)]
pub(super) struct Judge {
    pub(super) leaks: Vec<Finding>,
    pub(super) undecided: Vec<Finding>,
    pub(super) misses: Vec<Finding>,
    pub(super) astray: Vec<Astray>,
    /// Told otherwise than it is.
    pub(super) untrue: Vec<Untrue>,
    /// Times that a session was told of a mover.
    pub(super) told: u64,
    /// Times that a session was told of a door.
    pub(super) doors: u64,
    /// Pairs of a participant and a mover that it was not told of that were looked at.
    pub(super) untold: u64,
    /// Pairs of these that were in view but for the crowd between them, which the rules let be left out.
    pub(super) culled: u64,
    /// Pairs of these that were in view while the session waited for its stream.
    pub(super) waiting: u64,
    /// In plain view and not told of.
    suspects: BTreeMap<(SessionId, ObjectId), Suspect>,
    /// Doors in plain view that are taken to stand otherwise than they do, since when.
    pub(super) door_suspects: BTreeMap<(SessionId, ObjectId), Ms>,
    /// Those that plainly see into the ball of a mover whose owner relies on that nobody does, since when.
    pub(super) unwoken: BTreeMap<(SessionId, ObjectId), Ms>,
    ticks: u64,
}

impl Judge {
    /// Looks at a scene after a tick; at who was not told only each so many ticks.
    pub(super) fn look(&mut self, account: &mut Account, sights: &mut Sights, now_ms: Ms, every: u64) {
        for told in std::mem::take(&mut account.told) {
            self.told += 1;
            // Who is gone by now was told of while it was there.
            let Some(found) = told_of(account, told, now_ms) else {
                continue;
            };
            match could_see(account, sights, &found) {
                Sight::Seen => {}
                Sight::NotFound => self.undecided.push(found),
                Sight::Hidden => self.leaks.push(found),
            }
        }
        self.ticks += 1;
        let looks = self.ticks.is_multiple_of(every);
        if looks || !self.suspects.is_empty() {
            account.crowd_together(now_ms);
        }
        if looks {
            self.suspect(account, sights, now_ms);
        }
        self.convict(account, sights, now_ms);
        self.look_at_doors(account, sights, now_ms, looks);
        self.look_at_promises(account, sights, now_ms, looks);
    }

    /// Takes note of what is wrong with what was told, whatever can be seen.
    pub(super) fn note(&mut self, account: &Account, wrong: Vec<Wrong>, now_ms: Ms) {
        for wrong in wrong {
            match wrong {
                Wrong::Leak(told) => self.leaks.extend(told_of(account, told, now_ms)),
                Wrong::Astray(astray) => self.astray.push(astray),
                Wrong::Untrue(untrue) => self.untrue.push(untrue),
            }
        }
    }

    fn suspect(&mut self, account: &mut Account, sights: &Sights, now_ms: Ms) {
        let here = &*account;
        let people: Vec<_> = here.people.iter().filter(|(_, person)| person.hears()).collect();
        let untold = |(session, person): &(&SessionId, &Person)| {
            let others = here
                .movers
                .keys()
                .filter(|object| is_due(here, **session, person, **object, now_ms));
            let others: Vec<_> = others.copied().collect();
            let seen = others
                .iter()
                .filter(|object| in_view(here, sights, person, **object, now_ms));
            let seen: Vec<_> = seen.copied().collect();
            (**session, others.len() as u64, seen)
        };
        let found: Vec<_> = people.par_iter().map(untold).collect();
        for (session, looked_at, mut seen) in found {
            self.untold += looked_at;
            self.culled += seen.len() as u64;
            account.leave_out(session, &mut seen, now_ms);
            self.culled -= seen.len() as u64;
            if !account.has_room(session) {
                self.waiting += seen.len() as u64;
            }
            for object in seen {
                let suspect = Suspect::new(now_ms);
                self.suspects.entry((session, object)).or_insert(suspect);
            }
        }
    }

    fn convict(&mut self, account: &mut Account, sights: &Sights, now_ms: Ms) {
        // An owner that was woken has a round trip to say where its mover is.
        let crowd_lasts_ms = account.press.as_ref().map_or(0, Press::lasts_ms);
        let in_time_ms = TICKS_TO_TELL * account.rules.tick_ms + account.rules.round_trip_ms + crowd_lasts_ms;
        let mut still: BTreeMap<SessionId, Vec<ObjectId>> = BTreeMap::new();
        for (session, object) in self.suspects.keys().copied() {
            let here = account.people.get(&session).is_some_and(|person| {
                is_due(account, session, person, object, now_ms) && in_view(account, sights, person, object, now_ms)
            });
            if here {
                still.entry(session).or_default().push(object);
            }
        }
        let before = std::mem::take(&mut self.suspects);
        for (session, mut objects) in still {
            account.leave_out(session, &mut objects, now_ms);
            let room = account.has_room(session);
            for pair in objects.into_iter().map(|object| (session, object)) {
                let suspect = before[&pair].at(now_ms, room);
                if suspect.untold_ms > in_time_ms {
                    self.misses.extend(finding(account, pair.0, pair.1, now_ms));
                } else {
                    self.suspects.insert(pair, suspect);
                }
            }
        }
    }
}

impl Account {
    /// Whether somebody there is in a cell, and not just near one.
    pub(super) fn is_in_a_cell(&self, place: [f64; 3]) -> bool {
        self.cells.at(place).is_some_and(|place| place.distance_m == 0.0)
    }

    /// Whether a session may be told of somebody new before its reader has taken what waits.
    fn has_room(&self, session: SessionId) -> bool {
        self.people.get(&session).is_some_and(|person| person.room > 0)
    }

    /// Where some are left out in a crowd: it stands where everybody is now.
    fn crowd_together(&mut self, now_ms: Ms) {
        if let Some(press) = &mut self.press {
            press.stand(&self.movers, &self.cells, now_ms, self.rules.tick_ms);
        }
    }

    /// Takes away those of these that the crowd hides so far from a participant that it need not be told of them.
    fn leave_out(&mut self, session: SessionId, objects: &mut Vec<ObjectId>, now_ms: Ms) {
        let within_ms = self.known_within_ms();
        let (Some(press), Some(person)) = (&mut self.press, self.people.get(&session)) else {
            return;
        };
        let avatar = self.movers.get(&person.avatar).filter(|_| !objects.is_empty());
        let stands = avatar.map_or_else(Vec::new, |avatar| avatar.stands(now_ms, within_ms));
        let views = stands
            .into_iter()
            .filter_map(|eye| press.seen_from(eye, person.aoi.leave_m, &self.cells));
        let views: Vec<_> = views.collect();
        let hidden = |object: &ObjectId| {
            let mover = self.movers.get(object);
            mover.is_some_and(|mover| {
                let there = mover.position(now_ms);
                views.iter().any(|view| press.may_leave_out(view, there))
            })
        };
        objects.retain(|object| !hidden(object));
    }
}

fn told_of(account: &Account, told: Telling, now_ms: Ms) -> Option<Finding> {
    let found = finding(account, told.session, told.object, now_ms)?;
    Some(Finding {
        event: Some(told.event),
        ..found
    })
}

pub(super) fn finding(account: &Account, session: SessionId, object: ObjectId, now_ms: Ms) -> Option<Finding> {
    let person = account.people.get(&session)?;
    let mover = account.movers.get(&object)?;
    Some(Finding {
        at_ms: now_ms,
        session,
        object,
        event: None,
        eye: account.movers.get(&person.avatar)?.position(now_ms),
        position: mover.position(now_ms),
        eye_cells: person.eyes.0.clone(),
        cells: mover.cells(&account.cells, now_ms, account.rules.tick_ms),
        why: None,
    })
}

/// Whether what a session was told of may be seen from where its participant may be.
fn could_see(account: &Account, sights: &mut Sights, told: &Finding) -> Sight {
    // Whoever is in no cell is served as if in the nearest one, of which nothing can be proved.
    let proves = account.is_in_a_cell(told.eye) && account.is_in_a_cell(told.position);
    match seen_from_cells(account, sights, told) {
        Sight::Hidden if !proves => Sight::NotFound,
        sight => sight,
    }
}

/// The same, for whoever is in the cells that are looked from.
fn seen_from_cells(account: &Account, sights: &mut Sights, told: &Finding) -> Sight {
    let open = sights.any_sees_any(&told.eye_cells, &told.cells, &BTreeSet::new());
    let settled = |since_ms: Ms| told.at_ms - since_ms > DOOR_GRACE_MS;
    let closed = account.closed().filter(|(_, door)| settled(door.since_ms));
    let closed: BTreeSet<_> = closed.map(|(object, _)| object).collect();
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
        && !person.shown.contains_key(&object)
        && distance_m(eye, there) < person.aoi.enter_m - margin_m
}

fn in_view(account: &Account, sights: &Sights, person: &Person, object: ObjectId, now_ms: Ms) -> bool {
    let (Some(avatar), Some(mover)) = (account.movers.get(&person.avatar), account.movers.get(&object)) else {
        return false;
    };
    let there = mover.position(now_ms);
    let closed: Vec<Bounds> = account.closed().map(|(_, door)| door.bounds).collect();
    let sees = |eye: [f64; 3]| {
        account.is_in_a_cell(eye) && sights.in_plain_view(eye, there, PLAIN_M.min(0.5 * mover.radius_m), &closed)
    };
    account.is_in_a_cell(there) && avatar.stands(now_ms, account.known_within_ms()).into_iter().any(sees)
}
