//! Which view cells do closed doors hide from a view cell? Those of which that can be proved, with the bake's own proofs.
//!
//! A walk through open portals would not do: people see through windows and gaps where nobody can walk, and cells need
//! not fill the space between them. So geometry decides ([`belvedere_bake::visibility::screen`]).
//!
//! Guarantee: that of [`belvedere_bake::visibility::screen`]. Cells count as the
//! regions around them ([`Blockers::region`]). Cost: milliseconds for a cell; nothing for cells between which no closed door stands.
//!
//! Sight is mutual, and proofs are not: they look from one side through openings that the other may see to be none. So what is not hidden
//! from the cell may be proved by the cell being hidden from there. Either way one of the two is taken without what lies
//! within micrometres of its walls; whoever stands as near to where it ends otherwise stands in the cell beyond as well.
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
/// All questions about one cell together, nearest cells first, take at most so many tests of a wall; as many again from the other
/// side, and as many as both once a door is open.
const STEPS: u32 = 100_000;

/// Another cell, as one looks from it and as one looks at it.
struct Sides<'a> {
    cell: CellId,
    there: &'a Region,
    off_its_walls: Region,
}

impl Blockers {
    /// Those of the other cells that cannot be seen from one while these doors are closed. Takes milliseconds of CPU.
    #[must_use]
    pub fn screened(&self, eye: &Region, others: &[(CellId, Region)], closed: &[ObjectId]) -> Vec<Hidden> {
        let closed: Vec<_> = closed.iter().map(|door| door.0).collect();
        let mut screening = Screening::new(&self.scenery.blocker, &closed, STEPS);
        let sides = others.iter().map(|(cell, other)| Sides {
            cell: *cell,
            there: other,
            off_its_walls: self.off_its_walls(other),
        });
        let mut others: Vec<_> = sides.collect();
        let distance_m = |other: &Sides| other.off_its_walls.distance_m(eye);
        others.sort_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
        let back = self.off_its_walls(eye);
        let (mut hidden, mut open) = (Vec::new(), Vec::new());
        for other in others {
            match screening.hides(eye, &other.off_its_walls) {
                Some(behind) => hidden.push((other, vec![behind])),
                None => open.push(other),
            }
        }
        screening.close(closed.clone(), STEPS);
        for other in open {
            let behind = screening.hides(other.there, &back);
            hidden.extend(behind.map(|behind| (other, vec![behind])));
        }
        for door in &closed {
            let hidden = hidden.iter_mut();
            let mut at_stake: Vec<_> = hidden
                .filter(|(_, behind)| behind.iter().all(|doors| doors.contains(door)))
                .collect();
            if at_stake.is_empty() {
                continue;
            }
            let others_closed = || closed.iter().copied().filter(|other| other != door).collect();
            screening.close(others_closed(), STEPS);
            at_stake.retain_mut(|(other, behind)| match screening.hides(eye, &other.off_its_walls) {
                Some(doors) => {
                    behind.push(doors);
                    false
                }
                None => true,
            });
            screening.close(others_closed(), STEPS);
            for (other, behind) in at_stake {
                behind.extend(screening.hides(other.there, &back));
            }
        }
        let screened = hidden.into_iter().map(|(other, behind)| Hidden {
            cell: other.cell,
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
