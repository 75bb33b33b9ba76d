//! The rules of one scene: sessions, movers, doors, and what each session hears of them.
//!
//! Inputs are methods and take the time; [`World::tick`] decides what is told, and [`World::events`] hands it out. Between
//! ticks only what cannot wait is told: hushes, wakes, a participant's own cell.
//!
//! A mover is *awake* while a session watches one of its cells ([`sight`]). Otherwise it is *hushed*: registered in the
//! cells that its temporal bounding volume touches, and nobody looks at it until the volume expires or a session starts
//! to watch one of those cells, after the algorithm of Sudarsky & Gotsman (§3), with view cells for BSP leaves and one
//! registration of a mover for all sessions. Work in a tick is O(visible + expired + exposed).

mod abroad;
mod among;
mod asked;
mod check;
mod clock;
mod doors;
mod hushing;
mod looking;
mod mover;
mod movers;
mod session;
mod sessions;
mod showing;
mod sight;
mod telling;
mod tick;

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{Bounds, CellId, ObjectId, foliage::Foliage};
use serde::{Deserialize, Serialize};

pub(crate) use self::check::around;
pub use self::{
    abroad::Exported,
    among::BACK,
    check::{
        MOST_ACCELERATION_MPS2, MOST_AOI_M, MOST_RADIUS_M, MOST_SPEED_MPS, MOST_WALK_MPS, Moved, Radius, Refusal,
        SLACK, Seen, Sent, Unknown,
    },
    doors::Unscreened,
    mover::Look,
    movers::NewMover,
    session::{REMEMBERED, ROOM},
    sessions::{Stand, Visitor},
    telling::POSE_BYTES,
};
use self::{abroad::Watched, asked::Asked, doors::Door, mover::Mover, session::Session};
use crate::{
    Ms,
    cells::{Ball, Cells},
    crowd::{Crowd, Crowding},
    event::{Event, Gone, SessionId},
};

/// What can be set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rules {
    /// Time between ticks.
    pub tick_ms: Ms,
    /// From a pose in a participant's hands to an event there: visibility is widened by what it moves meanwhile, and an owner that
    /// was woken is waited for so long.
    pub round_trip_ms: Ms,
    /// Whoever has entered an area of interest stays for this long.
    pub shortest_stay_ms: Ms,
    /// A volume lasts for so long when the mover's owner can be woken, and else no longer. 0: there are none.
    pub longest_tbv_ms: Ms,
    /// A volume of a mover whose owner cannot be woken lasts no longer.
    pub longest_unheard_tbv_ms: Ms,
    /// How long an owner is waited for whose promise has run out.
    pub grace_ms: Ms,
    /// Poses for one session, in bytes a second.
    pub bytes_per_s: f64,
    /// Whether people hide each other, and how much that counts.
    pub crowd: Option<Crowding>,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            tick_ms: 100,
            round_trip_ms: 250,
            shortest_stay_ms: 1_000,
            longest_tbv_ms: 3_600_000,
            longest_unheard_tbv_ms: 2_000,
            grace_ms: 1_000,
            bytes_per_s: 64_000.0,
            crowd: Some(Crowding::default()),
        }
    }
}

/// One scene with everybody in it.
#[derive(Debug)]
pub struct World {
    rules: Rules,
    cells: Cells,
    /// Where positions may be.
    reach: Bounds,
    /// Boxed, and movers too: a tree's nodes are half empty where keys only rise.
    sessions: BTreeMap<SessionId, Box<Session>>,
    movers: BTreeMap<ObjectId, Box<Mover>>,
    /// By cell.
    movers_in: Vec<BTreeSet<ObjectId>>,
    /// By cell.
    watchers: Vec<BTreeSet<SessionId>>,
    /// Cells with watchers.
    watched: Watched,
    /// Cells that sessions of other nodes watch.
    watched_abroad: BTreeSet<CellId>,
    awake: BTreeSet<ObjectId>,
    /// Those of them that must be looked at each tick: all but those that rest where somebody watches them.
    restless: BTreeSet<ObjectId>,
    /// How many of the movers live on other nodes.
    abroad: usize,
    alarms: BTreeSet<(Ms, ObjectId)>,
    reaches: sight::Reaches,
    /// Who is awake, seen from above, where people hide each other.
    crowd: Option<Crowd>,
    /// Sessions and movers whose relations may have changed since the last tick.
    stirred_sessions: BTreeSet<SessionId>,
    stirred_movers: BTreeSet<ObjectId>,
    /// Sessions whose participants said that they go on, and that hear what they come to see.
    under_way: BTreeSet<SessionId>,
    /// Cells that these come to, and nobody has said what is seen from there yet.
    unknown_ahead: BTreeSet<CellId>,
    /// Sessions that see whom they do not know yet.
    uninformed: BTreeSet<SessionId>,
    /// Sessions that are restless, each once.
    unsettled: Vec<SessionId>,
    /// Sessions with a crowd around.
    in_crowd: BTreeSet<SessionId>,
    /// Somebody is in other cells than when crowds were looked at last.
    somebody_came: bool,
    /// Not told yet.
    gone: BTreeMap<(SessionId, Gone), Vec<ObjectId>>,
    doors: BTreeMap<ObjectId, Door>,
    /// Cells from which closed doors may hide something, and nobody has said what yet.
    unscreened: Asked,
    events: Vec<(SessionId, Event)>,
}

/// How much there is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Sessions.
    pub sessions: usize,
    /// Movers, avatars included.
    pub movers: usize,
    /// Movers that cost nothing now.
    pub hushed: usize,
    /// Movers that live on other nodes.
    pub abroad: usize,
}

impl World {
    /// An empty scene. `bounds` is the box around its objects.
    #[must_use]
    pub fn new(cells: Cells, bounds: &Bounds, rules: Rules) -> Self {
        let reach = check::around(&bounds.union(&cells.bounds()));
        Self {
            movers_in: vec![BTreeSet::new(); cells.len()],
            watchers: vec![BTreeSet::new(); cells.len()],
            watched: Watched::default(),
            watched_abroad: BTreeSet::new(),
            reach,
            rules,
            cells,
            sessions: BTreeMap::new(),
            movers: BTreeMap::new(),
            awake: BTreeSet::new(),
            restless: BTreeSet::new(),
            abroad: 0,
            alarms: BTreeSet::new(),
            reaches: sight::Reaches::default(),
            crowd: rules.crowd.map(|_| Crowd::new(&reach)),
            stirred_sessions: BTreeSet::new(),
            stirred_movers: BTreeSet::new(),
            under_way: BTreeSet::new(),
            unknown_ahead: BTreeSet::new(),
            uninformed: BTreeSet::new(),
            unsettled: Vec::new(),
            in_crowd: BTreeSet::new(),
            somebody_came: false,
            gone: BTreeMap::new(),
            doors: BTreeMap::new(),
            unscreened: Asked::default(),
            events: Vec::new(),
        }
    }

    /// Takes note of the foliage of a world where nobody is yet; it hides some of those who will stand in it and behind it.
    pub fn plant(&mut self, foliage: &Foliage) {
        if let Some(crowd) = &mut self.crowd {
            crowd.plant(foliage);
        }
    }

    /// The rules in force.
    #[must_use]
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// How much there is.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts {
            sessions: self.sessions.len(),
            movers: self.movers.len(),
            hushed: self.movers.len() - self.awake.len(),
            abroad: self.abroad,
        }
    }

    /// Whether a tick would do nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sessions.is_empty() && self.movers.is_empty()
    }

    /// What has happened since the last call, in order.
    pub fn events(&mut self) -> Vec<(SessionId, Event)> {
        std::mem::take(&mut self.events)
    }

    /// Cells of which [`World::teach`] must tell before a participant stands here.
    #[must_use]
    pub fn unknown_at(&self, position: [f64; 3], max_speed_mps: f64) -> Unknown {
        if check::walking_speed(max_speed_mps).is_err() {
            // It will be refused.
            return Vec::new();
        }
        let eye = self.rules.eye_ball(position, max_speed_mps);
        self.cells.unknown_under(&self.looked_ahead(eye, max_speed_mps))
    }

    /// The same for a session that moves there.
    #[must_use]
    pub fn unknown_to(&self, session: SessionId, position: [f64; 3]) -> Unknown {
        let mover = self.sessions.get(&session).and_then(|s| self.movers.get(&s.object));
        mover.map_or_else(Vec::new, |mover| self.unknown_at(position, mover.max_speed_mps))
    }

    /// Whether it is known what is seen from a cell.
    #[must_use]
    pub fn knows(&self, cell: CellId) -> bool {
        self.cells.knows(cell)
    }

    /// Takes note of what is seen from a cell.
    pub fn teach(&mut self, cell: CellId, sees: &[CellId]) {
        self.cells.learn(cell, sees);
    }

    /// Where participants may be before they hear of a new revision.
    pub fn eyes(&self) -> impl Iterator<Item = Ball> {
        let movers = self.sessions.values().map(|session| &self.movers[&session.object]);
        movers.map(|mover| self.rules.eye_ball(mover.pose.position, mover.max_speed_mps))
    }

    /// The scene was published anew. `cells` must know what is seen from all [`World::eyes`]. Doors are as published
    /// again, and nobody may rely on a volume among other cells.
    pub fn rebase(&mut self, cells: Cells, bounds: &Bounds, foliage: &Foliage, now_ms: Ms) {
        self.reach = check::around(&bounds.union(&cells.bounds()));
        self.crowd = self.rules.crowd.map(|_| Crowd::new(&self.reach));
        self.plant(foliage);
        self.movers_in = vec![BTreeSet::new(); cells.len()];
        self.watchers = vec![BTreeSet::new(); cells.len()];
        self.watched.clear();
        self.watched_abroad.clear();
        self.cells = cells;
        self.doors.clear();
        self.unscreened.clear();
        self.unknown_ahead.clear();
        self.alarms.clear();
        let movers: Vec<_> = self.movers.keys().copied().collect();
        for object in movers {
            self.revoke(object);
            if let Some(mover) = self.movers.get_mut(&object) {
                mover.cells.clear();
            }
            self.rouse(object, now_ms);
        }
        let sessions: Vec<_> = self.sessions.keys().copied().collect();
        for id in sessions {
            if let Some(session) = self.sessions.get_mut(&id) {
                session.eye = sight::Eye::default();
                session.doors.clear();
            }
            self.look_from_pose(id, now_ms);
            if let Ok(place) = self.place_of(id) {
                self.say(id, Event::Cell { cell: place.cell });
            }
        }
    }

    fn say(&mut self, session: SessionId, event: Event) {
        // What may be relied on is not said to who might hear of it when it is void; that it is void must be.
        let waits = !matches!(event, Event::Hush(_));
        if self
            .sessions
            .get(&session)
            .is_some_and(|session| session.wakeable || waits)
        {
            self.events.push((session, event));
        }
    }
}

/// Calls `each` for those of these sessions that are there. `ids` rise.
fn each_session(
    sessions: &mut BTreeMap<SessionId, Box<Session>>,
    ids: &[SessionId],
    mut each: impl FnMut(SessionId, &mut Session),
) {
    /// To go along past so many takes about as long as to look one up.
    const PASSED: usize = 8;
    if ids.len() < sessions.len() / PASSED {
        for id in ids {
            if let Some(session) = sessions.get_mut(id) {
                each(*id, session);
            }
        }
        return;
    }
    let mut wanted = ids.iter().copied().peekable();
    for (id, session) in sessions {
        while wanted.next_if(|wanted| wanted < id).is_some() {}
        if wanted.next_if_eq(id).is_some() {
            each(*id, session);
        }
    }
}
