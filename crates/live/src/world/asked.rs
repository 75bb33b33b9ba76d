//! Which question is next? The newest, and none twice.

use std::collections::BTreeMap;

use belvedere_scene::CellId;

/// Cells that are asked about.
#[derive(Debug, Default)]
pub(super) struct Asked {
    count: u64,
    /// By when they were asked about last.
    cells: BTreeMap<u64, CellId>,
    when: BTreeMap<CellId, u64>,
}

impl Asked {
    pub(super) fn ask(&mut self, cell: CellId) {
        self.count += 1;
        if let Some(before) = self.when.insert(cell, self.count) {
            self.cells.remove(&before);
        }
        self.cells.insert(self.count, cell);
    }

    pub(super) fn next(&mut self) -> Option<CellId> {
        let (_, cell) = self.cells.pop_last()?;
        self.when.remove(&cell);
        Some(cell)
    }

    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_question_comes_first_and_once() {
        let mut asked = Asked::default();
        [1, 2, 3, 2].map(CellId).into_iter().for_each(|cell| asked.ask(cell));
        let all: Vec<_> = std::iter::from_fn(|| asked.next()).collect();
        assert_eq!(all, [2, 3, 1].map(CellId));
    }
}
