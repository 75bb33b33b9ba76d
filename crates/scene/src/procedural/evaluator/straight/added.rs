//! What becomes of solids that were computed for several turns? They are added to the part that is being made: triangles that are
//! placed already turn by turn or all at once, and all else by its numbers.

use std::ops::Range;

use super::code::Columns;
use super::plan::Planned;
use crate::procedural::affine::Affine;
use crate::procedural::evaluator::{Evaluator, Outcome, Scope, Turtle};
use crate::procedural::syntax::At;

impl Evaluator<'_> {
    /// Adds the solids of one turn.
    pub(super) fn add_turn<const N: usize>(
        &mut self,
        (scope, turtle, materials): (&Scope, &Turtle, &[usize]),
        solids: &mut [Planned],
        columns: &Columns<N>,
        place: usize,
    ) -> Outcome<()> {
        for planned in solids {
            let place_of = (scope, planned.at, planned.outline_at);
            let material = planned.paint.map_or(turtle.material, |paint| materials[paint]);
            if planned.is_placed {
                self.add_sheaf(place_of, material, planned, place..place + 1)?;
                continue;
            }
            let at = |register: u16| columns.numbers[register as usize][place];
            planned.fill(self.settings.detail, at);
            let frame = Affine::of_numbers(std::array::from_fn(|i| at(planned.frame[i])));
            let turtle = Turtle { frame, material };
            self.add(place_of, &turtle, &planned.solid)?;
        }
        Ok(())
    }

    /// Whether so many times the triangles of a solid are within the limit, however many of them are written.
    pub(super) fn has_room(&self, planned: &Planned, times: usize) -> bool {
        let most = planned.solid.most_triangles().saturating_mul(times as u64);
        self.usage.triangles.saturating_add(most) <= self.settings.limits.triangles
    }

    /// Adds what was placed in some turns.
    pub(super) fn add_sheaf(
        &mut self,
        place: (&Scope, At, At),
        material: usize,
        planned: &Planned,
        turns: Range<usize>,
    ) -> Outcome<()> {
        let bounds = planned.sheaf.bounds(turns.clone());
        self.add_written(place, material, (bounds, planned.solid.most_triangles()), |mesh, _| {
            planned.sheaf.write(turns, mesh);
            Ok(())
        })
    }
}
