//! What do the online rules need of a published scene? Where a point is, what a ball touches, what is seen from a cell.
//!
//! Every cell's shape is held; what a cell sees is learnt when somebody first stands near it, so that a large world is
//! ready at once. Cells are found through a tree of boxes over their rising ids: ids of neighbours are near each other
//! (`belvedere_scene::index`), so the boxes are tight. A question costs O(log cells + answers).

use std::{collections::BTreeSet, sync::Arc};

use belvedere_scene::{
    Bounds, CellId, ObjectId,
    convex::{self, HalfSpace},
};

use crate::{screen::Screen, screens::Screens};

/// Children of a box of the tree.
const FAN: usize = 8;

/// The shape of a view cell.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cell {
    /// The box around it.
    pub bounds: Bounds,
    /// The half-spaces that together with the box are the cell; none when it is its box.
    pub planes: Vec<HalfSpace>,
}

/// Everything within a distance of a point, metres.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Ball {
    /// The middle.
    pub center: [f64; 3],
    /// Its radius.
    pub radius_m: f64,
}

impl Ball {
    /// Whether a point lies inside.
    #[must_use]
    pub fn holds(&self, point: [f64; 3]) -> bool {
        distance_m(self.center, point) <= self.radius_m
    }

    /// Whether a box has a point in common with it.
    fn touches(&self, bounds: &Bounds) -> bool {
        let square = |axis: usize| {
            let at = self.center[axis];
            let beyond_m = (bounds.min[axis] - at).max(at - bounds.max[axis]).max(0.0);
            beyond_m * beyond_m
        };
        square(0) + square(1) + square(2) <= self.radius_m * self.radius_m
    }
}

/// The distance of two points in metres.
#[must_use]
pub fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    // Without `hypot`, which takes many times as long: nothing in a scene is so far away that a square would overflow.
    let square = |axis: usize| (a[axis] - b[axis]) * (a[axis] - b[axis]);
    (square(0) + square(1) + square(2)).sqrt()
}

/// The cell at a point, or the nearest.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Place {
    /// The cell; of several at the same distance the one with the lowest id.
    pub cell: CellId,
    /// Zero when the cell holds the point.
    pub distance_m: f64,
}

/// The view cells of one revision.
#[derive(Debug, Clone, Default)]
pub struct Cells {
    cells: Vec<Cell>,
    /// `tree[0][i]` is the box around the cells `FAN · i ..`, `tree[n][i]` that around `tree[n - 1][FAN · i ..]`.
    tree: Vec<Vec<Bounds>>,
    /// While all doors are open.
    sees: Vec<Option<Arc<[CellId]>>>,
    /// Doors that are closed.
    closed: BTreeSet<ObjectId>,
    screens: Screens,
}

/// A cell that cannot be seen into from another while doors are closed.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Hidden {
    /// Which.
    pub cell: CellId,
    /// Each of these sets of doors hides it while all in it are closed, whatever becomes of others.
    pub behind: Vec<Vec<ObjectId>>,
}

impl Cells {
    /// The cells by id, without gaps.
    #[must_use]
    pub fn new(cells: Vec<Cell>) -> Self {
        let join = |boxes: &[Bounds]| boxes.iter().fold(Bounds::EMPTY, |all, one| all.union(one));
        let leaves: Vec<_> = cells.iter().map(|cell| cell.bounds).collect();
        let mut tree: Vec<Vec<Bounds>> = vec![leaves.chunks(FAN).map(join).collect()];
        while tree.last().is_some_and(|level| level.len() > FAN) {
            let above = tree.last().into_iter().flat_map(|level| level.chunks(FAN)).map(join);
            tree.push(above.collect());
        }
        Self {
            sees: vec![None; cells.len()],
            closed: BTreeSet::new(),
            screens: Screens::default(),
            cells,
            tree,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The box around all cells.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let roots = self.tree.last().into_iter().flatten();
        roots.fold(Bounds::EMPTY, |all, one| all.union(one))
    }

    /// The shape of a cell.
    #[must_use]
    pub fn cell(&self, cell: CellId) -> Option<&Cell> {
        self.cells.get(cell.index())
    }

    /// The cell at a point, or the nearest; `None` when there is none at all.
    #[must_use]
    pub fn at(&self, point: [f64; 3]) -> Option<Place> {
        let mut best: Option<Place> = None;
        self.visit(
            |bounds, best: &Option<Place>| best.is_none_or(|best| bounds.distance_m(point) < best.distance_m),
            &mut best,
            |id, cell, best| {
                let distance_m = convex::distance_m(&cell.bounds, &cell.planes, point);
                if best.is_none_or(|best| distance_m < best.distance_m) {
                    *best = Some(Place { cell: id, distance_m });
                }
            },
        );
        best
    }

    /// The cells that a ball touches, rising; the nearest one when it touches none.
    #[must_use]
    pub fn under(&self, ball: &Ball) -> Vec<CellId> {
        self.under_any(std::slice::from_ref(ball))
    }

    /// The same of two balls, which are often one.
    #[must_use]
    pub fn under_either(&self, (a, b): (Ball, Ball)) -> Vec<CellId> {
        if a == b {
            self.under(&a)
        } else {
            self.under_any(&[a, b])
        }
    }

    /// The cells that one of these balls touches, rising; of each that touches none the nearest one.
    #[must_use]
    pub fn under_any(&self, balls: &[Ball]) -> Vec<CellId> {
        let mut found = self.within(|bounds| balls.iter().any(|ball| ball.touches(bounds)));
        found.retain(|id| balls.iter().any(|ball| self.touches(ball, *id)));
        let touched = found.len();
        for ball in balls {
            if !found[..touched].iter().any(|id| self.touches(ball, *id)) {
                found.extend(self.at(ball.center).map(|place| place.cell));
            }
        }
        if found.len() > touched {
            found.sort_unstable();
            found.dedup();
        }
        found
    }

    fn touches(&self, ball: &Ball, cell: CellId) -> bool {
        let Cell { bounds, planes } = &self.cells[cell.index()];
        ball.touches(bounds) && (planes.is_empty() || convex::distance_m(bounds, planes, ball.center) <= ball.radius_m)
    }

    /// The cells whose boxes meet a box, rising.
    #[must_use]
    pub fn meeting(&self, bounds: &Bounds) -> Vec<CellId> {
        self.within(|other| other.intersects(bounds))
    }

    /// Takes note of what can be seen into from a cell, without itself.
    pub fn learn(&mut self, cell: CellId, sees: &[CellId]) {
        let known = self.cells.len();
        if let Some(slot) = self.sees.get_mut(cell.index()) {
            let inside = sees.iter().copied().filter(|other| other.index() < known);
            let mut all: Vec<_> = inside.chain([cell]).collect();
            all.sort_unstable();
            all.dedup();
            *slot = Some(all.into());
        }
    }

    /// Whether it is known what a cell sees.
    #[must_use]
    pub fn knows(&self, cell: CellId) -> bool {
        self.sees_through_all(cell).is_some()
    }

    /// What a cell sees while all doors are open, itself included, rising.
    #[must_use]
    pub fn sees_through_all(&self, cell: CellId) -> Option<&Arc<[CellId]>> {
        self.sees.get(cell.index())?.as_ref()
    }

    /// Takes note of what cannot be seen from a cell while these doors, rising, are closed. It counts whenever they are. `looked_by`
    /// gives the cells from which somebody looks now: where all together takes too much memory, what is known of others is given up,
    /// and where that is not enough, what is new. Says whether something else is seen from the cell than before.
    pub fn screen(
        &mut self,
        cell: CellId,
        closed: &[ObjectId],
        hidden: &[Hidden],
        looked_by: impl FnOnce() -> BTreeSet<CellId>,
    ) -> bool {
        let Some(sees) = self.sees.get(cell.index()).and_then(Option::as_ref) else {
            return false;
        };
        let before = self.seen_by(cell).cloned();
        let change = |screen: &mut Screen| {
            // A cell always sees itself.
            screen.learn(closed, hidden.iter().filter(|hidden| hidden.cell != cell));
            screen.leave(sees, &self.closed);
        };
        self.screens.change(cell, change, looked_by);
        before.as_ref() != self.seen_by(cell)
    }

    /// Somebody looks from a cell, or is about to: what is known of it is given up later than what nobody needs.
    pub fn look_from(&mut self, cell: CellId) {
        self.screens.touch(cell);
    }

    #[cfg(test)]
    pub(crate) fn limit_screens(&mut self, of_now: f64) {
        self.screens.limit(of_now);
    }

    /// Whether all is known that these closed doors, rising, hide from a cell.
    #[must_use]
    pub fn is_screened_by(&self, cell: CellId, closed: &[ObjectId]) -> bool {
        let screen = self.screens.get(cell);
        closed.is_empty() || screen.is_some_and(|screen| screen.knows(closed))
    }

    /// A door is open, or closed, from now on: whatever is known to be hidden by it counts no more, or again. Gives the
    /// cells that see something else now, rising.
    pub fn set_door(&mut self, door: ObjectId, open: bool) -> Vec<CellId> {
        let moved = if open {
            self.closed.remove(&door)
        } else {
            self.closed.insert(door)
        };
        let mut changed = Vec::new();
        for (cell, screen) in self.screens.iter_mut().filter(|_| moved) {
            if let Some(sees) = &self.sees[cell.index()]
                && screen.takes(door)
                && screen.leave(sees, &self.closed)
            {
                changed.push(cell);
            }
        }
        changed
    }

    fn seen_by(&self, cell: CellId) -> Option<&Arc<[CellId]>> {
        let screen = self.screens.get(cell).map(Screen::leaves);
        screen.or_else(|| self.sees_through_all(cell))
    }

    /// The cells that a ball touches and of which nothing is known.
    #[must_use]
    pub fn unknown_under(&self, ball: &Ball) -> Vec<CellId> {
        let mut cells = self.under(ball);
        cells.retain(|cell| !self.knows(*cell));
        cells
    }

    /// What some cells see together, themselves included, rising. A cell of which nothing is known sees itself.
    #[must_use]
    pub fn seen_from(&self, eyes: &[CellId]) -> Arc<[CellId]> {
        if let [eye] = eyes
            && let Some(sees) = self.seen_by(*eye)
        {
            return sees.clone();
        }
        let mut all = eyes.to_vec();
        for sees in eyes.iter().filter_map(|eye| self.seen_by(*eye)) {
            all.extend_from_slice(sees);
        }
        all.sort_unstable();
        all.dedup();
        all.into()
    }

    fn within(&self, near: impl Fn(&Bounds) -> bool) -> Vec<CellId> {
        let mut found = Vec::new();
        self.visit(
            |bounds, _| near(bounds),
            &mut found,
            |id, cell, found: &mut Vec<_>| {
                if near(&cell.bounds) {
                    found.push(id);
                }
            },
        );
        found
    }

    /// Calls `each` for the cells below the boxes that are `wanted`, by rising ids.
    fn visit<T>(
        &self,
        wanted: impl Fn(&Bounds, &T) -> bool,
        state: &mut T,
        mut each: impl FnMut(CellId, &Cell, &mut T),
    ) {
        let top = self.tree.len() - 1;
        let mut open: Vec<(usize, usize)> = (0..self.tree[top].len()).rev().map(|i| (top, i)).collect();
        while let Some((level, i)) = open.pop() {
            if !wanted(&self.tree[level][i], state) {
                continue;
            }
            if level > 0 {
                let end = self.tree[level - 1].len().min(FAN * (i + 1));
                open.extend((FAN * i..end).rev().map(|child| (level - 1, child)));
                continue;
            }
            for (id, cell) in (0u32..).zip(&self.cells).skip(FAN * i).take(FAN) {
                each(CellId(id), cell, state);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field of `n` × `n` unit cells.
    fn field(n: u32) -> Cells {
        let cell = |i: u32| {
            let min = [f64::from(i % n), 0.0, f64::from(i / n)];
            let bounds = Bounds {
                min,
                max: min.map(|x| x + 1.0),
            };
            Cell { bounds, planes: vec![] }
        };
        Cells::new((0..n * n).map(cell).collect())
    }

    #[test]
    fn a_point_finds_its_cell_and_on_a_face_the_lowest_id() {
        let cells = field(20);
        assert_eq!(cells.at([3.5, 0.5, 7.5]).unwrap().cell, CellId(143));
        assert_eq!(cells.at([3.0, 0.5, 0.5]).unwrap().cell, CellId(2));
        let outside = cells.at([-2.0, 0.5, 0.5]).unwrap();
        assert_eq!((outside.cell, outside.distance_m), (CellId(0), 2.0));
        assert_eq!(Cells::new(vec![]).at([0.0; 3]), None);
    }

    #[test]
    fn a_ball_touches_the_same_cells_as_without_a_tree() {
        let cells = field(20);
        for (x, z, radius_m) in [(3.5, 7.5, 0.2), (3.0, 7.0, 0.1), (10.2, 10.9, 3.3), (0.1, 0.1, 50.0)] {
            let ball = Ball {
                center: [x, 0.5, z],
                radius_m,
            };
            let plainly = |id: &u32| cells.cells[*id as usize].bounds.distance_m(ball.center) <= radius_m;
            let expected: Vec<_> = (0..400).filter(plainly).map(CellId).collect();
            assert_eq!(cells.under(&ball), expected);
        }
        let high = Ball {
            center: [0.5, 9.0, 0.5],
            radius_m: 0.1,
        };
        assert_eq!(cells.under(&high), [CellId(0)], "the nearest when none is touched");
        let inside = Ball {
            center: [3.5, 0.5, 7.5],
            ..high
        };
        assert_eq!(
            cells.under_any(&[inside, high]),
            [CellId(0), CellId(143)],
            "each that touches none has its nearest"
        );
    }

    #[test]
    fn what_cells_see_is_joined() {
        let mut cells = field(2);
        cells.learn(CellId(0), &[CellId(2), CellId(99)]);
        assert_eq!(*cells.seen_from(&[CellId(0)]), [CellId(0), CellId(2)]);
        assert_eq!(
            *cells.seen_from(&[CellId(0), CellId(3)]),
            [CellId(0), CellId(2), CellId(3)]
        );
        assert!(cells.knows(CellId(0)) && !cells.knows(CellId(3)));
    }

    fn hidden(cell: u32, behind: &[&[ObjectId]]) -> Hidden {
        Hidden {
            cell: CellId(cell),
            behind: behind.iter().map(|doors| doors.to_vec()).collect(),
        }
    }

    #[test]
    fn closed_doors_leave_less_until_one_of_them_opens_and_again_when_it_closes() {
        let mut cells = field(2);
        let [a, b] = [ObjectId(5), ObjectId(9)];
        cells.screen(CellId(0), &[a], &[hidden(2, &[&[a]])], BTreeSet::new);
        assert!(
            !cells.is_screened_by(CellId(0), &[a]),
            "nothing is known of the cell yet"
        );
        assert!(cells.is_screened_by(CellId(0), &[]));
        cells.learn(CellId(0), &[CellId(1), CellId(2)]);
        let open = [CellId(0), CellId(1), CellId(2)];
        assert_eq!([cells.set_door(a, false), cells.set_door(b, false)], [vec![], vec![]]);
        let answer = [hidden(0, &[&[a]]), hidden(2, &[&[a, b]])];
        assert!(cells.screen(CellId(0), &[a, b], &answer, BTreeSet::new));
        let again = cells.screen(CellId(0), &[a, b], &answer, BTreeSet::new);
        assert!(!again, "nothing else is seen than before");
        let behind = [CellId(0), CellId(1)];
        assert_eq!(*cells.seen_from(&[CellId(0)]), behind, "a cell sees itself");
        assert!(cells.is_screened_by(CellId(0), &[a, b]));
        for _ in 0..2 {
            assert_eq!(cells.set_door(ObjectId(7), true), []);
            assert_eq!(cells.set_door(b, true), [CellId(0)]);
            assert_eq!(*cells.seen_from(&[CellId(0)]), open);
            assert!(!cells.is_screened_by(CellId(0), &[a]), "it may hide more by itself");
            assert_eq!(cells.set_door(b, false), [CellId(0)], "which needs no new answer");
            assert_eq!(*cells.seen_from(&[CellId(0)]), behind);
        }
        assert!(cells.is_screened_by(CellId(0), &[a, b]));
    }

    #[test]
    fn an_answer_that_comes_late_counts_when_its_doors_are_closed() {
        let mut cells = field(2);
        let door = ObjectId(5);
        cells.learn(CellId(0), &[CellId(2)]);
        cells.screen(CellId(0), &[door], &[hidden(2, &[&[door]])], BTreeSet::new);
        assert_eq!(*cells.seen_from(&[CellId(0)]), [CellId(0), CellId(2)]);
        assert_eq!(cells.set_door(door, false), [CellId(0)]);
        assert_eq!(*cells.seen_from(&[CellId(0)]), [CellId(0)]);
    }

    #[test]
    fn what_other_doors_hide_stays_hidden_when_one_opens() {
        let mut cells = field(2);
        let [a, b, c] = [3, 5, 9].map(ObjectId);
        cells.learn(CellId(0), &[CellId(1), CellId(2), CellId(3)]);
        for door in [a, b, c] {
            cells.set_door(door, false);
        }
        let answer = [hidden(1, &[&[a]]), hidden(2, &[&[b, c], &[a]]), hidden(3, &[&[c]])];
        cells.screen(CellId(0), &[a, b, c], &answer, BTreeSet::new);
        assert_eq!(*cells.seen_from(&[CellId(0)]), [CellId(0)]);
        assert_eq!(cells.set_door(b, true), []);
        assert!(cells.is_screened_by(CellId(0), &[a, c]), "it was needed for nothing");
        cells.set_door(b, false);
        assert_eq!(cells.set_door(a, true), [CellId(0)]);
        assert_eq!(*cells.seen_from(&[CellId(0)]), [CellId(0), CellId(1)]);
        assert_eq!(cells.set_door(c, true), [CellId(0)]);
        assert_eq!(
            *cells.seen_from(&[CellId(0)]),
            [CellId(0), CellId(1), CellId(2), CellId(3)]
        );
        assert!(!cells.is_screened_by(CellId(0), &[b]));
    }
}
