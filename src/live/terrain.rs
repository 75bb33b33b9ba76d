//! What do the rules need of a published scene? The shapes of its cells at once, and what a cell sees when it is asked.

use std::{collections::BTreeSet, sync::Arc};

use belvedere_live::{
    cells::{Ball, Cell, Cells},
    journal::Ground,
    world::Unknown,
};
use belvedere_scene::CellId;

use crate::published::{Published, ReadError};

/// What can be seen into from a cell.
pub(super) type Sight = (CellId, Vec<CellId>);

/// A published revision as the rules see it.
#[derive(Debug, Clone)]
pub(super) struct Terrain {
    pub(super) published: Arc<Published>,
}

impl Terrain {
    /// All that is known at once.
    pub(super) async fn ground(&self) -> Result<Ground, ReadError> {
        let entries = self.published.reader.all_cells().await?;
        let shape = |entry: belvedere_scene::index::CellEntry| Cell {
            bounds: entry.bounds,
            planes: entry.planes,
        };
        Ok(Ground {
            revision: self.published.pointer.revision,
            bounds: self.published.pointer.bounds,
            cells: entries.into_iter().map(shape).collect(),
            foliage: self.published.reader.foliage().await?,
        })
    }

    /// What can be seen into from each of these cells.
    pub(super) async fn sights(&self, cells: Unknown) -> Result<Vec<Sight>, ReadError> {
        let mut sights = Vec::with_capacity(cells.len());
        for cell in cells {
            let record = self.published.reader.cell_record(cell).await?;
            sights.push((cell, record.map_or_else(Vec::new, |record| record.cpvs.clone())));
        }
        Ok(sights)
    }

    /// What can be seen into from wherever somebody stands.
    pub(super) async fn sights_around(
        &self,
        ground: &Ground,
        eyes: impl Iterator<Item = Ball>,
    ) -> Result<Vec<Sight>, ReadError> {
        let cells = Cells::new(ground.cells.clone());
        let under: BTreeSet<_> = eyes.flat_map(|eye| cells.under(&eye)).collect();
        self.sights(under.into_iter().collect()).await
    }
}
