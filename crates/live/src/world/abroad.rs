//! What do the other nodes of a scene mean for this one's rules?
//!
//! Every mover lives on one node, its *home*, where it is hushed and woken. A node that watches one of its cells has it
//! *imported*: a mover like any other to sessions, doors and crowds, always awake, since its home says where it is, and
//! withdraws it when nobody here watches it any more. The other way round, the cells that other nodes watch count as watched:
//! a mover is hidden only when no session of any node may see it. [`crate::nodes`] says how nodes tell each other.

use std::collections::BTreeSet;

use belvedere_scene::{CellId, ObjectId};

use super::{NewMover, Refusal, Sent, World, mover::Mover};
use crate::{
    Ms,
    event::{Gone, SessionId},
    motion::Pose,
};

/// The cells that sessions of this node watch.
#[derive(Debug, Default)]
pub(super) struct Watched {
    cells: BTreeSet<CellId>,
    changes: u64,
}

impl Watched {
    pub(super) fn clear(&mut self) {
        self.cells.clear();
        self.changes += 1;
    }
}

/// A mover of this node that another node watches.
#[derive(Debug, Clone, Copy)]
pub struct Exported<'a> {
    /// The mover.
    pub object: ObjectId,
    /// The cells that it touches, rising.
    pub cells: &'a [CellId],
    /// How it moves, as of now.
    pub pose: Pose,
    mover: &'a Mover,
}

impl Exported<'_> {
    /// What another node needs to know of it. It has no trajectory there: its home tells of each turn.
    #[must_use]
    pub fn introduction(&self) -> NewMover {
        NewMover {
            pose: Sent::of(&self.pose),
            max_speed_mps: self.mover.max_speed_mps,
            max_acceleration_mps2: None,
            radius_m: self.mover.radius_m,
            look: self.mover.look.clone(),
            way: None,
        }
    }
}

impl Sent {
    /// A pose as one node sends it to another.
    #[must_use]
    pub fn of(pose: &Pose) -> Self {
        Self {
            t_ms: Some(pose.t_ms),
            position: pose.position,
            orientation: pose.orientation,
            velocity: Some(pose.velocity),
            acceleration: Some(pose.acceleration),
        }
    }
}

impl World {
    /// Adds a mover of another node, or, when it is there already, moves it.
    ///
    /// # Errors
    /// When something about it cannot be, or a mover of this node has its id.
    pub fn import(&mut self, object: ObjectId, new: NewMover, now_ms: Ms) -> Result<(), Refusal> {
        match self.movers.get(&object) {
            Some(mover) if mover.abroad => self.shift(object, new.pose, now_ms).map(|_| ()),
            Some(_) => Err(Refusal::Taken),
            None => {
                self.add(object, None, new, now_ms)?;
                if let Some(mover) = self.movers.get_mut(&object) {
                    mover.abroad = true;
                    self.abroad += 1;
                }
                Ok(())
            }
        }
    }

    /// Removes a mover of another node: nobody here may see it any more (`hidden`), its node is gone (`left`), or it is.
    pub fn withdraw(&mut self, object: ObjectId, reason: Gone, now_ms: Ms) {
        let Some(mover) = self.movers.get(&object).filter(|mover| mover.abroad) else {
            return;
        };
        match reason {
            Gone::Hidden => self.end_showing(object, now_ms),
            Gone::Left => {
                let shown_to = mover.shown_to.clone();
                shown_to.into_iter().for_each(|id| self.hide(id, object, reason));
            }
            Gone::Destroyed => {}
        }
        self.destroy(object);
    }

    /// Takes note of cells that other nodes have begun to watch, and of those that none of them watches any more.
    pub fn watch_abroad(&mut self, begun: &[CellId], ended: &[CellId], now_ms: Ms) {
        for cell in ended {
            self.watched_abroad.remove(cell);
            self.stir_in(*cell);
        }
        for cell in begun {
            let Some(here) = self.movers_in.get(cell.index()) else {
                continue;
            };
            let here: Vec<_> = here.iter().copied().collect();
            if self.watched_abroad.insert(*cell) {
                here.into_iter().for_each(|object| self.expose(object, now_ms));
            }
        }
    }

    /// Cells that sessions of this node watch, with a number that changes when they do.
    #[must_use]
    pub fn watched(&self) -> (&BTreeSet<CellId>, u64) {
        (&self.watched.cells, self.watched.changes)
    }

    /// Movers of this node that are awake in a cell which another node watches.
    pub fn exported(&self, now_ms: Ms) -> impl Iterator<Item = Exported<'_>> {
        let watched = |cells: &[CellId]| cells.iter().any(|cell| self.watched_abroad.contains(cell));
        let awake = self.awake.iter().filter(|_| !self.watched_abroad.is_empty());
        awake.filter_map(move |object| {
            let mover = &self.movers[object];
            let exported = Exported {
                object: *object,
                cells: &mover.cells,
                pose: mover.pose_at(now_ms),
                mover,
            };
            (!mover.abroad && watched(&mover.cells)).then_some(exported)
        })
    }

    /// Whether there is such a mover, of whichever node.
    #[must_use]
    pub fn holds(&self, object: ObjectId) -> bool {
        self.movers.contains_key(&object)
    }

    pub(super) fn watch(&mut self, cell: CellId, session: SessionId) {
        let watchers = &mut self.watchers[cell.index()];
        watchers.insert(session);
        self.watched.changes += u64::from(self.watched.cells.insert(cell));
    }

    pub(super) fn unwatch(&mut self, cell: CellId, session: SessionId) {
        let watchers = &mut self.watchers[cell.index()];
        watchers.remove(&session);
        if watchers.is_empty() {
            self.watched.changes += u64::from(self.watched.cells.remove(&cell));
        }
        self.stir_in(cell);
    }

    /// A cell is watched less: who is awake in it may be put away.
    fn stir_in(&mut self, cell: CellId) {
        let here = self.movers_in.get(cell.index()).into_iter().flatten();
        self.restless.extend(here.filter(|object| self.awake.contains(object)));
    }
}
