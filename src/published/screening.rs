//! Which view cells do closed doors hide from a view cell? Those of which that can be proved, with the bake's own proofs.
//!
//! A walk through open portals would not do: people see through windows and gaps where nobody can walk, and cells need
//! not fill the space between them. So geometry decides ([`belvedere_bake::visibility::screen`]).
//!
//! Guarantee: that of [`belvedere_bake::visibility::screen`]. Cells count as the
//! regions around them ([`Blockers::region`]). Cost: milliseconds for a cell; nothing for cells between which no closed door stands.
//!
//! A proof tells the doors that it takes, so that it outlives the opening of others. Each that takes a door is looked for again
//! with that door open: whichever door opens next, what the others hide is known already.

use belvedere_bake::{occluders::Region, visibility::screen::Screening};
use belvedere_live::cells::Hidden;
use belvedere_scene::{CellId, ObjectId};
use glam::Vec3;

use super::Blockers;

/// A proof needs its target behind a wall, not on it: so many times the distance within which faces lie in one plane.
const BESIDE_A_WALL: f32 = 8.0;
/// All questions about one cell together, nearest cells first, take at most so many tests of a wall; as many again once a door
/// is open.
const STEPS: u32 = 100_000;

impl Blockers {
    /// Those of the other cells that cannot be seen from one while these doors are closed. Takes milliseconds of CPU.
    #[must_use]
    pub fn screened(&self, eye: &Region, others: &[(CellId, Region)], closed: &[ObjectId]) -> Vec<Hidden> {
        let closed: Vec<_> = closed.iter().map(|door| door.0).collect();
        let mut screening = Screening::new(&self.scenery.blocker, &closed, STEPS);
        let others = others.iter().map(|(cell, other)| (*cell, self.off_its_walls(other)));
        let mut others: Vec<_> = others.collect();
        others.sort_by(|(_, a), (_, b)| a.distance_m(eye).total_cmp(&b.distance_m(eye)));
        let mut hidden: Vec<_> = others
            .into_iter()
            .filter_map(|(cell, other)| Some((cell, vec![screening.hides(eye, &other)?], other)))
            .collect();
        for door in &closed {
            let hidden = hidden.iter_mut();
            let mut at_stake: Vec<_> = hidden
                .filter(|(_, behind, _)| behind.iter().all(|doors| doors.contains(door)))
                .collect();
            if at_stake.is_empty() {
                continue;
            }
            screening.close(closed.iter().copied().filter(|other| other != door).collect(), STEPS);
            for (_, behind, other) in &mut at_stake {
                behind.extend(screening.hides(eye, other));
            }
        }
        let screened = hidden.into_iter().map(|(cell, behind, _)| Hidden {
            cell,
            behind: behind
                .into_iter()
                .map(|doors| doors.into_iter().map(ObjectId).collect())
                .collect(),
        });
        screened.collect()
    }

    /// A cell without what is as near to its borders as makes no difference.
    fn off_its_walls(&self, cell: &Region) -> Region {
        let margin = Vec3::splat(BESIDE_A_WALL * self.scenery.blocker.occluders.tolerance.plane_m);
        let middle = cell.center();
        Region::of_box((cell.min + margin).min(middle), (cell.max - margin).max(middle))
    }
}
