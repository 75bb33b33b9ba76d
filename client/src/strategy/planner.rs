//! What is asked for next, of all that is wanted? Wishes become requests: a file alone, a pack of which most is wanted, or
//! small files together in a bundle; within memory, and within what may be under way.
//!
//! What lies ahead waits until it is due: until fetching it, and what is due before it, takes about as long as one could
//! need to get there. Then it comes before anything finer; earlier only where nothing else is wanted.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use belvedere_scene::{
    BlobHash, ModelId,
    object::{Level, Model, PackRef},
    rung::RungName,
};

use super::{
    ahead::{HORIZON_S, is_due},
    bundles,
    file::{FileRef, Key, StreamRef},
    grade::{Part, State, Stock},
    memory::{Gone, Terms},
    models::Models,
    order::{Budgets, Change, Member, Order, View},
    plan::{self, Held},
    priority::{Cause, Wish, band},
    residency::Residency,
};

/// A pack is fetched whole when at least this share of its bytes is wanted.
pub(crate) const WORTH_A_PACK: f64 = 0.5;
/// After so many wishes without memory, what is less urgent waits.
const REFUSALS: usize = 4;

/// What had to go once comes back only for what is further away than this. Else whoever goes to and fro between two rooms that memory
/// cannot hold sharp together would fetch each of them again at every turn.
const SHARP_STEPS: u32 = 2;

/// Turns wishes into requests, one after the other.
#[derive(Debug)]
pub struct Planner {
    /// What is held and on its way.
    pub residency: Residency,
    budgets: Budgets,
    /// Whether small files may come together, and how fast the line was when it was last planned.
    bundles: bool,
    bytes_per_s: f64,
    wishes: Vec<Wish>,
    models: Models,
    /// Whether no rules are used, whatever is learnt of models and forgiven.
    has_no_rules: bool,
    packs: HashSet<Key>,
    /// What the cells next door cannot do without and is not here yet.
    reserve_bytes: u64,
    is_short: bool,
    /// Whether memory had no room for some wish when one asked last.
    has_refused: bool,
    /// Whether first pictures were wanted when it was last planned, and have come since: finer grades were not planned then.
    is_stale: bool,
}

impl Planner {
    /// Holds nothing at first.
    #[must_use]
    pub fn new(budgets: Budgets) -> Self {
        Self {
            residency: Residency::within(budgets.memory_bytes),
            budgets,
            bundles: false,
            bytes_per_s: f64::INFINITY,
            wishes: Vec::new(),
            models: Models::default(),
            has_no_rules: false,
            packs: HashSet::new(),
            reserve_bytes: 0,
            is_short: false,
            has_refused: false,
            is_stale: false,
        }
    }

    /// Says whether the server offers bundles.
    pub fn offer_bundles(&mut self, offered: bool) {
        self.bundles = offered;
    }

    /// What is wanted, most urgent first, as of the last [`Planner::plan`].
    #[must_use]
    pub fn wishes(&self) -> &[Wish] {
        &self.wishes
    }

    /// Whether something visible of which nothing is held found no memory.
    #[must_use]
    pub fn is_short(&self) -> bool {
        self.is_short
    }

    /// Plans anew. What is wanted and here already is held at once; answers what has changed by that.
    pub fn plan(&mut self, view: &View, bytes_per_s: f64) -> Vec<Change> {
        let mut changes = Vec::new();
        self.bytes_per_s = bytes_per_s;
        let target_px = match self.budgets.triangles {
            u64::MAX => self.budgets.target_px,
            most => plan::target_within(view.here, &view.eye, self.budgets.target_px, most),
        };
        loop {
            self.wishes = self.wanted(view, target_px, bytes_per_s);
            let settled = self.settle();
            if settled.is_empty() {
                break;
            }
            changes.extend(settled);
        }
        self.is_stale = false;
        self.packs = self.packs_worth();
        let ahead = view.ahead.iter().flat_map(|(_, seen)| *seen);
        let missing = ahead.filter(|seen| self.residency.held(seen.model).is_none());
        self.reserve_bytes = match self.budgets.memory_bytes {
            u64::MAX => 0,
            _ => plan::least_bytes(missing, &self.residency),
        };
        changes
    }

    /// The files that are known to stand in a pack, each once; none where it is no pack.
    #[must_use]
    pub fn members_of(&self, pack: Key) -> Vec<Member> {
        self.models.members_of(pack)
    }

    /// A file has come out of a pack that was asked for, and may be still on its way; `false` when it is not needed.
    pub fn arrive_out_of(&mut self, pack: Key, member: &Member) -> bool {
        !self.is_here(member.key) && self.residency.arrive_out_of(pack, member.key, member.bytes)
    }

    /// A file has come, so many bytes. Where memory is limited, a pack becomes the files in it that are known, so that each can
    /// go by itself: those that had not come out of it before are answered. Else it stays as it is, for what may be wanted of it
    /// later, and what came out of it before is a part of it.
    pub fn arrive(&mut self, file: &FileRef, bytes: u64) -> Vec<Member> {
        let key = file.name.key();
        let mut members = self.members_of(key);
        if members.is_empty() || self.budgets.memory_bytes == u64::MAX {
            let here = members.iter().filter(|member| self.is_here(member.key));
            let apart: u64 = here.map(|member| member.bytes).sum();
            self.residency.arrive(key, bytes.saturating_sub(apart));
            return Vec::new();
        }
        members.retain(|member| self.arrive_out_of(key, member));
        self.residency.withdraw(key);
        members
    }

    /// Holds what was wanted and is here by now.
    pub fn settle(&mut self) -> Vec<Change> {
        let wishes = std::mem::take(&mut self.wishes);
        let mut changes = Vec::new();
        for wish in wishes {
            match self.hold_if_here(&wish) {
                true => {
                    self.is_stale |= matches!(wish.cause, Cause::Missing { .. });
                    changes.push(Change::Held(wish));
                }
                false => self.wishes.push(wish),
            }
        }
        changes
    }

    /// The next request that there is memory for; from then on it counts as under way. Call again until there is none, or
    /// no more may be under way; then plan anew, and once more when first pictures have come. What went for it is told.
    pub fn next(&mut self, changes: &mut Vec<Change>) -> Option<Order> {
        let mut refused = 0;
        (self.is_short, self.has_refused) = (false, false);
        for at in 0..self.wishes.len() {
            let wish = self.wishes[at];
            let mut missing = self.missing(&wish, true);
            if missing.is_empty() {
                continue;
            }
            if self.is_stale && wish.priority >= band::FINER {
                return None;
            }
            let mut room = self.room_for(&wish, &missing);
            if room.is_none() {
                // What does not fit with its pack may fit alone.
                missing = self.missing(&wish, false);
                room = self.room_for(&wish, &missing);
            }
            let (Some(gone), Some(first)) = (room, missing.first().cloned()) else {
                self.is_short |= matches!(wish.cause, Cause::Missing { .. });
                self.has_refused = true;
                refused += 1;
                if refused >= REFUSALS {
                    return None;
                }
                continue;
            };
            changes.extend(gone.details.into_iter().map(Change::Blunted));
            changes.extend(gone.models.into_iter().map(Change::Dropped));
            changes.extend(gone.files.into_iter().map(Change::Gone));
            let files = self.with_company(at, first);
            for file in &files {
                self.residency.ask(file);
            }
            return Some(Order { files, wish });
        }
        None
    }

    /// Whether something in sight of which nothing is held is still to be asked for, as of the last [`Planner::plan`]; not where
    /// memory is short of it.
    #[must_use]
    pub fn has_firsts_to_ask(&self) -> bool {
        if self.is_short {
            return false;
        }
        let is_first = |wish: &&Wish| matches!(wish.cause, Cause::Missing { .. });
        let mut firsts = self.wishes.iter().filter(is_first);
        firsts.any(|wish| !self.missing(wish, true).is_empty())
    }

    /// Whether anything is wanted that was not asked for, and that memory had room for when it was last looked at.
    #[must_use]
    pub fn has_more_to_ask(&self) -> bool {
        !self.has_refused && self.wishes.iter().any(|wish| !self.missing(wish, true).is_empty())
    }

    /// What is wanted of a request and not here, each file by itself; nothing where it serves no wish.
    #[must_use]
    pub fn wanted_of(&self, order: &Order) -> Vec<Key> {
        self.wanting(order).collect()
    }

    /// Whether a request that is under way still serves a wish.
    #[must_use]
    pub fn is_wanted(&self, order: &Order) -> bool {
        self.wanting(order).next().is_some()
    }

    fn wanting(&self, order: &Order) -> impl Iterator<Item = Key> {
        let asked: HashSet<Key> = order.files.iter().map(|file| file.name.key()).collect();
        let serves = move |part: &Part| {
            let pack = part.pack.map(|pack| Key::from(&pack.url));
            asked.contains(&part.key()) || pack.is_some_and(|pack| asked.contains(&pack))
        };
        let parts = self.wishes.iter().flat_map(|wish| self.parts(wish));
        let missing = parts.filter(|part| part.holder(&self.residency).is_none());
        missing.filter(serves).map(|part| part.key())
    }

    /// A smooth LOD that is damaged anywhere is not used at all.
    pub fn lose_stream(&mut self, model: &Model) {
        let Some(smooth) = &model.smooth else { return };
        self.residency.lose((&smooth.url).into());
        for rung in &smooth.rungs {
            self.residency.lose((&rung.url).into());
        }
    }

    /// Nor is the one that has this name, if a model has it.
    pub(crate) fn lose_stream_of(&mut self, stream: BlobHash) {
        if let Some(model) = self.model_of_stream(stream).cloned() {
            self.lose_stream(&model);
        }
    }

    /// Nothing can be grown from now on, neither what is known nor what is learnt later.
    pub fn lose_rules(&mut self) {
        self.has_no_rules = true;
        self.forgo_rules();
    }

    fn forgo_rules(&mut self) {
        for rules in self.models.rules() {
            self.residency.lose(rules);
        }
    }

    /// Whether a file is here.
    #[must_use]
    pub fn is_here(&self, file: Key) -> bool {
        self.residency.state(file) == State::Here
    }

    /// What there is of a model that was planned for.
    #[must_use]
    pub fn model(&self, model: ModelId) -> Option<&Arc<Model>> {
        self.models.get(model)
    }

    /// The model whose smooth LOD this is.
    #[must_use]
    pub fn model_of_stream(&self, stream: BlobHash) -> Option<&Arc<Model>> {
        self.models.of_stream(stream)
    }

    /// What is known of the stream that a rung is of.
    pub(crate) fn stream_of(&self, rung: &RungName) -> Option<StreamRef> {
        let model = self.models.of_stream(rung.hash)?;
        let is_lost = |level: &Level| self.residency.state((&level.url).into()) == State::Lost;
        Some(StreamRef {
            ends: model.smooth.as_ref()?.rungs.iter().map(|rung| rung.to).collect(),
            is_needed: model.procedural.is_none() && model.levels.iter().all(is_lost),
        })
    }

    /// Promises memory to a file that nobody has asked for and that comes all the same; `false` where it is no use, or there is no room.
    pub(crate) fn welcomes(&mut self, file: &FileRef) -> bool {
        let is_welcome = self.residency.state(file.name.key()) == State::Away && self.residency.has_room(file.bytes);
        if is_welcome {
            self.residency.ask(file);
        }
        is_welcome
    }

    fn wanted(&mut self, view: &View, target_px: f64, bytes_per_s: f64) -> Vec<Wish> {
        let ahead = view.ahead.iter().flat_map(|(_, seen)| *seen);
        self.models.learn(view.here.iter().chain(ahead));
        if self.has_no_rules {
            self.forgo_rules();
        }
        let residency = &self.residency;
        let mut wishes = plan::plan(view.here, residency, &view.eye, target_px);
        let blunt = residency.stay_blunt();
        wishes.retain(|wish| match wish.cause {
            Cause::Missing { .. } => true,
            // What takes the place of something useless is no luxury.
            Cause::Finer { error_px } => view.is_all_known && (error_px == f64::MAX || !blunt.contains(&wish.model)),
            Cause::Ahead { .. } => view.is_all_known,
        });
        let mut named: HashSet<ModelId> = wishes.iter().map(|wish| wish.model).collect();
        let mut before_bytes = 0.0;
        for (approach, seen) in view.ahead.iter().filter(|_| self.budgets.prefetch) {
            let others: Vec<_> = seen.iter().filter(|seen| !named.contains(&seen.model)).collect();
            let firsts = plan::first_wishes(others, residency);
            before_bytes += firsts.iter().map(|wish| wish.cost_bytes).sum::<f64>();
            let due = is_due(approach.in_s, before_bytes, bytes_per_s);
            // What one cell has no hurry for may be seen from another that is entered sooner.
            if !due && approach.in_s >= HORIZON_S {
                continue;
            }
            for wish in firsts {
                named.insert(wish.model);
                let cause = Cause::Ahead {
                    cell: approach.cell,
                    step: approach.step,
                    in_s: approach.in_s,
                    due,
                };
                let priority = cause.priority(wishes.len());
                wishes.push(Wish {
                    cause,
                    priority,
                    ..wish
                });
            }
        }
        wishes.sort_by(|a, b| a.priority.total_cmp(&b.priority));
        wishes
    }

    fn parts<'a>(&'a self, wish: &Wish) -> impl Iterator<Item = Part<'a>> + use<'a> {
        let (grade, model) = (wish.grade, self.models.get(wish.model));
        model
            .into_iter()
            .flat_map(move |model| grade.parts(model, &self.residency))
    }

    /// What nobody has asked for yet, in packs where they are worth it.
    fn missing(&self, wish: &Wish, packed: bool) -> Vec<FileRef> {
        let missing = self.parts(wish).filter(|part| part.cost_bytes(&self.residency) > 0.0);
        missing.map(|part| self.order_of(&part, packed)).collect()
    }

    /// Draws a model so if all that this takes is here.
    fn hold_if_here(&mut self, wish: &Wish) -> bool {
        let mut files = Vec::new();
        for part in self.parts(wish) {
            match part.holder(&self.residency) {
                Some(key) => files.push(key),
                None if part.spare && self.residency.state(part.key()) == State::Lost => {}
                None => return false,
            }
        }
        let sound = match (self.residency.base(wish.model), self.models.get(wish.model)) {
            (Some(base), Some(model)) => !base.is_lost(model, &self.residency),
            _ => true,
        };
        self.residency.hold(wish.model, wish.grade, files, sound);
        true
    }

    /// A file alone, or the pack that is worth fetching for it and others, or all that is left where it cannot be had alone.
    fn order_of(&self, part: &Part, packed: bool) -> FileRef {
        let is_lost = self.residency.state(part.key()) == State::Lost;
        let is_worth = |pack: &&PackRef| is_lost || (packed && self.packs.contains(&(&pack.url).into()));
        let pack = part.pack.filter(is_worth);
        let pack = pack.filter(|pack| self.residency.state((&pack.url).into()) == State::Away);
        pack.map_or_else(|| part.file(), |pack| FileRef::object(&pack.url, pack.bytes))
    }

    /// A small file, and what else is small, wanted for the same reason and may come with it.
    fn with_company(&self, at: usize, first: FileRef) -> Vec<FileRef> {
        // Room was made for one wish; where memory is short, the others may not find any.
        if !self.bundles || !bundles::is_small(&first) || self.residency.limit_bytes() != u64::MAX {
            return vec![first];
        }
        let like = self.wishes[at..]
            .iter()
            .filter(|wish| wish.cause.is_like(&self.wishes[at].cause));
        let files = like.flat_map(|wish| self.missing(wish, true)).filter(bundles::is_small);
        bundles::together([first].into_iter().chain(files), self.bytes_per_s)
    }

    /// Makes room for all that a wish still takes.
    fn room_for(&mut self, wish: &Wish, missing: &[FileRef]) -> Option<Gone> {
        let mut keep: Vec<Key> = self
            .parts(wish)
            .filter_map(|part| part.holder(&self.residency))
            .collect();
        keep.extend(self.residency.files_of(wish.model));
        let (spare_bytes, within_steps, sharp_within_steps) = match wish.cause {
            Cause::Missing { .. } => (0, 0, None),
            Cause::Ahead { step, due, .. } => (0, u32::from(step / 3) + 1, (!due).then_some(0)),
            Cause::Finer { .. } if self.residency.was_blunted(wish.model) => (self.reserve_bytes, 2, Some(SHARP_STEPS)),
            Cause::Finer { .. } => (self.reserve_bytes, 2, Some(0)),
        };
        let files: HashMap<Key, u64> = missing.iter().map(|file| (file.name.key(), file.bytes)).collect();
        let terms = Terms {
            spare_bytes,
            within_steps,
            sharp_within_steps,
        };
        self.residency.make_room(files.values().sum(), &keep, terms)
    }

    /// Packs of which enough is wanted.
    fn packs_worth(&self) -> HashSet<Key> {
        let mut wanted: HashMap<Key, (u64, HashMap<u64, u64>)> = HashMap::new();
        for part in self.wishes.iter().flat_map(|wish| self.parts(wish)) {
            if let Some(pack) = part.pack.filter(|_| part.cost_bytes(&self.residency) > 0.0) {
                let (_, files) = wanted.entry((&pack.url).into()).or_insert((pack.bytes, HashMap::new()));
                files.insert(pack.from, part.bytes);
            }
        }
        let is_worth =
            |all: u64, files: &HashMap<u64, u64>| files.values().sum::<u64>() as f64 >= WORTH_A_PACK * all as f64;
        wanted
            .into_iter()
            .filter(|(_, (all, files))| is_worth(*all, files))
            .map(|(key, _)| key)
            .collect()
    }
}
