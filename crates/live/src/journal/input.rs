//! What may happen to a scene, and what does it answer? Each as a value that can be written down.

use belvedere_scene::{Bounds, CellId, ObjectId, Revision, SceneName, foliage::Foliage};
use serde::{Deserialize, Serialize};

use crate::{
    Ms, World,
    aoi::Aoi,
    cells::{Cell, Cells, Hidden},
    crowd::Crowd,
    event::{Event, Gone, SessionId, Void},
    world::{Moved, NewMover, Refusal, Rules, Seen, Sent, Visitor, around},
};

/// What the rules know of a revision: everything but what is seen from where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ground {
    /// The revision.
    pub revision: Revision,
    /// The box around its objects.
    pub bounds: Bounds,
    /// Its view cells, by id.
    pub cells: Vec<Cell>,
    /// Its foliage.
    #[serde(default, skip_serializing_if = "Foliage::is_empty")]
    pub foliage: Foliage,
}

impl Ground {
    /// Where people will hide each other on this ground, as [`World`] sees it; nobody is there yet.
    #[must_use]
    pub fn crowd(&self) -> Crowd {
        let cells = Cells::new(self.cells.clone());
        let mut crowd = Crowd::new(&around(&self.bounds.union(&cells.bounds())));
        crowd.plant(&self.foliage);
        crowd
    }

    /// A world on this ground in which nobody is.
    pub(super) fn world(&self, rules: Rules) -> World {
        let mut world = World::new(Cells::new(self.cells.clone()), &self.bounds, rules);
        world.plant(&self.foliage);
        world
    }
}

/// A call of a method of [`World`], whose parameters these are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the methods say what their parameters mean")]
pub enum Input {
    /// A new world.
    Begin {
        scene: SceneName,
        rules: Rules,
        ground: Ground,
    },
    Teach {
        cell: CellId,
        sees: Vec<CellId>,
    },
    Open {
        session: SessionId,
        object: ObjectId,
        visitor: Visitor,
    },
    Pose {
        session: SessionId,
        sent: Sent,
    },
    Aoi {
        session: SessionId,
        aoi: Aoi,
    },
    Close {
        session: SessionId,
    },
    Create {
        object: ObjectId,
        owner: Option<SessionId>,
        new: NewMover,
    },
    Move {
        object: ObjectId,
        sent: Sent,
    },
    Destroy {
        object: ObjectId,
    },
    /// [`World::import`](crate::World::import).
    Import {
        object: ObjectId,
        new: NewMover,
    },
    /// [`World::withdraw`](crate::World::withdraw).
    Withdraw {
        object: ObjectId,
        reason: Gone,
    },
    /// [`World::watch_abroad`](crate::World::watch_abroad).
    WatchAbroad {
        begun: Vec<CellId>,
        ended: Vec<CellId>,
    },
    Door {
        object: ObjectId,
        bounds: Bounds,
        open: bool,
    },
    Screen {
        cell: CellId,
        closed: Vec<ObjectId>,
        hidden: Vec<Hidden>,
    },
    Resync {
        session: SessionId,
        reason: Void,
    },
    /// [`World::make_room`](crate::World::make_room).
    Room {
        session: SessionId,
    },
    /// [`World::listens`](crate::World::listens).
    Listens {
        session: SessionId,
        listens: bool,
    },
    /// [`World::wakeable`](crate::World::wakeable).
    Wakeable {
        session: SessionId,
        wakeable: bool,
    },
    Rebase {
        ground: Ground,
        /// What is seen from wherever somebody stands.
        sights: Vec<(CellId, Vec<CellId>)>,
    },
    Tick,
}

/// What an input is answered.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// It is done.
    Done,
    /// It is refused; why.
    Refused(String),
    /// What became of a participant's pose.
    Seen(Seen),
    /// What became of a mover's pose.
    Moved(Moved),
}

/// All that an input brings about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Output {
    /// For whoever asked.
    pub answer: Answer,
    /// What sessions are told of it, in order: the session, the name of the event, its data.
    pub told: Vec<(SessionId, &'static str, Event)>,
}

/// When something happened: the clock of the world.
pub(super) type At = Ms;

impl From<&Result<Seen, Refusal>> for Answer {
    fn from(seen: &Result<Seen, Refusal>) -> Self {
        match seen {
            Ok(seen) => Self::Seen(*seen),
            Err(refusal) => Self::Refused(refusal.to_string()),
        }
    }
}

impl From<&Result<Moved, Refusal>> for Answer {
    fn from(moved: &Result<Moved, Refusal>) -> Self {
        match moved {
            Ok(moved) => Self::Moved(*moved),
            Err(refusal) => Self::Refused(refusal.to_string()),
        }
    }
}

impl From<&Result<(), Refusal>> for Answer {
    fn from(done: &Result<(), Refusal>) -> Self {
        match done {
            Ok(()) => Self::Done,
            Err(refusal) => Self::Refused(refusal.to_string()),
        }
    }
}

impl From<&()> for Answer {
    fn from((): &()) -> Self {
        Self::Done
    }
}
