//! In which cell is a point? By adjacency for who knows the cell nearby (Marvie & Bouatouch 2004, §3.4), else by the index; and where a part of
//! the index is lost, in the nearest cell that is known, or nowhere, from where all is seen that is around.

use belvedere_scene::{
    Bounds, CellId,
    index::{CellChunk, CellEntry, CellSearch, Located, Page, PageEntry, PageKind},
    object::{ObjectChunk, ObjectEntry},
    record::{CellRecord, Guarantee, Hull, Visible},
    walk::CellWalk,
};

use crate::{ByteSource, Error, Scene};

/// Stands for the cell of who can know none. No scene has so many that one is called so.
pub(crate) const NOWHERE: CellId = CellId(u32::MAX);

/// So many chunks of objects take the place of a record.
const MOST_CHUNKS: usize = 16;

/// In which cell somebody is, as far as the index could be read.
#[derive(Debug)]
pub(crate) struct Whereabouts {
    /// The cell, or [`NOWHERE`].
    pub(crate) cell: CellEntry,
    /// Whether nothing nearer may be in what is lost of the index.
    pub(crate) is_sure: bool,
    /// What was found to be lost, told once.
    pub(crate) failures: Vec<Error>,
}

impl<S: ByteSource> Scene<S> {
    /// The cell at a point (world space, metres), or the nearest one with its distance.
    ///
    /// # Errors
    /// When a part of the index cannot be fetched or read.
    pub async fn locate(&self, point: [f64; 3]) -> Result<Located, Error> {
        let mut search = CellSearch::new(&self.manifest().cells, point);
        while let Some(entry) = search.wants() {
            self.answer(&mut search, &entry).await?;
        }
        search.finish().ok_or(Error::NoCells)
    }

    /// The same for who goes on whatever is lost: `from` the cell where one was, or the beginning, as [`Scene::begin`] has it. Who
    /// `waits` for what may come later hears of that instead.
    ///
    /// # Errors
    /// When a part of the index does not come now and may come later, for who waits.
    pub(crate) async fn whereabouts(
        &self,
        from: Option<&CellEntry>,
        point: [f64; 3],
        grows: bool,
        waits: bool,
    ) -> Result<Whereabouts, Error> {
        let known = match from.filter(|from| from.cell != NOWHERE) {
            Some(from) => self.step(from, point).await,
            None => self.start_at(point, grows).await,
        };
        if let Some(cell) = known {
            return Ok(Whereabouts {
                cell,
                is_sure: true,
                failures: Vec::new(),
            });
        }
        let mut search = CellSearch::new(&self.manifest().cells, point);
        let (mut is_sure, mut failures) = (true, Vec::new());
        while let Some(entry) = search.wants() {
            let Err(cause) = self.answer(&mut search, &entry).await else {
                continue;
            };
            if waits && cause.passes() {
                return Err(cause);
            }
            search.lose();
            is_sure = false;
            if !matches!(cause, Error::GivenUp { .. }) {
                failures.push(Error::Unmapped {
                    cause: cause.to_string(),
                });
            }
        }
        let cell = match search.finish() {
            Some(located) => located.cell,
            None => self.nowhere(point),
        };
        Ok(Whereabouts {
            cell,
            is_sure,
            failures,
        })
    }

    async fn answer(&self, search: &mut CellSearch, entry: &PageEntry) -> Result<(), Error> {
        match entry.kind {
            PageKind::Page => search.give_page(self.indexed::<Page>(&entry.url, Some(entry.bytes)).await?.as_ref()),
            PageKind::Chunk => {
                search.give_chunk(self.indexed::<CellChunk>(&entry.url, Some(entry.bytes)).await?.as_ref())
            }
        }
        Ok(())
    }

    /// The cell that surely holds a point, by way of the cells between; those that cannot be had are left out.
    async fn step(&self, from: &CellEntry, point: [f64; 3]) -> Option<CellEntry> {
        let mut walk = CellWalk::new(from, point);
        while let Some(wanted) = walk.wants() {
            let mut entries = Vec::with_capacity(wanted.len());
            for cell in wanted {
                entries.extend(self.cell(*cell).await.ok().flatten());
            }
            walk.give(&entries);
        }
        walk.finish()
    }

    /// What stands for the cell at a point where none is known.
    fn nowhere(&self, point: [f64; 3]) -> CellEntry {
        CellEntry {
            cell: NOWHERE,
            bounds: Bounds::around([point]),
            planes: Vec::new(),
            adjacent: Vec::new(),
            record: self.pointer().manifest.clone(),
            record_bytes: 0,
            steps: None,
            steps_bytes: None,
            record_json: self.pointer().manifest.clone(),
        }
    }

    /// What takes the place of a record where there is none: all that is around the cell, in a small world everything. What looks
    /// largest from its middle comes first. Says what of it cannot be had.
    pub(crate) async fn surroundings(&self, cell: &CellEntry) -> (CellRecord, Vec<Error>) {
        let eye = cell.bounds.center();
        let (objects, failures) = match &self.manifest().whole {
            Some(whole) => (whole.objects.clone(), Vec::new()),
            None => self.nearest_objects(eye).await,
        };
        let mut all: Vec<Visible> = objects
            .iter()
            .map(|entry| Visible {
                object: entry.object,
                solid_angle_sr: solid_angle_sr(&entry.bounds, eye),
                fraction: 1.0,
                doors: Vec::new(),
            })
            .collect();
        all.sort_by(|a, b| b.solid_angle_sr.total_cmp(&a.solid_angle_sr));
        let record = CellRecord {
            cell: cell.cell,
            hull: Hull::of_box(&cell.bounds),
            adjacent: Vec::new(),
            portals: Vec::new(),
            cpvs: Vec::new(),
            opvs: all,
            lpvs: Vec::new(),
            method: "surroundings".to_owned(),
            guarantee: Guarantee::Sampled,
            miss_bound: 1.0,
            visible_level0_bytes: 0,
            visible_coarsest_bytes: 0,
        };
        (record, failures)
    }

    /// The objects in the chunks that are nearest to a point.
    async fn nearest_objects(&self, point: [f64; 3]) -> (Vec<ObjectEntry>, Vec<Error>) {
        let mut open = self.manifest().objects.entries.clone();
        let (mut chunks, mut objects, mut failures) = (0, Vec::new(), Vec::new());
        while chunks < MOST_CHUNKS && !open.is_empty() {
            open.sort_by(|a, b| b.bounds.distance_m(point).total_cmp(&a.bounds.distance_m(point)));
            let Some(next) = open.pop() else { break };
            let read = match next.kind {
                PageKind::Page => self
                    .indexed::<Page>(&next.url, Some(next.bytes))
                    .await
                    .map(|page| open.extend(page.entries.iter().cloned())),
                PageKind::Chunk => {
                    chunks += 1;
                    let chunk = self.indexed::<ObjectChunk>(&next.url, Some(next.bytes)).await;
                    chunk.map(|chunk| objects.extend(chunk.objects.iter().cloned()))
                }
            };
            failures.extend(read.err());
        }
        (objects, failures)
    }
}

/// That of the ball around a box.
fn solid_angle_sr(bounds: &Bounds, eye: [f64; 3]) -> f32 {
    let center = bounds.center();
    let distance_m = (0..3).map(|i| (center[i] - eye[i]).powi(2)).sum::<f64>().sqrt();
    let sine = (0.5 * bounds.diagonal_m() / distance_m.max(f64::MIN_POSITIVE)).min(1.0);
    (std::f64::consts::TAU * (1.0 - (1.0 - sine * sine).sqrt())) as f32
}
