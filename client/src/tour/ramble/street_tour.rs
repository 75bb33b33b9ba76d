//! How does somebody walk who wants to have been everywhere? From each cell by the shortest way to the nearest that was not
//! visited (the nearest-neighbour rule for tours), straight from the middle of one opening to that of the next; when all
//! have been visited, home, and round again. Who cannot leave its cell wanders in it.
//!
//! What is near counts in metres of the way, and some ways count as longer than they are: through narrow openings and
//! doors, so that streets come before houses; up or down; and round corners, so that a street is followed to its end.
//!
//! Cost: one search over the cells visited so far for each cell.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, HashSet},
    sync::Arc,
};

use belvedere_scene::CellId;

use super::{
    MOST_PLACES, random,
    rooms::{Opening, Room, Rooms},
    wander,
};
use crate::{ByteSource, Error, tour::script::distance_m};

/// Narrower openings are those of houses …
const STREET_M: f64 = 2.5;
/// … and count as so much of a way, as doors do, and openings that one does not walk through upright.
const DETOUR_M: f64 = 30.0;
/// Who turns round on the spot could have gone so far.
const TURN_M: f64 = 8.0;
/// Ways that differ by less are as good as each other, and the seed decides.
const WHIM_M: f64 = 4.0;

/// The places of a way that is at least so long, if it can be.
pub(super) async fn places<S: ByteSource>(
    rooms: &mut Rooms<'_, S>,
    start: [f64; 3],
    long_m: f64,
    seed: u64,
) -> Result<Vec<[f64; 3]>, Error> {
    let mut walker = Walker {
        here: rooms.at(start).await?,
        places: vec![start],
        walked_m: 0.0,
    };
    let home = walker.here.entry.cell;
    let (mut plan, mut began_m) = (Plan::new(seed), 0.0);
    loop {
        plan.learn(&walker.here);
        let way = plan.way_to(&walker, |cell| plan.is_new(cell));
        let is_round = way.is_none();
        let way = way
            .or_else(|| plan.way_to(&walker, |cell| cell == home))
            .unwrap_or_default();
        for opening in way {
            let next = rooms.room(opening.to).await?;
            walker.go(opening, next);
            if walker.walked_m >= long_m || walker.places.len() >= MOST_PLACES {
                return Ok(walker.ended());
            }
        }
        if is_round {
            walker.step_to(start);
            if walker.walked_m <= began_m {
                return wander::places(rooms, start, long_m, seed).await;
            }
            began_m = walker.walked_m;
            plan.visited.clear();
        }
    }
}

/// Who walks.
struct Walker {
    here: Arc<Room>,
    places: Vec<[f64; 3]>,
    walked_m: f64,
}

impl Walker {
    fn place(&self) -> [f64; 3] {
        self.places[self.places.len() - 1]
    }

    /// Through an opening of the cell where one is.
    fn go(&mut self, opening: Opening, next: Arc<Room>) {
        let from = self.place();
        let half_way = [0, 1, 2].map(|i| 0.5 * (from[i] + opening.place[i]));
        if !self.here.entry.holds_alone(half_way) {
            // Both are in one wall of it, or the same: one steps in.
            self.step_to(self.here.middle);
        }
        self.step_to(opening.place);
        self.here = next;
    }

    fn step_to(&mut self, place: [f64; 3]) {
        self.walked_m += distance_m(self.place(), place);
        self.places.push(place);
    }

    /// Ends well inside the last cell.
    fn ended(mut self) -> Vec<[f64; 3]> {
        self.step_to(self.here.middle);
        self.places
    }

    /// Where one has come from, a direction of length 1; none at first.
    fn heading(&self) -> [f64; 3] {
        let [.., before, now] = self.places[..] else {
            return [0.0; 3];
        };
        let away_m = distance_m(before, now).max(f64::MIN_POSITIVE);
        [0, 1, 2].map(|i| (now[i] - before[i]) / away_m)
    }
}

/// What is known of ways.
struct Plan {
    seed: u64,
    openings: HashMap<CellId, Vec<Opening>>,
    visited: HashSet<CellId>,
}

impl Plan {
    fn new(seed: u64) -> Self {
        Self {
            seed,
            openings: HashMap::new(),
            visited: HashSet::new(),
        }
    }

    fn learn(&mut self, room: &Room) {
        let cell = room.entry.cell;
        self.visited.insert(cell);
        self.openings.entry(cell).or_insert_with(|| room.openings.clone());
    }

    fn is_new(&self, cell: CellId) -> bool {
        !self.visited.contains(&cell)
    }

    /// The openings on the shortest way to a cell that is wanted.
    fn way_to(&self, walker: &Walker, is_wanted: impl Fn(CellId) -> bool) -> Option<Vec<Opening>> {
        let here = walker.here.entry.cell;
        let mut reached: HashMap<CellId, (f64, Opening, CellId)> = HashMap::new();
        let mut settled = HashSet::new();
        let mut next = BinaryHeap::from([Reverse((0, here))]);
        while let Some(Reverse((_, cell))) = next.pop() {
            if !settled.insert(cell) {
                continue;
            }
            if cell != here && is_wanted(cell) {
                return Some(back_from(cell, here, &reached));
            }
            let (cost_m, place) = reached
                .get(&cell)
                .map_or((0.0, walker.place()), |(cost_m, opening, _)| (*cost_m, opening.place));
            for opening in self.openings.get(&cell).into_iter().flatten() {
                let turn_m = if cell == here { turn_m(walker, opening) } else { 0.0 };
                let cost_m = cost_m + distance_m(place, opening.place) + turn_m + self.detour_m(opening);
                let is_nearer = reached.get(&opening.to).is_none_or(|(known_m, ..)| cost_m < *known_m);
                if is_nearer && !settled.contains(&opening.to) {
                    reached.insert(opening.to, (cost_m, *opening, cell));
                    next.push(Reverse((in_micrometres(cost_m), opening.to)));
                }
            }
        }
        None
    }

    /// What an opening counts beside the way to it.
    fn detour_m(&self, opening: &Opening) -> f64 {
        let is_street = opening.width_m >= STREET_M && !opening.has_door;
        let hindrances = u8::from(!is_street) + u8::from(!opening.is_upright);
        let mut state = self.seed ^ (u64::from(opening.to.0) << 32);
        let whim = random(&mut state) as f64 / u64::MAX as f64;
        DETOUR_M * f64::from(hindrances) + WHIM_M * whim
    }
}

/// What it counts to turn to an opening.
fn turn_m(walker: &Walker, opening: &Opening) -> f64 {
    let (from, heading) = (walker.place(), walker.heading());
    let away_m = distance_m(from, opening.place);
    if away_m == 0.0 {
        return 0.0;
    }
    let ahead = (0..3).map(|i| heading[i] * (opening.place[i] - from[i])).sum::<f64>() / away_m;
    0.5 * TURN_M * (1.0 - ahead)
}

fn back_from(cell: CellId, here: CellId, reached: &HashMap<CellId, (f64, Opening, CellId)>) -> Vec<Opening> {
    let (mut way, mut at) = (Vec::new(), cell);
    while at != here
        && let Some((_, opening, before)) = reached.get(&at)
    {
        way.push(*opening);
        at = *before;
    }
    way.reverse();
    way
}

/// Whole numbers have an order.
fn in_micrometres(m: f64) -> u64 {
    (1e6 * m) as u64
}
