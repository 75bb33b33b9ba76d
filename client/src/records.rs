//! What is visible from a cell, where its record cannot be had? The same stands in its JSON twin, and in the steps from each neighbour.

use belvedere_scene::{
    index::CellEntry,
    record::{CellJson, CellRecord, Steps},
};

use crate::{ByteSource, Error, Scene, whereabouts::NOWHERE};

impl<S: ByteSource> Scene<S> {
    /// What is visible from a cell, by whichever way that can be had, with what failed before; `None` where there is none.
    pub(crate) async fn record_somehow(&self, cell: &CellEntry) -> (Option<CellRecord>, Vec<Error>) {
        if cell.cell == NOWHERE {
            return (None, Vec::new());
        }
        let mut failures = match self.record(cell).await {
            Ok(record) => return (Some(record), Vec::new()),
            Err(cause) => vec![cause],
        };
        match self.indexed::<CellJson>(&cell.record_json, None).await {
            Ok(json) => return (Some(CellRecord::from(&*json)), failures),
            Err(cause) => failures.push(cause),
        }
        for next in &cell.adjacent {
            // A neighbour of which nothing can be had, either, is no failure of this cell.
            let Ok(Some(next)) = self.cell(*next).await else {
                continue;
            };
            if let Ok(Some(record)) = self.record_from(&next, cell).await {
                return (Some(record), failures);
            }
        }
        (None, failures)
    }

    /// What a neighbour's record and its steps say of a cell.
    async fn record_from(&self, neighbour: &CellEntry, cell: &CellEntry) -> Result<Option<CellRecord>, Error> {
        let steps = self.steps(neighbour).await?;
        let Some(step) = steps.as_ref().and_then(|steps: &Steps| steps.step(cell.cell)) else {
            return Ok(None);
        };
        let known = self.record(neighbour).await?;
        let damaged = |cause| Error::Record { cell: cell.cell, cause };
        let record = known.follow(step).map_err(damaged)?;
        Ok(Some(record).filter(|record| cell.record.is_of(&record.encode())))
    }
}
