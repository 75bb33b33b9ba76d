//! Where may a mover be by what has come in of it, and what may be told of it?

use belvedere_live::{
    Ms,
    cells::{Ball, Cells, distance_m},
    event::SessionId,
    motion::{LONGEST_EXTRAPOLATION_MS, Pose, Trajectory},
    world::{NewMover, SLACK, Sent},
};
use belvedere_scene::CellId;

use super::{
    heard::{self, ESTIMATE_LASTS_MS, Heard, same},
    promises::Promise,
};

/// No two poses from which a velocity is estimated come faster.
const MOST_STEPS_PER_S: f64 = 1_000.0;
/// Cells with no wider gap between them touch.
const GAP_M: f64 = 0.01;

#[derive(Debug)]
pub(super) struct Mover {
    pub(super) owner: Option<SessionId>,
    /// Another node says where it is.
    pub(super) abroad: bool,
    position: [f64; 3],
    /// When the position came in.
    said_ms: Ms,
    /// Where it may be taken to go on from there unheard.
    goes_on: GoesOn,
    pub(super) radius_m: f64,
    /// So far around it it hides in a crowd.
    pub(super) hides_m: f64,
    max_speed_mps: f64,
    max_acceleration_mps2: Option<f64>,
    heard: Heard,
    way: Option<Trajectory>,
    /// While its owner need not speak.
    pub(super) promise: Option<Promise>,
}

/// How somebody is extrapolated of whom nothing is heard.
#[derive(Debug, Clone, Copy)]
enum GoesOn {
    /// As it said, metres a second; or as it did from one pose to the next, which is not for so long.
    Straight { velocity: [f64; 3], for_ms: Ms },
    /// As it said, on a curve.
    Somewhere,
}

impl Mover {
    pub(super) fn new(owner: Option<SessionId>, new: &NewMover, now_ms: Ms) -> Self {
        let max_speed_mps = new.way.as_ref().map_or(new.max_speed_mps, Trajectory::fastest_mps);
        let promise = heard::Limits {
            max_speed_mps,
            max_acceleration_mps2: new.max_acceleration_mps2,
        };
        let mut mover = Self {
            owner,
            abroad: false,
            position: new.pose.position,
            said_ms: now_ms,
            goes_on: GoesOn::Somewhere,
            radius_m: new.radius_m,
            hides_m: new.look.hides_m(new.radius_m),
            max_speed_mps,
            max_acceleration_mps2: new.max_acceleration_mps2,
            heard: Heard::first(&new.pose, promise, now_ms),
            way: new.way.clone(),
            promise: None,
        };
        mover.go_on(&new.pose, now_ms);
        mover
    }

    /// A pose has come in.
    pub(super) fn say(&mut self, sent: &Sent, now_ms: Ms) {
        let promise = heard::Limits {
            max_speed_mps: self.max_speed_mps,
            max_acceleration_mps2: self.max_acceleration_mps2,
        };
        self.heard.hear(sent, promise, now_ms);
        self.go_on(sent, now_ms);
    }

    fn go_on(&mut self, sent: &Sent, now_ms: Ms) {
        let step: [f64; 3] = std::array::from_fn(|axis| sent.position[axis] - self.position[axis]);
        self.goes_on = match (sent.acceleration, sent.velocity) {
            (Some(acceleration), _) if acceleration != [0.0; 3] => GoesOn::Somewhere,
            (_, Some(velocity)) => self.straight(velocity, LONGEST_EXTRAPOLATION_MS),
            // When the poses were true is their sender's affair: it may have gone as fast as it can.
            (_, None) => self.straight(step.map(|x| x * MOST_STEPS_PER_S), ESTIMATE_LASTS_MS),
        };
        self.position = sent.position;
        self.said_ms = now_ms;
    }

    /// No faster than it promised.
    fn straight(&self, velocity: [f64; 3], for_ms: Ms) -> GoesOn {
        let (length, most) = (distance_m(velocity, [0.0; 3]), SLACK * self.max_speed_mps);
        let share = if length > most { most / length } else { 1.0 };
        GoesOn::Straight {
            velocity: velocity.map(|mps| mps * share),
            for_ms,
        }
    }

    /// Where it is, as far as anybody knows.
    pub(super) fn position(&self, now_ms: Ms) -> [f64; 3] {
        self.way
            .as_ref()
            .map_or(self.position, |way| way.pose_at(now_ms).position)
    }

    /// The cells that it may look from when it comes so far meanwhile: about where it spoke last, and what it has passed since, if it
    /// goes on as it said.
    pub(super) fn eyes(&self, cells: &Cells, now_ms: Ms, reach_m: f64) -> Vec<CellId> {
        let around = |center| Ball {
            center,
            radius_m: reach_m,
        };
        let balls: Vec<_> = self.heard.passes(now_ms).into_iter().map(around).collect();
        cells.under_any(&balls)
    }

    /// Where it is to be told what it sees from: where it spoke last, and where it has come to since, if it goes on as it said. When that
    /// began must be known to this time.
    pub(super) fn stands(&self, now_ms: Ms, within_ms: Ms) -> Vec<[f64; 3]> {
        let places = [Some(self.position(now_ms)), self.heard.comes_to(now_ms, within_ms)];
        places.into_iter().flatten().collect()
    }

    /// What is wrong with a pose that somebody is told of it now, and by how many metres.
    pub(super) fn belies(&self, told: &Pose, now_ms: Ms) -> Option<(&'static str, Option<f64>)> {
        let Some(way) = &self.way else {
            return self.heard.belies(told);
        };
        let there = way.pose_at(told.t_ms);
        if told.t_ms > now_ms {
            return Some(("it is still to come", None));
        }
        if !same(&told.position, &there.position) {
            let off_m = distance_m(told.position, there.position);
            return Some(("its trajectory does not pass there then", Some(off_m)));
        }
        let goes = same(&told.velocity, &there.velocity) && same(&told.orientation, &there.orientation);
        (!goes).then_some(("its trajectory goes on otherwise", None))
    }

    /// How far a place is from wherever it may be, and a turn from how it stands.
    pub(super) fn off(&self, told: &Pose, now_ms: Ms) -> (f64, f64) {
        let believed = told.position_at(now_ms);
        match &self.way {
            Some(way) => {
                let there = way.pose_at(now_ms);
                (distance_m(believed, there.position), told.turned_rad(&there))
            }
            None => (self.heard.off_m(believed, now_ms), told.turned_rad(&self.heard.pose())),
        }
    }

    /// How far a place is at least from wherever it may be by now, and from where it spoke last.
    pub(super) fn off_at_least_m(&self, place: [f64; 3], now_ms: Ms) -> f64 {
        distance_m(place, self.position(now_ms)).min(self.heard.off_m(place, now_ms))
    }

    /// A time of its owner's clock in the server's: the earliest that it may be.
    pub(super) fn ours_ms(&self, theirs_ms: Ms) -> Ms {
        self.heard.ours_ms(theirs_ms)
    }

    /// How far it may be from there: it moves on for a while unheard, or the server extrapolates. A velocity that it stated beyond its
    /// promise excuses nothing.
    fn reach_m(&self, now_ms: Ms, tick_ms: Ms) -> f64 {
        let unheard_ms = if self.way.is_some() { 0 } else { now_ms - self.said_ms };
        let time_ms = unheard_ms.clamp(0, LONGEST_EXTRAPOLATION_MS) + 2 * tick_ms;
        SLACK * self.max_speed_mps * time_ms as f64 * 1e-3
    }

    /// How far it comes in a while.
    pub(super) fn reach_in_m(&self, time_ms: Ms) -> f64 {
        self.max_speed_mps * time_ms as f64 * 1e-3
    }

    /// All that it may touch, were there no walls.
    pub(super) fn ball(&self, now_ms: Ms, tick_ms: Ms) -> Ball {
        Ball {
            center: self.position(now_ms),
            radius_m: self.radius_m + self.reach_m(now_ms, tick_ms),
        }
    }

    /// The cells that it may touch: those that its ball reaches through others, and those in which it may be taken to be though there
    /// is a wall between, since whoever extrapolates knows of none.
    pub(super) fn cells(&self, cells: &Cells, now_ms: Ms, tick_ms: Ms) -> Vec<CellId> {
        let ball = self.ball(now_ms, tick_ms);
        let (GoesOn::Straight { velocity, for_ms }, None) = (self.goes_on, &self.way) else {
            return cells.under(&ball);
        };
        let near_m = self.radius_m + SLACK * self.max_speed_mps * (2 * tick_ms) as f64 * 1e-3;
        let at = |ms: Ms| Ball {
            center: std::array::from_fn(|axis| ball.center[axis] + velocity[axis] * ms as f64 * 1e-3),
            radius_m: near_m,
        };
        let unheard_ms = (now_ms - self.said_ms).clamp(0, for_ms);
        let on_the_way: Vec<_> = (0..=unheard_ms / tick_ms).map(|ticks| at(ticks * tick_ms)).collect();
        let mut found = cells.under_any(&on_the_way);
        let mut others = cells.under(&ball);
        others.retain(|cell| found.binary_search(cell).is_err());
        let mut open = cells.under(&at(0));
        while let Some(from) = open.pop() {
            let touched: Vec<_> = others.extract_if(.., |to| touch(cells, from, *to)).collect();
            found.extend(&touched);
            open.extend(touched);
        }
        found.sort_unstable();
        found
    }
}

/// Whether the boxes around two cells have a point in common, or nearly: nobody gets from one into the other else.
fn touch(cells: &Cells, a: CellId, b: CellId) -> bool {
    let (Some(a), Some(b)) = (cells.cell(a), cells.cell(b)) else {
        return false;
    };
    (0..3).all(|axis| {
        a.bounds.min[axis] <= b.bounds.max[axis] + GAP_M && b.bounds.min[axis] <= a.bounds.max[axis] + GAP_M
    })
}

#[cfg(test)]
mod tests {
    use belvedere_live::{cells::Cell, world::Look};
    use belvedere_scene::Bounds;

    use super::*;

    const TICK_MS: Ms = 100;

    /// A room, one beside it that it opens into, and the air above both, with a ceiling between.
    fn house() -> Cells {
        let boxes = [[0.0, 6.0, 0.0, 3.0], [6.0, 12.0, 0.0, 3.0], [-20.0, 20.0, 3.2, 9.0]];
        let cell = |[west, east, floor, ceiling]: [f64; 4]| Cell {
            bounds: Bounds {
                min: [west, floor, -3.0],
                max: [east, ceiling, 3.0],
            },
            planes: vec![],
        };
        Cells::new(boxes.map(cell).into())
    }

    fn sent(height_m: f64) -> Sent {
        Sent {
            t_ms: None,
            position: [3.0, height_m, 0.0],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
            acceleration: None,
        }
    }

    fn mover() -> Mover {
        let new = NewMover {
            pose: sent(1.5),
            max_speed_mps: 3.0,
            max_acceleration_mps2: None,
            radius_m: 0.3,
            look: Look::default(),
            way: None,
        };
        Mover::new(None, &new, 0)
    }

    #[test]
    fn who_stands_in_a_room_gets_into_the_next_one_in_time_and_through_no_ceiling() {
        let (cells, mover) = (house(), mover());
        let at = |now_ms: Ms| mover.cells(&cells, now_ms, TICK_MS);
        assert_eq!(at(0), [CellId(0)]);
        assert_eq!(at(60_000), [CellId(0), CellId(1)]);
        let [room, air] = [0, 2].map(CellId);
        assert!(cells.under(&mover.ball(60_000, TICK_MS)).contains(&air) && !touch(&cells, room, air));
    }

    #[test]
    fn who_goes_somewhere_may_be_taken_to_be_there_whatever_stands_between() {
        let cells = house();
        let up = |velocity: Option<[f64; 3]>, acceleration: Option<[f64; 3]>| {
            let mut mover = mover();
            let sent = Sent {
                velocity,
                acceleration,
                ..sent(1.6)
            };
            mover.say(&sent, 100);
            mover.cells(&cells, 1_100, TICK_MS).contains(&CellId(2))
        };
        assert!(up(None, None), "it went up from one pose to the next");
        assert!(up(Some([0.0, 2.0, 0.0]), None));
        assert!(!up(Some([0.0; 3]), None), "it says that it stands");
        assert!(up(Some([0.0; 3]), Some([0.0, 1.0, 0.0])));
    }
}
