//! What does one need to know first who begins in a cell? The cell and those around it, what can be seen from them and what there
//! is of that, in one document: an immutable object (`.json`).
//!
//! The index says the same in chunks, most of which tell of what cannot be seen from there. Who walks on reads these sooner or
//! later; who begins waits for each byte of them, and is around the next corner before long. So the cells of [viewpoints](crate::pointer::Viewpoint) have a start.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{
    BlobName, Bounds, CellId, ModelId,
    index::CellEntry,
    object::{Model, ObjectEntry},
};

/// A manifest names no more starts.
pub const MOST_STARTS: usize = 16;

/// Cells reach so many steps from the one in which one begins: doorways are cells, too.
pub const STEPS_AROUND: usize = 2;

/// What the index knows of a cell and of those around, of all that their records list, and of the models of that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Where one begins.
    pub start: CellId,
    /// That cell and those up to [`STEPS_AROUND`] steps away, with rising ids.
    pub cells: Vec<CellEntry>,
    /// Every object that can be seen from any of them, with rising ids.
    pub objects: Vec<ObjectEntry>,
    /// Every model that they use.
    pub models: BTreeMap<ModelId, Model>,
}

impl Start {
    /// The cell in which one begins.
    #[must_use]
    pub fn cell(&self) -> Option<&CellEntry> {
        self.cells.iter().find(|entry| entry.cell == self.start)
    }
}

/// Where a start is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartRef {
    /// The cell in which one begins.
    pub cell: CellId,
    /// The box around its hull.
    pub bounds: Bounds,
    /// A [`Start`].
    pub url: BlobName,
    /// Its size. It is never larger than the chunks that say the same.
    pub bytes: u64,
    /// Bytes of what who grows rules would read instead: [populations](crate::population), and chunks for what these leave out.
    pub grown_bytes: u64,
}

impl StartRef {
    /// Whether it is worth reading instead of the index, for who grows rules or does not. All of these documents are compressed
    /// to about the same share.
    #[must_use]
    pub fn is_worth(&self, grows: bool) -> bool {
        !grows || self.bytes <= self.grown_bytes
    }
}
