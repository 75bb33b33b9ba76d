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

    /// All that must be known before people who stand here go on with this revision.
    pub(super) async fn prospect(&self, eyes: &[Ball]) -> Result<Prospect, ReadError> {
        let ground = self.ground().await?;
        let mut prospect = Prospect {
            cells: Cells::new(ground.cells.clone()),
            ground,
            sights: Vec::new(),
        };
        self.look_around(&mut prospect, eyes).await?;
        Ok(prospect)
    }

    /// Looks from where nobody stood before.
    pub(super) async fn look_around(&self, prospect: &mut Prospect, eyes: &[Ball]) -> Result<(), ReadError> {
        for (cell, sees) in self.sights(prospect.unknown_under(eyes)).await? {
            prospect.cells.learn(cell, &sees);
            prospect.sights.push((cell, sees));
        }
        Ok(())
    }
}

/// A revision that people are about to go on with.
#[derive(Debug)]
pub(super) struct Prospect {
    pub(super) ground: Ground,
    pub(super) sights: Vec<Sight>,
    cells: Cells,
}

impl Prospect {
    /// From where it is not known yet what is seen.
    pub(super) fn unknown_under(&self, eyes: &[Ball]) -> Unknown {
        let unknown: BTreeSet<_> = eyes.iter().flat_map(|eye| self.cells.unknown_under(eye)).collect();
        unknown.into_iter().collect()
    }
}
