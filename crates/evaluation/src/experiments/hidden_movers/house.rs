//! Who speaks and who is told in a house of rooms full of walkers?

use std::collections::BTreeSet;

use crate::timing::cpu_s;
use belvedere_live::{
    Ms, World,
    aoi::Aoi,
    cells::{Cell, Cells},
    event::{Event, FIRST_MOVER, Hush, SessionId},
    tbv::Tbv,
    world::{Look, NewMover, Rules, Sent, Visitor},
};
use belvedere_scene::{Bounds, CellId, ObjectId};

pub(super) const ROOMS: u32 = 32;
pub(super) const ROOM_M: f64 = 4.0;
/// Ticks that count, when all speak …
pub(super) const TICKS: u32 = 100;
/// … and when volumes last as long as they may.
pub(super) const TICKS_OF_A_VOLUME: u32 = 6_050;
/// Volumes last for ten minutes at most, a sixth of what a server allows: an hour of 100,000 movers takes long to simulate.
const LONGEST_TBV_MS: Ms = 600_000;
const SPEED_MPS: f64 = 1.5;
const WALKS_MPS: f64 = 1.2;
const TICK_MS: Ms = 100;

fn house() -> Cells {
    let shape = |i: u32| {
        let min = [f64::from(i % ROOMS) * ROOM_M, 0.0, f64::from(i / ROOMS) * ROOM_M];
        let bounds = Bounds {
            min,
            max: min.map(|x| x + ROOM_M),
        };
        Cell { bounds, planes: vec![] }
    };
    let mut cells = Cells::new((0..ROOMS * ROOMS).map(shape).collect());
    for i in 0..ROOMS * ROOMS {
        let (x, z) = (i % ROOMS, i / ROOMS);
        let beside = [(x.wrapping_sub(1), z), (x + 1, z), (x, z.wrapping_sub(1)), (x, z + 1)];
        let sees: Vec<_> = beside
            .iter()
            .filter(|(x, z)| *x < ROOMS && *z < ROOMS)
            .map(|(x, z)| CellId(z * ROOMS + x))
            .collect();
        cells.learn(CellId(i), &sees);
    }
    cells
}

/// How somebody walks to and fro, and speaks of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gait {
    /// From one end to the other.
    way_m: f64,
    /// It states its velocity, and speaks when it turns and once a second else; who does not speaks each tick.
    states: bool,
}

/// In a room, each tick.
const ABOUT: Gait = Gait {
    way_m: 2.0,
    states: false,
};

/// Through 25 rooms in a row.
const THROUGH_ROOMS_M: f64 = 100.0;

/// Somebody who walks to and fro.
struct Walker {
    object: ObjectId,
    session: Option<SessionId>,
    home: [f64; 3],
    phase: f64,
    gait: Gait,
    /// Its owner need not speak while it is in there, until then.
    hush: Option<(Tbv, Ms)>,
}

/// All who walk. Who keeps to a ball for as long as it lasts is not looked at meanwhile: owners are other machines, and going through
/// all of them each tick would cost the server its caches.
struct Walkers {
    all: Vec<Walker>,
    /// Who is looked at in each tick.
    restless: BTreeSet<usize>,
    /// Who is silent, by when it speaks again.
    silent: BTreeSet<(Ms, usize)>,
}

impl Walkers {
    /// Who speaks now.
    fn due(&mut self, now_ms: Ms, volumes: bool) -> Vec<usize> {
        let later = self.silent.split_off(&(now_ms + 1, 0));
        let expired = std::mem::replace(&mut self.silent, later);
        self.restless.extend(expired.into_iter().map(|(_, at)| at));
        let speaks = |at: &usize| {
            let walker = &self.all[*at];
            walker.has_news(now_ms) && (!volumes || walker.must_speak(now_ms))
        };
        self.restless.iter().copied().filter(speaks).collect()
    }

    fn tell(&mut self, object: ObjectId, hush: Option<&Hush>) {
        if let Some(at) = object.0.checked_sub(FIRST_MOVER) {
            self.hush(at as usize, hush);
        }
    }

    /// What its owner may rely on from now on.
    fn hush(&mut self, at: usize, hush: Option<&Hush>) {
        let Some(walker) = self.all.get_mut(at) else { return };
        if let Some((_, until_ms)) = walker.hush {
            self.silent.remove(&(until_ms, at));
        }
        walker.hush = hush.map(|hush| (hush.tbv, hush.until_ms));
        match walker.hush {
            Some((tbv, until_ms)) if walker.ends().iter().all(|end| tbv.holds(*end)) => {
                self.restless.remove(&at);
                self.silent.insert((until_ms, at));
            }
            _ => _ = self.restless.insert(at),
        }
    }
}

impl Walker {
    fn must_speak(&self, now_ms: Ms) -> bool {
        self.hush
            .is_none_or(|(tbv, until_ms)| until_ms <= now_ms || !tbv.holds(self.sent(now_ms).position))
    }

    /// Whether it has something to say of its own accord.
    fn has_news(&self, now_ms: Ms) -> bool {
        let second = (now_ms / TICK_MS + Ms::from(self.object.0)) % (1_000 / TICK_MS) == 0;
        !self.gait.states || second || self.goes(now_ms).1 != self.goes(now_ms - TICK_MS).1
    }

    /// Between these it walks.
    fn ends(&self) -> [[f64; 3]; 2] {
        [-0.5, 0.5].map(|share| [self.home[0] + share * self.gait.way_m, 1.5, self.home[2]])
    }

    /// How far it is from the one end, and how fast it goes.
    fn goes(&self, now_ms: Ms) -> (f64, f64) {
        let way_m = self.gait.way_m;
        let at_m = (now_ms as f64 * 1e-3 * WALKS_MPS + self.phase) % (2.0 * way_m);
        if at_m < way_m {
            (at_m, WALKS_MPS)
        } else {
            (2.0 * way_m - at_m, -WALKS_MPS)
        }
    }

    fn sent(&self, now_ms: Ms) -> Sent {
        let (at_m, mps) = self.goes(now_ms);
        Sent {
            t_ms: Some(now_ms),
            position: [self.home[0] + at_m - 0.5 * self.gait.way_m, 1.5, self.home[2]],
            orientation: [0.0, 0.0, 0.0, 1.0],
            // In a room it turns too often to be extrapolated for long.
            velocity: self.gait.states.then_some([mps, 0.0, 0.0]),
            acceleration: None,
        }
    }
}

fn middle(room: u32) -> [f64; 3] {
    let at = |i: u32| (f64::from(i) + 0.5) * ROOM_M;
    [at(room % ROOMS), 1.5, at(room / ROOMS)]
}

pub(super) struct Outcome {
    /// CPU of a tick of the server, with the poses that came in.
    pub(super) tick_us: f64,
    /// In a tick.
    pub(super) poses_in: f64,
    pub(super) told: u64,
}

/// Rooms of walkers; a session looks on from the first room when there is one. `volumes` off is the naive server.
pub(super) fn simulate(homes: &[u32], with_sessions: bool, volumes: bool, ticks: u32) -> Outcome {
    let places: Vec<_> = homes.iter().map(|room| middle(*room)).collect();
    simulate_at(&places, ABOUT, with_sessions, volumes, ticks)
}

/// Participants who walk through rooms in a row, in all rows. Those who state where they go look on from there while they are silent.
pub(super) fn simulate_walk(people: u32, states: bool, volumes: bool, ticks: u32) -> Outcome {
    let places: Vec<_> = (0..people).map(|i| middle(i % ROOMS * ROOMS + ROOMS / 2)).collect();
    let way_m = THROUGH_ROOMS_M;
    simulate_at(&places, Gait { way_m, states }, true, volumes, ticks)
}

/// The same for a row of walkers whose ways are so far beside the middle of their rooms, with nobody looking on but one.
pub(super) fn simulate_aside(homes: &[u32], aside_m: f64, volumes: bool, ticks: u32) -> Outcome {
    let aside = |room: &u32| {
        let [x, y, z] = middle(*room);
        [x + aside_m, y, z]
    };
    let places: Vec<_> = homes.iter().map(aside).collect();
    simulate_at(&places, ABOUT, false, volumes, ticks)
}

fn simulate_at(homes: &[[f64; 3]], gait: Gait, with_sessions: bool, volumes: bool, ticks: u32) -> Outcome {
    let rules = Rules {
        tick_ms: TICK_MS,
        bytes_per_s: 1e9,
        longest_tbv_ms: if volumes { LONGEST_TBV_MS } else { 0 },
        ..Rules::default()
    };
    let cells = house();
    let bounds = cells.bounds();
    let mut world = World::new(cells, &bounds, rules);
    let mut now_ms = 1_000_000;
    let mut walkers = Walkers {
        all: Vec::new(),
        restless: (0..homes.len()).collect(),
        silent: BTreeSet::new(),
    };
    let observer = SessionId(1_000_000);
    let aoi = Aoi {
        enter_m: 1_000.0,
        leave_m: 1_100.0,
    };
    for (i, home) in (0u32..).zip(homes) {
        let session = with_sessions.then_some(SessionId(u64::from(i)));
        let walker = Walker {
            object: ObjectId(FIRST_MOVER + i),
            session,
            home: *home,
            // Golden sections of the way, so that they are all over it.
            phase: f64::from(i) * if gait == ABOUT { 0.37 } else { 1.236 * gait.way_m },
            gait,
            hush: None,
        };
        let pose = walker.sent(now_ms);
        match session {
            Some(session) => {
                let visitor = Visitor {
                    pose,
                    aoi,
                    max_speed_mps: SPEED_MPS,
                    max_acceleration_mps2: None,
                    radius_m: 0.3,
                    look: Look::default(),
                    hears_movers: true,
                    listens: true,
                };
                world.open(session, walker.object, visitor, now_ms).expect("a session");
            }
            None => {
                let new = NewMover {
                    pose,
                    max_speed_mps: SPEED_MPS,
                    max_acceleration_mps2: None,
                    radius_m: 0.3,
                    look: Look::default(),
                    way: None,
                };
                world
                    .create(walker.object, Some(SessionId(u64::MAX)), new, now_ms)
                    .expect("a mover");
            }
        }
        walkers.all.push(walker);
    }
    if !with_sessions {
        let visitor = Visitor {
            pose: Sent {
                position: middle(0),
                ..walkers.all[0].sent(now_ms)
            },
            aoi,
            max_speed_mps: 0.0,
            max_acceleration_mps2: None,
            radius_m: 0.3,
            look: Look::default(),
            hears_movers: true,
            listens: true,
        };
        world
            .open(observer, ObjectId(FIRST_MOVER - 1), visitor, now_ms)
            .expect("a session");
    }
    let (mut poses_in, mut told, mut spent_s) = (0, 0, 0.0);
    // The first second, in which everybody appears, is not counted.
    for tick in 0..ticks + 10 {
        now_ms += rules.tick_ms;
        let counted = tick >= 10;
        let due = walkers.due(now_ms, volumes);
        let said: Vec<_> = due.into_iter().map(|at| (at, walkers.all[at].sent(now_ms))).collect();
        let sent = said.len() as u64;
        let start_s = cpu_s();
        let mut answers = Vec::with_capacity(said.len());
        for (at, pose) in said {
            let walker = &walkers.all[at];
            let moved = match walker.session {
                Some(session) => world.pose(session, pose, now_ms).map(|seen| seen.moved),
                None => world.move_to(walker.object, pose, now_ms),
            };
            answers.push((at, moved.expect("a pose").hush));
        }
        // Everybody reads at once what is told.
        let waiting: Vec<_> = world.wants_room().collect();
        waiting.into_iter().for_each(|session| world.make_room(session));
        world.tick(now_ms);
        let events = world.events();
        spent_s += if counted { cpu_s() - start_s } else { 0.0 };
        poses_in += if counted { sent } else { 0 };
        if volumes {
            answers.iter().for_each(|(at, hush)| walkers.hush(*at, hush.as_ref()));
        }
        for (_, event) in events {
            match event {
                Event::ObjectPos { objects, .. } if counted => told += objects.len() as u64,
                Event::Wake { object } => walkers.tell(object, None),
                Event::Hush(promise) => walkers.tell(promise.object, Some(&promise)),
                _ => {}
            }
        }
    }
    Outcome {
        tick_us: spent_s * 1e6 / f64::from(ticks),
        poses_in: poses_in as f64 / f64::from(ticks),
        told,
    }
}
