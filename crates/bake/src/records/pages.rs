//! How do cells, objects and populations become findable? Builds the index trees of `belvedere_scene::index`.

use belvedere_scene::{
    BlobName, Bounds,
    index::{PAGE_ENTRIES, Page, PageEntry, PageKind},
};
use rayon::prelude::*;

use super::sink::{Ledger, SinkError};

/// A tree that was written.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// Its root, which stands in the manifest.
    pub(super) root: Page,
    /// All of its chunks, with rising ids.
    chunks: Vec<PageEntry>,
}

impl Tree {
    /// The chunk that holds an id.
    pub(super) fn chunk_of(&self, id: u32) -> Option<&PageEntry> {
        let after = self.chunks.partition_point(|chunk| chunk.first <= id);
        self.chunks[..after].last()
    }
}

/// Writes rows of neighbours as chunks of so many and pages above them until one page holds all. `put` stores a row, `bounds` is the box of one entry; ids are positions in `rows`.
pub(super) fn write_tree<T: Sync>(
    rows: &[T],
    chunk_entries: usize,
    bounds: impl Fn(&T) -> Bounds + Sync,
    put: impl Fn(&[T]) -> Result<(BlobName, u64), SinkError> + Sync,
    ledger: &Ledger<'_>,
) -> Result<Tree, SinkError> {
    let chunks = rows.par_chunks(chunk_entries).enumerate().map(|(i, row)| {
        let around = row.iter().fold(Bounds::EMPTY, |all, entry| all.union(&bounds(entry)));
        let first = (i * chunk_entries) as u32;
        let ids = first..first + row.len() as u32;
        Ok(entry(PageKind::Chunk, put(row)?, ids, around))
    });
    let chunks = chunks.collect::<Result<Vec<_>, SinkError>>()?;
    let mut entries = chunks.clone();
    while entries.len() > PAGE_ENTRIES {
        let mut above = Vec::new();
        for children in entries.chunks(PAGE_ENTRIES) {
            let around = children
                .iter()
                .fold(Bounds::EMPTY, |all, child| all.union(&child.bounds));
            let (first, last) = (&children[0], &children[children.len() - 1]);
            let ids = first.first..last.first + last.count;
            above.push(entry(
                PageKind::Page,
                ledger.put_json(&Page {
                    entries: children.to_vec(),
                })?,
                ids,
                around,
            ));
        }
        entries = above;
    }
    Ok(Tree {
        root: Page { entries },
        chunks,
    })
}

fn entry(kind: PageKind, (url, bytes): (BlobName, u64), ids: std::ops::Range<u32>, bounds: Bounds) -> PageEntry {
    PageEntry {
        kind,
        url,
        bytes,
        first: ids.start,
        count: ids.end - ids.start,
        bounds,
    }
}
