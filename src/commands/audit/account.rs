//! Where was everybody, and who had been told of whom? Kept from what a recording says alone: inputs say where, outputs say
//! what was told.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{
    Ms,
    aoi::Aoi,
    cells::Cells,
    event::SessionId,
    journal::{Ground, Input},
    pace::Bucket,
    world::{NewMover, ROOM, Rules},
};
use belvedere_scene::{Bounds, CellId, ObjectId, Revision};

use super::{crowd::Press, judge::Finding, mover::Mover, poses::Shown, promises::Promises, telling::Telling};

/// A scene as a recording tells of it.
#[derive(Debug)]
pub(super) struct Account {
    pub(super) rules: Rules,
    pub(super) revision: Revision,
    pub(super) cells: Cells,
    pub(super) people: BTreeMap<SessionId, Person>,
    pub(super) movers: BTreeMap<ObjectId, Mover>,
    /// Doors that were ever moved; all others are open.
    pub(super) doors: BTreeMap<ObjectId, Door>,
    /// One was moved since the last tick.
    pub(super) doors_moved: bool,
    /// Told of since the last tick but one.
    pub(super) told: Vec<Telling>,
    /// Doors that were told of since then, as everybody stood at that moment.
    pub(super) doors_told: Vec<Finding>,
    /// Sessions that there were.
    pub(super) ended: BTreeSet<SessionId>,
    /// Where so many stand that some need not be told of.
    pub(super) press: Option<Press>,
    /// What owners were told by `hush`.
    pub(super) promises: Promises,
}

#[derive(Debug)]
pub(super) struct Person {
    pub(super) avatar: ObjectId,
    pub(super) aoi: Aoi,
    hears_movers: bool,
    pub(super) listens: bool,
    /// Movers that it has been told of, and not that they are gone, and what it was told last.
    pub(super) shown: BTreeMap<ObjectId, Shown>,
    /// These, and those that may come back without an info.
    pub(super) known: BTreeSet<ObjectId>,
    /// What it was told of doors; it takes all others for open.
    pub(super) doors: BTreeMap<ObjectId, bool>,
    /// What it may be told of poses.
    pub(super) bytes: Bucket,
    /// So many infos it may still be told before its reader has taken some.
    pub(super) room: usize,
    /// Where it may look from, and since when that is so.
    pub(super) eyes: (Vec<CellId>, Ms),
}

/// A door that was moved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Door {
    pub(super) bounds: Bounds,
    pub(super) open: bool,
    /// Since when it stands so.
    pub(super) since_ms: Ms,
}

impl Person {
    /// Whether it is to be told of movers.
    pub(super) fn hears(&self) -> bool {
        self.hears_movers && self.listens
    }

    /// What it was told before is void.
    pub(super) fn forget(&mut self) {
        self.room = ROOM;
        self.shown.clear();
        self.known.clear();
        self.doors.clear();
    }
}

impl Account {
    pub(super) fn begin(rules: Rules, ground: &Ground) -> Self {
        Self {
            rules,
            revision: ground.revision,
            cells: Cells::new(ground.cells.clone()),
            people: BTreeMap::new(),
            movers: BTreeMap::new(),
            doors: BTreeMap::new(),
            doors_moved: false,
            told: Vec::new(),
            doors_told: Vec::new(),
            ended: BTreeSet::new(),
            press: Press::of(&rules, ground),
            promises: Promises::default(),
        }
    }

    /// Something has come in, and was not refused.
    pub(super) fn hear(&mut self, input: &Input, now_ms: Ms) {
        match input {
            Input::Open {
                session,
                object,
                visitor,
            } => {
                let avatar = NewMover {
                    pose: visitor.pose,
                    max_speed_mps: visitor.max_speed_mps,
                    max_acceleration_mps2: visitor.max_acceleration_mps2,
                    radius_m: visitor.radius_m,
                    look: visitor.look.clone(),
                    way: None,
                };
                self.movers.insert(*object, Mover::new(Some(*session), &avatar, now_ms));
                let person = Person {
                    avatar: *object,
                    aoi: visitor.aoi,
                    hears_movers: visitor.hears_movers,
                    listens: visitor.listens,
                    shown: BTreeMap::new(),
                    known: BTreeSet::new(),
                    doors: BTreeMap::new(),
                    bytes: Bucket::full(self.rules.bytes_per_s, self.rules.bytes_per_s, now_ms),
                    room: ROOM,
                    eyes: (Vec::new(), now_ms),
                };
                self.people.insert(*session, person);
                self.look(*session, now_ms);
            }
            Input::Pose { session, sent } => {
                let avatar = self.people.get(session).map(|person| person.avatar);
                if let Some(mover) = avatar.and_then(|avatar| self.movers.get_mut(&avatar)) {
                    mover.say(sent, now_ms);
                }
                self.look(*session, now_ms);
            }
            Input::Aoi { session, aoi } => {
                if let Some(person) = self.people.get_mut(session) {
                    person.aoi = *aoi;
                }
            }
            Input::Close { session } => {
                self.end_promises_to(*session);
                if let Some(person) = self.people.remove(session) {
                    self.movers.remove(&person.avatar);
                    self.ended.insert(*session);
                }
                for mover in self.movers.values_mut().filter(|mover| mover.owner == Some(*session)) {
                    mover.owner = None;
                }
            }
            Input::Create { object, owner, new } => {
                self.movers.insert(*object, Mover::new(*owner, new, now_ms));
            }
            Input::Import { object, new } => match self.movers.get_mut(object) {
                Some(mover) => mover.say(&new.pose, now_ms),
                None => {
                    let mut mover = Mover::new(None, new, now_ms);
                    mover.abroad = true;
                    self.movers.insert(*object, mover);
                }
            },
            // Of who is here, others have nothing to say.
            Input::Withdraw { object, .. } => {
                if self.movers.get(object).is_some_and(|mover| mover.abroad) {
                    self.movers.remove(object);
                }
            }
            Input::Move { object, sent } => {
                if let Some(mover) = self.movers.get_mut(object) {
                    mover.say(sent, now_ms);
                }
            }
            Input::Destroy { object } => _ = self.movers.remove(object),
            Input::Door { object, bounds, open } => {
                let (bounds, open, since_ms) = (*bounds, *open, now_ms);
                let door = self.doors.entry(*object).or_insert(Door { bounds, open, since_ms });
                if door.open != open {
                    (door.open, door.since_ms) = (open, since_ms);
                }
                self.doors_moved = true;
            }
            Input::Rebase { ground, .. } => {
                self.revision = ground.revision;
                self.cells = Cells::new(ground.cells.clone());
                self.press = Press::of(&self.rules, ground);
                self.doors.clear();
                self.people.values_mut().for_each(|person| person.doors.clear());
                self.movers.values_mut().for_each(|mover| mover.promise = None);
                let everybody: Vec<_> = self.people.keys().copied().collect();
                everybody.into_iter().for_each(|session| self.look(session, now_ms));
            }
            Input::Listens { session, listens } => {
                self.end_promises_to(*session);
                if let Some(person) = self.people.get_mut(session) {
                    person.listens = *listens;
                    person.forget();
                }
            }
            Input::Room { session } => {
                if let Some(person) = self.people.get_mut(session) {
                    person.room = ROOM;
                }
            }
            // Whoever goes on looks from elsewhere by now.
            Input::Tick => {
                let everybody: Vec<_> = self.people.keys().copied().collect();
                everybody.into_iter().for_each(|session| self.look(session, now_ms));
            }
            Input::Begin { .. }
            | Input::Teach { .. }
            | Input::Screen { .. }
            | Input::Resync { .. }
            | Input::WatchAbroad { .. }
            | Input::Wakeable { .. } => {}
        }
    }

    /// Where somebody goes is known when it is known to this time since when: it comes less far meanwhile than it may before an event
    /// arrives.
    pub(super) fn known_within_ms(&self) -> Ms {
        self.rules.round_trip_ms - self.rules.tick_ms
    }

    /// Doors that are closed.
    pub(super) fn closed(&self) -> impl Iterator<Item = (ObjectId, &Door)> {
        let closed = self.doors.iter().filter(|(_, door)| !door.open);
        closed.map(|(object, door)| (*object, door))
    }

    fn look(&mut self, session: SessionId, now_ms: Ms) {
        let Some(person) = self.people.get_mut(&session) else {
            return;
        };
        let Some(avatar) = self.movers.get(&person.avatar) else {
            return;
        };
        let time_ms = self.rules.round_trip_ms + 2 * self.rules.tick_ms;
        let eyes = avatar.eyes(&self.cells, now_ms, avatar.reach_in_m(time_ms));
        if eyes != person.eyes.0 {
            person.eyes = (eyes, now_ms);
        }
    }
}
