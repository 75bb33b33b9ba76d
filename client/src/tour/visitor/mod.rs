//! How does the strategy fare on a simulated line? Carries out [`crate::strategy`]: bytes are fetched for real, and count as
//! here when they would have come.

mod measures;

use std::collections::{HashMap, HashSet};

use belvedere_scene::{CellId, ModelId, index::CellEntry};

use super::{
    Script, TourSettings,
    courier::Courier,
    metered::Metered,
    outcome::{Frame, Memory, Tour},
    script::distance_m,
};
use crate::{
    ByteSource, Error, Scene,
    atlas::{self, Atlas, Uses},
    strategy::{
        ahead::{Approach, approaches, is_worth_knowing},
        motion::Motion,
        nearness::steps_to_models,
        order::{Change, Order, View},
        plan,
        planner::Planner,
        priority::Cause,
        sight::Eye,
    },
};

/// Who has moved so far looks anew at what is wanted.
const MOVED_M: f64 = 0.25;
/// Between two looks at whether the scene was published anew.
const LOOK_AGAIN_MS: f64 = 10_000.0;

/// Walks through one revision.
pub(super) struct Visitor<'a, S> {
    scene: &'a Scene<Metered<S>>,
    settings: TourSettings,
    now_ms: f64,
    atlas: Atlas,
    /// When the documents of a cell had come; cells that the index does not lead to never do.
    known_ms: HashMap<CellId, f64>,
    planner: Planner,
    motion: Motion,
    here: Option<CellId>,
    /// Whether something of all in sight that can be had was there once.
    has_begun: bool,
    /// Whether one may be in another cell, of which nobody knows.
    is_astray: bool,
    visible: HashSet<ModelId>,
    position: [f64; 3],
    /// Where one stood when it was last planned; nowhere when that is out of date.
    planned_at: Option<[f64; 3]>,
    /// Whether something was held since, so that another plan may want more.
    held_since: bool,
    /// Cells of which it was said that memory is short.
    short_in: HashSet<CellId>,
    /// From when on the pointer may be looked at again.
    look_ms: f64,
    courier: Courier<'a, S>,
}

impl<'a, S: ByteSource> Visitor<'a, S> {
    pub(super) fn new(scene: &'a Scene<Metered<S>>, settings: &TourSettings) -> Self {
        Self {
            scene,
            settings: *settings,
            now_ms: 0.0,
            atlas: Atlas::default(),
            known_ms: HashMap::new(),
            planner: Planner::new(settings.budgets()),
            motion: Motion::default(),
            here: None,
            has_begun: false,
            is_astray: false,
            visible: HashSet::new(),
            position: [0.0; 3],
            planned_at: None,
            held_since: false,
            short_in: HashSet::new(),
            look_ms: 0.0,
            courier: Courier::on(settings.line, scene),
        }
    }

    pub(super) async fn walk(mut self, script: &Script, each_frame: impl Fn()) -> Tour {
        let [from_ms, _] = script.times_ms();
        let frame_ms = self.settings.frame_ms();
        // The pointer and the manifest have been read.
        self.now_ms = self.courier.charge(0.0);
        for frame in 0..super::frames(script, &self.settings) {
            let t_ms = frame as f64 * frame_ms;
            self.position = script.at(from_ms + t_ms);
            self.motion.observe(t_ms / 1000.0, self.position);
            self.enter(t_ms).await;
            let frame = self.frame(t_ms);
            self.courier.tour.frames.push(frame);
            self.ask(t_ms + frame_ms).await;
            self.look_for_newer(t_ms).await;
            each_frame();
        }
        let mut tour = self.courier.end().await;
        tour.memory = Memory::of(
            &self.planner.residency,
            tour.memory,
            self.short_in.len() as u64,
            &tour.frames,
        );
        tour
    }

    /// Where something of this revision is gone, another may have taken its place: looks now and then until it is known which.
    async fn look_for_newer(&mut self, t_ms: f64) {
        let is_due = self.courier.tour.newer_revision.is_none() && t_ms >= self.look_ms;
        if is_due && self.courier.has_missed() {
            self.look_ms = t_ms + LOOK_AGAIN_MS;
            self.courier.tour.newer_revision = self.scene.newer_revision().await.unwrap_or_default();
            self.courier.charge(self.now_ms);
        }
    }

    /// Finds the cell at a position and reads what can be seen from there. Who cannot find it stays where it was.
    async fn enter(&mut self, t_ms: f64) {
        self.now_ms = self.now_ms.max(t_ms);
        let from = self.here.and_then(|here| self.atlas.place(here));
        let from = from.map(|place| &place.entry);
        let grows = self.settings.rules;
        let found = self.scene.whereabouts(from, self.position, grows, false).await;
        let asked_ms = self.courier.charge(self.now_ms);
        let at = match found {
            Ok(whereabouts) => {
                self.is_astray = !whereabouts.is_sure;
                whereabouts.failures.iter().for_each(|cause| self.courier.fail(cause));
                whereabouts.cell
            }
            Err(cause) => return self.courier.fail(&cause),
        };
        if self.here == Some(at.cell) {
            return;
        }
        let cell = at.cell;
        self.here = Some(cell);
        self.planned_at = None;
        self.learn(at, asked_ms).await;
        self.look_around();
        if self.is_known(cell) {
            // What is here already is drawn at once, whether or not anything more may be asked for now.
            let changes = self.plan(cell);
            self.note(&changes);
        }
    }

    /// Reads what can be seen from a cell. What cannot be read is counted, and will never be there.
    async fn learn(&mut self, entry: CellEntry, asked_ms: f64) {
        let cell = entry.cell;
        if self.known_ms.contains_key(&cell) {
            return;
        }
        let (record, mut failures) = self.scene.record_somehow(&entry).await;
        let read_ms = self.courier.charge(asked_ms);
        let uses = Uses {
            smooth: self.settings.smooth,
            rules: self.settings.rules,
        };
        let (place, others) = atlas::look(self.scene, entry, record, uses).await;
        failures.extend(others);
        failures.iter().for_each(|cause| self.courier.fail(cause));
        self.atlas.add(place);
        let from_ms = self.courier.charge(read_ms);
        self.known_ms.insert(cell, from_ms);
    }

    /// Reads what can be seen from a cell of which only the name is known.
    async fn learn_of(&mut self, cell: CellId) {
        let entry = self.scene.cell(cell).await;
        let asked_ms = self.courier.charge(self.now_ms);
        let cause = match entry {
            Ok(Some(entry)) => {
                self.learn(entry, asked_ms).await;
                return self.look_around();
            }
            Ok(None) => Error::NoCell(cell),
            Err(cause) => cause,
        };
        self.courier.fail(&cause);
        self.known_ms.insert(cell, f64::INFINITY);
    }

    /// Says what is needed here and how near what else is; and whether memory can hold it.
    fn look_around(&mut self) {
        let Some(here) = self.here else { return };
        self.planned_at = None;
        let seen = self.atlas.seen_from(here);
        self.visible = seen.iter().map(|seen| seen.model).collect();
        let limit_bytes = self.settings.memory_bytes;
        let mut steps = HashMap::new();
        if limit_bytes != u64::MAX {
            steps = steps_to_models(here, &self.atlas, |cell| self.atlas.seen_from(cell));
        }
        let needed_bytes = plan::least_bytes(self.atlas.seen_around(here), &self.planner.residency);
        self.courier.tour.memory.needs(here, needed_bytes);
        if needed_bytes > limit_bytes && self.short_in.insert(here) {
            self.courier.fail(&Error::MemoryShort {
                cell: here,
                needed_bytes,
                limit_bytes,
            });
        }
        self.planner.residency.need(self.visible.clone(), steps);
        for model in &self.visible {
            self.courier.ledger.sees(self.planner.residency.files_of(*model));
        }
    }

    /// Asks until a time, as much at once as may be under way.
    async fn ask(&mut self, until_ms: f64) {
        while self.now_ms < until_ms {
            if self.courier.has_room() && self.ask_once().await {
                continue;
            }
            let learnt = self.known_ms.values().copied().filter(|from_ms| *from_ms > self.now_ms);
            self.now_ms = learnt.fold(until_ms.min(self.courier.next_ms()), f64::min);
            self.receive();
            self.note_convergence();
        }
    }

    /// Asks for what is most urgent; `false` when there is nothing.
    async fn ask_once(&mut self) -> bool {
        let Some(here) = self.here.filter(|here| self.is_known(*here)) else {
            return false;
        };
        let mut changes = Vec::new();
        let moved = self.planned_at.is_none_or(|at| distance_m(at, self.position) > MOVED_M);
        let mut order = if moved { None } else { self.planner.next(&mut changes) };
        if order.is_none() && (moved || self.held_since) {
            changes.extend(self.plan(here));
            order = self.planner.next(&mut changes);
        }
        self.note(&changes);
        // What can be seen ahead must be known before it can be fetched: it is read of once all is asked for that is missing here,
        // and before what is only finer.
        let is_first = |order: &Order| matches!(order.wish.cause, Cause::Missing { .. });
        let asks_firsts = order.as_ref().is_some_and(is_first) || self.planner.has_firsts_to_ask();
        let learnt = !asks_firsts && self.learn_ahead(here).await;
        let asked = order.is_some();
        if let Some(order) = order {
            self.courier.fetch(&order, &mut self.planner, self.now_ms).await;
        }
        asked || learnt
    }

    fn plan(&mut self, here: CellId) -> Vec<Change> {
        self.planner
            .offer_bundles(self.settings.bundles && self.courier.offers_bundles());
        // Before the first picture is there, one reads of what lies ahead, and no more.
        let ahead = if self.has_begun { self.ahead(here) } else { Vec::new() };
        let ahead = ahead.into_iter().filter(|approach| self.is_known(approach.cell));
        let view = View {
            eye: Eye::at(self.position),
            here: self.atlas.seen_from(here),
            is_all_known: true,
            ahead: ahead
                .map(|approach| (approach, self.atlas.seen_from(approach.cell)))
                .collect(),
        };
        (self.planned_at, self.held_since) = (Some(self.position), false);
        self.planner.plan(&view, self.courier.bytes_per_s())
    }

    /// Cells that may be entered soon.
    fn ahead(&self, here: CellId) -> Vec<Approach> {
        if !self.settings.prefetch {
            return Vec::new();
        }
        approaches(here, &self.atlas, self.position, self.motion.velocity_mps())
    }

    fn is_known(&self, cell: CellId) -> bool {
        self.known_ms.get(&cell).is_some_and(|from_ms| *from_ms <= self.now_ms)
    }

    /// Reads of the next cell that may be entered soon; `false` when there is none.
    async fn learn_ahead(&mut self, here: CellId) -> bool {
        let rate = self.courier.bytes_per_s();
        let unknown = self
            .ahead(here)
            .into_iter()
            .find(|approach| !self.known_ms.contains_key(&approach.cell) && is_worth_knowing(approach.in_s, rate));
        let Some(approach) = unknown else { return false };
        self.learn_of(approach.cell).await;
        true
    }

    /// Takes in what is here by now.
    fn receive(&mut self) {
        let received = self.courier.receive(&mut self.planner, self.now_ms);
        if received.lost {
            self.planned_at = None;
        }
        if received.lost_rules {
            self.do_without_rules();
        }
        if received.any {
            // It may have come for others as well, and memory that was short may suffice now.
            self.held_since = true;
            let changes = self.planner.settle();
            self.note(&changes);
        }
    }

    /// Levels come instead of what was to grow; what is known only so far is read of anew.
    fn do_without_rules(&mut self) {
        self.settings.rules = false;
        self.planner.lose_rules();
        for cell in self.atlas.forget_stand_ins() {
            self.known_ms.remove(&cell);
            if self.here == Some(cell) {
                self.here = None;
            }
        }
    }

    fn note(&mut self, changes: &[Change]) {
        for change in changes {
            match change {
                Change::Held(wish) if self.visible.contains(&wish.model) => {
                    self.courier.ledger.sees(self.planner.residency.files_of(wish.model));
                }
                Change::Gone(file) => self.courier.ledger.goes(*file),
                _ => {}
            }
        }
    }
}
