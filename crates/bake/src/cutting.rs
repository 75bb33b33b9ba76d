//! Which cells are published? Those of the partition by what rays see, but for cuts on both sides of which about the same is
//! published.

use crate::{
    cells::{CellGraph, Partition},
    memory::Memory,
    occluders::Hiders,
    progress::{Cancelled, Progress, Stage},
    visibility::{self, Rough, Views, Visibility, VisibilitySettings},
    world::World,
};

/// A world and how it is cut.
pub(crate) struct Cutting<'a> {
    pub(crate) world: &'a World,
    pub(crate) hiders: &'a Hiders<'a>,
    /// None where the author drew the cells.
    pub(crate) partition: Option<Partition>,
    /// How many bytes draw each object.
    pub(crate) bytes: Vec<f64>,
}

impl Cutting<'_> {
    /// Whether there are so many cells that [`tried`](Self::tried) asks for rough sets.
    pub(crate) fn is_fine(&self) -> bool {
        self.partition.as_ref().is_some_and(Partition::is_fine)
    }

    /// The cells of a first revision, and what is published of each. `rough` are the sets of the cells as they are cut.
    pub(crate) fn preview(
        &self,
        views: &Views<'_>,
        rough: &Rough,
        progress: &dyn Progress,
    ) -> Result<(CellGraph, Visibility), Cancelled> {
        let rejoined = |partition: &Partition| partition.rejoined(&objects(rough), &self.bytes).graph(self.world);
        let rejoined = self.partition.as_ref().map(rejoined);
        match rejoined.filter(|graph| graph.cells.len() < views.graph().cells.len()) {
            Some(graph) => {
                let views = Views::told(self.world, &graph, self.hiders, (Stage::Preview, progress))?;
                let visibility = visibility::preview(&views, &visibility::rough(&views, progress)?);
                Ok((graph, visibility))
            }
            None => Ok((views.graph().clone(), visibility::preview(views, rough))),
        }
    }

    /// The cells that are looked from, after a few looks where proofs may hide nothing; `None` for those that there are.
    pub(crate) fn tried(
        &self,
        views: &Views<'_>,
        rough: &Rough,
        settings: &VisibilitySettings,
        memory: &dyn Memory,
        progress: &dyn Progress,
    ) -> Result<Option<CellGraph>, Cancelled> {
        let Some(partition) = self.partition.as_ref().filter(|_| self.is_fine()) else {
            return Ok(None);
        };
        let mut look = |cells: &[usize]| visibility::of_some(views, cells, settings, memory, progress);
        let tried = partition.tried(&objects(rough), &self.bytes, &mut look)?;
        Ok(Some(tried.graph(self.world)))
    }
}

fn objects(rough: &Rough) -> Vec<Vec<u32>> {
    rough.iter().map(|(objects, _)| objects.clone()).collect()
}
