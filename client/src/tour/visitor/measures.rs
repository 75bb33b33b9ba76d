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
        let (missing, all) = self.in_sight().unwrap_or_default();
        let quality = match self.here {
            // Of objects that nobody knows of, none is there and none is sharp.
            Some(_) if all > 0 => (all - missing) as f64 / all as f64,
            Some(here) if self.atlas.place(here).is_some() => 1.0,
            _ => 0.0,
        };
        let (eye, target_px) = (Eye::at(self.position), self.settings.target_px);
        let bytes = self.courier.arrived_bytes(t_ms);
        let (mut sharp, mut rungs) = (0, 0);
        for seen in self.in_view() {
            let Some(held) = self.planner.residency.held(seen.model) else {
                continue;
            };
            sharp += usize::from(plan::is_sharp(seen, held, &eye, target_px));
            rungs += usize::from(held.form == Form::Rung);
        }
        let share = |count: usize| {
            if all == 0 { 0.0 } else { count as f64 / all as f64 }
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

#[cfg(test)]
mod tests {
    use belvedere_scene::{CellId, record::Portal};

    use super::*;
    use crate::{
        atlas::Place,
        strategy::order::View,
        testing::{self, Bare, packed},
        tour::{TourSettings, metered::Metered},
    };

    #[tokio::test]
    async fn what_nobody_knows_of_is_neither_there_nor_sharp() {
        let packed = packed(&[b"one", b"two"]);
        let scene = testing::open(Metered::new(Bare::new())).await;
        for (lost, held, expected) in [(0, 2, 1.0), (6, 2, 0.25), (2, 1, 0.25), (2, 0, 0.0)] {
            let mut visitor = Visitor::new(&scene, &TourSettings::default());
            let entry = scene
                .whereabouts(None, [0.0; 3], false, false)
                .await
                .expect("nowhere")
                .cell;
            let cell = CellId(1);
            visitor.atlas.add(Place {
                entry: belvedere_scene::index::CellEntry { cell, ..entry },
                portals: Vec::<Portal>::new(),
                seen: packed.seen.clone(),
                lost,
                is_unknown: false,
            });
            visitor.here = Some(cell);
            for (level, _) in &packed.levels[..held] {
                visitor.planner.residency.arrive(level.into(), 3);
            }
            let view = View {
                eye: Eye::at([0.0; 3]),
                here: &packed.seen,
                is_all_known: true,
                ahead: Vec::new(),
            };
            visitor.planner.plan(&view, f64::INFINITY);
            let frame = visitor.frame(0.0);
            assert_eq!(
                (frame.quality, frame.sharp),
                (expected, expected),
                "{lost} lost, {held} held"
            );
            assert_eq!(frame.missing as usize, lost + 2 - held);
        }
    }
}
