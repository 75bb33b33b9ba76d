//! What does a bake say that it did? People read it, `--json` prints it, and the catalogue keeps it for `inspect`.

use std::collections::BTreeMap;

use belvedere_bake::{defect::Defect, growable::Growable, records::Written};
use belvedere_scene::{
    SceneName,
    manifest::{PackSummary, RecordSizes},
};
use serde::{Deserialize, Serialize};

use crate::progress::BakeProgress;

/// What a bake did; `bake --json` prints it and the catalogue keeps it for `inspect`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Report {
    pub(crate) scene: SceneName,
    pub(crate) revision: belvedere_scene::Revision,
    pub(crate) cells: u32,
    pub(crate) objects: u32,
    pub(crate) models: u32,
    pub(crate) triangles: u64,
    pub(crate) visibility: VisibilityReport,
    /// What the binary records and the steps between adjacent cells cost.
    pub(crate) records: RecordsReport,
    /// What it costs to enter a cell.
    #[serde(default)]
    pub(crate) packs: PackSummary,
    /// Which of its models clients can grow from rules.
    #[serde(default)]
    pub(crate) growable: Growable,
    /// Whether the manifest lists every object because the world is small.
    pub(crate) whole: bool,
    pub(crate) bytes: BTreeMap<String, u64>,
    pub(crate) seconds: BTreeMap<String, f64>,
    pub(crate) defects: Vec<DefectReport>,
    /// What else one should know of this bake.
    #[serde(default)]
    pub(crate) notes: Vec<String>,
    /// Whether nothing had to be baked because the source had not changed.
    #[serde(default)]
    pub(crate) unchanged: bool,
}

impl Report {
    /// What is told of a bake that was written.
    pub(super) fn of(scene: &SceneName, written: &Written, defects: Vec<Defect>, progress: &BakeProgress) -> Self {
        let manifest = &written.manifest;
        let mean_visible = manifest.visibility.mean_visible;
        let seconds = progress.seconds();
        let counts = &manifest.counts;
        Self {
            scene: scene.clone(),
            revision: written.revision(),
            cells: counts.cells,
            objects: counts.objects,
            models: counts.models,
            triangles: counts.triangles,
            visibility: VisibilityReport {
                method: manifest.visibility.method.clone(),
                guarantee: manifest.visibility.guarantee,
                mean_visible,
                mean_seen: manifest.visibility.mean_seen,
                mean_not_hidden: manifest.visibility.mean_not_hidden,
                reason: manifest.visibility.reason.clone(),
                mean_culled: 1.0 - mean_visible / f64::from(counts.objects.max(1)),
                remembered_cells: written.remembered_cells,
            },
            records: manifest.records.into(),
            packs: manifest.packs,
            growable: written.growable.clone(),
            whole: manifest.whole.is_some(),
            bytes: manifest.bytes.clone(),
            seconds,
            defects: defects.into_iter().map(DefectReport::from).collect(),
            notes: Vec::new(),
            unchanged: false,
        }
    }
}

/// How the visible sets came about and how much they cull.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct VisibilityReport {
    pub(crate) method: String,
    pub(crate) guarantee: belvedere_scene::record::Guarantee,
    /// Mean number of objects visible from a cell.
    pub(crate) mean_visible: f64,
    /// Mean number of objects that rays have seen from a cell: a lower bound of the truth.
    pub(crate) mean_seen: f64,
    /// Mean number of objects that cannot be proved hidden from a cell: an upper bound of the truth; null when nobody
    /// asked.
    pub(crate) mean_not_hidden: Option<f64>,
    /// Why this method.
    pub(crate) reason: String,
    /// Mean share of objects that are hidden from a cell, 0 to 1.
    pub(crate) mean_culled: f64,
    /// Cells from which nothing had to be looked at again, because a bake before had and nothing has changed for them.
    #[serde(default)]
    pub(crate) remembered_cells: u32,
}

/// Mean sizes of cell records and steps, in bytes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RecordsReport {
    /// A binary record.
    pub(crate) mean_record: f64,
    /// What of it says which objects are visible.
    pub(crate) mean_record_set: f64,
    /// What that would be if objects inside a cell were known from its record to the cells that see into it.
    pub(crate) mean_hybrid_set: f64,
    /// A step to an adjacent cell.
    pub(crate) mean_step: f64,
    /// What of it says which objects appear and vanish.
    pub(crate) mean_step_set: f64,
}

impl From<RecordSizes> for RecordsReport {
    fn from(sizes: RecordSizes) -> Self {
        let [mean_record, mean_record_set, mean_step, mean_step_set] = sizes.means();
        Self {
            mean_record,
            mean_record_set,
            mean_hybrid_set: sizes.hybrid_set_bytes as f64 / sizes.records.max(1) as f64,
            mean_step,
            mean_step_set,
        }
    }
}

/// One kind of defect of the source.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct DefectReport {
    pub(crate) kind: String,
    pub(crate) count: u64,
    pub(crate) first: String,
    /// Further places, of kinds of which all are named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) others: Vec<String>,
}

impl From<Defect> for DefectReport {
    fn from(defect: Defect) -> Self {
        Self {
            kind: defect.kind.to_owned(),
            count: defect.count,
            first: defect.first,
            others: defect.others,
        }
    }
}
