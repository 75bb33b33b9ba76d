//! What do closed doors hide, and who hears of them?
//!
//! What a cell sees is published with all doors open. What closed doors hide of that is for geometry to say, so it is
//! asked for ([`World::unscreened`]) and taken note of ([`World::screen`]): for the cells that somebody stands in or is
//! about to enter, and only of doors that can be seen from there. Until an answer comes everything counts as visible
//! that was so before. An answer says of each cell which doors it takes to hide it ([`Hidden`]): it stays right when others are closed
//! or opened, and is void as soon as one of these opens. So nobody ever misses what a door has just uncovered, and nobody hears
//! of what others still hide.

use std::collections::BTreeSet;

use belvedere_scene::{Bounds, CellId, ObjectId};

use super::World;
use crate::{
    Ms,
    cells::{Ball, Cell, Hidden},
    event::{Event, SessionId},
};

/// Whoever may be in a cell so soon is shown from there what closed doors leave as soon as it comes in.
const AHEAD_MS: Ms = 1_000;

#[derive(Debug)]
pub(super) struct Door {
    open: bool,
    /// What it stands in, rising.
    cells: Vec<CellId>,
}

/// A question: which of these cells cannot be seen from that one?
#[derive(Debug, Clone, PartialEq)]
pub struct Unscreened {
    /// Where the eyes are.
    pub cell: CellId,
    /// Its shape.
    pub shape: Cell,
    /// What else is seen while all doors are open, with the shapes of these, rising.
    pub others: Vec<(CellId, Cell)>,
    /// While these doors are closed, rising.
    pub closed: Vec<ObjectId>,
}

impl World {
    /// Opens or closes a door; everybody who may see it is told, the others when they come to see it.
    pub fn set_door(&mut self, door: ObjectId, bounds: &Bounds, open: bool, now_ms: Ms) {
        let cells = self.cells.meeting(bounds);
        let watching: BTreeSet<_> = cells
            .iter()
            .flat_map(|cell| &self.watchers[cell.index()])
            .copied()
            .collect();
        self.doors.insert(door, Door { open, cells });
        watching.into_iter().for_each(|session| self.tell_doors(session));
        let widened = if open { self.cells.open(door) } else { Vec::new() };
        self.look_again(&widened, now_ms);
        let everybody: Vec<_> = self.sessions.keys().copied().collect();
        everybody.into_iter().for_each(|session| self.ask_ahead(session));
    }

    /// Whether a door is open, as all are until somebody closes them.
    #[must_use]
    pub fn is_open(&self, door: ObjectId) -> bool {
        self.doors.get(&door).is_none_or(|door| door.open)
    }

    /// Doors that are closed, rising.
    #[must_use]
    pub fn closed(&self) -> Vec<ObjectId> {
        let closed = self.doors.iter().filter(|(_, door)| !door.open);
        closed.map(|(object, _)| *object).collect()
    }

    /// Questions to be answered with [`World::screen`], each told once.
    pub fn unscreened(&mut self) -> Vec<Unscreened> {
        let asked = std::mem::take(&mut self.unscreened);
        asked.into_iter().filter_map(|cell| self.question(cell)).collect()
    }

    /// What is not known of a cell.
    fn question(&self, cell: CellId) -> Option<Unscreened> {
        let sees = self.cells.sees_through_all(cell)?;
        let closed = self.closed_near(sees);
        if self.cells.is_screened_by(cell, &closed) {
            return None;
        }
        let shape_of = |cell: CellId| self.cells.cell(cell).cloned();
        let others = sees.iter().filter(|other| **other != cell);
        Some(Unscreened {
            cell,
            shape: shape_of(cell)?,
            others: others.filter_map(|other| Some((*other, shape_of(*other)?))).collect(),
            closed,
        })
    }

    /// An answer: while these doors are closed, those cells cannot be seen from this one. What takes a door that has been opened
    /// meanwhile is void, and asked again.
    pub fn screen(&mut self, cell: CellId, closed: &[ObjectId], hidden: &[Hidden], now_ms: Ms) {
        self.cells.screen(cell, closed, hidden);
        for door in closed {
            if self.is_open(*door) {
                self.cells.open(*door);
                self.unscreened.insert(cell);
            }
        }
        self.look_again(&[cell], now_ms);
    }

    /// Closed doors that stand in one of these cells: others hide none of them.
    fn closed_near(&self, seen: &[CellId]) -> Vec<ObjectId> {
        let is_seen = |cell: &CellId| seen.binary_search(cell).is_ok();
        let near = self.doors.iter().filter(|(_, door)| !door.open);
        let near = near.filter(|(_, door)| door.cells.iter().any(is_seen));
        near.map(|(object, _)| *object).collect()
    }

    /// A larger ball around an eye where there are closed doors.
    pub(super) fn looked_ahead(&self, eye: Ball, max_speed_mps: f64) -> Ball {
        let closed = self.doors.values().any(|door| !door.open);
        let ahead_m = max_speed_mps * AHEAD_MS as f64 * 1e-3;
        Ball {
            radius_m: if closed {
                eye.radius_m.max(ahead_m)
            } else {
                eye.radius_m
            },
            ..eye
        }
    }

    /// Asks what closed doors hide from where a participant is or may soon be.
    pub(super) fn ask_ahead(&mut self, id: SessionId) {
        let closed = self.doors.values().any(|door| !door.open);
        let Some(session) = self.sessions.get(&id).filter(|session| closed && session.hears()) else {
            return;
        };
        let avatar = &self.movers[&session.object];
        let eye = self.rules.eye_ball(avatar.pose.position, avatar.max_speed_mps);
        let cells = self.cells.under(&self.looked_ahead(eye, avatar.max_speed_mps));
        self.unscreened.extend(cells);
    }

    /// Something else is seen from these cells than before.
    fn look_again(&mut self, cells: &[CellId], now_ms: Ms) {
        let stands_in = |cell: &CellId| cells.binary_search(cell).is_ok();
        let there = self
            .sessions
            .iter_mut()
            .filter(|(_, session)| session.eye.cells.iter().any(stands_in));
        let sessions: Vec<_> = there
            .map(|(id, session)| {
                session.eye.cells.clear();
                *id
            })
            .collect();
        sessions.into_iter().for_each(|session| self.look(session, now_ms));
    }

    /// Tells a session what it does not know of the doors that it may see. Doors are published open.
    pub(super) fn tell_doors(&mut self, id: SessionId) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        for (object, door) in &self.doors {
            let watched = |cell: &CellId| session.eye.watched.binary_search(cell).is_ok();
            let believed = session.doors.get(object).copied().unwrap_or(true);
            if believed != door.open && door.cells.iter().any(watched) {
                session.doors.insert(*object, door.open);
                let (object, open) = (*object, door.open);
                self.events.push((id, Event::Door { object, open }));
            }
        }
    }
}
