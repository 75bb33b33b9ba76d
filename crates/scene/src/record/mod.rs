//! What is visible from one view cell?
//!
//! A [`CellRecord`] travels in two forms: compact binary ([`CellRecord::encode`], extension `.cell`) for clients of
//! ours and JSON for everybody else. Who stands in a cell learns what its neighbours see from its [`Steps`] (extension
//! `.steps`): each says what changes on the way to one of them. `docs/FORMAT.md` gives the bytes.

mod binary;
mod coded;
mod geometry;
mod range;
mod rounding;
mod steps;
#[cfg(test)]
mod tests;
mod text;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use self::{binary::DecodeError, steps::Steps};
use crate::{BlobName, CellId, ObjectId, convex::HalfSpace, index::CellEntry};

/// Everything that a record says of one cell. Ids are those of its revision.
#[derive(Debug, Clone, PartialEq)]
pub struct CellRecord {
    /// The cell.
    pub cell: CellId,
    /// Its convex hull.
    pub hull: Hull,
    /// Cells that share an opening with it, rising.
    pub adjacent: Vec<CellId>,
    /// The openings.
    pub portals: Vec<Portal>,
    /// Cells that can be seen into from here, rising, without the cell itself. Movers in any other cell are hidden.
    pub cpvs: Vec<CellId>,
    /// Objects that can be seen and do not lie wholly inside the cell, largest visible solid angle first.
    pub opvs: Vec<Visible>,
    /// Objects that can be seen and lie wholly inside the cell, largest visible solid angle first.
    pub lpvs: Vec<Visible>,
    /// How the sets were computed.
    pub method: String,
    /// Whether they may miss something.
    pub guarantee: Guarantee,
    /// Estimated chance that a sight line from the cell ends on an object that is missing; 0 when conservative.
    pub miss_bound: f64,
    /// Bytes of the level 0 of everything visible, each model once, with textures.
    pub visible_level0_bytes: u64,
    /// Bytes of the coarsest level of everything visible, each model once, with textures.
    pub visible_coarsest_bytes: u64,
}

/// A convex polyhedron in world space, metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hull {
    /// Corners.
    pub points: Vec<[f64; 3]>,
    /// Each face as indices into `points`, counter-clockwise seen from outside.
    pub faces: Vec<Vec<u32>>,
}

impl Hull {
    /// The hull of a box.
    #[must_use]
    pub fn of_box(bounds: &crate::Bounds) -> Self {
        let faces = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        Self {
            points: bounds.corners().to_vec(),
            faces: faces.map(Vec::from).to_vec(),
        }
    }
}

/// An opening between two cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Portal {
    /// The cell on the other side.
    pub to: CellId,
    /// A convex polygon in world space, metres.
    pub polygon: Vec<[f64; 3]>,
    /// The door that closes it.
    pub door: Option<ObjectId>,
}

/// An object that can be seen from somewhere in the cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visible {
    /// The object.
    pub object: ObjectId,
    /// The share of sight lines from the cell to the object that arrive, in (0, 1].
    pub fraction: f32,
    /// What is visible of it fills this solid angle on average over all eyes in the cell, in steradians, in (0, 4π].
    pub solid_angle_sr: f32,
    /// Doors that hide it when they are closed.
    pub doors: Vec<ObjectId>,
}

impl Visible {
    /// Whether one of these doors hides it when they are closed.
    #[must_use]
    pub fn is_hidden_by(&self, closed: &[ObjectId]) -> bool {
        self.doors.iter().any(|door| closed.contains(door))
    }
}

/// Whether a visible set may miss something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Guarantee {
    /// Never misses anything.
    Conservative,
    /// May miss with at most the stated estimate.
    Sampled,
}

impl CellRecord {
    /// Objects of both sets, largest visible solid angle first: the order in which a client fetches them.
    #[must_use]
    pub fn visible(&self) -> Vec<&Visible> {
        let mut all: Vec<_> = self.lpvs.iter().chain(&self.opvs).collect();
        all.sort_by(|a, b| {
            b.solid_angle_sr
                .total_cmp(&a.solid_angle_sr)
                .then(a.object.cmp(&b.object))
        });
        all
    }
}

/// The JSON twin of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellJson {
    /// The cell.
    pub cell: CellId,
    /// Its convex hull.
    pub hull: Hull,
    /// Cells that share an opening with it.
    pub adjacent: Vec<CellId>,
    /// The openings.
    pub portals: Vec<Portal>,
    /// Cells that can be seen into from here.
    pub cpvs: Vec<CellId>,
    /// Visible objects that do not lie wholly inside the cell.
    pub opvs: Vec<Visible>,
    /// Visible objects that lie wholly inside the cell.
    pub lpvs: Vec<Visible>,
    /// How the sets were computed.
    pub method: String,
    /// Whether they may miss something.
    pub guarantee: Guarantee,
    /// Estimated chance that a sight line ends on a missing object.
    pub miss_bound: f64,
    /// Sizes.
    pub bytes: CellBytes,
}

/// Sizes that a client can plan with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellBytes {
    /// The binary record.
    pub record: u64,
    /// The step from each adjacent cell.
    pub delta: BTreeMap<CellId, u64>,
    /// What coming from each adjacent cell downloads: the step, and the coarsest level of everything that was not
    /// visible there, each model and texture once.
    pub crossing: BTreeMap<CellId, u64>,
    /// Level 0 of everything visible, each model and texture once.
    pub visible_level0: u64,
    /// The coarsest level of everything visible, each model and texture once.
    pub visible_coarsest: u64,
}

/// What it costs to come into a cell from an adjacent one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crossing {
    /// The cell that one comes from.
    pub from: CellId,
    /// The step.
    pub step_bytes: u64,
    /// The coarsest level of everything that was not visible there, each model and texture once.
    pub model_bytes: u64,
}

impl From<&CellJson> for CellRecord {
    fn from(json: &CellJson) -> Self {
        Self {
            cell: json.cell,
            hull: json.hull.clone(),
            adjacent: json.adjacent.clone(),
            portals: json.portals.clone(),
            cpvs: json.cpvs.clone(),
            opvs: json.opvs.clone(),
            lpvs: json.lpvs.clone(),
            method: json.method.clone(),
            guarantee: json.guarantee,
            miss_bound: json.miss_bound,
            visible_level0_bytes: json.bytes.visible_level0,
            visible_coarsest_bytes: json.bytes.visible_coarsest,
        }
    }
}

impl CellJson {
    /// The twin of a record whose binary form has `record_bytes` bytes. Solid angles, fractions and the miss bound are
    /// those of the binary form.
    #[must_use]
    pub fn of(record: &CellRecord, record_bytes: u64, crossings: &[Crossing]) -> Self {
        let record = record.rounded();
        let from = |bytes: fn(&Crossing) -> u64| crossings.iter().map(|c| (c.from, bytes(c))).collect();
        Self {
            bytes: CellBytes {
                record: record_bytes,
                delta: from(|c| c.step_bytes),
                crossing: from(|c| c.step_bytes + c.model_bytes),
                visible_level0: record.visible_level0_bytes,
                visible_coarsest: record.visible_coarsest_bytes,
            },
            cell: record.cell,
            hull: record.hull,
            adjacent: record.adjacent,
            portals: record.portals,
            cpvs: record.cpvs,
            opvs: record.opvs,
            lpvs: record.lpvs,
            method: record.method,
            guarantee: record.guarantee,
            miss_bound: record.miss_bound,
        }
    }
}

/// What the index says of a record that was written; `planes` are those of a cell that is not a box.
#[must_use]
pub fn index_entry(
    record: &CellRecord,
    planes: &[HalfSpace],
    binary: (BlobName, u64),
    steps: Option<(BlobName, u64)>,
    json: BlobName,
) -> CellEntry {
    let (steps, steps_bytes) = steps.unzip();
    CellEntry {
        cell: record.cell,
        bounds: crate::Bounds::around(record.hull.points.iter().copied()),
        planes: planes.to_vec(),
        adjacent: record.adjacent.clone(),
        record: binary.0,
        record_bytes: binary.1,
        steps,
        steps_bytes,
        record_json: json,
    }
}
