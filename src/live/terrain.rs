//! What do the rules need of a published scene? The shapes of its cells at once, and what a cell sees when it is asked.

use std::sync::Arc;

use belvedere_live::{
    cells::{Ball, Cell, Cells},
    world::Unknown,
};
use belvedere_scene::{Bounds, CellId};

use crate::published::{Published, ReadError};

/// A published revision as the rules see it.
#[derive(Debug, Clone)]
pub(super) struct Terrain {
    pub(super) published: Arc<Published>,
}

impl Terrain {
    /// The shapes of all cells.
    pub(super) async fn cells(&self) -> Result<Cells, ReadError> {
        let entries = self.published.reader.all_cells().await?;
        let shape = |entry: belvedere_scene::index::CellEntry| Cell {
            bounds: entry.bounds,
            planes: entry.planes,
        };
        Ok(Cells::new(entries.into_iter().map(shape).collect()))
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.published.pointer.bounds
    }

    /// What can be seen into from each of these cells.
    pub(super) async fn sights(&self, cells: Unknown) -> Result<Vec<(CellId, Vec<CellId>)>, ReadError> {
        let mut sights = Vec::with_capacity(cells.len());
        for cell in cells {
            let record = self.published.reader.cell_record(cell).await?;
            sights.push((cell, record.map_or_else(Vec::new, |record| record.cpvs.clone())));
        }
        Ok(sights)
    }

    /// Teaches cells what is seen from wherever somebody stands.
    pub(super) async fn teach(&self, cells: &mut Cells, eyes: Vec<Ball>) -> Result<(), ReadError> {
        for eye in eyes {
            for (cell, sees) in self.sights(cells.unknown_under(&eye)).await? {
                cells.learn(cell, &sees);
            }
        }
        Ok(())
    }
}
