//! What belongs to one revision? The immutable entry document.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{BlobName, Bounds, index::Page, object::Whole, pointer::Viewpoint, start::StartRef};

/// The version of the published format that this build writes and reads.
pub const FORMAT: u32 = 4;

/// The immutable entry of a revision (`/o/{hash}.json`). It stays small however large the world is: the two roots
/// hold at most [`crate::index::PAGE_ENTRIES`] entries each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: u32,
    /// The scene's name for people.
    pub title: String,
    /// The box around its objects, metres.
    pub bounds: Bounds,
    /// Always `+Y`.
    pub up: String,
    /// Always `m`.
    pub unit: String,
    /// How many view cells, objects and models there are, and triangles at level 0.
    pub counts: Counts,
    /// Sizes by name, as in the pointer.
    pub bytes: BTreeMap<String, u64>,
    /// Where one may start; at least one.
    pub viewpoints: Vec<Viewpoint>,
    /// How the sets were computed.
    pub visibility: VisibilitySummary,
    /// What hides, for questions about places that are no view cells; none when nobody can ask.
    pub occluders: Option<OccludersRef>,
    /// Where leaves hide a share of what is behind them; none where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foliage: Option<FoliageRef>,
    /// What records and steps cost.
    pub records: RecordSizes,
    /// What entering a cell costs with packs.
    #[serde(default)]
    pub packs: PackSummary,
    /// Root of the tree that finds cells by place; leads to [`crate::index::CellChunk`]s.
    pub cells: Page,
    /// Root of the tree that finds objects by id; leads to [`ObjectChunk`](crate::object::ObjectChunk)s.
    pub objects: Page,
    /// Root of the tree that finds models by id; leads to [`ModelChunk`](crate::object::ModelChunk)s.
    pub models: Page,
    /// Root of the tree that finds [populations](crate::population) by id of their members; none when nothing can be grown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub populations: Option<Page>,
    /// What who begins in the cell of a viewpoint needs to know first; none in a small world. At most
    /// [`MOST_STARTS`](crate::start::MOST_STARTS), with rising cells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<StartRef>,
    /// A small world loses with cells: below a size that the bake decides, every object is listed here and clients
    /// load them all.
    pub whole: Option<Whole>,
}

/// Where the occluders of a revision are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OccludersRef {
    /// An object with extension `.occ`.
    pub url: BlobName,
    /// Its size.
    pub bytes: u64,
}

/// Where the foliage of a revision is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoliageRef {
    /// A [`Foliage`](crate::foliage::Foliage).
    pub url: BlobName,
    /// Its size.
    pub bytes: u64,
}

/// The packs of a revision, and what it costs to enter a cell and fetch the coarsest level of all that it sees, pictures
/// apart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PackSummary {
    /// How many packs there are.
    pub packs: u32,
    /// How many GLBs are in one.
    pub files: u32,
    /// Bytes of all packs.
    pub bytes: u64,
    /// Packs, and GLBs that are in none, that a cell needs which was entered with nothing in hand: the mean over all cells.
    pub requests_per_cell: f64,
    /// The share of these bytes that are of models which the cell does not see, over all cells.
    pub wasted_share: f64,
    /// The same for who comes from an adjacent cell and holds what that needs: the mean over all ways from cell to cell.
    pub requests_per_crossing: f64,
}

/// How many things a revision has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// View cells.
    pub cells: u32,
    /// Placed objects.
    pub objects: u32,
    /// Unique geometries.
    pub models: u32,
    /// Triangles drawn when every object stands at level 0.
    pub triangles: u64,
}

/// How the visible sets of a revision were computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VisibilitySummary {
    /// `sampled`, `occluders`, `portals` or `conservative` (the intersection of the two before).
    pub method: String,
    /// Whether a set may miss something.
    pub guarantee: crate::record::Guarantee,
    /// Mean number of objects in a cell's set.
    pub mean_visible: f64,
    /// Mean number of objects that rays from a cell have seen: a lower bound of the truth.
    pub mean_seen: f64,
    /// Mean number of objects that cannot be proved hidden from a cell: an upper bound of the truth; `None` when nobody
    /// asked.
    pub mean_not_hidden: Option<f64>,
    /// Why this method, for people.
    pub reason: String,
}

/// Totals over the binary records of a revision and the steps between adjacent cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordSizes {
    /// How many records there are: one for each cell.
    pub records: u64,
    /// Bytes of all records.
    pub record_bytes: u64,
    /// Those of them that say which objects are visible.
    pub record_set_bytes: u64,
    /// What these would be if an object that lies wholly inside one cell were known from that cell's record to every
    /// cell that sees into it (the hybrid relation of Marvie and Bouatouch). Who enters a cell would have to fetch the
    /// records of all cells that it sees into first.
    pub hybrid_set_bytes: u64,
    /// How many steps there are: one for each ordered pair of adjacent cells.
    pub steps: u64,
    /// Bytes of all steps, without the headers of the objects that hold them.
    pub step_bytes: u64,
    /// Those of them that say which objects appear and vanish.
    pub step_set_bytes: u64,
}

impl std::iter::Sum for RecordSizes {
    fn sum<I: Iterator<Item = Self>>(sizes: I) -> Self {
        sizes.fold(Self::default(), |all, one| Self {
            records: all.records + one.records,
            record_bytes: all.record_bytes + one.record_bytes,
            record_set_bytes: all.record_set_bytes + one.record_set_bytes,
            hybrid_set_bytes: all.hybrid_set_bytes + one.hybrid_set_bytes,
            steps: all.steps + one.steps,
            step_bytes: all.step_bytes + one.step_bytes,
            step_set_bytes: all.step_set_bytes + one.step_set_bytes,
        })
    }
}

impl RecordSizes {
    /// Means in bytes: of a record, of its set, of a step, of its set.
    #[must_use]
    pub fn means(&self) -> [f64; 4] {
        let mean = |bytes: u64, count: u64| bytes as f64 / count.max(1) as f64;
        [
            mean(self.record_bytes, self.records),
            mean(self.record_set_bytes, self.records),
            mean(self.step_bytes, self.steps),
            mean(self.step_set_bytes, self.steps),
        ]
    }
}
