//! What do closed doors hide, and who hears of them?
//!
//! What a cell sees is published with all doors open. What closed doors hide of that is for geometry to say, so it is
//! asked for ([`World::next_unscreened`]) and taken note of ([`World::screen`]): for the cells that somebody stands in or is
//! about to enter, and only of doors that can be seen from there. Until an answer comes everything counts as visible
//! that was so before. An answer says of each cell which doors it takes to hide it ([`Hidden`]): it stays right when others are closed
//! or opened, does not count as soon as one of these opens, and counts again when it closes. So nobody ever misses what a door has
//! just uncovered, nobody hears of what others still hide, and a door that closes again waits for no answer. Of all answers so much is
//! kept as memory allows ([`screens`](crate::screens)).

use std::{cmp::Ordering, collections::BTreeSet};

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
        let changed = self.cells.set_door(door, open);
        self.look_again(&changed, now_ms);
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

    /// The newest question, to be answered with [`World::screen`], as doors stand now; each is told once.
    pub fn next_unscreened(&mut self) -> Option<Unscreened> {
        while let Some(cell) = self.unscreened.next() {
            if let Some(question) = self.question(cell) {
                return Some(question);
            }
        }
        None
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

    /// An answer: while these doors are closed, those cells cannot be seen from this one. If doors stand otherwise by now, it is
    /// asked again.
    pub fn screen(&mut self, cell: CellId, closed: &[ObjectId], hidden: &[Hidden], now_ms: Ms) {
        let looked_by = || {
            let looking = self.sessions.values().filter(|session| session.hears());
            looking.flat_map(|session| &session.eye.cells).copied().collect()
        };
        let changed = self.cells.screen(cell, closed, hidden, looked_by);
        if closed.iter().any(|door| self.is_open(*door)) {
            self.unscreened.ask(cell);
        }
        // Whoever looks again asks again: there may have been no room for the answer, nor is there soon.
        if changed {
            self.look_again(&[cell], now_ms);
        }
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
        let (now, last) = self.rules.eye_balls(avatar, session.eye.position);
        let [now, last] = [now, last].map(|eye| self.looked_ahead(eye, avatar.max_speed_mps));
        let mut cells = self.cells.under_either((now, last));
        // The newest question is answered first: that of where it stands, then those of what is near.
        let away_m = |cell: &CellId| self.cells.cell(*cell).map(|cell| cell.bounds.distance_m(now.center));
        cells.sort_by(|a, b| away_m(b).partial_cmp(&away_m(a)).unwrap_or(Ordering::Equal));
        for cell in cells {
            self.cells.look_from(cell);
            self.unscreened.ask(cell);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        aoi::Aoi,
        cells::Cells,
        world::{Look, Rules, Sent, Visitor},
    };

    const DOOR: ObjectId = ObjectId(1);
    const A: SessionId = SessionId(0);

    fn sent(x: f64) -> Sent {
        Sent {
            t_ms: None,
            position: [x, 0.5, 0.5],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
            acceleration: None,
        }
    }

    fn visitor(x: f64) -> Visitor {
        Visitor {
            pose: sent(x),
            aoi: Aoi {
                enter_m: 10.0,
                leave_m: 12.0,
            },
            max_speed_mps: 0.1,
            max_acceleration_mps2: None,
            radius_m: 0.05,
            look: Look::default(),
            hears_movers: true,
            listens: true,
        }
    }

    /// Three cells in a row, with a closed door behind the first one, in which somebody stands.
    fn row() -> World {
        let cell = |i: u32| Cell {
            bounds: Bounds {
                min: [f64::from(i), 0.0, 0.0],
                max: [f64::from(i) + 1.0, 1.0, 1.0],
            },
            planes: vec![],
        };
        let cells = Cells::new((0..3).map(cell).collect());
        let bounds = cells.bounds();
        let mut world = World::new(cells, &bounds, Rules::default());
        for cell in (0..3).map(CellId) {
            world.teach(cell, &[CellId(0), CellId(1), CellId(2)]);
        }
        world.open(A, ObjectId(100), visitor(0.5), 0).unwrap();
        world.set_door(DOOR, &Bounds::around([[1.0, 0.5, 0.5]]), false, 0);
        world
    }

    /// All on the other side of the door are hidden; gives what is hidden from where.
    fn screen(world: &mut World, from: u32) -> [bool; 3] {
        let hidden = |cell: u32| Hidden {
            cell: CellId(cell),
            behind: vec![vec![DOOR]],
        };
        let others: Vec<_> = if from == 0 { vec![1, 2] } else { vec![0] };
        let hidden: Vec<_> = others.into_iter().map(hidden).collect();
        world.screen(CellId(from), &[DOOR], &hidden, 0);
        [0, 1, 2].map(|cell| world.cells.is_screened_by(CellId(cell), &[DOOR]))
    }

    #[test]
    fn where_memory_is_short_what_doors_hide_is_known_where_somebody_looks() {
        let mut world = row();
        assert_eq!(screen(&mut world, 0), [true, false, false]);
        world.cells.limit_screens(1.5);
        assert_eq!(
            screen(&mut world, 2),
            [true, false, false],
            "somebody looks from the first"
        );
        assert_eq!(*world.sessions[&A].eye.sees, [CellId(0)]);
        world.pose(A, sent(2.5), 100).unwrap();
        assert_eq!(screen(&mut world, 2), [false, false, true], "and now from the last");
        assert_eq!(*world.sessions[&A].eye.sees, [CellId(1), CellId(2)]);
        world.pose(A, sent(0.5), 200).unwrap();
        assert_eq!(
            world.sessions[&A].eye.sees.len(),
            3,
            "until that is known again all is seen"
        );
        assert!(world.next_unscreened().is_some_and(|asked| asked.cell == CellId(0)));
    }

    /// Cells that are asked about, the last one first.
    fn asked(world: &mut World) -> Vec<CellId> {
        std::iter::from_fn(|| world.next_unscreened().map(|asked| asked.cell)).collect()
    }

    #[test]
    fn where_somebody_stands_is_asked_about_before_where_they_may_be_soon() {
        let mut world = row();
        asked(&mut world);
        let walker = Visitor {
            max_speed_mps: 0.8,
            ..visitor(1.4)
        };
        world.open(SessionId(1), ObjectId(101), walker, 0).unwrap();
        assert_eq!(asked(&mut world), [CellId(1), CellId(0), CellId(2)]);
    }

    #[test]
    fn what_there_is_no_room_for_is_asked_again_when_somebody_moves_or_a_door_does() {
        let mut world = row();
        let b = SessionId(1);
        screen(&mut world, 0);
        world.cells.limit_screens(1.5);
        world.open(b, ObjectId(101), visitor(2.5), 0).unwrap();
        assert_eq!(asked(&mut world), [CellId(2)]);
        for t_ms in [100, 200] {
            assert_eq!(screen(&mut world, 2), [true, false, false], "somebody looks from both");
            assert_eq!(asked(&mut world), [], "and goes on to do so");
            world.pose(b, sent(2.5), t_ms).unwrap();
            assert_eq!(asked(&mut world), [CellId(2)]);
        }
        screen(&mut world, 2);
        world.set_door(DOOR, &Bounds::around([[1.0, 0.5, 0.5]]), false, 300);
        assert_eq!(asked(&mut world), [CellId(2)]);
    }

    #[test]
    fn whoever_listens_again_sees_all_that_was_uncovered_meanwhile() {
        let mut world = row();
        screen(&mut world, 0);
        assert_eq!(*world.sessions[&A].eye.sees, [CellId(0)]);
        world.listens(A, false, 100);
        world.cells.limit_screens(1.5);
        world.open(SessionId(1), ObjectId(101), visitor(2.5), 100).unwrap();
        assert_eq!(
            screen(&mut world, 2),
            [false, false, true],
            "nobody listens in the first"
        );
        world.set_door(DOOR, &Bounds::around([[1.0, 0.5, 0.5]]), true, 200);
        world.listens(A, true, 300);
        assert_eq!(world.sessions[&A].eye.sees.len(), 3);
    }
}
