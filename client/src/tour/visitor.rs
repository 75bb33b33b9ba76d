//! What does a visitor ask for next?
//!
//! The coarsest level of everything that can be seen comes first, largest solid angle first. Then, in three steps as in
//! Marvie & Bouatouch 2004, §6.1, each when the one before has been asked for: what can be seen from where the visitor heads
//! (the ray through the last two positions against the boxes of adjacent cells), from the other adjacent cells, and from those
//! adjacent to where it heads. Finer levels come last, those with the largest error on the screen first.

use std::collections::{HashMap, HashSet};

use belvedere_scene::{
    BlobName, Bounds, CellId,
    index::CellEntry,
    object::{Level, ObjectInfo},
};

use super::{
    Script, TourSettings,
    line::Traffic,
    metered::{Answer, Metered},
    outcome::{Frame, Tour},
};
use crate::{ByteSource, Scene, packs};

/// So many requests are under way at once.
const UNDER_WAY: usize = 8;
/// No tour has more frames: a day at ten a second.
const MOST_FRAMES: u64 = 864_000;

/// A cell that the visitor has read of.
struct Known {
    entry: CellEntry,
    objects: Vec<ObjectInfo>,
    /// What could not be read: objects, or 1 for the record itself. It is never there.
    lost: usize,
    /// When the last document had come.
    from_ms: f64,
}

/// Why a file is asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cause {
    Seen,
    Ahead,
}

/// Walks through one revision.
pub(super) struct Visitor<'a, S> {
    scene: &'a Scene<Metered<S>>,
    settings: TourSettings,
    traffic: Traffic,
    now_ms: f64,
    known: HashMap<CellId, Known>,
    /// When each file is there; never for one that cannot be had.
    arrivals: HashMap<BlobName, f64>,
    /// Bytes of files that were asked for ahead and were not in sight since.
    ahead: HashMap<BlobName, u64>,
    /// Cells that the index does not lead to.
    lost: HashSet<CellId>,
    here: Option<CellId>,
    tour: Tour,
}

impl<'a, S: ByteSource> Visitor<'a, S> {
    pub(super) fn new(scene: &'a Scene<Metered<S>>, settings: &TourSettings) -> Self {
        Self {
            scene,
            settings: *settings,
            traffic: Traffic::on(settings.line),
            now_ms: 0.0,
            known: HashMap::new(),
            arrivals: HashMap::new(),
            ahead: HashMap::new(),
            lost: HashSet::new(),
            here: None,
            tour: Tour::default(),
        }
    }

    pub(super) async fn walk(mut self, script: &Script) -> Tour {
        let [from_ms, to_ms] = script.times_ms();
        let frame_ms = 1000.0 / self.settings.frames_per_s;
        let frames = (((to_ms - from_ms) / frame_ms).floor() as u64).min(MOST_FRAMES);
        // The pointer and the manifest have been read.
        self.now_ms = self.charge(0.0);
        let mut before = script.at(from_ms);
        for frame in 0..=frames {
            let t_ms = frame as f64 * frame_ms;
            let position = script.at(from_ms + t_ms);
            self.enter(position, t_ms).await;
            self.tour.frames.push(self.frame(t_ms));
            self.ask(position, before, t_ms + frame_ms).await;
            before = position;
        }
        self.tour.bytes.prefetched_wasted = self.ahead.values().sum();
        self.tour
    }

    /// Finds the cell at a position and reads what can be seen from there. Who cannot find it stays where it was.
    async fn enter(&mut self, position: [f64; 3], t_ms: f64) {
        self.now_ms = self.now_ms.max(t_ms);
        let at = match self.place() {
            Some(known) => self.scene.locate_from(&known.entry, position).await,
            None => self.scene.locate(position).await,
        };
        let asked_ms = self.charge(self.now_ms);
        let at = match at {
            Ok(at) => at,
            Err(cause) => return self.tour.fail(cause),
        };
        if self.here == Some(at.cell.cell) {
            return;
        }
        self.here = Some(at.cell.cell);
        self.learn(at.cell, asked_ms).await;
        self.note_what_came_ahead();
    }

    /// Reads what can be seen from a cell. What cannot be read is counted, and will never be there.
    async fn learn(&mut self, entry: CellEntry, asked_ms: f64) {
        if self.known.contains_key(&entry.cell) {
            return;
        }
        let record = self.scene.record(&entry).await;
        let read_ms = self.charge(asked_ms);
        let mut lost = 0;
        let objects = match record {
            Ok(record) => {
                let mut order: Vec<_> = record.visible();
                order.sort_by(|a, b| b.solid_angle_sr.total_cmp(&a.solid_angle_sr));
                let mut objects = Vec::with_capacity(order.len());
                for visible in order {
                    match self.scene.object(visible.object).await {
                        Ok(info) => objects.push(info),
                        Err(cause) => {
                            self.tour.fail(cause);
                            lost += 1;
                        }
                    }
                }
                objects
            }
            Err(cause) => {
                self.tour.fail(cause);
                lost = 1;
                Vec::new()
            }
        };
        let from_ms = self.charge(read_ms);
        let known = Known {
            objects,
            lost,
            from_ms,
            entry,
        };
        self.known.insert(known.entry.cell, known);
    }

    /// Lets all documents that were fetched since come over the line, asked for at this time; says when the last is there.
    fn charge(&mut self, asked_ms: f64) -> f64 {
        let mut there_ms = asked_ms;
        for answer in self.scene.source().take() {
            there_ms = self.traffic.send(asked_ms, answer.bytes);
            self.tour.bytes.needed += answer.bytes;
            self.count(answer);
        }
        there_ms
    }

    fn count(&mut self, answer: Answer) {
        self.tour.requests += 1;
        self.tour.latencies_ms.push(1000.0 * answer.took.as_secs_f64());
    }

    /// Asks for files until a time, as many at once as may be under way.
    async fn ask(&mut self, position: [f64; 3], before: [f64; 3], until_ms: f64) {
        let here = self.here;
        let heading = here.map_or_else(Vec::new, |here| self.heading(here, position, before));
        while self.now_ms < until_ms {
            let under_way = self.arrivals.values().filter(|at| **at > self.now_ms && at.is_finite());
            if under_way.count() < UNDER_WAY
                && let Some((file, bytes, cause)) = self.next_file(position, &heading).await
            {
                self.fetch(file, bytes, cause).await;
                continue;
            }
            let later = self.arrivals.values().filter(|at| **at > self.now_ms);
            let known = here.and_then(|here| self.known.get(&here)).map(|known| known.from_ms);
            let learnt = known.filter(|from_ms| *from_ms > self.now_ms);
            self.now_ms = later.copied().chain(learnt).fold(until_ms, f64::min);
            self.note_convergence();
        }
        self.note_convergence();
    }

    /// What is worth most now.
    async fn next_file(&mut self, position: [f64; 3], heading: &[CellId]) -> Option<(BlobName, u64, Cause)> {
        let here = self.here?;
        let known = self.known.get(&here).filter(|known| known.from_ms <= self.now_ms)?;
        if let Some((file, bytes)) = self.missing(&known.objects) {
            return Some((file, bytes, Cause::Seen));
        }
        let finer = self.finer(&known.objects, position);
        if self.settings.prefetch {
            for cell in self.cells_ahead(here, heading) {
                self.learn_of(cell).await;
                let known = self.known.get(&cell);
                let known = known.filter(|known| known.from_ms <= self.now_ms);
                if let Some((file, bytes)) = known.and_then(|known| self.missing(&known.objects)) {
                    return Some((file, bytes, Cause::Ahead));
                }
            }
        }
        finer.map(|(file, bytes)| (file, bytes, Cause::Seen))
    }

    /// Reads what can be seen from a cell of which only the name is known.
    async fn learn_of(&mut self, cell: CellId) {
        if self.known.contains_key(&cell) || self.lost.contains(&cell) {
            return;
        }
        let entry = self.scene.cell(cell).await;
        let asked_ms = self.charge(self.now_ms);
        match entry {
            Ok(Some(entry)) => self.learn(entry, asked_ms).await,
            Ok(None) => self.lose(cell, format!("the index does not lead to {cell}")),
            Err(cause) => self.lose(cell, cause),
        }
    }

    fn lose(&mut self, cell: CellId, cause: impl ToString) {
        self.tour.fail(cause);
        self.lost.insert(cell);
    }

    /// The cells to fetch ahead, in order, each once.
    fn cells_ahead(&self, here: CellId, heading: &[CellId]) -> Vec<CellId> {
        let adjacent = |cell: &CellId| self.known.get(cell).map_or(&[][..], |known| &known.entry.adjacent);
        let beyond = heading.iter().flat_map(adjacent);
        let mut named = HashSet::from([here]);
        let all = heading.iter().chain(adjacent(&here)).chain(beyond);
        all.copied().filter(|cell| named.insert(*cell)).collect()
    }

    /// Adjacent cells that the ray through the last two positions meets.
    fn heading(&self, here: CellId, position: [f64; 3], before: [f64; 3]) -> Vec<CellId> {
        let adjacent = self.known.get(&here).map_or(&[][..], |known| &known.entry.adjacent);
        let ahead = |cell: &&CellId| {
            let known = self.known.get(cell);
            known.is_some_and(|known| ray_meets(&known.entry.bounds, before, position))
        };
        if position == before {
            return Vec::new();
        }
        adjacent.iter().filter(ahead).copied().collect()
    }

    /// The first file of the coarsest levels of these objects that was not asked for yet, with its size: a pack where
    /// most of it is wanted.
    fn missing(&self, objects: &[ObjectInfo]) -> Option<(BlobName, u64)> {
        let wanted: Vec<&Level> = objects
            .iter()
            .filter_map(|object| object.levels.last())
            .filter(|level| !self.asked(level))
            .collect();
        let first = wanted.first()?;
        let pack = first.pack.as_ref().filter(|pack| {
            let failed = self.arrivals.contains_key(&pack.url);
            !failed && packs::is_worth(pack, &wanted)
        });
        if let Some(pack) = pack {
            return Some((pack.url.clone(), pack.bytes));
        }
        self.rest_of(first)
    }

    /// The first file of a level that was not asked for yet, with its size: its GLB alone, or a texture.
    fn rest_of(&self, level: &Level) -> Option<(BlobName, u64)> {
        if !self.glb_asked(level) {
            return Some((level.url.clone(), level.bytes));
        }
        let texture = level.textures.iter().find(|t| !self.arrivals.contains_key(&t.url))?;
        Some((texture.url.clone(), texture.bytes))
    }

    /// The level whose coming would mend the largest error on the screen.
    fn finer(&self, objects: &[ObjectInfo], position: [f64; 3]) -> Option<(BlobName, u64)> {
        let mut best: Option<(f64, &Level)> = None;
        for object in objects {
            let away_m = object.bounds.distance_m(position).max(0.05);
            let fits = |level: &&Level| level.switch_distance_m <= away_m * self.settings.target_px;
            let wanted = object.levels.iter().rev().find(fits).or_else(|| object.levels.first());
            let Some(wanted) = wanted.filter(|level| !self.asked(level)) else {
                continue;
            };
            let finer_asked = object.levels.iter().any(|l| l.level < wanted.level && self.asked(l));
            let asked = object.levels.iter().find(|level| self.asked(level));
            let error = asked.map_or(f64::INFINITY, |level| level.geometric_error_m / away_m);
            if !finer_asked && best.is_none_or(|(most, _)| error > most) {
                best = Some((error, wanted));
            }
        }
        best.and_then(|(_, level)| self.rest_of(level))
    }

    /// Whether all files of a level were asked for.
    fn asked(&self, level: &Level) -> bool {
        self.glb_asked(level) && level.textures.iter().all(|t| self.arrivals.contains_key(&t.url))
    }

    /// Whether a level's GLB was asked for, alone or in a pack that can be had.
    fn glb_asked(&self, level: &Level) -> bool {
        let packed = level.pack.as_ref().and_then(|pack| self.arrivals.get(&pack.url));
        self.arrivals.contains_key(&level.url) || packed.is_some_and(|at| at.is_finite())
    }

    /// Whether all of a level is there. A texture that cannot be had leaves it plain.
    fn is_there(&self, level: &Level) -> bool {
        let there = |name: &BlobName| self.arrivals.get(name).is_some_and(|at| *at <= self.now_ms);
        let glb = there(&level.url) || level.pack.as_ref().is_some_and(|pack| there(&pack.url));
        let lost = |name: &BlobName| self.arrivals.get(name).is_some_and(|at| at.is_infinite());
        glb && level.textures.iter().all(|t| there(&t.url) || lost(&t.url))
    }

    async fn fetch(&mut self, file: BlobName, bytes: u64, cause: Cause) {
        let fetched = self.scene.blob(&file).await;
        let mut bytes = bytes;
        for answer in self.scene.source().take() {
            bytes = answer.bytes;
            self.count(answer);
        }
        let there_ms = match fetched {
            Ok(_) => self.traffic.send(self.now_ms, bytes),
            Err(cause) => {
                self.tour.fail(cause);
                f64::INFINITY
            }
        };
        if there_ms.is_finite() {
            match cause {
                Cause::Seen => self.tour.bytes.needed += bytes,
                Cause::Ahead => _ = self.ahead.insert(file.clone(), bytes),
            }
        }
        self.arrivals.insert(file, there_ms);
    }

    /// What was asked for ahead and is in sight now was worth it.
    fn note_what_came_ahead(&mut self) {
        let Some(known) = self.here.and_then(|here| self.known.get(&here)) else {
            return;
        };
        for level in known.objects.iter().filter_map(|object| object.levels.last()) {
            let pack = level.pack.iter().map(|pack| &pack.url);
            let textures = level.textures.iter().map(|texture| &texture.url);
            for file in [&level.url].into_iter().chain(pack).chain(textures) {
                self.tour.bytes.prefetched_used += self.ahead.remove(file).unwrap_or(0);
            }
        }
    }

    /// What is known of the cell where the visitor is.
    fn place(&self) -> Option<&Known> {
        self.known.get(&self.here?)
    }

    fn note_convergence(&mut self) {
        let known = self.place();
        let is_told = known.is_some_and(|known| known.from_ms <= self.now_ms);
        if self.tour.converged_ms.is_none() && is_told && self.in_sight().is_some_and(|(missing, _)| missing == 0) {
            self.tour.converged_ms = Some(self.now_ms);
        }
    }

    /// How many objects in sight have nothing there, of how many; `None` for who does not know where it is.
    fn in_sight(&self) -> Option<(usize, usize)> {
        let known = self.place()?;
        let is_here = |object: &&ObjectInfo| object.levels.iter().any(|level| self.is_there(level));
        let all = known.objects.len() + known.lost;
        Some((all - known.objects.iter().filter(is_here).count(), all))
    }

    fn frame(&self, t_ms: f64) -> Frame {
        let (missing, quality) = match self.in_sight() {
            Some((_, 0)) => (0, 1.0),
            Some((missing, all)) => (missing, 1.0 - missing as f64 / all as f64),
            None => (0, 0.0),
        };
        let bytes = &self.tour.bytes;
        Frame {
            t_ms,
            quality,
            missing: missing as u32,
            bytes: bytes.needed + bytes.prefetched_used + self.ahead.values().sum::<u64>(),
        }
    }
}

/// Whether a ray from one place through another meets a box.
fn ray_meets(bounds: &Bounds, from: [f64; 3], through: [f64; 3]) -> bool {
    let (mut enter, mut leave) = (0.0, f64::INFINITY);
    for axis in 0..3 {
        let along = through[axis] - from[axis];
        let [low, high] = [bounds.min[axis] - from[axis], bounds.max[axis] - from[axis]];
        if along == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / along, high / along);
        enter = f64::max(enter, a.min(b));
        leave = f64::min(leave, a.max(b));
    }
    enter <= leave
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_meets_what_lies_ahead_and_not_what_lies_behind() {
        let bounds = Bounds {
            min: [2.0, 0.0, 0.0],
            max: [3.0, 2.0, 1.0],
        };
        assert!(ray_meets(&bounds, [0.0, 1.0, 0.5], [0.1, 1.0, 0.5]));
        assert!(!ray_meets(&bounds, [0.0, 1.0, 0.5], [-0.1, 1.0, 0.5]));
        assert!(!ray_meets(&bounds, [0.0, 1.0, 0.5], [0.1, 1.0, 0.6]));
    }
}
