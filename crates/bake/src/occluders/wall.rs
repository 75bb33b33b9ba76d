//! Where is a plane opaque? Coplanar faces fused into one wall, with its openings.
//!
//! A wall is a plane with a rectilinear grid whose lines lie on the corners of the faces in it; a square of the grid is
//! opaque when the faces cover all of it. What is not opaque is opening: doors and windows, and everything beyond the
//! wall's ends. Opaque squares are counted in a summed-area table, so whether a rectangle is opaque takes four look-ups,
//! however many faces there are.
//!
//! Guarantee: a sight line that crosses the plane in an opaque square, in a direction in which the wall hides, meets a
//! face; except through gaps narrower than [`Tolerance::hole_m`], and as near outside of an edge as twice [`Tolerance::plane_m`], or half a
//! hole more where the edge is aslant to the grid. Faces may stand off the plane by
//! [`Tolerance::plane_m`]; rectangles are taken smaller by twice that, so that rounding opens no slit between a wall and
//! the floor it stands on.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::pieces;
use crate::digest::{Digest, Digester};

/// What counts as the same plane, and as no hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Faces within this distance of a plane lie in it, in metres.
    pub plane_m: f32,
    /// Gaps narrower than this are closed, and bodies lie this far inside the geometry, in metres.
    pub hole_m: f32,
}

/// A plane with opaque squares.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    /// Its unit normal.
    pub normal: Vec3,
    /// `normal · p` of its points.
    pub offset: f32,
    /// Directions of its grid, unit vectors across each other and the normal.
    pub axes: [Vec3; 2],
    /// The grid's lines along each, rising, in metres: `axes[i] · p`.
    pub lines: [Vec<f32>; 2],
    /// The object that this is the leaf of; it is opaque only when that door is closed.
    pub door: Option<u32>,
    /// Opaque squares for sight lines against the normal, and along it, each as a summed-area table of
    /// `lines[0].len() × lines[1].len()` counts; empty where there are none.
    opaque: [Vec<u32>; 2],
    /// The same squares, one bit each, row after row: a look at one of them is a look at one place in memory.
    bits: [Vec<u64>; 2],
    /// Rectangles outside of which nothing is opaque.
    pieces: Vec<Rectangle>,
}

/// A rectangle in a wall, `[from, to]` along each of its axes.
pub(crate) type Rectangle = [[f32; 2]; 2];

/// Which way a sight line crosses a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From where the normal points to.
    Against = 0,
    /// To where it points.
    Along = 1,
}

impl Wall {
    /// A wall from its grid and, for each way, whether each square is opaque (rows along the first axis).
    pub(super) fn new(
        normal: Vec3,
        offset: f32,
        axes: [Vec3; 2],
        lines: [Vec<f32>; 2],
        squares: [Vec<bool>; 2],
    ) -> Self {
        let width = lines[0].len();
        let bits = [0, 1].map(|way| bits(&squares[way]));
        let opaque = squares.map(|squares| {
            if !squares.contains(&true) {
                return Vec::new();
            }
            let mut sums = vec![0; width * lines[1].len()];
            for (j, row) in squares.chunks(width - 1).enumerate() {
                let mut sum = 0;
                for (i, opaque) in row.iter().enumerate() {
                    sum += u32::from(*opaque);
                    sums[(j + 1) * width + i + 1] = sums[j * width + i + 1] + sum;
                }
            }
            sums
        });
        let count = |[u, v]: &[Range<usize>; 2]| {
            let sums = opaque.iter().filter(|sums| !sums.is_empty());
            sums.map(|sums| counted(sums, width, [u.start, u.end], [v.start, v.end]))
                .sum()
        };
        let pieces = pieces::pieces(&lines, &count);
        Self {
            normal,
            offset,
            axes,
            lines,
            door: None,
            opaque,
            bits,
            pieces,
        }
    }

    /// Directions of the grid of a wall: for an upright or level one the world's own axes, or they lie level and upright, as most
    /// edges do.
    pub(super) fn axes_across(normal: Vec3) -> [Vec3; 2] {
        let level = Vec3::Y.cross(normal);
        let first = if level.length_squared() > 1e-6 {
            level.normalize()
        } else {
            Vec3::X.reject_from_normalized(normal).normalize()
        };
        [first, normal.cross(first)]
    }

    /// The axis of the world that it stands across, if any.
    pub(crate) fn axis(&self) -> Option<usize> {
        let axis = self.normal.abs().max_position();
        (self.normal[axis].abs() > 1.0 - 1e-6).then_some(axis)
    }

    /// Whether a rectangle of it is opaque this or that way and nowhere narrower than this.
    pub(super) fn is_wide(&self, least_m: f32) -> bool {
        let width = self.lines[0].len();
        let ways = self.opaque.iter().filter(|sums| !sums.is_empty());
        ways.into_iter().any(|sums| {
            let count = |[u, v]: &[Range<usize>; 2]| counted(sums, width, [u.start, u.end], [v.start, v.end]);
            pieces::is_wide(&self.lines, &count, least_m)
        })
    }

    /// Memory that it takes.
    pub(super) fn bytes(&self) -> usize {
        let of = |axis: usize| {
            size_of_val(&self.lines[axis][..]) + size_of_val(&self.opaque[axis][..]) + size_of_val(&self.bits[axis][..])
        };
        size_of::<Self>() + of(0) + of(1) + size_of_val(&self.pieces[..])
    }

    /// A digest of all that it is.
    pub(super) fn digest(&self) -> Digest {
        let mut digester = Digester::default();
        digester.point(self.normal).floats(&[self.offset]);
        digester.point(self.axes[0]).point(self.axes[1]);
        digester.count(self.door.map_or(0, |door| door as usize + 1));
        for lines in &self.lines {
            digester.count(lines.len()).floats(lines);
        }
        for sums in &self.opaque {
            digester.count(sums.len());
            sums.iter().for_each(|sum| _ = digester.count(*sum as usize));
        }
        digester.finish()
    }

    /// Whether it hides anything this way.
    #[must_use]
    pub fn hides(&self, way: Way) -> bool {
        !self.opaque[way as usize].is_empty()
    }

    /// Whether it is opaque this way but for a border of this width: the rim of a leaf follows what stands around it.
    pub(super) fn is_filled(&self, way: Way, border_m: f32) -> bool {
        let [columns, rows] = [0, 1].map(|axis| {
            let lines = &self.lines[axis];
            let ends = [lines[0] + border_m, lines[lines.len() - 1] - border_m];
            let squares = 1..lines.len();
            squares.filter(move |i| lines[*i] > ends[0] && lines[i - 1] < ends[1])
        });
        let mut inner = rows.flat_map(|j| columns.clone().map(move |i| (i, j)));
        self.hides(way) && inner.all(|(i, j)| self.opaque_square(way, i, j))
    }

    /// Whether each square is opaque this way, rows along the first axis; `None` where it hides nothing.
    pub(super) fn opaque_squares(&self, way: Way) -> Option<Vec<bool>> {
        let [columns, rows] = [self.lines[0].len(), self.lines[1].len()];
        let all = (1..rows).flat_map(|j| (1..columns).map(move |i| (i, j)));
        self.hides(way)
            .then(|| all.map(|(i, j)| self.opaque_square(way, i, j)).collect())
    }

    /// Where a point is in the wall's grid.
    #[must_use]
    pub fn place(&self, point: Vec3) -> Vec2 {
        Vec2::new(self.axes[0].dot(point), self.axes[1].dot(point))
    }

    /// The point at a place of the grid.
    #[must_use]
    pub fn point(&self, place: Vec2) -> Vec3 {
        self.offset * self.normal + place.x * self.axes[0] + place.y * self.axes[1]
    }

    /// The squares that a rectangle meets further than a margin: index ranges from 0 (before the first line) to the
    /// number of lines (after the last).
    fn squares(&self, rectangle: &Rectangle, margin_m: f32) -> [[usize; 2]; 2] {
        [0, 1].map(|axis| {
            let [mut from, mut to] = rectangle[axis];
            if to - from > 2.0 * margin_m {
                from += margin_m;
                to -= margin_m;
            } else {
                from = 0.5 * (from + to);
                to = from;
            }
            let lines = &self.lines[axis];
            let first = lines.partition_point(|line| *line <= from);
            let last = lines.partition_point(|line| *line < to);
            [first, last.max(first)]
        })
    }

    /// How many squares a rectangle meets.
    pub(crate) fn squares_in(&self, rectangle: &Rectangle) -> usize {
        let [u, v] = self.squares(rectangle, 0.0);
        (u[1] + 1 - u[0]) * (v[1] + 1 - v[0])
    }

    fn count(&self, way: Way, u: [usize; 2], v: [usize; 2]) -> u32 {
        counted(&self.opaque[way as usize], self.lines[0].len(), u, v)
    }

    /// Whether a rectangle is opaque but for a margin at its border.
    pub(crate) fn covers(&self, way: Way, rectangle: &Rectangle, margin_m: f32) -> bool {
        let [u, v] = self.squares(rectangle, margin_m);
        // Index 0 is before the first line, so square i stands between lines i − 1 and i.
        u[0] >= 1
            && v[0] >= 1
            && u[1] < self.lines[0].len()
            && v[1] < self.lines[1].len()
            && self.hides(way)
            && self.count(way, [u[0] - 1, u[1]], [v[0] - 1, v[1]]) as usize == (u[1] + 1 - u[0]) * (v[1] + 1 - v[0])
    }

    fn opaque_square(&self, way: Way, i: usize, j: usize) -> bool {
        i >= 1 && j >= 1 && i < self.lines[0].len() && j < self.lines[1].len() && {
            let at = (j - 1) * (self.lines[0].len() - 1) + i - 1;
            self.bits[way as usize][at / 64] >> (at % 64) & 1 == 1
        }
    }

    /// The openings of a rectangle: boxes around connected squares that are not opaque, cut to the rectangle. `None` when there are
    /// more than `limit`, or too many squares to look at.
    pub(crate) fn openings(
        &self,
        way: Way,
        rectangle: &Rectangle,
        margin_m: f32,
        limit: usize,
    ) -> Option<Vec<Rectangle>> {
        const MAX_SQUARES: usize = 1 << 14;
        let [u, v] = self.squares(rectangle, margin_m);
        let (width, height) = (u[1] + 1 - u[0], v[1] + 1 - v[0]);
        if width * height > MAX_SQUARES || !self.hides(way) {
            return None;
        }
        let mut open: Vec<bool> = Vec::with_capacity(width * height);
        for j in v[0]..=v[1] {
            open.extend((u[0]..=u[1]).map(|i| !self.opaque_square(way, i, j)));
        }
        let side = |axis: usize, from: usize, to: usize| {
            let lines = &self.lines[axis];
            let low = if from == 0 { f32::NEG_INFINITY } else { lines[from - 1] };
            let high = lines.get(to).copied().unwrap_or(f32::INFINITY);
            [low.max(rectangle[axis][0]), high.min(rectangle[axis][1])]
        };
        let mut openings = Vec::new();
        let mut stack = Vec::new();
        for start in 0..open.len() {
            if !std::mem::replace(&mut open[start], false) {
                continue;
            }
            if openings.len() == limit {
                return None;
            }
            let mut around = [[usize::MAX, 0], [usize::MAX, 0]];
            stack.push(start);
            while let Some(at) = stack.pop() {
                let (i, j) = (at % width, at / width);
                for (range, index) in around.iter_mut().zip([i, j]) {
                    *range = [range[0].min(index), range[1].max(index)];
                }
                let mut visit = |next: usize| {
                    if std::mem::replace(&mut open[next], false) {
                        stack.push(next);
                    }
                };
                if i > 0 {
                    visit(at - 1);
                }
                if i + 1 < width {
                    visit(at + 1);
                }
                if j > 0 {
                    visit(at - width);
                }
                if j + 1 < height {
                    visit(at + width);
                }
            }
            openings.push([
                side(0, u[0] + around[0][0], u[0] + around[0][1]),
                side(1, v[0] + around[1][0], v[0] + around[1][1]),
            ]);
        }
        Some(openings)
    }

    /// Whether a sight line that crosses the plane at this place is blocked.
    pub(crate) fn opaque_at(&self, way: Way, place: Vec2) -> bool {
        let index = |axis: usize| self.lines[axis].partition_point(|line| *line <= place[axis]);
        self.hides(way) && self.reaches(place) && self.opaque_square(way, index(0), index(1))
    }

    /// Whether a place of the plane is inside its grid.
    pub(crate) fn reaches(&self, place: Vec2) -> bool {
        (0..2).all(|axis| {
            let lines = &self.lines[axis];
            lines[0] <= place[axis] && place[axis] <= lines[lines.len() - 1]
        })
    }

    /// The share of a rectangle that is opaque, by squares.
    pub(crate) fn opaque_share(&self, way: Way, rectangle: &Rectangle) -> f32 {
        let area = |r: &Rectangle| (r[0][1] - r[0][0]).max(0.0) * (r[1][1] - r[1][0]).max(0.0);
        let total = area(rectangle);
        let whole = [0, 1].map(|axis| [self.lines[axis][0], self.lines[axis][self.lines[axis].len() - 1]]);
        let inside = [0, 1].map(|axis| {
            [
                whole[axis][0].max(rectangle[axis][0]),
                whole[axis][1].min(rectangle[axis][1]),
            ]
        });
        if !self.hides(way) || total <= 0.0 || area(&inside) <= 0.0 {
            return 0.0;
        }
        let [u, v] = self.squares(&inside, 0.0);
        let clamp = |axis: usize, [a, b]: [usize; 2]| {
            let last = self.lines[axis].len() - 1;
            [a.clamp(1, last) - 1, b.clamp(1, last)]
        };
        let (u, v) = (clamp(0, u), clamp(1, v));
        let squares = (u[1] - u[0]) * (v[1] - v[0]);
        area(&inside) / total * self.count(way, u, v) as f32 / squares.max(1) as f32
    }

    /// The box around its grid: the lowest corner and the highest.
    #[must_use]
    pub fn around(&self) -> [Vec3; 2] {
        self.box_of(&[0, 1].map(|axis| [self.lines[axis][0], self.lines[axis][self.lines[axis].len() - 1]]))
    }

    /// Rectangles outside of which nothing of it is opaque, and the box around each.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = (Rectangle, [Vec3; 2])> + '_ {
        self.pieces.iter().map(|piece| (*piece, self.box_of(piece)))
    }

    fn box_of(&self, [u, v]: &Rectangle) -> [Vec3; 2] {
        let corners = u.iter().flat_map(|u| v.map(|v| self.point(Vec2::new(*u, v))));
        corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[min, max], p| {
            [min.min(p), max.max(p)]
        })
    }
}

/// One bit for each square; nothing where none is opaque.
fn bits(squares: &[bool]) -> Vec<u64> {
    let word = |squares: &[bool]| {
        (0..)
            .zip(squares)
            .fold(0, |word, (i, opaque)| word | u64::from(*opaque) << i)
    };
    let any = squares.contains(&true);
    squares.chunks(64).filter(|_| any).map(word).collect()
}

/// How many squares are opaque, from a summed-area table of so many columns.
fn counted(sums: &[u32], width: usize, u: [usize; 2], v: [usize; 2]) -> u32 {
    let at = |i: usize, j: usize| sums[j * width + i];
    at(u[1], v[1]) + at(u[0], v[0]) - at(u[0], v[1]) - at(u[1], v[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall in the plane x = 0 from 0 to 10 m along z and 0 to 3 m up, with a door from 4 to 5 m.
    fn with_door() -> Wall {
        let lines = [vec![0.0, 4.0, 5.0, 10.0], vec![0.0, 2.0, 3.0]];
        let squares = vec![true, false, true, true, true, true];
        Wall::new(Vec3::X, 0.0, [Vec3::Z, Vec3::Y], lines, [squares, vec![false; 6]])
    }

    #[test]
    fn a_rectangle_is_covered_where_no_opening_is() {
        let wall = with_door();
        let covers = |u, v| wall.covers(Way::Against, &[u, v], 1e-3);
        assert!(covers([0.5, 3.9], [0.1, 2.9]));
        assert!(covers([0.0, 4.0], [0.0, 3.0]), "up to the jamb");
        assert!(!covers([0.0, 4.01], [0.0, 3.0]), "a centimetre of the door");
        assert!(covers([3.0, 6.0], [2.0, 3.0]), "above the door");
        assert!(!covers([9.0, 10.1], [1.0, 2.0]), "beyond its end");
        assert!(!wall.covers(Way::Along, &[[0.5, 3.9], [0.1, 2.9]], 1e-3), "from behind");
    }

    #[test]
    fn openings_are_doors_and_what_is_beyond_the_ends() {
        let wall = with_door();
        let found = wall
            .openings(Way::Against, &[[3.0, 11.0], [0.5, 2.5]], 1e-3, 4)
            .unwrap();
        assert_eq!(found, [[[4.0, 5.0], [0.5, 2.0]], [[10.0, 11.0], [0.5, 2.5]]]);
        assert!(
            wall.openings(Way::Against, &[[3.0, 11.0], [0.5, 2.5]], 1e-3, 1)
                .is_none()
        );
    }

    #[test]
    fn a_wall_that_hardly_leans_has_its_grid_in_itself() {
        for lean in [0.0, 1e-5, 5e-4, 9e-4, 2e-3] {
            let normal = Vec3::new(lean, 1.0, 0.5 * lean).normalize();
            let axes = Wall::axes_across(normal);
            assert!(axes.iter().all(|axis| axis.dot(normal).abs() < 1e-6), "{lean}");
            let squares = vec![true];
            let lines = [vec![0.0, 50.0], vec![0.0, 50.0]];
            let wall = Wall::new(normal, 4.0, axes, lines, [squares.clone(), squares]);
            let point = wall.point(Vec2::new(40.0, 1.0));
            let again = wall.point(wall.place(point));
            assert!((again - point).length() < 1e-4, "{lean}: {again} for {point}");
        }
    }

    #[test]
    fn a_point_of_the_opening_is_open() {
        let wall = with_door();
        assert!(wall.opaque_at(Way::Against, Vec2::new(2.0, 1.0)));
        assert!(!wall.opaque_at(Way::Against, Vec2::new(4.5, 1.0)));
        assert!(!wall.opaque_at(Way::Against, Vec2::new(-1.0, 1.0)));
        assert_eq!(wall.opaque_share(Way::Against, &[[0.0, 4.0], [0.0, 3.0]]), 1.0);
    }
}
