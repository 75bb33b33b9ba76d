//! `belvedere inspect SCENE|FILE`: what is in a published scene, cell by cell, or in a source file.

mod explain;
mod file;
mod places;
mod which;

use std::{path::Path, sync::Arc};

use anyhow::Context;
use belvedere_scene::{
    CellId, ObjectId, SceneName,
    index::CellEntry,
    object::ObjectInfo,
    pointer::Pointer,
    record::{CellJson, CellRecord, Steps},
};
use serde::Serialize;

use self::{places::Places, which::Which};
use super::{
    output::{bytes, counted, no_such_cell, percent, print, print_json, table},
    sowing::{GrowthArgs, beginning, refuse_given},
};
use crate::{
    place::PlaceArgs,
    publish::{data::DataFolder, report::Report},
    published::SceneReader,
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The name of a published scene, or a source file
    what: String,
    /// Show one cell of a published scene
    #[arg(long)]
    cell: Option<CellId>,
    /// Say why an object, by its id or its node's name, can be seen from that cell, or why not; without a cell, from which cells
    /// it may be seen
    #[arg(long, value_name = "ID|NODE")]
    object: Option<Which>,
    #[command(flatten)]
    growth: GrowthArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let file = Path::new(&args.what);
    if file.is_file() {
        anyhow::ensure!(
            args.cell.is_none() && args.object.is_none(),
            "a source file has neither cells nor objects yet: bake it, then inspect the scene"
        );
        return file::inspect(file, args.growth, args.json);
    }
    refuse_given(&args.growth, &format!("{} is a published scene", beginning(&args.what)))?;
    let name: SceneName = args
        .what
        .parse()
        .with_context(|| format!("`{}` is neither a file nor the name of a scene", beginning(&args.what)))?;
    let data = DataFolder::open_existing(&args.place).await?;
    let baked = data.baked(&name).await?;
    let scene = Opened {
        reader: SceneReader::of(&baked.pointer, data.store().clone()),
        pointer: baked.pointer,
    };
    let object = match args.object {
        Some(which) => Some(which.of(&scene).await?),
        None => None,
    };
    match (args.cell, object) {
        (Some(cell), Some(object)) => explain::explain(&data, &name, &scene, (cell, object), args.json).await,
        (Some(cell), None) => inspect_cell(&scene, cell, args.json).await,
        (None, Some(object)) => explain::seen_from(&scene, object, args.json).await,
        (None, None) => inspect_scene(&scene, serde_json::from_value(baked.report)?, args.json).await,
    }
}

/// A published scene, read from its blobs.
struct Opened {
    reader: SceneReader,
    pointer: Pointer,
}

/// A cell's line in the table.
#[derive(Debug, Serialize)]
struct CellLine {
    cell: CellId,
    size_m: [f64; 3],
    portals: usize,
    visible_cells: usize,
    visible_objects: usize,
    /// Share of the scene's objects that are hidden from the cell.
    culled: f64,
    visible_coarsest_bytes: u64,
    visible_level0_bytes: u64,
    record_bytes: u64,
    /// What of the record says which objects are visible.
    record_set_bytes: u64,
    /// Mean size of a step to an adjacent cell; null when there is none.
    mean_step_bytes: Option<f64>,
    miss_bound: f64,
}

#[derive(Debug, Serialize)]
struct SceneTables<'a> {
    report: &'a Report,
    cells: Vec<CellLine>,
    levels: Vec<LevelLine>,
}

/// All objects at one level.
#[derive(Debug, Default, Serialize)]
struct LevelLine {
    level: u32,
    objects: u64,
    triangles: u64,
    bytes: u64,
    largest_error_m: f64,
}

async fn inspect_scene(scene: &Opened, report: Report, json: bool) -> anyhow::Result<()> {
    let mut cells = Vec::new();
    for id in 0..scene.pointer.cells {
        let (entry, record) = cell(scene, CellId(id)).await?;
        let steps = scene.reader.steps(CellId(id)).await?;
        cells.push(line(&entry, &record, steps.as_deref(), scene.pointer.objects));
    }
    let levels = levels(scene).await?;
    if json {
        return print_json(&SceneTables {
            report: &report,
            cells,
            levels,
        });
    }
    let pointer = &scene.pointer;
    print(&format!(
        "{} ({}), revision {}\n{}",
        pointer.title,
        pointer.scene,
        pointer.revision,
        super::bake::summary(&report)
    ))?;
    let head = [
        "cell",
        "size m",
        "portals",
        "cells seen",
        "objects seen",
        "culled",
        "coarsest",
        "finest",
        "record",
        "set",
        "step",
    ];
    let rows: Vec<_> = cells
        .iter()
        .map(|c| {
            vec![
                c.cell.to_string(),
                c.size_m.map(|s| format!("{s:.1}")).join(" × "),
                c.portals.to_string(),
                c.visible_cells.to_string(),
                c.visible_objects.to_string(),
                percent(c.culled),
                bytes(c.visible_coarsest_bytes),
                bytes(c.visible_level0_bytes),
                bytes(c.record_bytes),
                bytes(c.record_set_bytes),
                c.mean_step_bytes
                    .map_or_else(|| "–".to_owned(), |mean| format!("{mean:.0} B")),
            ]
        })
        .collect();
    print(&format!("\n{}", table(&head, &rows)))?;
    let rows: Vec<_> = levels
        .iter()
        .map(|l| {
            let error = format!("{:.4}", l.largest_error_m);
            vec![
                l.level.to_string(),
                l.objects.to_string(),
                l.triangles.to_string(),
                bytes(l.bytes),
                error,
            ]
        })
        .collect();
    print(&format!(
        "\n{}",
        table(&["level", "objects", "triangles", "bytes", "largest error m"], &rows)
    ))
}

async fn inspect_cell(scene: &Opened, id: CellId, json: bool) -> anyhow::Result<()> {
    let (entry, record) = cell(scene, id).await?;
    if json {
        let twin: CellJson = scene.reader.cell_json(&entry).await?;
        return print_json(&twin);
    }
    let steps = scene.reader.steps(id).await?;
    let line = line(&entry, &record, steps.as_deref(), scene.pointer.objects);
    let places = Places::within(&scene.pointer.bounds);
    print(&format!(
        "{id}: {} m from {}, {} of {} visible ({} culled), {}, miss bound {}; record {}, its set {}",
        line.size_m.map(|s| format!("{s:.1}")).join(" × "),
        places.point(entry.bounds.min),
        line.visible_objects,
        counted(scene.pointer.objects as usize, "object"),
        percent(line.culled),
        counted(line.visible_cells, "cell"),
        share(record.miss_bound),
        bytes(line.record_bytes),
        bytes(line.record_set_bytes),
    ))?;
    let mut rows = Vec::new();
    for (visible, place) in record
        .lpvs
        .iter()
        .map(|v| (v, "inside"))
        .chain(record.opvs.iter().map(|v| (v, "beyond")))
    {
        let info = object(scene, visible.object).await?;
        let finest = &info.levels[0];
        rows.push(vec![
            info.object.to_string(),
            info.source_node,
            place.to_owned(),
            format!("{:.4}", visible.fraction),
            visible
                .doors
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(" "),
            info.levels.len().to_string(),
            finest.triangles.to_string(),
            bytes(finest.bytes),
        ]);
    }
    print(&table(
        &[
            "object",
            "node",
            "stands",
            "fraction",
            "hidden by",
            "levels",
            "triangles",
            "finest",
        ],
        &rows,
    ))?;
    let portals: Vec<_> = record
        .portals
        .iter()
        .map(|p| {
            vec![
                p.to.to_string(),
                places.point(belvedere_scene::Bounds::around(p.polygon.iter().copied()).center()),
            ]
        })
        .collect();
    print(&format!("\n{}", table(&["portal to", "middle m"], &portals)))
}

/// A share that is mostly none.
fn share(share: f64) -> String {
    if share == 0.0 {
        return "0".to_owned();
    }
    format!("{share:.1e}")
}

async fn cell(scene: &Opened, id: CellId) -> anyhow::Result<(CellEntry, Arc<CellRecord>)> {
    let missing = || no_such_cell(id, scene.pointer.cells);
    let entry = scene.reader.cell_entry(id).await?.with_context(missing)?;
    let record = scene.reader.cell_record(id).await?.with_context(missing)?;
    Ok((entry, record))
}

async fn object(scene: &Opened, id: ObjectId) -> anyhow::Result<ObjectInfo> {
    scene
        .reader
        .object_info(id)
        .await?
        .with_context(|| format!("the scene's index does not lead to {id}"))
}

fn line(entry: &CellEntry, record: &CellRecord, steps: Option<&Steps>, objects: u32) -> CellLine {
    let seen = record.visible().len();
    let mean_step_bytes = steps.filter(|steps| !steps.to.is_empty()).map(|steps| {
        let total: usize = steps.to.iter().map(|(_, step)| step.len()).sum();
        total as f64 / steps.to.len() as f64
    });
    CellLine {
        cell: record.cell,
        size_m: entry.bounds.size_m(),
        portals: record.portals.len(),
        visible_cells: record.cpvs.len(),
        visible_objects: seen,
        culled: 1.0 - seen as f64 / f64::from(objects.max(1)),
        visible_coarsest_bytes: record.visible_coarsest_bytes,
        visible_level0_bytes: record.visible_level0_bytes,
        record_bytes: entry.record_bytes,
        record_set_bytes: record.set_bytes([]),
        mean_step_bytes,
        miss_bound: record.miss_bound,
    }
}

/// Sums over all objects; an object without such a coarse level counts with its coarsest.
async fn levels(scene: &Opened) -> anyhow::Result<Vec<LevelLine>> {
    let mut infos = Vec::new();
    for id in 0..scene.pointer.objects {
        infos.push(object(scene, ObjectId(id)).await?);
    }
    let deepest = infos.iter().map(|info| info.levels.len()).max().unwrap_or(0);
    let sums = (0..deepest).map(|number| {
        let mut line = LevelLine {
            level: number as u32,
            ..LevelLine::default()
        };
        let mut models = std::collections::BTreeSet::new();
        for info in &infos {
            let level = &info.levels[number.min(info.levels.len() - 1)];
            line.objects += u64::from(number < info.levels.len());
            line.triangles += level.triangles;
            line.largest_error_m = line.largest_error_m.max(level.geometric_error_m);
            if models.insert(&level.url) {
                line.bytes += level.bytes;
            }
        }
        line
    });
    Ok(sums.collect())
}
