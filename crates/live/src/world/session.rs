//! What is kept of a session?

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use belvedere_scene::ObjectId;

use super::{among::Among, sight::Eye};
use crate::{
    Ms,
    aoi::Aoi,
    event::{Attention, SessionId},
    motion::Pose,
    pace::Bucket,
};

/// Infos of so many hidden movers a client is expected to keep: the last ones.
pub const REMEMBERED: usize = 256;

/// So many infos are told before it is known that the reader has taken what waits: far less than may wait for it, however large they are.
pub const ROOM: usize = 64;

#[derive(Debug)]
pub(super) struct Session {
    /// The participant's own mover.
    pub(super) object: ObjectId,
    pub(super) aoi: Aoi,
    hears_movers: bool,
    /// Somebody does, or will before what is said meanwhile is lost.
    pub(super) listens: bool,
    /// Somebody hears at once what is said.
    pub(super) wakeable: bool,
    /// Movers that it drives, beside its own.
    pub(super) driven: BTreeSet<ObjectId>,
    pub(super) eye: Eye,
    /// Movers that it is told of.
    pub(super) shown: BTreeMap<ObjectId, Shown>,
    /// Hidden movers whose infos it still has, oldest first.
    remembered: VecDeque<ObjectId>,
    /// What it believes of doors that were ever moved.
    pub(super) doors: BTreeMap<ObjectId, bool>,
    pub(super) bytes: Bucket,
    /// So many infos may be told until its reader has taken what waits.
    pub(super) room: usize,
    /// What it sees of a crowd, where there is one.
    pub(super) among: Option<Box<Among>>,
    /// Something that it sees, or how it looks, may have changed since it was told of poses.
    pub(super) restless: bool,
    /// From where it was told of poses last, where it stood in no crowd.
    pub(super) told_from: Option<[f64; 3]>,
}

/// What a session knows of a mover.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) since_ms: Ms,
    /// It has the info, or is told of it at once; else nothing is said of it until there is room.
    pub(super) known: bool,
    /// The last pose that it was sent; none when it must be sent one at once.
    pub(super) sent: Option<Pose>,
    pub(super) sent_at_ms: Ms,
    pub(super) attention: Attention,
    pub(super) priority: f64,
    /// It rests about where the session was told (within [`crate::pace::tolerance_m`]), and neither has stirred since: there is nothing
    /// to be told.
    pub(super) rests: bool,
}

impl Session {
    pub(super) fn new(object: ObjectId, aoi: Aoi, (hears_movers, listens): (bool, bool), bytes: Bucket) -> Self {
        Self {
            object,
            aoi,
            hears_movers,
            listens,
            wakeable: listens,
            driven: BTreeSet::new(),
            eye: Eye::default(),
            shown: BTreeMap::new(),
            remembered: VecDeque::new(),
            doors: BTreeMap::new(),
            bytes,
            room: ROOM,
            among: None,
            restless: false,
            told_from: None,
        }
    }

    /// Whether it is to be told of movers and doors.
    pub(super) fn hears(&self) -> bool {
        self.hears_movers && self.listens
    }

    /// Something that it sees, or how it looks, may have changed: it is put among those for which that is so, once.
    pub(super) fn unsettle(&mut self, id: SessionId, unsettled: &mut Vec<SessionId>) {
        if !self.restless {
            self.restless = true;
            unsettled.push(id);
        }
    }

    /// Takes note that a mover is hidden.
    pub(super) fn remember(&mut self, object: ObjectId) {
        if self.remembered.len() == REMEMBERED {
            self.remembered.pop_front();
        }
        self.remembered.push_back(object);
    }

    /// Whether the client still has the info of a mover that appears.
    pub(super) fn recall(&mut self, object: ObjectId) -> bool {
        let at = self.remembered.iter().position(|other| *other == object);
        at.is_some_and(|at| self.remembered.remove(at).is_some())
    }

    /// Nothing that was told counts any more, and nothing waits for its reader.
    pub(super) fn forget(&mut self) {
        self.room = ROOM;
        self.remembered.clear();
        self.doors.clear();
    }
}
