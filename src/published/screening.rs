//! Which view cells do closed doors hide from a view cell? Those of which that can be proved, with the bake's own proofs.
//!
//! A walk through open portals would not do: people see through windows and gaps where nobody can walk, and cells need
//! not fill the space between them. So geometry decides ([`belvedere_bake::visibility::screen`]).
//!
//! Guarantee: conservative, but for gaps narrower than 8 · 10⁻⁶ of the scene's diagonal, which are closed. Cells count as the
//! regions around them ([`Blockers::region`]). Cost: milliseconds for a cell; nothing for cells between which no closed door stands.

use belvedere_bake::{occluders::Region, visibility::screen::Screening};
use belvedere_scene::{CellId, ObjectId};
use glam::Vec3;

use super::Blockers;

/// A proof needs its target behind a wall, not on it: so many times the distance within which faces lie in one plane.
const BESIDE_A_WALL: f32 = 8.0;
/// All questions about one cell together, nearest cells first, take at most so many tests of a wall.
const STEPS: u32 = 100_000;

impl Blockers {
    /// Those of the other cells that cannot be seen from one while these doors are closed. Takes milliseconds of CPU.
    #[must_use]
    pub fn screened(&self, eye: &Region, others: &[(CellId, Region)], closed: &[ObjectId]) -> Vec<CellId> {
        let closed: Vec<_> = closed.iter().map(|door| door.0).collect();
        let mut screening = Screening::new(&self.scenery.blocker, &closed, STEPS);
        let others = others.iter().map(|(cell, other)| (*cell, self.off_its_walls(other)));
        let mut hidden: Vec<_> = others.collect();
        hidden.sort_by(|(_, a), (_, b)| a.distance_m(eye).total_cmp(&b.distance_m(eye)));
        hidden.retain(|(_, other)| screening.hides(eye, other));
        hidden.into_iter().map(|(cell, _)| cell).collect()
    }

    /// A cell without what is as near to its borders as makes no difference.
    fn off_its_walls(&self, cell: &Region) -> Region {
        let margin = Vec3::splat(BESIDE_A_WALL * self.scenery.blocker.occluders.tolerance.plane_m);
        let middle = cell.center();
        Region::of_box((cell.min + margin).min(middle), (cell.max - margin).max(middle))
    }
}
