//! How does a program walk through a scene without caring what to fetch? Carries out [`crate::strategy`] over a source: many
//! requests at once, those that nobody needs any more cancelled, all of it verified, within memory. Levels are taken out of packs
//! while these come. What cannot be had is told and done without; a level stands in for another, or for a smooth LOD. Where files are
//! gone because the scene was published anew, that is told as well, and [`Explorer::successor`] walks on through the new revision.
//!
//! ```no_run
//! # async fn walk() -> Result<(), belvedere_client::Error> {
//! use belvedere_client::{Client, Event, Explorer, ExplorerOptions, HttpSource, Retrying, strategy::sight::Eye};
//!
//! let client = Client::new(Retrying::new(HttpSource::new("http://127.0.0.1:8080")?));
//! let scene = client.open(&"museum".parse().expect("a scene name")).await?;
//! let eye = Eye::at(scene.pointer().viewpoints[0].position);
//! let mut explorer = Explorer::new(scene, ExplorerOptions::default());
//! explorer.follow(eye).await;
//! while let Some(events) = explorer.advance().await {
//!     for event in events {
//!         if let Event::Drawn { model, .. } = event {
//!             let mesh = explorer.mesh(model); // to be decoded and drawn instead of the one before
//!         }
//!     }
//!     println!("{}", explorer.progress());
//! }
//! # Ok(())
//! # }
//! ```

mod event;
mod members;
mod mesh;
mod newer;
mod recovery;
mod seedling;
mod tasks;
#[cfg(test)]
mod tests;

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
    time::Instant,
};

use belvedere_scene::{CellId, ModelId, index::CellEntry};
use bytes::Bytes;
use members::Come;
use tokio::{
    sync::mpsc::{self, UnboundedReceiver, UnboundedSender},
    task::{Id, JoinSet},
};

pub use event::{Event, ExplorerOptions};
pub use mesh::{Geometry, Mesh};
use newer::{Inheritance, Lookout};
use recovery::{Losses, Recovery};
pub use seedling::Seedling;
use tasks::{Brought, UnderWay};

use crate::{
    ByteSource, Error, Scene,
    atlas::Atlas,
    fetch::Manners,
    strategy::{
        ahead::{approaches, is_worth_knowing},
        file::Key,
        meter::Meter,
        motion::Motion,
        nearness::steps_to_models,
        order::{Change, View},
        plan::{self, Held},
        planner::Planner,
        progress::{Progress, first_progress, sharp_progress},
        sight::{Eye, Seen},
    },
};

/// Walks through one revision of a scene.
pub struct Explorer<S> {
    scene: Arc<Scene<S>>,
    options: ExplorerOptions,
    atlas: Atlas,
    /// Cells that were read of, or are being read of.
    asked: HashSet<CellId>,
    /// Those of them that could not even be found from afar.
    unfound: HashSet<CellId>,
    planner: Planner,
    meter: Meter,
    motion: Motion,
    manners: Arc<Manners>,
    files: HashMap<Key, Bytes>,
    tasks: JoinSet<Brought>,
    under_way: HashMap<Id, UnderWay>,
    /// What tasks tell before they end: what has come of packs so far.
    tell: UnboundedSender<Come>,
    told: UnboundedReceiver<Come>,
    /// The cell at the eye, and that of which one knows what can be seen.
    at: Option<CellEntry>,
    /// Whether the eye has gone on since, and nobody knows where that is.
    is_astray: bool,
    shown: Option<CellId>,
    eye: Option<Eye>,
    /// Whether something of all in sight that can be had was there once.
    has_begun: bool,
    short_in: HashSet<CellId>,
    recovery: Recovery,
    lookout: Lookout,
    inheritance: Inheritance,
    events: Vec<Event>,
    started: Instant,
    cancelled: u64,
}

impl<S: ByteSource + 'static> Explorer<S> {
    /// Stands nowhere and holds nothing at first.
    #[must_use]
    pub fn new(scene: Scene<S>, options: ExplorerOptions) -> Self {
        let (tell, told) = mpsc::unbounded_channel();
        Self {
            scene: Arc::new(scene.giving_up()),
            options,
            atlas: Atlas::default(),
            asked: HashSet::new(),
            unfound: HashSet::new(),
            planner: Planner::new(options.budgets),
            meter: Meter::default(),
            motion: Motion::default(),
            manners: Arc::default(),
            files: HashMap::new(),
            tasks: JoinSet::new(),
            under_way: HashMap::new(),
            tell,
            told,
            at: None,
            is_astray: false,
            shown: None,
            eye: None,
            has_begun: false,
            short_in: HashSet::new(),
            recovery: Recovery::default(),
            lookout: Lookout::default(),
            inheritance: Inheritance::default(),
            events: Vec::new(),
            started: Instant::now(),
            cancelled: 0,
        }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene<S> {
        &self.scene
    }

    /// The eye is there now. Next door that mostly asks nobody; what is wanted from there is asked for.
    pub async fn follow(&mut self, eye: Eye) {
        self.motion.observe(self.started.elapsed().as_secs_f64(), eye.position);
        self.eye = Some(eye);
        self.find(eye).await;
        self.look_where_missed();
        self.replan();
    }

    /// Looks in which cell the eye is, and reads of it.
    async fn find(&mut self, eye: Eye) {
        let (from, grows, waits) = (self.at.as_ref(), self.options.rules, self.options.recovers);
        match self.scene.whereabouts(from, eye.position, grows, waits).await {
            Ok(whereabouts) => {
                let entry = whereabouts.cell;
                self.events.extend(whereabouts.failures.into_iter().map(Event::Problem));
                let cell = entry.cell;
                if self.asked.insert(cell) || self.unfound.remove(&cell) {
                    self.read(Ok(entry.clone()));
                }
                self.at = Some(entry);
                self.is_astray = false;
                self.recovery.found();
                self.show(cell);
            }
            Err(cause) => {
                self.is_astray = true;
                self.recovery.note(&cause, |losses| losses.is_astray = true);
                if !matches!(cause, Error::GivenUp { .. }) {
                    self.events.push(Event::Problem(cause));
                }
            }
        }
    }

    /// Waits until something has happened, and says what; `None` when nothing is under way and nothing will be tried again, so
    /// that nothing will. May be called off at any time, for a new [`Explorer::follow`].
    ///
    /// # Panics
    /// When a source does.
    pub async fn advance(&mut self) -> Option<Vec<Event>> {
        while self.events.is_empty() {
            if self.tasks.is_empty() && !self.recovery.is_waiting() {
                return None;
            }
            let ended = tokio::select! {
                biased;
                Some(come) = self.told.recv() => {
                    self.take_members(come);
                    continue;
                }
                Some(ended) = self.tasks.join_next_with_id() => ended,
                () = self.recovery.due() => {
                    self.scene.forgive_what_passes().await;
                    // Only now: nothing is lost when this is called off before.
                    let losses = self.recovery.take();
                    self.try_again(losses).await;
                    continue;
                }
            };
            // What a task has told may have come with its end.
            while let Ok(come) = self.told.try_recv() {
                self.take_members(come);
            }
            match ended {
                Ok((id, brought)) => self.take(id, brought),
                // What it was to bring would be waited for for ever.
                Err(ended) if ended.is_panic() => std::panic::resume_unwind(ended.into_panic()),
                // It was called off.
                Err(_) => {}
            }
        }
        Some(std::mem::take(&mut self.events))
    }

    /// What can be seen, largest solid angle first, as far as it is known.
    #[must_use]
    pub fn visible(&self) -> &[Seen] {
        self.shown.map_or(&[], |cell| self.atlas.seen_from(cell))
    }

    /// Towards the first picture.
    #[must_use]
    pub fn progress(&self) -> Progress {
        first_progress(self.visible(), &self.planner.residency)
    }

    /// Towards a picture that is as sharp as it will get from here.
    #[must_use]
    pub fn sharp_progress(&self) -> Progress {
        let target_px = self.options.budgets.target_px;
        self.eye.map_or_else(Progress::default, |eye| {
            sharp_progress(self.visible(), &self.planner.residency, &eye, target_px)
        })
    }

    /// Visible objects of which nothing is held; `None` while nobody knows what can be seen from where the eye is.
    #[must_use]
    pub fn missing(&self) -> Option<usize> {
        let here = self.at.as_ref().filter(|_| !self.is_astray)?.cell;
        let place = self.atlas.place(here).filter(|_| self.shown == Some(here))?;
        if place.is_unknown && self.recovery.awaits(here) {
            return None;
        }
        let unread = if place.is_unknown { 0 } else { place.lost };
        let lacks = |seen: &&Seen| self.planner.residency.held(seen.model).is_none();
        Some(place.seen.iter().filter(lacks).count() + unread)
    }

    /// Memory of what is held, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.planner.residency.bytes() + self.inheritance.bytes()
    }

    /// How many requests were called off because nobody needed their answers any more.
    #[must_use]
    pub fn cancelled(&self) -> u64 {
        self.cancelled
    }

    /// Tries again what could not be had: all of it, whatever the reason.
    pub async fn retry(&mut self) {
        self.planner.residency.forgive_all();
        self.scene.forgive().await;
        let mut losses = self.recovery.take();
        losses.cells.extend(self.atlas.lacking());
        losses.cells.extend(&self.unfound);
        losses.is_astray |= self.is_astray;
        self.try_again(losses).await;
    }

    /// Reads and asks for all of that again.
    async fn try_again(
        &mut self,
        Losses {
            files,
            cells,
            is_astray,
        }: Losses,
    ) {
        self.planner.residency.forgive(&files);
        for cell in cells {
            self.unfound.remove(&cell);
            self.asked.insert(cell);
            let known = self.atlas.place(cell).map(|place| place.entry.clone());
            self.read(known.ok_or(cell));
        }
        self.replan();
        if let Some(eye) = self.eye.filter(|_| is_astray) {
            // Should this be called off, it is tried again.
            if self.options.recovers {
                self.recovery.expect(|losses| losses.is_astray = true);
            }
            self.find(eye).await;
            self.replan();
        }
    }

    /// Says what went wrong, and tries what was lost with it again if that may help.
    fn lose(&mut self, cause: Error, loss: impl FnOnce(&mut Losses)) {
        self.lookout.has_missed |= matches!(cause, Error::Missing(_));
        if self.options.recovers {
            self.recovery.note(&cause, loss);
        }
        self.events.push(Event::Problem(cause));
    }

    /// Nothing is grown any more: levels come instead of what has not come, or could not be grown.
    pub fn without_rules(&mut self) {
        self.options.rules = false;
        self.planner.lose_rules();
        for cell in self.atlas.forget_stand_ins() {
            self.asked.remove(&cell);
        }
        if let Some(at) = self.at.clone()
            && self.asked.insert(at.cell)
        {
            self.read(Ok(at));
        }
        self.replan();
    }

    /// The smooth LOD of a model cannot be decoded: levels take its place, and nothing of it is kept on disk. Its hash shows damage
    /// only when all rungs have come, and most never do.
    pub fn without_smooth(&mut self, model: ModelId) {
        let Some(model) = self.planner.model(model).cloned() else {
            return;
        };
        let Some(smooth) = &model.smooth else { return };
        self.planner.lose_stream(&model);
        self.scene.source().forget_parts(&smooth.url);
        self.replan();
    }

    /// What a model is drawn with.
    #[must_use]
    pub fn mesh(&self, model: ModelId) -> Option<Mesh> {
        mesh::of(&self.planner, model, &self.files)
    }

    /// What can be seen from a cell counts from now on, if anything is known of it; else the picture from before stays.
    fn show(&mut self, cell: CellId) {
        let is_known = self.atlas.place(cell).is_some_and(|place| !place.is_blank());
        if self.at.as_ref().is_none_or(|at| at.cell != cell) || !is_known {
            return;
        }
        if self.shown.replace(cell) != Some(cell) {
            self.events.push(Event::Entered(cell));
        }
        self.look_around(cell);
    }

    /// Says what is needed here and how near what else is; and whether memory can hold it.
    fn look_around(&mut self, cell: CellId) {
        let seen = self.atlas.seen_from(cell);
        let models = seen.iter().map(|seen| seen.model).collect();
        let steps = steps_to_models(cell, &self.atlas, |cell| self.atlas.seen_from(cell));
        let needed_bytes = plan::least_bytes(self.atlas.seen_around(cell), &self.planner.residency);
        self.planner.residency.need(models, steps);
        let limit_bytes = self.planner.residency.limit_bytes();
        if needed_bytes > limit_bytes && self.short_in.insert(cell) {
            self.events.push(Event::Problem(Error::MemoryShort {
                cell,
                needed_bytes,
                limit_bytes,
            }));
        }
    }

    fn note(&mut self, changes: Vec<Change>) {
        for change in changes {
            match change {
                Change::Held(wish) => self.events.push(Event::Drawn {
                    model: wish.model,
                    grade: wish.grade,
                    why: wish.to_string(),
                }),
                Change::Blunted(model) => self.events.push(Event::Blunted(model)),
                Change::Dropped(model) => self.events.push(Event::Dropped(model)),
                Change::Gone(key) => _ = self.files.remove(&key),
            }
        }
    }

    /// Reads of cells that may be entered soon.
    fn look_ahead(&mut self, ahead: &[CellId]) {
        for cell in ahead {
            if self.asked.insert(*cell) {
                self.read(Err(*cell));
            }
        }
    }

    /// Makes what is under way equal to what is wanted. What lies ahead is read of once all is asked for that is missing here,
    /// and fetched once the first picture was there.
    fn replan(&mut self) {
        let (Some(shown), Some(eye)) = (self.shown, self.eye) else {
            return;
        };
        self.has_begun = self.has_begun || plan::has_first_picture(self.visible(), &self.planner.residency);
        let mut ahead = Vec::new();
        if self.options.budgets.prefetch {
            ahead = approaches(shown, &self.atlas, eye.position, self.motion.velocity_mps());
        }
        let bytes_per_s = self.meter.bytes_per_s();
        let worth_knowing = ahead
            .iter()
            .filter(|approach| is_worth_knowing(approach.in_s, bytes_per_s));
        let worth_knowing: Vec<CellId> = worth_knowing.map(|approach| approach.cell).collect();
        let known = ahead
            .into_iter()
            .filter(|approach| self.has_begun && self.atlas.place(approach.cell).is_some());
        let view = View {
            eye,
            here: self.atlas.seen_from(shown),
            is_all_known: true,
            ahead: known
                .map(|approach| (approach, self.atlas.seen_from(approach.cell)))
                .collect(),
        };
        let offered = self.scene.source().offers_bundles() && !self.manners.bundles_refused();
        self.planner.offer_bundles(self.options.bundles && offered);
        let mut changes = self.planner.plan(&view, bytes_per_s);
        self.cancel();
        while self.has_room()
            && let Some(order) = self.planner.next(&mut changes)
        {
            self.start(order);
        }
        self.make_room();
        self.note(changes);
        if !self.planner.has_firsts_to_ask() {
            self.look_ahead(&worth_knowing);
        }
    }
}
