//! How many cells must be closed until two points fall together?
//!
//! Cells are closed after those in them, so it is as many as until the smallest cell is closed that holds both.

/// Stands for "no cell".
const NONE: u32 = u32::MAX;

/// A cell on the way from a point to the root.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// The first point behind it.
    end: u32,
    /// The smallest cell around it.
    parent: u32,
    /// Which number it is in the order of closing.
    rank: u32,
}

/// The cells of an octree as a forest.
pub(super) struct Ancestry {
    links: Vec<Link>,
    /// The smallest cell around each point.
    cell_of: Vec<u32>,
}

impl Ancestry {
    /// Of so many points in cells, of each the first point, the one behind the last and its number in the order of
    /// closing. Each comes after those in it.
    pub(super) fn new(points: usize, cells: impl Iterator<Item = (u32, u32, u32)>) -> Self {
        let mut cell_of = vec![NONE; points];
        let mut links: Vec<Link> = Vec::new();
        // Cells that nothing is around yet, with their first points.
        let mut open: Vec<(u32, u32)> = Vec::new();
        for (number, (first, end, rank)) in (0..).zip(cells) {
            let mut behind = end;
            while let Some((inner, begin)) = open.pop_if(|(_, begin)| *begin >= first) {
                let child = &mut links[inner as usize];
                child.parent = number;
                cell_of[child.end as usize..behind as usize].fill(number);
                behind = begin;
            }
            cell_of[first as usize..behind as usize].fill(number);
            let parent = NONE;
            links.push(Link { end, parent, rank });
            open.push((number, first));
        }
        Self { links, cell_of }
    }

    /// So many cells may be closed before two different points fall together; `None` when they never do.
    pub(super) fn apart_until(&self, a: u32, b: u32) -> Option<u32> {
        let (a, b) = (a.min(b), a.max(b));
        let mut cell = *self.cell_of.get(a as usize)?;
        loop {
            let link = self.links.get(cell as usize)?;
            if link.end > b {
                return Some(link.rank);
            }
            cell = link.parent;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_meet_in_the_smallest_cell_around_both() {
        // ((0 1) 2 (3 4)) 5, and 6 in no cell.
        let cells = [(0, 2, 0), (3, 5, 2), (0, 5, 3), (0, 6, 7)];
        let ancestry = Ancestry::new(7, cells.into_iter());
        let expected = [
            ((0, 1), Some(0)),
            ((1, 2), Some(3)),
            ((4, 3), Some(2)),
            ((2, 3), Some(3)),
            ((1, 4), Some(3)),
            ((5, 0), Some(7)),
            ((4, 6), None),
            ((6, 7), None),
        ];
        for ((a, b), rank) in expected {
            assert_eq!(ancestry.apart_until(a, b), rank, "{a} and {b}");
        }
    }
}
