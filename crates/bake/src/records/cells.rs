//! What does each cell's record say? Turns what the visibility stage found into records, their JSON twins and the rows
//! of the cell index.

use belvedere_scene::{
    CellId, ObjectId,
    index::CellEntry,
    manifest::RecordSizes,
    object::{Model, ObjectEntry},
    record::{CellJson, CellRecord, Crossing, Portal, Steps, Visible, index_entry},
};
use rayon::prelude::*;

use super::{
    BakeError, Input,
    models::{UniqueBytes, coarsest},
    settle::settle,
    sink::Ledger,
};
use crate::{
    cells::ViewCell,
    progress::Progress,
    visibility::{CellVisibility, SeenObject},
};

/// The rows of the cell index, and what they lead to.
pub(super) struct WrittenCells {
    /// In the order of their ids.
    pub(super) rows: Vec<CellEntry>,
    /// Totals over all records and steps.
    pub(super) sizes: RecordSizes,
}

/// Steps of progress for each cell: its record, the steps to its neighbours, and writing both.
pub(super) const STEPS: u64 = 3;

/// Writes every record in both forms, and the steps between neighbours.
pub(super) fn write_records(
    input: Input<'_>,
    entries: &[ObjectEntry],
    models: &[Model],
    ledger: &Ledger<'_>,
    progress: &dyn Progress,
) -> Result<WrittenCells, BakeError> {
    let cells: Vec<_> = input.graph.cells.iter().zip(&input.visibility.cells).collect();
    let mut records: Vec<CellRecord> = cells
        .par_iter()
        .enumerate()
        .map(|(id, (cell, seen))| {
            let record = CellRecord {
                method: input.visibility.method.name().to_owned(),
                guarantee: input.visibility.guarantee,
                ..record(CellId(id as u32), cell, seen, entries, models)
            };
            progress.advance(1);
            record
        })
        .collect();
    settle(&mut records);
    let steps: Vec<Steps> = records
        .par_iter()
        .map(|from| {
            let steps = Steps::between(from, from.adjacent.iter().map(|to| &records[to.index()]));
            progress.advance(1);
            steps
        })
        .collect();
    let neighbours = Neighbours {
        records: &records,
        steps: &steps,
        entries,
        models,
    };
    let written: Vec<(CellEntry, RecordSizes)> = input
        .graph
        .cells
        .par_iter()
        .enumerate()
        .map(|(id, cell)| {
            if progress.cancelled() {
                return Err(BakeError::Cancelled);
            }
            let written = neighbours.write(id, cell, ledger)?;
            progress.advance(1);
            Ok(written)
        })
        .collect::<Result<_, _>>()?;
    let (rows, sizes): (Vec<_>, Vec<_>) = written.into_iter().unzip();
    Ok(WrittenCells {
        rows,
        sizes: sizes.into_iter().sum(),
    })
}

/// All records, and the steps between them.
struct Neighbours<'a> {
    records: &'a [CellRecord],
    steps: &'a [Steps],
    entries: &'a [ObjectEntry],
    models: &'a [Model],
}

impl Neighbours<'_> {
    /// Writes what belongs to one cell.
    fn write(&self, id: usize, cell: &ViewCell, ledger: &Ledger<'_>) -> Result<(CellEntry, RecordSizes), BakeError> {
        let Self { records, steps, .. } = self;
        let (record, from) = (&records[id], &steps[id]);
        let binary = ledger.put("cell", record.encode())?;
        let stepping = match from.to.len() {
            0 => None,
            _ => Some(ledger.put("steps", from.encode())?),
        };
        let (json, _) = ledger.put_json(&CellJson::of(record, binary.1, &self.crossings_into(record)))?;
        let local_elsewhere = record.cpvs.iter().flat_map(|cell| records[cell.index()].lpvs.iter());
        let step_bytes = from.to.iter().map(|(_, step)| step.len() as u64);
        let step_sets = from
            .to
            .iter()
            .map(|(to, _)| records[to.index()].set_bytes(record.objects()));
        let sizes = RecordSizes {
            records: 1,
            record_bytes: binary.1,
            record_set_bytes: record.set_bytes([]),
            hybrid_set_bytes: record.set_bytes(local_elsewhere.map(|visible| visible.object)),
            steps: from.to.len() as u64,
            step_bytes: step_bytes.sum(),
            step_set_bytes: step_sets.sum(),
        };
        Ok((index_entry(record, cell.planes(), binary, stepping, json), sizes))
    }

    /// What it costs to come into a cell from each side.
    fn crossings_into(&self, record: &CellRecord) -> Vec<Crossing> {
        let crossing = |before: &CellId| {
            Some(Crossing {
                from: *before,
                step_bytes: self.steps[before.index()].step(record.cell)?.len() as u64,
                model_bytes: newly_visible_bytes(&self.records[before.index()], record, self.entries, self.models),
            })
        };
        record.adjacent.iter().filter_map(crossing).collect()
    }
}

/// The coarsest level of everything that is visible from `to` but shares no geometry with what is visible from `from`.
fn newly_visible_bytes(from: &CellRecord, to: &CellRecord, entries: &[ObjectEntry], models: &[Model]) -> u64 {
    let lowest = |record: &CellRecord| {
        let mut lowest = UniqueBytes::default();
        for seen in record.visible() {
            lowest.add(coarsest(&models[entries[seen.object.index()].model.index()]));
        }
        lowest
    };
    lowest(to).without(&lowest(from)).total()
}

fn record(id: CellId, cell: &ViewCell, seen: &CellVisibility, entries: &[ObjectEntry], models: &[Model]) -> CellRecord {
    let inside = |seen: &&SeenObject| cell.contains_box(&entries[seen.object as usize].bounds);
    let (local, shared): (Vec<_>, Vec<_>) = seen.objects.iter().partition(inside);
    let visible = |seen: Vec<&SeenObject>| -> Vec<Visible> {
        seen.into_iter()
            .map(|s| Visible {
                object: ObjectId(s.object),
                fraction: s.fraction,
                solid_angle_sr: s.solid_angle,
                doors: s.doors.iter().map(|door| ObjectId(*door)).collect(),
            })
            .collect()
    };
    let (mut level0, mut lowest) = (UniqueBytes::default(), UniqueBytes::default());
    for seen in &seen.objects {
        let model = &models[entries[seen.object as usize].model.index()];
        level0.add(&model.levels[0]);
        lowest.add(coarsest(model));
    }
    CellRecord {
        cell: id,
        hull: cell.shape(),
        adjacent: cell.adjacent.iter().map(|c| CellId(*c)).collect(),
        portals: cell
            .portals
            .iter()
            .map(|p| Portal {
                to: CellId(p.to),
                polygon: p.polygon.clone(),
                door: p.door.map(ObjectId),
            })
            .collect(),
        cpvs: seen.cells.iter().map(|c| CellId(*c)).collect(),
        opvs: visible(shared),
        lpvs: visible(local),
        method: String::new(),
        guarantee: belvedere_scene::record::Guarantee::Sampled,
        miss_bound: seen.miss_bound,
        visible_level0_bytes: level0.total(),
        visible_coarsest_bytes: lowest.total(),
    }
}
