//! Whom does a crowd hide so far that nobody needs to be told? By the paper's rule ([`belvedere_live::crowd`]) for where everybody
//! is by the recording; what the server made of that is not asked.
//!
//! The server looks at the crowd anew only now and then, and who is silent goes on there for a while. So whoever is seen by less than
//! [`SURELY`] times what brings somebody back may be left out, and who comes to be seen is waited for until the server has looked.
//! Everybody hides others here, also who is put away there: so this excuses rather too much than too little.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{
    Ms,
    cells::{Ball, Cells},
    crowd::{Crowd, Crowding, View},
    journal::Ground,
    world::{BACK, Rules},
};
use belvedere_scene::{CellId, ObjectId};

use super::mover::Mover;

const SURELY: f64 = 2.0;

/// Everybody in a scene whose rules leave some out in a crowd.
#[derive(Debug)]
pub(super) struct Press {
    crowding: Crowding,
    crowd: Crowd,
    standing: BTreeSet<ObjectId>,
    /// How many touch each cell.
    touching: BTreeMap<CellId, usize>,
    largest_m: f64,
}

impl Press {
    /// None where the rules leave nobody out.
    pub(super) fn of(rules: &Rules, ground: &Ground) -> Option<Self> {
        let crowding = rules.crowd.filter(|crowding| crowding.cull_below > 0.0)?;
        Some(Self {
            crowding,
            crowd: ground.crowd(),
            standing: BTreeSet::new(),
            touching: BTreeMap::new(),
            largest_m: 0.0,
        })
    }

    /// How long it may take until the server has looked anew.
    pub(super) fn lasts_ms(&self) -> Ms {
        self.crowding.lasts_ms
    }

    /// Everybody stands where it is now.
    pub(super) fn stand(&mut self, movers: &BTreeMap<ObjectId, Mover>, cells: &Cells, now_ms: Ms, tick_ms: Ms) {
        let gone: Vec<_> = self
            .standing
            .iter()
            .filter(|object| !movers.contains_key(object))
            .copied()
            .collect();
        for object in gone {
            self.standing.remove(&object);
            self.crowd.take(object);
        }
        self.touching.clear();
        for (object, mover) in movers {
            let ball = Ball {
                center: mover.position(now_ms),
                radius_m: mover.radius_m + mover.reach_in_m(tick_ms),
            };
            self.largest_m = self.largest_m.max(ball.radius_m);
            self.standing.insert(*object);
            self.crowd.put(*object, ball.center, mover.hides_m);
            for cell in cells.under(&ball) {
                *self.touching.entry(cell).or_default() += 1;
            }
        }
    }

    /// What is seen of the crowd from a place, where there is one within the area of interest.
    pub(super) fn seen_from(&mut self, eye: [f64; 3], leave_m: f64, cells: &Cells) -> Option<View> {
        let reaches = |cell: CellId| {
            let shape = cells.cell(cell);
            shape.is_some_and(|shape| shape.bounds.distance_m(eye) <= leave_m + self.largest_m)
        };
        let near = self.touching.iter().filter(|(cell, _)| reaches(**cell));
        let many = near.map(|(_, count)| count).sum::<usize>() >= self.crowding.least;
        many.then(|| View::from(&mut self.crowd, eye, leave_m))
    }

    /// Whether so little is seen of who stands there that it may be left out.
    pub(super) fn may_leave_out(&self, view: &View, there: [f64; 3]) -> bool {
        view.of(&self.crowd.spot(there)) < SURELY * BACK * self.crowding.cull_below
    }
}
