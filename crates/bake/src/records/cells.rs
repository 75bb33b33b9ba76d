//! What does each cell's record say? Turns what the visibility stage found into records, their JSON twins and the rows
//! of the cell index.

use belvedere_scene::{
    CellId, ObjectId,
    index::CellEntry,
    object::{Model, ObjectEntry},
    record::{CellJson, CellRecord, Portal, Visible, index_entry},
};

use super::{
    BakeError, Input,
    models::{UniqueBytes, coarsest},
    sink::Ledger,
};
use crate::{
    cells::ViewCell,
    progress::Progress,
    visibility::{CellVisibility, SeenObject},
};

/// Writes every record in both forms; gives the rows of the index in the order of their ids.
pub(super) fn write_records(
    input: Input<'_>,
    entries: &[ObjectEntry],
    models: &[Model],
    ledger: &Ledger<'_>,
    progress: &dyn Progress,
) -> Result<Vec<CellEntry>, BakeError> {
    let mut rows = Vec::with_capacity(input.graph.cells.len());
    for (id, (cell, seen)) in input.graph.cells.iter().zip(&input.visibility.cells).enumerate() {
        if progress.cancelled() {
            return Err(BakeError::Cancelled);
        }
        let record = CellRecord {
            method: input.visibility.method.name().to_owned(),
            guarantee: input.visibility.guarantee,
            ..record(CellId(id as u32), cell, seen, entries, models)
        };
        let binary = ledger.put("cell", record.encode())?;
        let (json, _) = ledger.put_json(&CellJson::of(&record, binary.1))?;
        rows.push(index_entry(&record, cell.planes(), binary, json));
        progress.advance(1);
    }
    Ok(rows)
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
