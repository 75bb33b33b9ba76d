//! What is held, what has been promised a place, and what goes when memory is short? Of each model what came of it first,
//! its *base*, and at most one finer grade, its *detail*, which can go at any time without leaving a hole. Files are counted
//! by who uses them, so that a picture that many models share is held once, and goes with the last of them.
//!
//! Guarantees, as in `viewer/core/strategy/residency.ts`: nothing is promised that would exceed the limit together with what is held
//! and promised already, and the base of what is visible never goes. Files that nobody uses go first, then details, then
//! bases; of each those first that are needed furthest away, counted in steps from cell to adjacent cell, and of these the
//! longest unused (Marvie & Bouatouch, *A VRML97-X3D extension for massive scenery management in virtual worlds*, 2004,
//! §6.2).

use std::collections::{HashMap, HashSet};

use belvedere_scene::ModelId;

use super::{
    file::{FileRef, Key},
    grade::{Grade, State, Stock},
    memory::{Evictions, Gone, Terms},
    nearness::Nearness,
    plan::Held,
};

#[derive(Debug, Clone, Copy)]
struct File {
    bytes: u64,
    users: u32,
    last_used: u64,
    /// The model that ceased last to be drawn with it.
    last_user: Option<ModelId>,
}

#[derive(Debug, Clone)]
struct Mesh {
    grade: Grade,
    files: Vec<Key>,
}

#[derive(Debug, Clone)]
struct Resident {
    base: Mesh,
    detail: Option<Mesh>,
    last_needed: u64,
}

impl Resident {
    fn drawn(&self) -> &Mesh {
        self.detail.as_ref().unwrap_or(&self.base)
    }

    fn files(&self) -> impl Iterator<Item = &Key> {
        [Some(&self.base), self.detail.as_ref()]
            .into_iter()
            .flatten()
            .flat_map(|mesh| &mesh.files)
    }
}

/// What is held and on its way, within a limit.
#[derive(Debug)]
#[cfg_attr(test, derive(Clone))]
pub struct Residency {
    limit_bytes: u64,
    files: HashMap<Key, File>,
    models: HashMap<ModelId, Resident>,
    asked: HashMap<Key, u64>,
    lost: HashSet<Key>,
    nearness: Nearness,
    held_bytes: u64,
    asked_bytes: u64,
    peak_bytes: u64,
    uses: u64,
    gone: HashSet<Key>,
    /// What of it went although the cell or one adjacent to it saw a model that was drawn with it, and has seen it since.
    gone_near: HashMap<Key, ModelId>,
    blunted: HashSet<ModelId>,
    /// Those that the cell or one adjacent to it saw then, and has seen since.
    blunted_near: HashSet<ModelId>,
    evictions: Evictions,
}

impl Residency {
    /// Nothing is held; at most so many bytes will be.
    #[must_use]
    pub fn within(limit_bytes: u64) -> Self {
        Self {
            limit_bytes,
            files: HashMap::new(),
            models: HashMap::new(),
            asked: HashMap::new(),
            lost: HashSet::new(),
            nearness: Nearness::default(),
            held_bytes: 0,
            asked_bytes: 0,
            peak_bytes: 0,
            uses: 0,
            gone: HashSet::new(),
            gone_near: HashMap::new(),
            blunted: HashSet::new(),
            blunted_near: HashSet::new(),
            evictions: Evictions::default(),
        }
    }

    /// The limit.
    #[must_use]
    pub fn limit_bytes(&self) -> u64 {
        self.limit_bytes
    }

    /// What is held.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.held_bytes
    }

    /// The most that was held and promised at once.
    #[must_use]
    pub fn peak_bytes(&self) -> u64 {
        self.peak_bytes
    }

    /// What is on its way.
    #[must_use]
    pub fn asked_bytes(&self) -> u64 {
        self.asked_bytes
    }

    /// What went for want of memory.
    #[must_use]
    pub fn evictions(&self) -> Evictions {
        self.evictions
    }

    /// The files that a model is drawn with.
    #[must_use]
    pub fn files_of(&self, model: ModelId) -> &[Key] {
        self.models.get(&model).map_or(&[], |resident| &resident.drawn().files)
    }

    /// What of a model came first and stays.
    #[must_use]
    pub fn base(&self, model: ModelId) -> Option<Grade> {
        self.models.get(&model).map(|resident| resident.base.grade)
    }

    /// Whether a model has ever lost its detail for want of memory.
    #[must_use]
    pub fn was_blunted(&self, model: ModelId) -> bool {
        self.blunted.contains(&model)
    }

    /// Models that get nothing finer for now: those that lost their detail for want of memory while they were near, and have been
    /// near since, as long as what is near takes more than a quarter of the memory. Else details would come in one cell and go in
    /// the next, again and again.
    #[must_use]
    pub fn stay_blunt(&self) -> HashSet<ModelId> {
        if self.blunted_near.is_empty() || self.near_bytes() <= self.limit_bytes / 4 {
            return HashSet::new();
        }
        self.blunted_near.clone()
    }

    /// Names the models that are visible now, and says in how many steps others are needed.
    pub fn need(&mut self, models: HashSet<ModelId>, steps: HashMap<ModelId, u32>) {
        self.nearness = Nearness::new(models, steps);
        self.uses += 1;
        for model in self.nearness.visible() {
            if let Some(resident) = self.models.get_mut(model) {
                resident.last_needed = self.uses;
            }
        }
        self.gone_near.retain(|_, model| self.nearness.is_near(*model));
        self.blunted_near.retain(|model| self.nearness.is_near(*model));
    }

    /// Makes room for so many bytes more beside what is held and promised; answers what went for it, or `None` when there
    /// is no room, and nothing went. What is in `keep` stays.
    pub fn make_room(&mut self, bytes: u64, keep: &[Key], terms: Terms) -> Option<Gone> {
        let wanted = (self.held_bytes + self.asked_bytes)
            .saturating_add(bytes)
            .saturating_add(terms.spare_bytes);
        let short = wanted.saturating_sub(self.limit_bytes);
        if short == 0 {
            return Some(Gone::default());
        }
        let (mut freed, mut gone) = (0, Gone::default());
        let mut unused: Vec<_> = self
            .files
            .iter()
            .filter(|(key, file)| file.users == 0 && !keep.contains(key))
            .collect();
        unused.sort_by_key(|(key, file)| (file.last_used, **key));
        for (key, file) in unused {
            if freed < short {
                freed += file.bytes;
                gone.files.push(*key);
            }
        }
        let leaving = if freed < short {
            self.in_order_of_leaving()
        } else {
            Vec::new()
        };
        let mut users: HashMap<Key, u32> = HashMap::new();
        // Bytes that come free when a mesh goes, and those before it.
        let mut free = |mesh: &Mesh, gone: &mut Gone| -> u64 {
            let mut bytes = 0;
            for key in &mesh.files {
                let Some(file) = self.files.get(key) else { continue };
                let left = users.entry(*key).or_insert(file.users);
                *left -= 1;
                if *left == 0 && !keep.contains(key) {
                    bytes += file.bytes;
                    gone.files.push(*key);
                }
            }
            bytes
        };
        for (steps, model) in &leaving {
            if freed >= short || terms.sharp_within_steps.is_some_and(|within| *steps <= within) {
                break;
            }
            if let Some(detail) = self.models[model].detail.as_ref() {
                gone.details.push(*model);
                freed += free(detail, &mut gone);
            }
        }
        for (steps, model) in &leaving {
            if freed >= short || *steps <= terms.within_steps {
                break;
            }
            gone.models.push(*model);
            freed += free(&self.models[model].base, &mut gone);
        }
        if freed < short {
            return None;
        }
        self.blunted.extend(&gone.details);
        let near = gone.details.iter().filter(|model| self.nearness.is_near(**model));
        self.blunted_near.extend(near);
        for model in &gone.details {
            let detail = self.models.get_mut(model).and_then(|resident| resident.detail.take());
            self.release(*model, detail);
        }
        for model in &gone.models {
            let base = self.models.remove(model).map(|resident| resident.base);
            self.release(*model, base);
        }
        for key in &gone.files {
            self.evict(*key);
        }
        Some(gone)
    }

    /// Whether so many bytes more find room although nothing goes.
    pub fn has_room(&self, bytes: u64) -> bool {
        (self.held_bytes + self.asked_bytes).saturating_add(bytes) <= self.limit_bytes
    }

    /// Promises memory to a file and takes it as asked for. Who asks has made room.
    pub fn ask(&mut self, file: &FileRef) {
        self.asked_bytes += file.bytes;
        self.asked.insert(file.name.key(), file.bytes);
        self.peak_bytes = self.peak_bytes.max(self.held_bytes + self.asked_bytes);
    }

    /// Takes a promise back: the file is not on its way any more.
    pub fn withdraw(&mut self, name: Key) {
        self.asked_bytes -= self.asked.remove(&name).unwrap_or(0);
    }

    /// A file is here, so many bytes of it; the promise is kept thereby.
    pub fn arrive(&mut self, name: Key, bytes: u64) {
        self.withdraw(name);
        self.uses += 1;
        // It may have come in another way meanwhile.
        let before = self.files.get(&name);
        let file = File {
            bytes,
            users: before.map_or(0, |before| before.users),
            last_used: self.uses,
            last_user: before.and_then(|before| before.last_user),
        };
        if self.gone.remove(&name) {
            self.evictions.again_files += 1;
            self.evictions.again_bytes += bytes;
        }
        if let Some(before) = self.files.insert(name, file) {
            self.held_bytes -= before.bytes;
        }
        self.held_bytes += bytes;
        self.peak_bytes = self.peak_bytes.max(self.held_bytes + self.asked_bytes);
    }

    /// A file is here out of a pack that is on its way: so much of what was promised to the pack is its own now; `false` where
    /// nothing is left of that.
    pub fn arrive_out_of(&mut self, pack: Key, name: Key, bytes: u64) -> bool {
        let promised = self.asked.get_mut(&pack).filter(|promised| **promised >= bytes);
        let Some(promised) = promised else { return false };
        *promised -= bytes;
        self.asked_bytes -= bytes;
        self.lost.remove(&name);
        self.arrive(name, bytes);
        true
    }

    /// A file cannot be had, or is not what it should be; what is drawn with it stays until something better has come.
    pub fn lose(&mut self, name: Key) {
        self.withdraw(name);
        self.lost.insert(name);
    }

    /// Forgets which files could not be had.
    pub fn forgive_all(&mut self) {
        self.lost.clear();
    }

    /// Forgets that these could not be had.
    pub fn forgive(&mut self, files: &HashSet<Key>) {
        self.lost.retain(|file| !files.contains(file));
    }

    /// Draws a model with these files, which are here. What came first stays as its base, unless it is of no use.
    pub fn hold(&mut self, model: ModelId, grade: Grade, files: Vec<Key>, base_is_sound: bool) {
        for key in &files {
            if let Some(file) = self.files.get_mut(key) {
                file.users += 1;
                if self.gone_near.get(key) == Some(&model) {
                    self.gone_near.remove(key);
                    self.evictions.cycle_files += 1;
                    self.evictions.cycle_bytes += file.bytes;
                }
            }
        }
        let mesh = Mesh { grade, files };
        let before = match self.models.get_mut(&model) {
            Some(resident) if base_is_sound => resident.detail.replace(mesh).into_iter().collect(),
            _ => {
                let resident = Resident {
                    base: mesh,
                    detail: None,
                    last_needed: self.uses,
                };
                let before = self.models.insert(model, resident);
                before.map_or_else(Vec::new, |before| {
                    [Some(before.base), before.detail].into_iter().flatten().collect()
                })
            }
        };
        for mesh in before {
            self.release(model, Some(mesh));
        }
    }

    /// Models in the order in which they would go, each with the steps to it; 0 for what is visible.
    fn in_order_of_leaving(&self) -> Vec<(u32, ModelId)> {
        let all = self
            .models
            .iter()
            .map(|(model, resident)| (self.nearness.steps_to(*model), resident.last_needed, *model));
        let mut all: Vec<_> = all.collect();
        all.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        all.into_iter().map(|(steps, _, model)| (steps, model)).collect()
    }

    /// What is near takes, each file once, with all that is on its way.
    fn near_bytes(&self) -> u64 {
        let near = self.models.iter().filter(|(model, _)| self.nearness.is_near(**model));
        let files: HashSet<_> = near.flat_map(|(_, resident)| resident.files()).collect();
        let held = files.into_iter().filter_map(|key| self.files.get(key));
        self.asked_bytes + held.map(|file| file.bytes).sum::<u64>()
    }

    /// Files without users stay as long as memory allows.
    fn release(&mut self, model: ModelId, mesh: Option<Mesh>) {
        self.uses += 1;
        for key in mesh.iter().flat_map(|mesh| &mesh.files) {
            let Some(file) = self.files.get_mut(key) else { continue };
            file.users -= 1;
            file.last_used = self.uses;
            file.last_user = Some(model);
        }
    }

    fn evict(&mut self, name: Key) {
        let Some(file) = self.files.remove(&name) else { return };
        self.held_bytes -= file.bytes;
        self.evictions.files += 1;
        self.evictions.bytes += file.bytes;
        self.gone.insert(name);
        if let Some(model) = file.last_user.filter(|model| self.nearness.is_near(*model)) {
            self.gone_near.insert(name, model);
        }
    }
}

impl Stock for Residency {
    fn state(&self, file: Key) -> State {
        if self.lost.contains(&file) {
            State::Lost
        } else if self.files.contains_key(&file) {
            State::Here
        } else if self.asked.contains_key(&file) {
            State::Asked
        } else {
            State::Away
        }
    }
}

impl Held for Residency {
    fn held(&self, model: ModelId) -> Option<Grade> {
        self.models.get(&model).map(|resident| resident.drawn().grade)
    }
}
