//! How does a client find a cell or an object without reading the whole world?
//!
//! Through a tree of small immutable pages. Leaves are chunks: [`CellChunk`] (found by place),
//! [`crate::object::ObjectChunk`], [`crate::object::ModelChunk`] or a [population](crate::population) (found by id). Trees are built in an order that keeps neighbours together, so
//! boxes of entries are tight, and ids are dense and rising from left to right.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::{
    BlobName, Bounds, CellId,
    convex::{self, HalfSpace},
};

/// The largest number of entries of one page.
pub const PAGE_ENTRIES: usize = 64;
/// The largest number of cells or objects of one chunk.
pub const CHUNK_ENTRIES: usize = 64;
/// The largest number of models of one chunk: one takes ten times what an object does.
pub const CHUNK_MODELS: usize = 16;

/// One page of an index tree. The root stands in the manifest; the others are immutable objects (`.json`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Page {
    /// At most [`PAGE_ENTRIES`], with rising ids.
    pub entries: Vec<PageEntry>,
}

/// What a page knows of one child.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PageEntry {
    /// Whether the child is another page or a chunk.
    pub kind: PageKind,
    /// The child.
    pub url: BlobName,
    /// Its size in bytes, without content encoding.
    pub bytes: u64,
    /// The first id below it.
    pub first: u32,
    /// How many ids lie below it.
    pub count: u32,
    /// The box around everything below it; around all objects of models.
    pub bounds: Bounds,
}

/// What an entry of a page leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PageKind {
    /// Another [`Page`].
    Page,
    /// A [`CellChunk`], an [`ObjectChunk`](crate::object::ObjectChunk), a [`ModelChunk`](crate::object::ModelChunk) or a
    /// [population](crate::population).
    Chunk,
}

impl Page {
    /// The entry below which an id lies.
    #[must_use]
    pub fn entry_of(&self, id: u32) -> Option<&PageEntry> {
        let after = self.entries.partition_point(|entry| entry.first <= id);
        self.entries[..after]
            .last()
            .filter(|entry| id - entry.first < entry.count)
    }

    /// The entries whose boxes meet `bounds`.
    pub fn intersecting<'a>(&'a self, bounds: &'a Bounds) -> impl Iterator<Item = &'a PageEntry> {
        self.entries.iter().filter(|entry| entry.bounds.intersects(bounds))
    }
}

/// A run of cells with what is needed to choose one: an immutable object (`.json`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CellChunk {
    /// Cells with rising ids, without gaps.
    pub cells: Vec<CellEntry>,
}

/// What the index knows of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellEntry {
    /// Its id in this revision.
    pub cell: CellId,
    /// The box around its hull.
    pub bounds: Bounds,
    /// The half-spaces that together with the box are the cell, see [`convex`]; none when the cell is its box.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planes: Vec<HalfSpace>,
    /// Cells that one can step into from here.
    pub adjacent: Vec<CellId>,
    /// Its binary record (`.cell`).
    pub record: BlobName,
    /// Size of the binary record.
    pub record_bytes: u64,
    /// What changes on the way to each adjacent cell (`.steps`); absent when there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<BlobName>,
    /// Its size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps_bytes: Option<u64>,
    /// The same record as JSON.
    pub record_json: BlobName,
}

impl CellEntry {
    /// Zero when the point lies in the cell or on its surface, else how far away it is, see [`convex::distance_m`].
    #[must_use]
    pub fn distance_m(&self, point: [f64; 3]) -> f64 {
        convex::distance_m(&self.bounds, &self.planes, point)
    }

    /// Whether the point lies so deep in the cell that no other holds it.
    #[must_use]
    pub fn holds_alone(&self, point: [f64; 3]) -> bool {
        convex::holds_alone(&self.bounds, &self.planes, point)
    }
}

/// The cell at a point, or the nearest one.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// What the index knows of it.
    pub cell: CellEntry,
    /// Zero when the cell contains the point.
    pub distance_m: f64,
}

/// Finds the cell at a point, best first, reading as few pages as possible. It does no I/O: it says which page or
/// chunk it needs next and is given it.
///
/// ```text
/// let mut search = CellSearch::new(&manifest.cells, point);
/// while let Some(entry) = search.wants() {
///     match entry.kind {
///         PageKind::Page => search.give_page(&fetch(entry)),
///         PageKind::Chunk => search.give_chunk(&fetch(entry)),
///     }
/// }
/// let located = search.finish();
/// ```
///
/// Where cells touch, the one with the lowest id wins, so that every client agrees on faces and corners.
#[derive(Debug)]
pub struct CellSearch {
    point: [f64; 3],
    /// Sorted by distance, nearest first.
    open: VecDeque<(f64, PageEntry)>,
    best: Option<Located>,
}

impl CellSearch {
    /// Starts at the root page.
    #[must_use]
    pub fn new(root: &Page, point: [f64; 3]) -> Self {
        let mut search = Self {
            point,
            open: VecDeque::new(),
            best: None,
        };
        search.add(root);
        search
    }

    /// What to read next, or `None` when the search is over.
    #[must_use]
    pub fn wants(&self) -> Option<PageEntry> {
        let (distance_m, entry) = self.open.front()?;
        let beaten = self
            .best
            .as_ref()
            .is_some_and(|best| match best.distance_m.total_cmp(distance_m) {
                std::cmp::Ordering::Less => true,
                // At equal distance a lower id may still wait in an earlier subtree.
                std::cmp::Ordering::Equal => best.cell.cell.0 < entry.first,
                std::cmp::Ordering::Greater => false,
            });
        (!beaten).then(|| entry.clone())
    }

    /// Answers [`CellSearch::wants`] with a page.
    pub fn give_page(&mut self, page: &Page) {
        self.open.pop_front();
        self.add(page);
    }

    /// Answers [`CellSearch::wants`] with a chunk.
    pub fn give_chunk(&mut self, chunk: &CellChunk) {
        self.open.pop_front();
        for cell in &chunk.cells {
            let distance_m = cell.distance_m(self.point);
            let better = self
                .best
                .as_ref()
                .is_none_or(|best| (distance_m, cell.cell) < (best.distance_m, best.cell.cell));
            if better {
                self.best = Some(Located {
                    cell: cell.clone(),
                    distance_m,
                });
            }
        }
    }

    /// Answers [`CellSearch::wants`] when it cannot be had: the search goes on without what is below it.
    pub fn lose(&mut self) {
        self.open.pop_front();
    }

    /// The answer; `None` only when no cell was found.
    #[must_use]
    pub fn finish(self) -> Option<Located> {
        self.best
    }

    fn add(&mut self, page: &Page) {
        for entry in &page.entries {
            let key = (entry.bounds.distance_m(self.point), entry.first);
            let at = self
                .open
                .partition_point(|(distance_m, other)| (*distance_m, other.first) < key);
            self.open.insert(at, (key.0, entry.clone()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(id: u32, min: [f64; 3], max: [f64; 3]) -> CellEntry {
        let name = BlobName::of(&id.to_le_bytes(), "cell").unwrap();
        CellEntry {
            cell: CellId(id),
            bounds: Bounds { min, max },
            planes: vec![],
            adjacent: vec![],
            record: name.clone(),
            record_bytes: 4,
            steps: None,
            steps_bytes: None,
            record_json: name,
        }
    }

    /// A row of unit cells along x, two to a chunk.
    fn row(cells: u32) -> (Page, Vec<CellChunk>) {
        let all: Vec<_> = (0..cells)
            .map(|i| cell(i, [f64::from(i), 0.0, 0.0], [f64::from(i + 1), 1.0, 1.0]))
            .collect();
        let chunks: Vec<_> = all.chunks(2).map(|cells| CellChunk { cells: cells.to_vec() }).collect();
        let entries = chunks
            .iter()
            .map(|chunk| PageEntry {
                kind: PageKind::Chunk,
                url: chunk.cells[0].record.clone(),
                bytes: 1,
                first: chunk.cells[0].cell.0,
                count: chunk.cells.len() as u32,
                bounds: chunk.cells.iter().fold(Bounds::EMPTY, |b, c| b.union(&c.bounds)),
            })
            .collect();
        (Page { entries }, chunks)
    }

    fn locate(point: [f64; 3]) -> (Located, usize) {
        let (root, chunks) = row(9);
        let mut search = CellSearch::new(&root, point);
        let mut reads = 0;
        while let Some(entry) = search.wants() {
            reads += 1;
            search.give_chunk(&chunks[entry.first as usize / 2]);
        }
        (search.finish().unwrap(), reads)
    }

    #[test]
    fn a_point_inside_a_cell_is_found_with_one_read() {
        let (located, reads) = locate([4.5, 0.5, 0.5]);
        assert_eq!((located.cell.cell, located.distance_m, reads), (CellId(4), 0.0, 1));
    }

    #[test]
    fn on_a_shared_face_the_lowest_id_wins() {
        for face in 1..9 {
            let (located, _) = locate([f64::from(face), 1.0, 0.0]);
            assert_eq!(located.cell.cell, CellId(face - 1));
        }
    }

    #[test]
    fn outside_the_nearest_cell_is_named_with_its_distance() {
        let (located, _) = locate([-3.0, 5.0, 0.5]);
        assert_eq!((located.cell.cell, located.distance_m), (CellId(0), 5.0));
    }

    #[test]
    fn an_id_finds_its_entry() {
        let (root, _) = row(9);
        assert_eq!(root.entry_of(5).unwrap().first, 4);
        assert_eq!(root.entry_of(8).unwrap().first, 8);
        assert!(root.entry_of(9).is_none());
    }
}
