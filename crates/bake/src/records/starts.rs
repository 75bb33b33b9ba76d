//! What does one need to know first who begins at a viewpoint? Writes it for each of their cells, as one document.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{
    CellId,
    index::CellEntry,
    object::{Model, ObjectEntry},
    pointer::Viewpoint,
    start::{MOST_STARTS, STEPS_AROUND, Start, StartRef},
};

use super::{
    pages::Tree,
    populations,
    sink::{Ledger, SinkError},
};
use crate::visibility::Visibility;

/// What was written of a revision, and what of it can be seen from where.
pub(super) struct Written<'a> {
    pub(super) visibility: &'a Visibility,
    pub(super) cells: (&'a [CellEntry], &'a Tree),
    pub(super) objects: (&'a [ObjectEntry], &'a Tree),
    pub(super) models: (&'a [Model], &'a Tree),
    pub(super) populations: Option<&'a Tree>,
}

impl Written<'_> {
    /// Writes the start of each cell that holds one of the first viewpoints.
    pub(super) fn starts(&self, viewpoints: &[Viewpoint], ledger: &Ledger<'_>) -> Result<Vec<StartRef>, SinkError> {
        let mut cells = BTreeSet::new();
        for viewpoint in viewpoints {
            if cells.len() < MOST_STARTS {
                cells.insert(viewpoint.cell);
            }
        }
        let write = |cell: CellId| {
            let start = self.start(cell);
            let (url, bytes) = ledger.put_json(&start)?;
            Ok(StartRef {
                cell,
                bounds: self.cells.0[cell.index()].bounds,
                url,
                bytes,
                grown_bytes: self.grown_bytes(&start),
            })
        };
        cells.into_iter().map(write).collect()
    }

    fn start(&self, cell: CellId) -> Start {
        let around = self.around(cell);
        let seen = around
            .iter()
            .flat_map(|cell| &self.visibility.cells[cell.index()].objects);
        let seen: BTreeSet<_> = seen.map(|seen| seen.object as usize).collect();
        let objects: Vec<_> = seen.into_iter().map(|object| self.objects.0[object].clone()).collect();
        let models = objects.iter().map(|entry| entry.model);
        let models = models.map(|model| (model, self.models.0[model.index()].clone()));
        Start {
            start: cell,
            cells: around.iter().map(|cell| self.cells.0[cell.index()].clone()).collect(),
            models: models.collect(),
            objects,
        }
    }

    /// A cell, and those up to so many steps away.
    fn around(&self, cell: CellId) -> BTreeSet<CellId> {
        let mut around = BTreeSet::from([cell]);
        for _ in 0..STEPS_AROUND {
            let next = around.iter().flat_map(|cell| &self.cells.0[cell.index()].adjacent);
            around = next.copied().chain(around.iter().copied()).collect();
        }
        around
    }

    /// Bytes of the documents that say as much to who grows rules.
    fn grown_bytes(&self, start: &Start) -> u64 {
        let mut documents = BTreeMap::new();
        let mut read = |tree: &Tree, id: u32| {
            if let Some(chunk) = tree.chunk_of(id) {
                documents.insert(chunk.url.clone(), chunk.bytes);
            }
        };
        for entry in &start.cells {
            read(self.cells.1, entry.cell.0);
        }
        for entry in &start.objects {
            match self.populations {
                Some(tree) if populations::is_member(entry, &start.models[&entry.model]) => read(tree, entry.object.0),
                _ => {
                    read(self.objects.1, entry.object.0);
                    read(self.models.1, entry.model.0);
                }
            }
        }
        documents.into_values().sum()
    }
}
