//! In which cell is a point? By adjacency for who knows the cell nearby (Marvie & Bouatouch 2004, §3.4), else by the index; and where a part of
//! the index is lost, in the nearest cell that is known, or nowhere, from where everything is seen.

use belvedere_scene::{
    Bounds, CellId,
    index::{CellChunk, CellEntry, CellSearch, Located, Page, PageEntry, PageKind},
    record::{CellRecord, Guarantee, Hull, Visible},
    walk::CellWalk,
};

use crate::{ByteSource, Error, Scene};

/// Stands for the cell of who can know none. No scene has so many that one is called so.
pub(crate) const NOWHERE: CellId = CellId(u32::MAX);

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

    /// The cell at a point (world space, metres) for who knows the cell at a point nearby: the same answer as
    /// [`Scene::locate`], mostly without a look at the index.
    ///
    /// # Errors
    /// When a part of the index cannot be fetched or read.
    pub async fn locate_from(&self, from: &CellEntry, point: [f64; 3]) -> Result<Located, Error> {
        match self.step(from, point).await {
            Some(cell) => Ok(Located { cell, distance_m: 0.0 }),
            None => self.locate(point).await,
        }
    }

    /// The same for who goes on whatever is lost: `from` the cell where one was, or the beginning, as [`Scene::begin`] has it.
    ///
    /// # Errors
    /// When a part of the index does not come now and may come later, or is lost and nothing tells what there is to see.
    pub(crate) async fn whereabouts(
        &self,
        from: Option<&CellEntry>,
        point: [f64; 3],
        grows: bool,
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
        let (mut lost, mut failures) = (None, Vec::new());
        while let Some(entry) = search.wants() {
            let Err(cause) = self.answer(&mut search, &entry).await else {
                continue;
            };
            if !cause.is_final() {
                return Err(cause);
            }
            search.lose();
            match cause {
                Error::GivenUp { .. } => lost = Some(cause),
                cause => failures.push(Error::Unmapped {
                    cause: cause.to_string(),
                }),
            }
        }
        let is_sure = lost.is_none() && failures.is_empty();
        let cell = match search.finish() {
            Some(located) => located.cell,
            None => match self.nowhere() {
                Some(nowhere) => nowhere,
                None => return Err(failures.pop().or(lost).unwrap_or(Error::NoCells)),
            },
        };
        Ok(Whereabouts {
            cell,
            is_sure,
            failures,
        })
    }

    async fn answer(&self, search: &mut CellSearch, entry: &PageEntry) -> Result<(), Error> {
        match entry.kind {
            PageKind::Page => search.give_page(self.indexed::<Page>(&entry.url).await?.as_ref()),
            PageKind::Chunk => search.give_chunk(self.indexed::<CellChunk>(&entry.url).await?.as_ref()),
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

    /// What stands for a cell where none is known, if it is known what there is to see.
    fn nowhere(&self) -> Option<CellEntry> {
        let manifest = self.manifest();
        manifest.whole.as_ref()?;
        Some(CellEntry {
            cell: NOWHERE,
            bounds: manifest.bounds,
            planes: Vec::new(),
            adjacent: Vec::new(),
            record: self.pointer().manifest.clone(),
            record_bytes: 0,
            steps: None,
            steps_bytes: None,
            record_json: self.pointer().manifest.clone(),
        })
    }

    /// What takes the place of a record where there is none: everything, if it is known what there is. What looks largest from the
    /// first viewpoint comes first.
    pub(crate) fn record_of_all(&self) -> Option<CellRecord> {
        let manifest = self.manifest();
        let objects = manifest.whole.as_ref()?.objects.iter();
        let eye = match manifest.viewpoints.first() {
            Some(viewpoint) => viewpoint.position,
            None => manifest.bounds.center(),
        };
        let mut all: Vec<Visible> = objects
            .map(|entry| Visible {
                object: entry.object,
                solid_angle_sr: solid_angle_sr(&entry.bounds, eye),
                fraction: 1.0,
                doors: Vec::new(),
            })
            .collect();
        all.sort_by(|a, b| b.solid_angle_sr.total_cmp(&a.solid_angle_sr));
        Some(CellRecord {
            cell: NOWHERE,
            hull: Hull::of_box(&manifest.bounds),
            adjacent: Vec::new(),
            portals: Vec::new(),
            cpvs: Vec::new(),
            opvs: all,
            lpvs: Vec::new(),
            method: "everything".to_owned(),
            guarantee: Guarantee::Conservative,
            miss_bound: 0.0,
            visible_level0_bytes: 0,
            visible_coarsest_bytes: 0,
        })
    }
}

/// That of the ball around a box.
fn solid_angle_sr(bounds: &Bounds, eye: [f64; 3]) -> f32 {
    let center = bounds.center();
    let distance_m = (0..3).map(|i| (center[i] - eye[i]).powi(2)).sum::<f64>().sqrt();
    let sine = (0.5 * bounds.diagonal_m() / distance_m.max(f64::MIN_POSITIVE)).min(1.0);
    (std::f64::consts::TAU * (1.0 - (1.0 - sine * sine).sqrt())) as f32
}
