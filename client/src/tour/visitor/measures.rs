//! What does a visitor see at a moment, of all that could be seen? What frames say, and when the first picture is there.

use super::{Frame, Visitor};
use crate::{
    ByteSource,
    strategy::{
        grade::Form,
        plan::{self, Held},
        sight::{Eye, Seen},
    },
};

impl<S: ByteSource> Visitor<'_, S> {
    pub(super) fn note_convergence(&mut self) {
        if self.courier.tour.converged_ms.is_some() {
            return;
        }
        // What came at the very moment of a frame was not in it.
        let is_after = self
            .courier
            .tour
            .frames
            .last()
            .is_none_or(|frame| frame.t_ms < self.now_ms);
        let is_told = self.here.is_some_and(|here| self.is_known(here));
        if !is_after || !is_told || !plan::has_first_picture(self.in_view(), &self.planner.residency) {
            return;
        }
        if !self.has_begun {
            (self.has_begun, self.planned_at) = (true, None);
        }
        if !self.is_blind() && self.sees_anything() {
            self.courier.tour.converged_ms = Some(self.now_ms);
        }
    }

    /// Whether nobody knows what can be seen.
    fn is_blind(&self) -> bool {
        let place = self.here.and_then(|here| self.atlas.place(here));
        self.is_astray || place.is_none_or(|place| place.is_unknown)
    }

    /// How many objects in sight have nothing there, of how many; `None` for who does not know where it is.
    fn in_sight(&self) -> Option<(usize, usize)> {
        let place = self.atlas.place(self.here?)?;
        let all = place.seen.len() + place.lost.max(usize::from(self.is_astray));
        let held = place
            .seen
            .iter()
            .filter(|seen| self.planner.residency.held(seen.model).is_some());
        Some((all - held.count(), all))
    }

    /// What is known of what can be seen.
    fn in_view(&self) -> &[Seen] {
        self.here.map_or(&[], |here| self.atlas.seen_from(here))
    }

    /// Whether something of anything in sight is there, if there is anything.
    fn sees_anything(&self) -> bool {
        let is_held = |seen: &Seen| self.planner.residency.held(seen.model).is_some();
        self.in_view().iter().any(is_held) || self.in_sight().is_some_and(|(missing, _)| missing == 0)
    }

    pub(super) fn frame(&mut self, t_ms: f64) -> Frame {
        let (missing, quality) = match self.in_sight() {
            Some((_, 0)) => (0, 1.0),
            Some((missing, all)) => (missing, 1.0 - missing as f64 / all as f64),
            None => (0, 0.0),
        };
        let (eye, target_px) = (Eye::at(self.position), self.settings.target_px);
        let bytes = self.courier.arrived_bytes(t_ms);
        let seen = self.in_view();
        let (mut sharp, mut rungs) = (0, 0);
        for seen in seen {
            let Some(held) = self.planner.residency.held(seen.model) else {
                continue;
            };
            sharp += usize::from(plan::is_sharp(seen, held, &eye, target_px));
            rungs += usize::from(held.form == Form::Rung);
        }
        let share = |count: usize| {
            if seen.is_empty() {
                0.0
            } else {
                count as f64 / seen.len() as f64
            }
        };
        Frame {
            t_ms,
            quality,
            missing: missing as u32,
            is_short: missing > 0
                && self.planner.is_short()
                && self.here.is_some_and(|here| self.short_in.contains(&here)),
            unknown: self.is_blind(),
            bytes,
            sharp: share(sharp),
            rungs: share(rungs),
        }
    }
}
