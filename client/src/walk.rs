//! How does one go on to the next cell? With the steps of the cell where one stands when they cost less than the next
//! record, and for nothing when they are here already: they lead to every neighbour.

use belvedere_scene::{
    index::CellEntry,
    record::{CellRecord, Steps},
};

use crate::{ByteSource, Error, Scene};

/// A walk from cell to cell.
#[derive(Debug)]
pub struct Walk<'a, S> {
    scene: &'a Scene<S>,
    cell: CellEntry,
    record: CellRecord,
    /// Of the cell, once they were fetched.
    steps: Option<Steps>,
}

impl<'a, S: ByteSource> Walk<'a, S> {
    /// Starts in a cell.
    ///
    /// # Errors
    /// When its record cannot be fetched, or is damaged.
    pub async fn start(scene: &'a Scene<S>, cell: CellEntry) -> Result<Self, Error> {
        let record = scene.record(&cell).await?;
        Ok(Self {
            scene,
            cell,
            record,
            steps: None,
        })
    }

    /// Where one stands.
    #[must_use]
    pub fn cell(&self) -> &CellEntry {
        &self.cell
    }

    /// What is visible from there.
    #[must_use]
    pub fn record(&self) -> &CellRecord {
        &self.record
    }

    /// Fetches the steps, so that going on to any neighbour needs no request for its record.
    ///
    /// # Errors
    /// When they cannot be fetched, or are damaged.
    pub async fn look_around(&mut self) -> Result<(), Error> {
        if self.steps.is_none() {
            self.steps = self.scene.steps(&self.cell).await?;
        }
        Ok(())
    }

    /// Goes on to another cell, next door or not. What a step leads to is verified as a fetched record would be.
    ///
    /// # Errors
    /// When steps or record cannot be fetched, or are damaged; one then still stands where one stood.
    pub async fn enter(&mut self, next: CellEntry) -> Result<&CellRecord, Error> {
        let adjacent = self.cell.adjacent.contains(&next.cell);
        if adjacent && self.cell.steps_bytes.is_some_and(|bytes| bytes < next.record_bytes) {
            self.look_around().await?;
        }
        let step = self.steps.as_ref().and_then(|steps| steps.step(next.cell));
        let record = match step {
            Some(step) => {
                let record = self
                    .record
                    .follow(step)
                    .map_err(|cause| Error::Record { cell: next.cell, cause })?;
                if !next.record.is_of(&record.encode()) {
                    return Err(Error::Corrupt(next.record));
                }
                record
            }
            None => self.scene.record(&next).await?,
        };
        (self.cell, self.record, self.steps) = (next, record, None);
        Ok(&self.record)
    }
}
