//! Where was everybody, and who had been told of whom? Kept from what a recording says alone: inputs say where, outputs say
//! what was told.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{
    Ms,
    aoi::Aoi,
    cells::{Ball, Cells, distance_m},
    event::SessionId,
    journal::{Ground, Input},
    motion::{LONGEST_EXTRAPOLATION_MS, Trajectory},
    world::{NewMover, Rules, SLACK, Sent},
};
use belvedere_scene::{Bounds, CellId, ObjectId, Revision};

use super::{crowd::Press, telling::Telling};

/// A velocity that nobody stated is taken for true for so long, with a few ticks for what comes late.
const ESTIMATE_LASTS_MS: Ms = 1_500;
/// No two poses from which one is estimated come faster.
const MOST_STEPS_PER_S: f64 = 1_000.0;
/// Cells with no wider gap between them touch.
const GAP_M: f64 = 0.01;

/// A scene as a recording tells of it.
#[derive(Debug)]
pub(super) struct Account {
    pub(super) rules: Rules,
    pub(super) revision: Revision,
    pub(super) cells: Cells,
    pub(super) people: BTreeMap<SessionId, Person>,
    pub(super) movers: BTreeMap<ObjectId, Mover>,
    pub(super) closed: BTreeMap<ObjectId, ClosedDoor>,
    /// Told of since the last tick but one.
    pub(super) told: Vec<Telling>,
    /// Sessions that there were.
    pub(super) ended: BTreeSet<SessionId>,
    /// Where so many stand that some need not be told of.
    pub(super) press: Option<Press>,
}

#[derive(Debug)]
pub(super) struct Person {
    pub(super) avatar: ObjectId,
    pub(super) aoi: Aoi,
    hears_movers: bool,
    listens: bool,
    /// Movers that it has been told of, and not that they are gone.
    pub(super) shown: BTreeSet<ObjectId>,
    /// Where it may look from, and since when that is so.
    pub(super) eyes: (Vec<CellId>, Ms),
}

#[derive(Debug)]
pub(super) struct Mover {
    pub(super) owner: Option<SessionId>,
    /// Another node says where it is.
    abroad: bool,
    position: [f64; 3],
    /// When the position came in.
    said_ms: Ms,
    /// Where it may be taken to go on from there unheard.
    goes_on: GoesOn,
    pub(super) radius_m: f64,
    max_speed_mps: f64,
    way: Option<Trajectory>,
}

/// How somebody is extrapolated of whom nothing is heard.
#[derive(Debug, Clone, Copy)]
enum GoesOn {
    /// As it said, metres a second; or as it did from one pose to the next, which is not for so long.
    Straight { velocity: [f64; 3], for_ms: Ms },
    /// As it said, on a curve.
    Somewhere,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct ClosedDoor {
    pub(super) bounds: Bounds,
    pub(super) since_ms: Ms,
}

impl Person {
    /// Whether it is to be told of movers.
    pub(super) fn hears(&self) -> bool {
        self.hears_movers && self.listens
    }
}

impl Mover {
    fn new(owner: Option<SessionId>, new: &NewMover, now_ms: Ms) -> Self {
        let mut mover = Self {
            owner,
            abroad: false,
            position: new.pose.position,
            said_ms: now_ms,
            goes_on: GoesOn::Somewhere,
            radius_m: new.radius_m,
            max_speed_mps: new.way.as_ref().map_or(new.max_speed_mps, Trajectory::fastest_mps),
            way: new.way.clone(),
        };
        mover.say(&new.pose, now_ms);
        mover
    }

    fn say(&mut self, sent: &Sent, now_ms: Ms) {
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

impl Account {
    pub(super) fn begin(rules: Rules, ground: &Ground) -> Self {
        Self {
            rules,
            revision: ground.revision,
            cells: Cells::new(ground.cells.clone()),
            people: BTreeMap::new(),
            movers: BTreeMap::new(),
            closed: BTreeMap::new(),
            told: Vec::new(),
            ended: BTreeSet::new(),
            press: Press::of(&rules, ground),
        }
    }

    /// Something has come in, and was not refused.
    pub(super) fn hear(&mut self, input: &Input, now_ms: Ms) {
        match input {
            Input::Open {
                session,
                object,
                visitor,
            } => {
                let avatar = NewMover {
                    pose: visitor.pose,
                    max_speed_mps: visitor.max_speed_mps,
                    max_acceleration_mps2: visitor.max_acceleration_mps2,
                    radius_m: visitor.radius_m,
                    look: visitor.look.clone(),
                    way: None,
                };
                self.movers.insert(*object, Mover::new(Some(*session), &avatar, now_ms));
                let person = Person {
                    avatar: *object,
                    aoi: visitor.aoi,
                    hears_movers: visitor.hears_movers,
                    listens: visitor.listens,
                    shown: BTreeSet::new(),
                    eyes: (Vec::new(), now_ms),
                };
                self.people.insert(*session, person);
                self.look(*session, now_ms);
            }
            Input::Pose { session, sent } => {
                let avatar = self.people.get(session).map(|person| person.avatar);
                if let Some(mover) = avatar.and_then(|avatar| self.movers.get_mut(&avatar)) {
                    mover.say(sent, now_ms);
                }
                self.look(*session, now_ms);
            }
            Input::Aoi { session, aoi } => {
                if let Some(person) = self.people.get_mut(session) {
                    person.aoi = *aoi;
                }
            }
            Input::Close { session } => {
                if let Some(person) = self.people.remove(session) {
                    self.movers.remove(&person.avatar);
                    self.ended.insert(*session);
                }
                for mover in self.movers.values_mut().filter(|mover| mover.owner == Some(*session)) {
                    mover.owner = None;
                }
            }
            Input::Create { object, owner, new } => {
                self.movers.insert(*object, Mover::new(*owner, new, now_ms));
            }
            Input::Import { object, new } => match self.movers.get_mut(object) {
                Some(mover) => mover.say(&new.pose, now_ms),
                None => {
                    let mut mover = Mover::new(None, new, now_ms);
                    mover.abroad = true;
                    self.movers.insert(*object, mover);
                }
            },
            // Of who is here, others have nothing to say.
            Input::Withdraw { object, .. } => {
                if self.movers.get(object).is_some_and(|mover| mover.abroad) {
                    self.movers.remove(object);
                }
            }
            Input::Move { object, sent } => {
                if let Some(mover) = self.movers.get_mut(object) {
                    mover.say(sent, now_ms);
                }
            }
            Input::Destroy { object } => _ = self.movers.remove(object),
            Input::Door { object, bounds, open } => {
                let (bounds, since_ms) = (*bounds, now_ms);
                if *open {
                    self.closed.remove(object);
                } else {
                    self.closed.entry(*object).or_insert(ClosedDoor { bounds, since_ms });
                }
            }
            Input::Rebase { ground, .. } => {
                self.revision = ground.revision;
                self.cells = Cells::new(ground.cells.clone());
                self.press = Press::of(&self.rules, ground);
                self.closed.clear();
                let everybody: Vec<_> = self.people.keys().copied().collect();
                everybody.into_iter().for_each(|session| self.look(session, now_ms));
            }
            Input::Listens { session, listens } => {
                if let Some(person) = self.people.get_mut(session) {
                    person.listens = *listens;
                    person.shown.clear();
                }
            }
            Input::Begin { .. }
            | Input::Teach { .. }
            | Input::Screen { .. }
            | Input::Resync { .. }
            | Input::WatchAbroad { .. }
            | Input::Wakeable { .. }
            | Input::Tick => {}
        }
    }

    fn look(&mut self, session: SessionId, now_ms: Ms) {
        let Some(person) = self.people.get_mut(&session) else {
            return;
        };
        let Some(avatar) = self.movers.get(&person.avatar) else {
            return;
        };
        let time_ms = self.rules.round_trip_ms + 2 * self.rules.tick_ms;
        let ball = Ball {
            center: avatar.position,
            radius_m: avatar.max_speed_mps * time_ms as f64 * 1e-3,
        };
        let eyes = self.cells.under(&ball);
        if eyes != person.eyes.0 {
            person.eyes = (eyes, now_ms);
        }
    }
}

#[cfg(test)]
mod tests {
    use belvedere_live::{cells::Cell, world::Look};

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
