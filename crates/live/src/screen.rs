//! What do closed doors leave of what a cell sees? All that was ever proved of it is kept: a proof names the doors that it takes,
//! and holds whenever these are closed, so a door that closes again hides at once.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::Arc,
};

use belvedere_scene::{CellId, ObjectId};

use crate::cells::Hidden;

/// When more sets of doors than this hide something from a cell, only the last answer is kept.
const SETS: usize = 64;
/// So many answers are remembered to have been complete.
const ANSWERS: usize = 16;

/// What is known to be hidden from a cell.
#[derive(Debug, Clone, Default)]
pub(crate) struct Screen {
    /// What a set of doors, rising, hides while all in it are closed, rising.
    behind: BTreeMap<Vec<ObjectId>, Vec<CellId>>,
    /// While just these doors were closed all was proved that could be, the last one last.
    answered: VecDeque<Vec<ObjectId>>,
    /// What is seen now.
    leaves: Arc<[CellId]>,
}

impl Screen {
    /// Takes note of all that can be proved while these doors, rising, are closed.
    pub(crate) fn learn<'a>(&mut self, closed: &[ObjectId], hidden: impl Iterator<Item = &'a Hidden>) {
        let mut behind: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for Hidden { cell, behind: sets } in hidden {
            for doors in sets {
                let mut doors = doors.clone();
                doors.sort_unstable();
                behind.entry(doors).or_default().push(*cell);
            }
        }
        let new = behind.keys().filter(|doors| !self.behind.contains_key(*doors)).count();
        if self.behind.len() + new > SETS {
            self.behind.clear();
            self.answered.clear();
        }
        for (doors, cells) in behind {
            let known = self.behind.entry(doors).or_default();
            known.extend(cells);
            known.sort_unstable();
            known.dedup();
        }
        self.answered.retain(|answered| answered != closed);
        if self.answered.len() == ANSWERS {
            self.answered.pop_front();
        }
        self.answered.push_back(closed.to_vec());
    }

    /// Whether all is known that these closed doors, rising, hide: what more of them hid is all that these could.
    pub(crate) fn knows(&self, closed: &[ObjectId]) -> bool {
        if self.answered.iter().any(|all| all == closed) {
            return true;
        }
        let holds = |all: &[ObjectId]| closed.iter().all(|door| all.binary_search(door).is_ok());
        let hidden = |closed: &[ObjectId]| self.hidden(|door| closed.binary_search(&door).is_ok());
        let ours = hidden(closed);
        self.answered.iter().any(|all| holds(all) && hidden(all) == ours)
    }

    /// Whether it hides anything behind a door.
    pub(crate) fn takes(&self, door: ObjectId) -> bool {
        self.behind.keys().any(|doors| doors.binary_search(&door).is_ok())
    }

    /// Finds what closed doors leave of what the cell sees; whether that is something else than before.
    pub(crate) fn leave(&mut self, sees: &[CellId], closed: &BTreeSet<ObjectId>) -> bool {
        let hidden = self.hidden(|door| closed.contains(&door));
        let left = sees.iter().filter(|other| hidden.binary_search(other).is_err());
        let leaves: Arc<[CellId]> = left.copied().collect();
        let differs = leaves != self.leaves;
        self.leaves = leaves;
        differs
    }

    /// What it takes, about, whatever of it is seen now.
    pub(crate) fn bytes(&self) -> usize {
        /// What stands around a list in a tree.
        const AROUND: usize = 64;
        let lists = self
            .behind
            .iter()
            .map(|(doors, cells)| 2 * AROUND + 4 * (doors.len() + cells.len()));
        let answered = self.answered.iter().map(|doors| AROUND + 4 * doors.len());
        size_of::<Self>() + lists.sum::<usize>() + answered.sum::<usize>() + size_of_val(&*self.leaves)
    }

    /// What is seen now.
    pub(crate) fn leaves(&self) -> &Arc<[CellId]> {
        &self.leaves
    }

    /// What cannot be seen while such doors are closed, rising.
    fn hidden(&self, is_closed: impl Fn(ObjectId) -> bool) -> Vec<CellId> {
        let counts = |doors: &[ObjectId]| doors.iter().all(|door| is_closed(*door));
        let behind = self.behind.iter().filter(|(doors, _)| counts(doors));
        let mut hidden: Vec<_> = behind.flat_map(|(_, cells)| cells).copied().collect();
        hidden.sort_unstable();
        hidden.dedup();
        hidden
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_bounded_and_what_it_claims_to_know_it_hides() {
        let mut screen = Screen::default();
        let sees = [CellId(1), CellId(2)];
        for door in (0..3 * SETS as u32).map(ObjectId) {
            let hidden = Hidden {
                cell: CellId(2),
                behind: vec![vec![door]],
            };
            screen.learn(&[door], [&hidden].into_iter());
            for known in (0..=door.0).map(ObjectId) {
                screen.leave(&sees, &BTreeSet::from([known]));
                assert!(!screen.knows(&[known]) || **screen.leaves() == [CellId(1)]);
            }
            assert!(screen.knows(&[door]));
            assert!(screen.behind.len() <= SETS && screen.answered.len() <= ANSWERS);
        }
    }
}
