//! In which cell is a point, for one who knows in which cell it was a moment ago?
//!
//! Steps from cell to adjacent cell towards the point (Marvie & Bouatouch, *A VRML97-X3D extension for massive scenery
//! management in virtual worlds*, 2004, §3.4). A small step stays in its cell or ends next door, so its cost does not
//! depend on the size of the world. The walk answers only what is sure: a point on a face, edge or corner may belong to
//! cells that are not adjacent, so there it leaves the answer to [`crate::index::CellSearch`]. Hence both agree everywhere.

use std::borrow::Cow;

use crate::{CellId, index::CellEntry};

/// A walk that has not arrived after so many cells is given up.
const MAX_CELLS: u32 = 16;

/// Finds the cell at a point near another cell. It does no I/O: it says which cells' entries it needs and is given them.
///
/// ```text
/// let mut walk = CellWalk::new(&current, point);
/// while let Some(cells) = walk.wants() {
///     walk.give(&entries_of(cells));
/// }
/// let entry = walk.finish();    // None: ask a CellSearch
/// ```
#[derive(Debug)]
pub struct CellWalk<'a> {
    point: [f64; 3],
    at: Cow<'a, CellEntry>,
    distance_m: f64,
    cells: u32,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Walking,
    Arrived,
    Lost,
}

impl<'a> CellWalk<'a> {
    /// Starts in a cell.
    #[must_use]
    pub fn new(from: &'a CellEntry, point: [f64; 3]) -> Self {
        let distance_m = from.distance_m(point);
        let state = if from.holds_alone(point) {
            State::Arrived
        } else if distance_m == 0.0 {
            State::Lost
        } else {
            State::Walking
        };
        Self {
            point,
            at: Cow::Borrowed(from),
            distance_m,
            cells: 0,
            state,
        }
    }

    /// The cells whose entries to give next, or `None` when the walk is over.
    #[must_use]
    pub fn wants(&self) -> Option<&[CellId]> {
        (self.state == State::Walking).then_some(&self.at.adjacent)
    }

    /// Answers [`CellWalk::wants`]; entries that are not at hand may be left out.
    pub fn give(&mut self, entries: &[CellEntry]) {
        self.cells += 1;
        self.state = State::Lost;
        let alone = entries.iter().find(|entry| entry.holds_alone(self.point));
        let nearest = alone.or_else(|| {
            let key = |entry: &&CellEntry| (entry.distance_m(self.point), entry.cell);
            entries.iter().min_by(|a, b| {
                let ((a_m, a_id), (b_m, b_id)) = (key(a), key(b));
                a_m.total_cmp(&b_m).then(a_id.cmp(&b_id))
            })
        });
        let Some(next) = nearest else { return };
        let distance_m = next.distance_m(self.point);
        if alone.is_some() {
            self.state = State::Arrived;
        } else if 0.0 < distance_m && distance_m < self.distance_m && self.cells < MAX_CELLS {
            self.state = State::Walking;
        }
        self.at = Cow::Owned(next.clone());
        self.distance_m = distance_m;
    }

    /// The cell that holds the point and no other does; `None` when only the index can tell.
    #[must_use]
    pub fn finish(self) -> Option<CellEntry> {
        (self.state == State::Arrived).then(|| self.at.into_owned())
    }
}
