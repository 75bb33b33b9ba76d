//! From where does a participant look, and when? From each of its poses; and between them from where it said that it goes, since who
//! goes on as it said need not say so again. From its last pose too, all the while: it may have stopped before a wall.
//!
//! Where it goes is looked at each tick, for those who are on their way: one question to the tree of cells. It looks anew only when
//! it has come to others, or some steps further.

use belvedere_scene::CellId;

use super::World;
use crate::{Ms, cells::distance_m, event::SessionId, motion::LONGEST_EXTRAPOLATION_MS};

/// Whoever stays among the same cells looks anew after so much of its way: distances decide how closely others are followed.
const STEPS_M: f64 = 0.5;

impl World {
    /// Looks from the participant's last pose alone.
    pub(super) fn look_from_pose(&mut self, id: SessionId, now_ms: Ms) {
        if let Some(session) = self.sessions.get(&id) {
            let position = self.movers[&session.object].pose.position;
            self.look_from(id, position, now_ms);
        }
    }

    /// Looks again: something else may be seen from there, or by whom.
    pub(super) fn look(&mut self, id: SessionId, now_ms: Ms) {
        if let Some(session) = self.sessions.get(&id) {
            self.look_from(id, session.eye.position, now_ms);
        }
    }

    /// Whoever is on its way looks from where it has come to. What is seen from there must be known: else it looks from where it was,
    /// and [`World::unknown_ahead`] asks.
    pub(super) fn look_on(&mut self, now_ms: Ms) {
        let under_way: Vec<_> = self.under_way.iter().copied().collect();
        for id in under_way {
            let session = &self.sessions[&id];
            let avatar = &self.movers[&session.object];
            let position = avatar.position_at(now_ms);
            if now_ms - avatar.pose.t_ms >= LONGEST_EXTRAPOLATION_MS {
                self.under_way.remove(&id);
            }
            let cells = self.cells.under_either(self.rules.eye_balls(avatar, position));
            let unknown: Vec<_> = cells.iter().copied().filter(|cell| !self.cells.knows(*cell)).collect();
            if !unknown.is_empty() {
                self.unknown_ahead.extend(unknown);
                continue;
            }
            let eye = &session.eye;
            if cells != eye.cells || distance_m(position, eye.position) > STEPS_M {
                self.look_from(id, position, now_ms);
                self.end_straying(id, now_ms);
            }
        }
    }

    /// Whoever would see from its volume what it is not told of may not rely on it any more.
    pub(super) fn end_straying(&mut self, id: SessionId, now_ms: Ms) {
        let object = self.sessions.get(&id).map(|session| session.object);
        if let Some(object) = object.filter(|object| self.strays(*object)) {
            self.revoke(object);
            self.rouse(object, now_ms);
        }
    }

    /// Cells of which [`World::teach`] must tell before those who are on their way can look from there.
    pub fn unknown_ahead(&mut self) -> Vec<CellId> {
        std::mem::take(&mut self.unknown_ahead).into_iter().collect()
    }

    /// Looks from a place and from the participant's last pose: registers what it watches and rouses what it may see.
    fn look_from(&mut self, id: SessionId, position: [f64; 3], now_ms: Ms) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        let avatar = &self.movers[&session.object];
        let balls = self.rules.eye_balls(avatar, position);
        let mut eye = session
            .eye
            .look(&self.cells, balls, session.aoi.leave_m, self.reaches.looked_m());
        if !session.hears() {
            eye.watched.clear();
        }
        if session.hears() && avatar.goes_on() {
            self.under_way.insert(id);
        } else {
            self.under_way.remove(&id);
        }
        let before = std::mem::replace(&mut session.eye, eye).watched;
        let now = session.eye.watched.clone();
        self.stirred_sessions.insert(id);
        self.ask_ahead(id);
        if before == now {
            return;
        }
        for cell in before.iter().filter(|cell| now.binary_search(cell).is_err()) {
            self.unwatch(*cell, id);
        }
        for cell in now.iter().filter(|cell| before.binary_search(cell).is_err()) {
            self.watch(*cell, id);
            let here: Vec<_> = self.movers_in[cell.index()].iter().copied().collect();
            for object in here {
                if self.movers[&object].owner != Some(id) {
                    self.expose(object, now_ms);
                }
            }
        }
        self.tell_doors(id);
    }
}
