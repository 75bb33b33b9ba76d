//! Do the walk, the index and a look at every cell name the same cell, also on faces, edges and corners?

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use belvedere_scene::{
    BlobName, Bounds, CellId,
    convex::{HalfSpace, TOUCH_M, outside_m},
    index::{CellChunk, CellEntry, CellSearch, Page, PageEntry, PageKind},
    walk::CellWalk,
};
use proptest::prelude::*;

const SIZE_M: f64 = 16.0;
const CHUNK: usize = 4;

/// A partition of a cube, and places on the surfaces of its cells.
#[derive(Debug)]
struct Partition {
    cells: Vec<CellEntry>,
    corners: Vec<[f64; 3]>,
}

fn cell(id: usize, bounds: Bounds, planes: Vec<HalfSpace>) -> CellEntry {
    let name = BlobName::of(&(id as u32).to_le_bytes(), "cell").unwrap();
    CellEntry {
        cell: CellId(id as u32),
        bounds,
        planes,
        adjacent: Vec::new(),
        record: name.clone(),
        record_bytes: 4,
        steps: None,
        steps_bytes: None,
        record_json: name,
    }
}

/// Cells whose boxes share a face, or which share a plane: what a bake would give, or a little more.
fn join(cells: &mut [CellEntry]) {
    let touching = |a: &CellEntry, b: &CellEntry| {
        let share = (0..3).filter(|i| a.bounds.max[*i].min(b.bounds.max[*i]) > a.bounds.min[*i].max(b.bounds.min[*i]));
        let opposite = |half: &HalfSpace| b.planes.contains(&half.map(|x| -x));
        let along = if a.planes.is_empty() {
            share.count() >= 2
        } else {
            a.planes.iter().any(opposite)
        };
        a.bounds.intersects(&b.bounds) && along
    };
    let all = cells.to_vec();
    for cell in cells {
        let near = all
            .iter()
            .filter(|other| other.cell != cell.cell && touching(cell, other));
        cell.adjacent = near.map(|other| other.cell).collect();
    }
}

/// Boxes, cut at places that are often the same.
fn boxes(cuts: &[(usize, u8, u8)]) -> Partition {
    let mut all = vec![Bounds {
        min: [0.0; 3],
        max: [SIZE_M; 3],
    }];
    for (which, axis, share) in cuts {
        let axis = usize::from(axis % 3);
        let index = which % all.len();
        let cut = all[index];
        let at = cut.min[axis] + (cut.max[axis] - cut.min[axis]) * f64::from(1 + share % 7) / 8.0;
        let (mut low, mut high) = (cut, cut);
        (low.max[axis], high.min[axis]) = (at, at);
        all[index] = low;
        all.insert(index + 1, high);
    }
    let corners = all.iter().flat_map(Bounds::corners).collect();
    let mut cells: Vec<_> = all
        .into_iter()
        .enumerate()
        .map(|(id, b)| cell(id, b, Vec::new()))
        .collect();
    join(&mut cells);
    Partition { cells, corners }
}

/// The point on three planes.
fn meeting([a, b, c]: [&HalfSpace; 3]) -> Option<[f64; 3]> {
    let cross = |u: &HalfSpace, v: &HalfSpace| -> [f64; 3] {
        [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ]
    };
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let det = a[0] * bc[0] + a[1] * bc[1] + a[2] * bc[2];
    (det.abs() > 1e-3).then(|| [0, 1, 2].map(|i| (a[3] * bc[i] + b[3] * ca[i] + c[3] * ab[i]) / det))
}

fn corners_of(planes: &[HalfSpace]) -> Vec<[f64; 3]> {
    let mut corners = Vec::new();
    for (i, a) in planes.iter().enumerate() {
        for (j, b) in planes.iter().enumerate().skip(i + 1) {
            for c in &planes[j + 1..] {
                let inside = |p: &[f64; 3]| planes.iter().all(|half| outside_m(half, *p) < 1e-9);
                corners.extend(meeting([a, b, c]).filter(inside));
            }
        }
    }
    corners
}

/// Convex pieces of a cube, cut by planes that stand askew.
fn pieces(cuts: &[([f64; 3], [f64; 3])]) -> Partition {
    let mut cube = Vec::new();
    for axis in 0..3 {
        let mut up: HalfSpace = [0.0; 4];
        (up[axis], up[3]) = (1.0, SIZE_M);
        let mut down: HalfSpace = [0.0; 4];
        down[axis] = -1.0;
        cube.extend([up, down]);
    }
    let mut all = vec![cube];
    for (through, normal) in cuts {
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let n = normal.map(|x| x / length);
        let plane = [
            n[0],
            n[1],
            n[2],
            n[0] * through[0] + n[1] * through[1] + n[2] * through[2],
        ];
        all = all
            .into_iter()
            .flat_map(|piece| {
                let halves = [plane, plane.map(|x| -x)].map(|half| {
                    let mut piece = piece.clone();
                    piece.push(half);
                    piece
                });
                let solid = |piece: &Vec<HalfSpace>| {
                    let size = Bounds::around(corners_of(piece)).size_m();
                    size.iter().all(|s| *s > 0.02)
                };
                if halves.iter().all(solid) {
                    halves.to_vec()
                } else {
                    vec![piece]
                }
            })
            .collect();
    }
    let mut corners = Vec::new();
    let mut cells: Vec<_> = all
        .into_iter()
        .enumerate()
        .map(|(id, planes)| {
            let own = corners_of(&planes);
            corners.extend(&own);
            cell(id, Bounds::around(own), planes)
        })
        .collect();
    join(&mut cells);
    Partition { cells, corners }
}

impl Partition {
    fn brute_force(&self, point: [f64; 3]) -> (CellId, bool) {
        let best = self.cells.iter().min_by(|a, b| {
            let key = a.distance_m(point).total_cmp(&b.distance_m(point));
            key.then(a.cell.cmp(&b.cell))
        });
        let best = best.unwrap();
        (best.cell, best.distance_m(point) == 0.0)
    }

    fn by_index(&self, point: [f64; 3]) -> (CellId, bool) {
        let entries = self.cells.chunks(CHUNK).map(|row| PageEntry {
            kind: PageKind::Chunk,
            url: row[0].record.clone(),
            bytes: 1,
            first: row[0].cell.0,
            count: row.len() as u32,
            bounds: row.iter().fold(Bounds::EMPTY, |all, cell| all.union(&cell.bounds)),
        });
        let mut search = CellSearch::new(
            &Page {
                entries: entries.collect(),
            },
            point,
        );
        while let Some(entry) = search.wants() {
            let first = entry.first as usize;
            let cells = self.cells[first..first + entry.count as usize].to_vec();
            search.give_chunk(&CellChunk { cells });
        }
        let located = search.finish().unwrap();
        (located.cell.cell, located.distance_m == 0.0)
    }

    fn by_walk(&self, from: CellId, point: [f64; 3]) -> Option<CellId> {
        let mut walk = CellWalk::new(&self.cells[from.index()], point);
        while let Some(ids) = walk.wants() {
            let entries: Vec<_> = ids.iter().map(|id| self.cells[id.index()].clone()).collect();
            walk.give(&entries);
        }
        walk.finish().map(|entry| entry.cell)
    }

    /// Places inside, on faces, edges and corners, and outside, in turns.
    fn places(&self, steps: &[([f64; 3], u8, usize, usize)]) -> Vec<[f64; 3]> {
        let corner = |i: &usize| self.corners[i % self.corners.len()];
        let between = |a: [f64; 3], b: [f64; 3], t: f64| [0, 1, 2].map(|i| a[i] + t * (b[i] - a[i]));
        let place = |(free, kind, i, j): &([f64; 3], u8, usize, usize)| match kind % 5 {
            0 => corner(i),
            1 => between(corner(i), corner(&(i + j % 4)), free[0] / SIZE_M),
            // The middle of three corners of one cell is often on a face.
            2 => between(between(corner(i), corner(&(i + 1)), 0.5), corner(&(i + 2)), 1.0 / 3.0),
            _ => *free,
        };
        steps.iter().map(place).collect()
    }

    fn check(&self, places: &[[f64; 3]]) -> Result<(), TestCaseError> {
        let mut current = CellId(0);
        for point in places {
            let truth = self.brute_force(*point);
            prop_assert_eq!(self.by_index(*point), truth, "index at {:?}", point);
            if let Some(walked) = self.by_walk(current, *point) {
                prop_assert_eq!((walked, true), truth, "walk from {} to {:?}", current, point);
            }
            let inside = point.iter().all(|x| (0.0..=SIZE_M).contains(x));
            prop_assert!(truth.1 || !inside, "nobody holds {:?}", point);
            current = truth.0;
        }
        Ok(())
    }
}

fn steps() -> impl Strategy<Value = Vec<([f64; 3], u8, usize, usize)>> {
    let free = [-1.0..SIZE_M + 1.0, -1.0..SIZE_M + 1.0, -1.0..SIZE_M + 1.0];
    proptest::collection::vec(
        (free, any::<u8>(), any::<usize>().prop_map(|i| i / 2), 0usize..64),
        1..60,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn in_boxes_all_agree(
        cuts in proptest::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 0..40),
        steps in steps(),
    ) {
        let partition = boxes(&cuts);
        partition.check(&partition.places(&steps))?;
    }

    #[test]
    fn in_convex_pieces_all_agree(
        cuts in proptest::collection::vec(
            ([2.0..14.0, 2.0..14.0, 2.0..14.0], [-1.0..1.0, -1.0..1.0, 0.1..1.0]), 0..6),
        steps in steps(),
    ) {
        let partition = pieces(&cuts);
        partition.check(&partition.places(&steps))?;
    }

    #[test]
    fn small_steps_inside_are_answered_by_the_walk(
        cuts in proptest::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 0..40),
        start in [1.0..15.0, 1.0..15.0, 1.0..15.0],
        step in [-0.3..0.3, -0.3..0.3, -0.3..0.3],
    ) {
        let partition = boxes(&cuts);
        let from = partition.brute_force(start).0;
        let to = [0, 1, 2].map(|i: usize| start[i] + step[i]);
        let (cell, _) = partition.brute_force(to);
        let on_surface = !partition.cells[cell.index()].holds_alone(to);
        prop_assert!(on_surface || partition.by_walk(from, to) == Some(cell));
    }
}

#[test]
fn half_spaces_of_neighbours_leave_no_gap() {
    let plane: HalfSpace = [0.6, 0.0, 0.8, 1.0];
    for point in [[1.0, 2.0, 0.5], [0.2, -7.0, 1.1], [1e7, 0.0, -7.5e6 + 1.25]] {
        let sides = [outside_m(&plane, point), outside_m(&plane.map(|x| -x), point)];
        assert_eq!(sides[0], -sides[1]);
        assert!(sides.iter().any(|outside_m| *outside_m <= TOUCH_M));
    }
}
