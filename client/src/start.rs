//! How does one begin? With one document about the cell where one stands, those around, and all that can be seen from there, instead
//! of the chunks of the index that say the same among much else.

use std::sync::Arc;

use belvedere_scene::{
    index::{CellEntry, Located},
    start::{Start, StartRef},
};

use crate::{ByteSource, Error, Scene};

impl<S: ByteSource> Scene<S> {
    /// As [`Scene::locate`], for who begins at a point (world space, metres): where the scene has a start for it, all that
    /// [`Scene::cell`], [`Scene::entry`] and [`Scene::model`] are asked of what is around is known from then on. `grows` says
    /// whether the caller takes [populations](Scene::population) where these are fewer bytes. A start that cannot be had is done
    /// without.
    ///
    /// # Errors
    /// When a part of the index cannot be fetched or read.
    pub async fn begin(&self, point: [f64; 3], grows: bool) -> Result<Located, Error> {
        match self.start_at(point, grows).await {
            Some(cell) => Ok(Located { cell, distance_m: 0.0 }),
            None => self.locate(point).await,
        }
    }

    /// The cell that surely holds a point, from its start, unless what is around has been read of already.
    pub(crate) async fn start_at(&self, point: [f64; 3], grows: bool) -> Option<CellEntry> {
        let holds = |start: &&StartRef| start.bounds.distance_m(point) == 0.0 && start.is_worth(grows);
        let named = self.manifest().starts.iter().find(holds)?;
        let around = self.manifest().cells.entry_of(named.cell.0)?;
        if self.is_read(&around.url).await {
            return None;
        }
        let start: Arc<Start> = self.indexed(&named.url, Some(named.bytes)).await.ok()?;
        let cell = start
            .cell()
            .filter(|entry| entry.cell == named.cell && entry.holds_alone(point))?;
        self.learn(&start).await;
        Some(cell.clone())
    }
}
