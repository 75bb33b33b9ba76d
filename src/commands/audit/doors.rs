//! Does everybody who may see a door hear how it stands, and nobody else?
//!
//! Doors are published open, and whoever begins to listen takes them for that. A *miss*: a place within the door's box, inside a cell,
//! is in plain view of a participant, well inside the area of interest, and for longer than it takes to be told the participant was
//! told otherwise, or nothing though the door was closed. A *leak*: somebody was told of a door although it is proved that no sight
//! line leads from any cell that its participant may have looked from into any cell that the door stands in, whatever that door
//! itself hides. So nothing is asked here but where everybody is, what stands between, and what came in.

use std::collections::BTreeSet;

use belvedere_live::{Ms, cells::distance_m, event::SessionId};
use belvedere_scene::{Bounds, ObjectId};
use belvedere_verify::between::Sight;
use serde_json::Value;

use super::{
    account::{Account, Door, Person},
    judge::{DOOR_GRACE_MS, Finding, Judge, PLAIN_M},
    poses::Untrue,
    sights::Sights,
    telling::Wrong,
};

/// How a door stands is told within so many ticks.
const TICKS_TO_TELL: Ms = 2;
/// Places along each edge of a door's box that are looked at.
const ALONG: [f64; 3] = [0.5, 0.15, 0.85];

impl Account {
    /// A session is told how a door stands.
    pub(super) fn tell_door(&mut self, session: SessionId, object: ObjectId, said: &Value, at_ms: Ms) -> Option<Wrong> {
        let stands = self.doors.get(&object)?.open;
        self.doors_told
            .extend(finding(self, session, object, Some("door"), at_ms));
        let told = said["open"].as_bool();
        let person = self.people.get_mut(&session)?;
        // Nonsense is no news.
        person.doors.extend(told.map(|open| (object, open)));
        let untrue = Untrue {
            at_ms,
            session,
            object,
            event: Some("door"),
            off_m: None,
            why: "the door stands otherwise",
        };
        (told != Some(stands)).then_some(Wrong::Untrue(untrue))
    }
}

impl Judge {
    /// Looks at doors after a tick: at who was told of them, and now and then, or when one was moved, at who was not.
    pub(super) fn look_at_doors(&mut self, account: &mut Account, sights: &mut Sights, now_ms: Ms, looks: bool) {
        for told in std::mem::take(&mut account.doors_told) {
            self.doors += 1;
            match could_see(account, sights, &told) {
                Sight::Seen => {}
                Sight::NotFound => self.undecided.push(told),
                Sight::Hidden => self.leaks.push(told),
            }
        }
        if std::mem::take(&mut account.doors_moved) || looks {
            for (session, person) in account.people.iter().filter(|(_, person)| person.hears()) {
                for object in account.doors.keys() {
                    if is_missed(account, sights, person, *object, now_ms) {
                        self.door_suspects.entry((*session, *object)).or_insert(now_ms);
                    }
                }
            }
        }
        let mut suspects = std::mem::take(&mut self.door_suspects);
        suspects.retain(|(session, object), since_ms| {
            let person = account.people.get(session).filter(|person| person.hears());
            if !person.is_some_and(|person| is_missed(account, sights, person, *object, now_ms)) {
                return false;
            }
            let told_late = now_ms - *since_ms > TICKS_TO_TELL * account.rules.tick_ms;
            if told_late {
                self.misses.extend(finding(account, *session, *object, None, now_ms));
            }
            !told_late
        });
        self.door_suspects = suspects;
    }
}

fn finding(
    account: &Account,
    session: SessionId,
    object: ObjectId,
    event: Option<&'static str>,
    at_ms: Ms,
) -> Option<Finding> {
    let (person, door) = (account.people.get(&session)?, account.doors.get(&object)?);
    Some(Finding {
        at_ms,
        session,
        object,
        event,
        eye: account.movers.get(&person.avatar)?.position(at_ms),
        position: within(&door.bounds, [0.5; 3]),
        eye_cells: person.eyes.0.clone(),
        cells: account.cells.meeting(&door.bounds),
        why: None,
    })
}

/// Whether a door that a session was told of may be seen from where its participant was.
fn could_see(account: &Account, sights: &mut Sights, told: &Finding) -> Sight {
    let open = sights.any_sees_any(&told.eye_cells, &told.cells, &BTreeSet::new());
    let settled = |since_ms: Ms| told.at_ms - since_ms > DOOR_GRACE_MS;
    let others = account.closed().filter(|(object, _)| *object != told.object);
    let closed: BTreeSet<_> = others
        .filter(|(_, door)| settled(door.since_ms))
        .map(|(object, _)| object)
        .collect();
    let person = account.people.get(&told.session);
    let stands = person.is_some_and(|person| person.eyes.0 == told.eye_cells && settled(person.eyes.1));
    let sight = if open != Sight::Seen || !stands || closed.is_empty() {
        open
    } else {
        sights.any_sees_any(&told.eye_cells, &told.cells, &closed)
    };
    // Whoever is in no cell is served as if in the nearest one, of which nothing can be proved.
    match sight {
        Sight::Hidden if !account.is_in_a_cell(told.eye) || told.cells.is_empty() => Sight::NotFound,
        sight => sight,
    }
}

/// Whether a participant who sees a door takes it to stand as it does not.
fn is_missed(account: &Account, sights: &Sights, person: &Person, object: ObjectId, now_ms: Ms) -> bool {
    let Some(door) = account.doors.get(&object) else {
        return false;
    };
    let believed = person.doors.get(&object).copied().unwrap_or(true);
    believed != door.open && is_in_view(account, sights, person, (object, door), now_ms)
}

fn is_in_view(
    account: &Account,
    sights: &Sights,
    person: &Person,
    (object, door): (ObjectId, &Door),
    now_ms: Ms,
) -> bool {
    let Some(avatar) = account.movers.get(&person.avatar) else {
        return false;
    };
    let near_m = person.aoi.enter_m - avatar.ball(now_ms, account.rules.tick_ms).radius_m;
    let others = account.closed().filter(|(other, _)| *other != object);
    let others: Vec<_> = others.map(|(_, door)| door.bounds).collect();
    let thin_m = door.bounds.size_m().into_iter().fold(f64::INFINITY, f64::min);
    let shows = |eye: [f64; 3], place: [f64; 3]| {
        distance_m(avatar.position(now_ms), place) < near_m
            && account.is_in_a_cell(place)
            && sights.in_plain_view(eye, place, PLAIN_M.min(0.4 * thin_m), &others)
    };
    let places = ALONG
        .into_iter()
        .flat_map(|x| ALONG.into_iter().flat_map(move |y| ALONG.map(|z| [x, y, z])));
    let places = places.map(|share| within(&door.bounds, share));
    let stands = avatar.stands(now_ms, account.known_within_ms()).into_iter();
    let mut eyes = stands.filter(|eye| account.is_in_a_cell(*eye));
    eyes.any(|eye| places.clone().any(|place| shows(eye, place)))
}

fn within(bounds: &Bounds, share: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| bounds.min[axis] + share[axis] * (bounds.max[axis] - bounds.min[axis]))
}
