//! A stage for stories: cells in a row along x, sessions that do as they are told, and what each of them believes.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::collections::{BTreeMap, BTreeSet};

use belvedere_live::{
    Ms,
    aoi::Aoi,
    cells::{Cell, Cells, Hidden},
    event::{Event, FIRST_MOVER, Gone, Hush, SessionId, Void},
    journal::{Ground, Journal},
    motion::{Key, Pose, Trajectory},
    world::{Look, NewMover, Rules, Sent, Visitor},
};
use belvedere_scene::{Bounds, CellId, ObjectId, foliage::Foliage};

pub(crate) const UP: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
pub(crate) const SPEED_MPS: f64 = 2.0;
pub(crate) const RADIUS_M: f64 = 0.05;

/// What a client believes after all events so far.
#[derive(Debug, Default, Clone)]
pub(crate) struct Belief {
    pub(crate) shown: BTreeMap<ObjectId, Pose>,
    infos: BTreeSet<ObjectId>,
    pub(crate) cell: Option<CellId>,
    pub(crate) doors: BTreeMap<ObjectId, bool>,
}

impl Belief {
    pub(crate) fn hear(&mut self, event: &Event) {
        match event {
            Event::Resync { .. } => *self = Self::default(),
            Event::Cell { cell } => self.cell = Some(*cell),
            Event::ObjectInfo(told) => {
                let moving = told.moving.as_ref().expect("a mover");
                self.infos.insert(told.info.object);
                let twice = self.shown.insert(told.info.object, moving.pose);
                assert_eq!(twice, None, "told twice of {}", told.info.object);
            }
            Event::ObjectPos { objects, .. } => {
                for told in objects.iter() {
                    assert!(
                        self.infos.contains(&told.object),
                        "a pose of an unknown {}",
                        told.object
                    );
                    self.shown.insert(told.object, told.pose);
                }
            }
            Event::ObjectGone { objects, .. } => {
                for object in objects {
                    assert!(self.shown.remove(object).is_some(), "{object} was not there");
                }
            }
            Event::Rate { objects } => assert!(objects.iter().all(|p| self.shown.contains_key(&p.object))),
            Event::Door { object, open } => {
                self.doors.insert(*object, *open);
            }
            Event::Hello(_) | Event::Hush(_) | Event::Wake { .. } | Event::Revision { .. } | Event::Network { .. } => {}
        }
    }
}

pub(crate) struct Stage {
    pub(crate) world: Journal,
    /// All that was written.
    journal: String,
    pub(crate) now_ms: Ms,
    sees: Vec<Vec<CellId>>,
    /// Borders between two cells that are shut.
    shut: BTreeSet<u32>,
    ground: Ground,
    next: u32,
    /// Whether readers take what they are told.
    pub(crate) reads: bool,
    avatars: BTreeMap<SessionId, ObjectId>,
    pub(crate) beliefs: BTreeMap<SessionId, Belief>,
    log: Vec<(SessionId, Event)>,
    read: BTreeMap<SessionId, usize>,
}

impl Stage {
    /// Unit cells in a row; each sees those at most `reach` away.
    pub(crate) fn row(cells: u32, reach: u32) -> Self {
        Self::among(Foliage::default(), cells, reach)
    }

    /// One hall that sees everything, with foliage in it.
    pub(crate) fn grove(foliage: Foliage, cells: u32) -> Self {
        Self::among(foliage, cells, cells)
    }

    fn among(foliage: Foliage, cells: u32, reach: u32) -> Self {
        let shape = |i: u32| Cell {
            bounds: Bounds {
                min: [f64::from(i), 0.0, 0.0],
                max: [f64::from(i) + 1.0, 1.0, 1.0],
            },
            planes: vec![],
        };
        let sees = (0..cells).map(|i| {
            (i.saturating_sub(reach)..cells.min(i + reach + 1))
                .map(CellId)
                .collect()
        });
        let cells: Vec<_> = (0..cells).map(shape).collect();
        let ground = Ground {
            revision: "00000000000000aa".parse().unwrap(),
            bounds: Cells::new(cells.clone()).bounds(),
            cells,
            foliage,
        };
        let (scene, now_ms) = ("row".parse().unwrap(), 1_000_000);
        Self {
            world: Journal::begin(scene, &ground, Rules::default(), true, now_ms),
            journal: String::new(),
            now_ms,
            sees: sees.collect(),
            shut: BTreeSet::new(),
            ground,
            next: 0,
            reads: true,
            avatars: BTreeMap::new(),
            beliefs: BTreeMap::new(),
            log: Vec::new(),
            read: BTreeMap::new(),
        }
    }

    /// Ids from here on.
    pub(crate) fn numbered_from(self, next: u32) -> Self {
        Self { next, ..self }
    }

    /// Rooms that see their neighbours only.
    pub(crate) fn rooms(cells: u32) -> Self {
        Self::row(cells, 1)
    }

    /// One hall that sees everything.
    pub(crate) fn hall(cells: u32) -> Self {
        Self::row(cells, cells)
    }

    pub(crate) fn sent(&self, x: f64) -> Sent {
        Sent {
            t_ms: Some(self.now_ms),
            position: [x, 0.5, 0.5],
            orientation: UP,
            velocity: None,
            acceleration: None,
        }
    }

    fn teach(&mut self, x: f64) {
        for cell in self.world.unknown_at([x, 0.5, 0.5], SPEED_MPS) {
            self.world.teach(cell, &self.sees[cell.index()], self.now_ms);
        }
    }

    fn object(&mut self) -> ObjectId {
        self.next += 1;
        ObjectId(FIRST_MOVER + self.next)
    }

    pub(crate) fn enter(&mut self, x: f64) -> SessionId {
        self.teach(x);
        let object = self.object();
        let session = SessionId(u64::from(self.next));
        let visitor = Visitor {
            pose: self.sent(x),
            aoi: Aoi {
                enter_m: 100.0,
                leave_m: 120.0,
            },
            max_speed_mps: SPEED_MPS,
            max_acceleration_mps2: None,
            radius_m: RADIUS_M,
            look: Look::default(),
            hears_movers: true,
            listens: true,
        };
        self.world.open(session, object, visitor, self.now_ms).unwrap();
        self.avatars.insert(session, object);
        self.beliefs.insert(session, Belief::default());
        self.listen();
        session
    }

    pub(crate) fn leave(&mut self, session: SessionId) {
        self.world.close(session, self.now_ms);
        self.beliefs.remove(&session);
        self.listen();
    }

    pub(crate) fn avatar(&self, session: SessionId) -> ObjectId {
        self.avatars[&session]
    }

    pub(crate) fn mover(&mut self, x: f64, max_speed_mps: f64, way: Option<Trajectory>) -> ObjectId {
        let pose = self.sent(x);
        let new = NewMover {
            pose,
            max_speed_mps,
            max_acceleration_mps2: None,
            radius_m: RADIUS_M,
            look: Look::default(),
            way,
        };
        self.add(new).0
    }

    /// A mover whose owner has promised more than its speed, and what it may rely on.
    pub(crate) fn create(
        &mut self,
        pose: Sent,
        max_speed_mps: f64,
        max_acceleration_mps2: Option<f64>,
    ) -> (ObjectId, Option<Hush>) {
        self.add(NewMover {
            pose,
            max_speed_mps,
            max_acceleration_mps2,
            radius_m: RADIUS_M,
            look: Look::default(),
            way: None,
        })
    }

    /// A mover in a ball of another size.
    pub(crate) fn large(&mut self, x: f64, radius_m: f64) -> ObjectId {
        let new = NewMover {
            pose: self.sent(x),
            max_speed_mps: 0.0,
            max_acceleration_mps2: None,
            radius_m,
            look: Look::default(),
            way: None,
        };
        self.add(new).0
    }

    /// A mover of which a session says where it is.
    pub(crate) fn own(&mut self, owner: SessionId, x: f64) -> (ObjectId, Option<Hush>) {
        let new = NewMover {
            pose: self.sent(x),
            max_speed_mps: SPEED_MPS,
            max_acceleration_mps2: None,
            radius_m: RADIUS_M,
            look: Look::default(),
            way: None,
        };
        self.add_for(Some(owner), new)
    }

    fn add(&mut self, new: NewMover) -> (ObjectId, Option<Hush>) {
        self.add_for(None, new)
    }

    fn add_for(&mut self, owner: Option<SessionId>, new: NewMover) -> (ObjectId, Option<Hush>) {
        let object = self.object();
        let moved = self.world.create(object, owner, new, self.now_ms).unwrap();
        self.listen();
        (object, moved.hush)
    }

    /// A pose of a mover that nobody can wake.
    pub(crate) fn drive(&mut self, object: ObjectId, x: f64, velocity_mps: Option<f64>) -> Option<Hush> {
        let sent = Sent {
            velocity: velocity_mps.map(|mps| [mps, 0.0, 0.0]),
            ..self.sent(x)
        };
        let moved = self.world.move_to(object, sent, self.now_ms).unwrap();
        self.listen();
        moved.hush
    }

    pub(crate) fn park(&mut self, x: f64) -> ObjectId {
        self.mover(x, SPEED_MPS, None)
    }

    /// To and fro for ever.
    pub(crate) fn tram(&mut self, from: f64, to: f64, one_way_ms: Ms) -> ObjectId {
        let key = |t_ms, x| Key {
            t_ms,
            position: [x, 0.5, 0.5],
            orientation: UP,
        };
        let keys = vec![key(0, from), key(one_way_ms, to), key(2 * one_way_ms, from)];
        let way = Trajectory::new(self.now_ms, keys, true).unwrap();
        self.mover(from, SPEED_MPS, Some(way))
    }

    pub(crate) fn set_aoi(&mut self, session: SessionId, enter_m: f64, leave_m: f64) {
        self.world
            .set_aoi(session, Aoi { enter_m, leave_m }, self.now_ms)
            .unwrap();
        self.listen();
    }

    /// A door that hides nothing.
    pub(crate) fn door(&mut self, x: f64, open: bool) {
        let at = Bounds::around([[x, 0.5, 0.5]]);
        self.world.set_door(ObjectId(7), &at, open, self.now_ms);
        self.listen();
    }

    /// A door that fills the border before a cell.
    pub(crate) fn gate(&mut self, border: u32, open: bool) {
        self.gate_unanswered(border, open);
        self.listen();
    }

    /// The same before it is known what gates hide now.
    pub(crate) fn gate_unanswered(&mut self, border: u32, open: bool) {
        let at = Bounds::around([[f64::from(border), 0.5, 0.5]]);
        self.know_gate(border, open);
        let door = ObjectId(1_000 + border);
        self.world.set_door(door, &at, open, self.now_ms);
        self.listen_unanswered();
    }

    /// A gate that was moved somewhere else.
    pub(crate) fn know_gate(&mut self, border: u32, open: bool) {
        if open {
            self.shut.remove(&border);
        } else {
            self.shut.insert(border);
        }
    }

    pub(crate) fn shut_gates(&self) -> Vec<u32> {
        self.shut.iter().copied().collect()
    }

    /// Says what gates hide, as geometry would.
    fn screen(&mut self) {
        while let Some(asked) = self.world.next_unscreened() {
            let borders: Vec<_> = asked
                .closed
                .iter()
                .filter_map(|door| door.0.checked_sub(1_000))
                .collect();
            let apart = |to: CellId| {
                let between = borders
                    .iter()
                    .filter(|border| (asked.cell.0 < **border) != (to.0 < **border));
                let behind: Vec<_> = between.map(|border| vec![ObjectId(1_000 + border)]).collect();
                (!behind.is_empty()).then_some(Hidden { cell: to, behind })
            };
            let others = asked.others.iter().map(|(cell, _)| *cell);
            let hidden: Vec<_> = others.filter_map(apart).collect();
            self.world.screen(asked.cell, &asked.closed, &hidden, self.now_ms);
        }
    }

    pub(crate) fn resync(&mut self, session: SessionId) {
        self.world.resync(session, Void::Unknown, self.now_ms);
        self.listen();
    }

    /// Somebody begins to listen to a session, or nobody does any more.
    pub(crate) fn ears(&mut self, session: SessionId, listens: bool) {
        self.world.listens(session, listens, self.now_ms);
        self.beliefs.insert(session, Belief::default());
        self.listen();
    }

    /// The stream of a session is there again, or has ended; what is said meanwhile waits for it.
    pub(crate) fn reach(&mut self, session: SessionId, wakeable: bool) {
        self.world.wakeable(session, wakeable, self.now_ms);
        self.listen();
    }

    pub(crate) fn tick(&mut self) {
        self.now_ms += 100;
        self.tick_now();
    }

    pub(crate) fn tick_now(&mut self) {
        for cell in self.world.unknown_ahead() {
            self.world.teach(cell, &self.sees[cell.index()], self.now_ms);
        }
        let waiting: Vec<_> = self.world.wants_room().filter(|_| self.reads).collect();
        for session in waiting {
            self.world.make_room(session, self.now_ms);
        }
        self.world.tick(self.now_ms);
        self.listen();
    }

    /// The scene is published anew, as it is.
    pub(crate) fn publish(&mut self) {
        let sights = self.sees.iter().enumerate();
        let sights: Vec<_> = sights.map(|(cell, sees)| (CellId(cell as u32), sees.clone())).collect();
        self.world.rebase(&self.ground, &sights, self.now_ms);
        self.listen();
    }

    /// Ticks while nobody speaks.
    pub(crate) fn silence(&mut self, ms: Ms) {
        (0..ms / 100).for_each(|_| self.tick());
    }

    /// A pose where it is; gives what may be relied on.
    pub(crate) fn pose(&mut self, session: SessionId, x: f64) -> Option<Hush> {
        self.teach(x);
        let seen = self.world.pose(session, self.sent(x), self.now_ms).unwrap();
        self.listen();
        seen.moved.hush
    }

    /// A pose where it is, with the velocity along x at which its participant says that it goes on.
    pub(crate) fn go(&mut self, session: SessionId, mps: f64) {
        self.state(session, [mps, 0.0, 0.0], [0.0; 3]);
    }

    /// A pose where it is, with a velocity and an acceleration that its participant states.
    pub(crate) fn state(&mut self, session: SessionId, velocity: [f64; 3], acceleration: [f64; 3]) {
        let sent = Sent {
            velocity: Some(velocity),
            acceleration: Some(acceleration),
            ..self.sent(self.x(session))
        };
        self.world.pose(session, sent, self.now_ms).unwrap();
        self.listen();
    }

    pub(crate) fn jump(&mut self, session: SessionId, x: f64) -> Option<Hush> {
        self.pose(session, x)
    }

    pub(crate) fn x(&self, session: SessionId) -> f64 {
        self.world.standpoint(session).unwrap().0[0]
    }

    pub(crate) fn stand(&mut self, session: SessionId) -> Option<Hush> {
        self.pose(session, self.x(session))
    }

    /// Walks there, a pose and a tick each 100 ms, while everybody else who is woken answers.
    pub(crate) fn walk(&mut self, session: SessionId, to: f64, speed_mps: f64) -> Option<Hush> {
        let mut hush = None;
        while self.x(session) != to {
            let left = to - self.x(session);
            let step = left.clamp(-0.1 * speed_mps, 0.1 * speed_mps);
            let next = if left.abs() < 0.1 * speed_mps + 1e-9 {
                to
            } else {
                self.x(session) + step
            };
            hush = self.pose(session, next);
            self.tick();
        }
        hush
    }

    pub(crate) fn listen(&mut self) {
        self.screen();
        self.listen_unanswered();
    }

    /// Before it is known what gates hide now.
    pub(crate) fn listen_unanswered(&mut self) {
        for (session, event) in self.world.events() {
            if let Some(belief) = self.beliefs.get_mut(&session) {
                belief.hear(&event);
            }
            self.log.push((session, event));
        }
    }

    /// All that was written so far, an entry each: what came in and what went out.
    pub(crate) fn journal(&mut self) -> Vec<(String, String)> {
        self.journal.extend(self.world.written());
        let lines: Vec<_> = self.journal.lines().map(str::to_owned).collect();
        lines
            .chunks(2)
            .map(|entry| (entry[0].clone(), entry[1].clone()))
            .collect()
    }

    pub(crate) fn seen_by(&self, session: SessionId) -> Vec<ObjectId> {
        self.beliefs[&session].shown.keys().copied().collect()
    }

    pub(crate) fn all(&self, session: SessionId) -> Vec<Event> {
        let mine = self.log.iter().filter(|(to, _)| *to == session);
        mine.map(|(_, event)| event.clone()).collect()
    }

    /// What a session was told since the last call.
    pub(crate) fn unread(&mut self, session: SessionId) -> Vec<Event> {
        let from = self.read.insert(session, self.log.len()).unwrap_or(0);
        let mine = self.log[from..].iter().filter(|(to, _)| *to == session);
        mine.map(|(_, event)| event.clone()).collect()
    }

    pub(crate) fn heard(&self, session: SessionId, name: &str) -> Vec<Event> {
        let mut all = self.all(session);
        all.retain(|event| event.name() == name);
        all
    }

    pub(crate) fn count(&self, session: SessionId, name: &str) -> usize {
        self.heard(session, name).len()
    }

    pub(crate) fn last_gone(&self, session: SessionId) -> Option<(ObjectId, Gone)> {
        let gone = self.heard(session, "object-gone");
        match gone.last() {
            Some(Event::ObjectGone { objects, reason }) => Some((objects[0], *reason)),
            _ => None,
        }
    }

    /// Whether what is at `x` may be told to who is at `eye`, by geometry alone, with room on both sides.
    pub(crate) fn sees(&self, eye: f64, x: f64, room_m: f64) -> bool {
        let near = |at: f64, by: f64| {
            (at - by).floor().max(0.0) as usize..=((at + by).floor() as usize).min(self.sees.len() - 1)
        };
        let mut eyes = near(eye, room_m);
        let targets = near(x, room_m);
        eyes.any(|from| {
            let open = |to: usize| {
                !self
                    .shut
                    .iter()
                    .any(|border| (from < *border as usize) != (to < *border as usize))
            };
            targets
                .clone()
                .any(|to| self.sees[from].contains(&CellId(to as u32)) && open(to))
        })
    }
}
