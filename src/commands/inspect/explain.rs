//! `belvedere inspect SCENE --cell C --object O`: why is the object in the cell's visible set, or why is it not? Without a
//! cell: in which sets is it?
//!
//! What is seen is shown by a sight line of the oracle (`belvedere-verify`); what is hidden, by what hides it. What is
//! neither is said to be neither. What is proved hidden is looked for all the same: the bake asked the same prover.

use anyhow::Context;
use belvedere_scene::{
    CellId, ObjectId, SceneName,
    index::CellEntry,
    record::{CellRecord, Guarantee, Visible},
};
use belvedere_verify::line::{AIMED, SightLine, sight_line};
use glam::DVec3;
use serde::Serialize;

use super::{
    Opened, cell, object,
    places::{Places, direction},
};
use crate::{
    commands::{
        output::{print, print_json},
        verify::load,
    },
    publish::data::DataFolder,
    published::{Hiding, Plane},
};

/// So many eyes look for an object before one gives up, …
const EYES: u64 = 200;
/// … and so many for one that is proved hidden.
const EYES_IN_SPITE: u64 = 20;
/// Pixels along the side of a face of the cube around each.
const SIZE_PX: usize = 256;

/// What is known of one object and one cell.
#[derive(Debug, Serialize)]
struct Explained {
    cell: CellId,
    object: ObjectId,
    source_node: String,
    /// Whether the cell's record may miss something.
    guarantee: Guarantee,
    /// The record's entry; null when the record does not list the object.
    listed: Option<Visible>,
    /// Null when nobody looked or no eye saw it.
    sight_line: Option<SightLine>,
    /// What hides it from all of the cell while all doors are open; null when that was not proved or not asked.
    hidden: Option<Vec<Reason>>,
    /// How many eyes may have looked for it.
    eyes: u64,
}

/// What hides it, with the name of the object that does.
#[derive(Debug, Serialize)]
struct Reason {
    #[serde(flatten)]
    hiding: Hiding,
    source_node: Option<String>,
}

pub(super) async fn explain(
    data: &DataFolder,
    name: &SceneName,
    scene: &Opened,
    (in_cell, about): (CellId, ObjectId),
    json: bool,
) -> anyhow::Result<()> {
    let (entry, record) = cell(scene, in_cell).await?;
    ensure_known(scene, about)?;
    let listed = record
        .visible()
        .iter()
        .find(|v| v.object == about)
        .map(|v| Visible::clone(v));
    let mut explained = Explained {
        cell: in_cell,
        object: about,
        source_node: object(scene, about).await?.source_node,
        guarantee: record.guarantee,
        listed,
        sight_line: None,
        hidden: None,
        eyes: 0,
    };
    // The likelier answer first. Faces take longer to read than the box around them.
    if explained.listed.is_none() {
        explained.hidden = hidden(scene, (&entry, &record), about, Vec::new()).await?;
    }
    explained.eyes = if explained.hidden.is_none() {
        EYES
    } else {
        EYES_IN_SPITE
    };
    let (sight_line, faces) = look(data, name, (in_cell, about), explained.eyes).await?;
    explained.sight_line = sight_line;
    if explained.hidden.is_none() && explained.sight_line.is_none() {
        explained.hidden = hidden(scene, (&entry, &record), about, faces).await?;
    }
    if json {
        print_json(&explained)
    } else {
        print(&explained.text(Places::within(&scene.pointer.bounds)))
    }
}

/// In which cells' sets an object is.
#[derive(Debug, Serialize)]
struct SeenFrom {
    object: ObjectId,
    source_node: String,
    cells: Vec<CellId>,
    /// How many cells the scene has.
    of: u32,
}

pub(super) async fn seen_from(scene: &Opened, about: ObjectId, json: bool) -> anyhow::Result<()> {
    ensure_known(scene, about)?;
    let of = scene.pointer.cells;
    let mut cells = Vec::new();
    for id in (0..of).map(CellId) {
        let (_, record) = cell(scene, id).await?;
        if record.visible().iter().any(|visible| visible.object == about) {
            cells.push(id);
        }
    }
    let found = SeenFrom {
        object: about,
        source_node: object(scene, about).await?.source_node,
        cells,
        of,
    };
    if json {
        return print_json(&found);
    }
    let SeenFrom { source_node, cells, .. } = &found;
    let names: Vec<_> = cells.iter().map(ToString::to_string).collect();
    print(&format!(
        "{about} ({source_node}) is in the sets of {} of {of} cells: {}\n`--cell` with any cell says why, or why not",
        cells.len(),
        names.join(" ")
    ))
}

fn ensure_known(scene: &Opened, object: ObjectId) -> anyhow::Result<()> {
    let known = scene.pointer.objects;
    anyhow::ensure!(
        object.0 < known,
        "there is no object {object}; the scene has {known}, the first is o0"
    );
    Ok(())
}

/// A sight line to the object, if one is found, and the object's triangles as they are published, in world space.
async fn look(
    data: &DataFolder,
    name: &SceneName,
    (in_cell, about): (CellId, ObjectId),
    eyes: u64,
) -> anyhow::Result<(Option<SightLine>, Vec<[DVec3; 3]>)> {
    let published = load::published(data, name, Some(in_cell)).await?;
    let looking = tokio::task::spawn_blocking(move || {
        let mut cells = published.cells.iter();
        let line = cells.find_map(|cell| sight_line(&published.scene, cell, about.0, eyes, SIZE_PX));
        (line, published.scene.triangles_of(about.0 as usize))
    });
    Ok(looking.await?)
}

/// What hides an object, of which these triangles are known, or only the box around it.
async fn hidden(
    scene: &Opened,
    (cell, record): (&CellEntry, &CellRecord),
    about: ObjectId,
    triangles: Vec<[DVec3; 3]>,
) -> anyhow::Result<Option<Vec<Reason>>> {
    let blockers = scene.reader.blockers().await?;
    let blockers = blockers.context("the scene was baked without occluders: bake it again")?;
    let eye = blockers.region_of((&cell.bounds, &cell.planes), &record.hull);
    let found = tokio::task::spawn_blocking(move || blockers.hiding(&eye, about, &triangles)).await?;
    let Some(found) = found else {
        return Ok(None);
    };
    let mut reasons = Vec::new();
    for hiding in found {
        let source_node = match &hiding {
            Hiding::Body { object: by, .. } => Some(object(scene, *by).await?.source_node),
            Hiding::Walls { .. } | Hiding::Bodies => None,
        };
        reasons.push(Reason { hiding, source_node });
    }
    Ok(Some(reasons))
}

impl Explained {
    fn text(&self, places: Places) -> String {
        let mut lines = vec![match &self.listed {
            Some(visible) => {
                let doors: Vec<_> = visible.doors.iter().map(ToString::to_string).collect();
                let doors = if doors.is_empty() {
                    String::new()
                } else {
                    format!("; hidden when closed: {}", doors.join(" "))
                };
                format!(
                    "{} ({}) is in the set of {}: fraction {:.4}, solid angle {:.2e} sr{doors}",
                    self.object, self.source_node, self.cell, visible.fraction, visible.solid_angle_sr
                )
            }
            None => format!(
                "{} ({}) is not in the set of {}",
                self.object, self.source_node, self.cell
            ),
        }];
        match (&self.sight_line, &self.hidden) {
            (Some(line), reasons) => {
                lines.push(format!(
                    "{}seen from {} ({}) at {}",
                    if self.listed.is_some() { "" } else { "missing: it is " },
                    places.point(line.eye),
                    line.place,
                    places.point(line.point)
                ));
                let reasons = reasons.iter().flatten();
                lines.extend(reasons.map(|reason| format!("yet it is proved hidden {}", reason.text(places))));
            }
            (None, Some(reasons)) => {
                let all = match reasons.len() {
                    1 => "from all of the cell",
                    _ => "from one part of the cell or another",
                };
                lines.extend(
                    reasons
                        .iter()
                        .map(|reason| format!("hidden {all} {}", reason.text(places))),
                );
            }
            (None, None) => {
                let why = match (&self.listed, self.guarantee) {
                    (Some(_), Guarantee::Conservative) => "; so the record, which is conservative, lists it",
                    (None, Guarantee::Conservative) => {
                        "; the bake, which knows the cell and the source to more digits, proved it"
                    }
                    (None, Guarantee::Sampled) => "; rays did not see it either, and the record is sampled",
                    _ => "",
                };
                lines.push(format!(
                    "not seen by {} eyes nor along {AIMED} aimed lines, and not proved hidden{why}",
                    self.eyes
                ));
            }
        }
        lines.join("\n")
    }
}

impl Reason {
    fn text(&self, places: Places) -> String {
        match &self.hiding {
            Hiding::Body { object, bounds } => {
                let node = self.source_node.as_deref().unwrap_or_default();
                format!("by a body inside {object} ({node}), {}", places.span(bounds))
            }
            Hiding::Walls { walls } => {
                let walls: Vec<_> = walls.iter().map(|wall| plane(wall, places)).collect();
                format!("by walls: {}", walls.join("; then "))
            }
            Hiding::Bodies => "by bodies of several nearer objects together".to_owned(),
        }
    }
}

fn plane(wall: &Plane, places: Places) -> String {
    format!(
        "the plane with normal {} at {} m, {}",
        direction(wall.normal.map(f64::from)),
        places.length(wall.offset_m),
        places.span(&wall.bounds)
    )
}
