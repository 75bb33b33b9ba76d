//! What do closed doors leave of what the cells of a scene see? A [`Screen`] for each cell from which that was asked, as long as all
//! of them together take no more than so much memory.
//!
//! Where there is no more room, those give way that nobody has looked by for longest; never one by which somebody looks now, for then
//! more would be seen than is so. Where that is not enough all stays as it was, and what is new is not kept. Without its screen a cell
//! sees what it sees while doors are open: more is told, never less, until somebody asks again.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::CellId;

use crate::screen::Screen;

/// Screens of one scene take no more, about.
pub(crate) const MOST_BYTES: usize = 64 << 20;

#[derive(Debug, Clone)]
pub(crate) struct Screens {
    kept: BTreeMap<CellId, Kept>,
    /// By when they were used last.
    by_use: BTreeMap<u64, CellId>,
    uses: u64,
    bytes: usize,
    most_bytes: usize,
}

#[derive(Debug, Clone, Default)]
struct Kept {
    screen: Screen,
    used: u64,
    bytes: usize,
}

impl Default for Screens {
    fn default() -> Self {
        Self {
            kept: BTreeMap::new(),
            by_use: BTreeMap::new(),
            uses: 0,
            bytes: 0,
            most_bytes: MOST_BYTES,
        }
    }
}

impl Screens {
    /// From now on they take no more than so many times what they take now.
    #[cfg(test)]
    pub(crate) fn limit(&mut self, of_now: f64) {
        self.most_bytes = (of_now * self.bytes as f64) as usize;
    }

    pub(crate) fn get(&self, cell: CellId) -> Option<&Screen> {
        self.kept.get(&cell).map(|kept| &kept.screen)
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (CellId, &mut Screen)> {
        self.kept.iter_mut().map(|(cell, kept)| (*cell, &mut kept.screen))
    }

    /// Somebody looks from there.
    pub(crate) fn touch(&mut self, cell: CellId) {
        if let Some(kept) = self.kept.get_mut(&cell) {
            self.uses += 1;
            self.by_use.remove(&kept.used);
            self.by_use.insert(self.uses, cell);
            kept.used = self.uses;
        }
    }

    /// Changes a screen, or makes one, where there is room or others make room; else nothing changes.
    pub(crate) fn change(
        &mut self,
        cell: CellId,
        change: impl FnOnce(&mut Screen),
        looked_by: impl FnOnce() -> BTreeSet<CellId>,
    ) {
        let kept = self.kept.get(&cell);
        let before = kept.map_or(0, |kept| kept.bytes);
        let mut screen = kept.map_or_else(Screen::default, |kept| kept.screen.clone());
        change(&mut screen);
        let bytes = screen.bytes();
        let over = (self.bytes - before + bytes).saturating_sub(self.most_bytes);
        if over == 0 || self.give_up(over, cell, &looked_by()) {
            self.bytes = self.bytes - before + bytes;
            let kept = self.kept.entry(cell).or_default();
            (kept.screen, kept.bytes) = (screen, bytes);
        }
        self.touch(cell);
    }

    /// Gives up others by which nobody looks, that take so many bytes; none when all of these take less.
    fn give_up(&mut self, bytes: usize, but: CellId, looked_by: &BTreeSet<CellId>) -> bool {
        let oldest = self.by_use.values().copied();
        let mut oldest = oldest.filter(|cell| *cell != but && !looked_by.contains(cell));
        let (mut given_up, mut lost) = (0, Vec::new());
        while given_up < bytes {
            let Some(cell) = oldest.next() else {
                return false;
            };
            given_up += self.kept[&cell].bytes;
            lost.push(cell);
        }
        lost.into_iter().for_each(|cell| self.lose(cell));
        true
    }

    fn lose(&mut self, cell: CellId) {
        if let Some(kept) = self.kept.remove(&cell) {
            self.by_use.remove(&kept.used);
            self.bytes -= kept.bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use belvedere_scene::ObjectId;

    use super::*;
    use crate::cells::Hidden;

    /// Takes note that a door hides a hundred cells from this one.
    fn learn(screens: &mut Screens, cell: u32, looked_by: &[u32]) {
        learn_of(screens, (cell, ObjectId(1), 100), looked_by);
    }

    /// Takes note that this door hides so many cells from this one.
    fn learn_of(screens: &mut Screens, (cell, door, others): (u32, ObjectId, u32), looked_by: &[u32]) {
        let hidden: Vec<_> = (0..others)
            .map(|other| Hidden {
                cell: CellId(other),
                behind: vec![vec![door]],
            })
            .collect();
        let change = |screen: &mut Screen| screen.learn(&[door], hidden.iter());
        screens.change(CellId(cell), change, || looked_by.iter().copied().map(CellId).collect());
        assert!(screens.bytes <= screens.most_bytes);
        let counted: usize = screens.kept.values().map(|kept| kept.screen.bytes()).sum();
        assert_eq!((counted, screens.by_use.len()), (screens.bytes, screens.kept.len()));
    }

    fn there(screens: &Screens) -> Vec<u32> {
        screens.kept.keys().map(|cell| cell.0).collect()
    }

    /// Room for three of them.
    fn three() -> Screens {
        let mut screens = Screens::default();
        learn(&mut screens, 0, &[]);
        screens.limit(3.5);
        screens
    }

    #[test]
    fn what_was_not_used_for_longest_gives_way_and_what_is_used_never() {
        let mut screens = three();
        learn(&mut screens, 1, &[]);
        learn(&mut screens, 2, &[]);
        screens.touch(CellId(0));
        learn(&mut screens, 3, &[]);
        assert_eq!(there(&screens), [0, 2, 3]);
        learn(&mut screens, 4, &[2, 0]);
        assert_eq!(there(&screens), [0, 2, 4]);
        learn(&mut screens, 5, &[0, 2, 4]);
        assert_eq!(there(&screens), [0, 2, 4], "somebody looks by all of them");
        (5..1_000).for_each(|cell| learn(&mut screens, cell, &[]));
        assert_eq!(there(&screens), [997, 998, 999]);
    }

    #[test]
    fn where_there_is_no_room_to_learn_more_what_was_known_stays() {
        let (mut screens, other) = (three(), ObjectId(2));
        learn(&mut screens, 1, &[]);
        learn(&mut screens, 2, &[]);
        let knows = |screens: &Screens| {
            let screen = screens.get(CellId(2)).unwrap();
            [screen.knows(&[ObjectId(1)]), screen.knows(&[other])]
        };
        learn_of(&mut screens, (2, other, 100), &[0, 1, 2]);
        assert_eq!((there(&screens), knows(&screens)), (vec![0, 1, 2], [true, false]));
        learn_of(&mut screens, (2, other, 1_000), &[1]);
        assert_eq!(
            (there(&screens), knows(&screens)),
            (vec![0, 1, 2], [true, false]),
            "nothing gives way in vain"
        );
        learn_of(&mut screens, (2, other, 100), &[0, 2]);
        assert_eq!((there(&screens), knows(&screens)), (vec![0, 2], [true, true]));
    }
}
