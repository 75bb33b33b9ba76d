//! Which squares of a wall do its faces cover? A wall is a rectilinear grid through the corners of its faces; a square is opaque
//! when nothing is left of it after all of them were taken away. Faces are grown by half a hole on all sides, so that narrower gaps
//! between them are closed; corners sharper than a right angle no further than that beyond the corner, or a fan of slivers would
//! close what is as wide as they are long.
//!
//! Cost: squares times the faces that meet them and the pieces that these leave, little for squares of which a corner or the middle is bare.

use std::ops::Range;

use glam::Vec2;

use super::wall::Tolerance;

/// At most this many lines along an axis of a wall.
const MAX_LINES: usize = 256;
/// A square of which more pieces than this are left, as where a whole town stands in one, is taken to be open: each face more would have to
/// be taken away from all of them.
const MAX_PIECES: usize = 2048;

/// Where corners lie along an axis; where there are too many, those on the longest edges across it.
pub(super) fn lines(faces: &[([Vec2; 3], [bool; 2])], axis: usize, tolerance: Tolerance) -> Vec<f32> {
    let mut corners: Vec<(f32, f32)> = Vec::with_capacity(3 * faces.len());
    for (face, _) in faces {
        for i in 0..3 {
            let (from, to) = (face[i], face[(i + 1) % 3]);
            let straight = (from[axis] - to[axis]).abs() <= tolerance.plane_m;
            let length = if straight { (from - to).length() } else { 0.0 };
            corners.push((from[axis], length));
            corners.push((to[axis], length));
        }
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lines: Vec<(f32, f32)> = Vec::new();
    for (at, length) in corners {
        match lines.last_mut() {
            Some(last) if at - last.0 <= tolerance.plane_m => last.1 += length,
            _ => lines.push((at, length)),
        }
    }
    let ends = [lines[0].0, lines[lines.len() - 1].0];
    if lines.len() > MAX_LINES {
        lines.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
        lines.truncate(MAX_LINES - 2);
    }
    let mut lines: Vec<f32> = lines.into_iter().map(|(at, _)| at).chain(ends).collect();
    lines.sort_by(f32::total_cmp);
    lines.dedup();
    if lines.len() == 1 {
        lines.push(lines[0] + tolerance.plane_m);
    }
    lines
}

/// For each square whether the faces cover all of it, but for gaps narrower than a hole.
pub(super) fn covered<'a>(
    faces: impl Iterator<Item = &'a [Vec2; 3]> + Clone,
    lines: &[Vec<f32>; 2],
    tolerance: Tolerance,
) -> Vec<bool> {
    let squares = Squares {
        lines,
        grow_m: 0.5 * tolerance.hole_m,
    };
    let knives = faces.filter_map(|face| Some((Knife::of(face, squares.grow_m)?, squares.near(face))));
    // A place of a square that lies in no face is enough.
    let mut bare = vec![(1u8 << PLACES.len()) - 1; squares.count()];
    for (knife, near) in knives.clone() {
        squares.each(&near, |index, square| {
            for (place, [u, v]) in PLACES.iter().enumerate() {
                let at = square[0] + Vec2::new(*u, *v) * (square[1] - square[0]);
                bare[index] &= !(u8::from(knife.may_take(at)) << place);
            }
        });
    }
    let mut left: Vec<Option<Vec<Vec<Vec2>>>> = vec![None; squares.count()];
    for (knife, near) in knives {
        squares.each(&near, |index, [min, max]| {
            if bare[index] != 0 {
                return;
            }
            let whole = || vec![vec![min, Vec2::new(max.x, min.y), max, Vec2::new(min.x, max.y)]];
            let rest = left[index].get_or_insert_with(whole);
            if !rest.is_empty() {
                let mut pieces = Vec::new();
                rest.drain(..).for_each(|piece| knife.cut(piece, &mut pieces));
                if pieces.len() > MAX_PIECES {
                    pieces.truncate(1);
                    bare[index] = 1;
                }
                *rest = pieces;
            }
        });
    }
    left.into_iter()
        .map(|rest| rest.is_some_and(|rest| rest.is_empty()))
        .collect()
}

/// The number of a square: `at` along an axis, `other` along the other one, where a row has so many.
pub(super) fn number(columns: usize, axis: usize, [at, other]: [usize; 2]) -> usize {
    match axis {
        0 => other * columns + at,
        _ => at * columns + other,
    }
}

/// Takes out lines on both sides of which all squares are alike.
pub(super) fn join(lines: &mut [Vec<f32>; 2], opaque: &mut [Vec<bool>; 2]) {
    let counts = [lines[0].len() - 1, lines[1].len() - 1];
    let kept = [0, 1].map(|axis| -> Vec<usize> {
        let differs = |at: &usize| {
            let mut across = (0..counts[1 - axis]).flat_map(|other| opaque.iter().map(move |squares| (squares, other)));
            across.any(|(squares, other)| {
                let square = |at: usize| squares[number(counts[0], axis, [at, other])];
                square(*at) != square(*at - 1)
            })
        };
        std::iter::once(0).chain((1..counts[axis]).filter(differs)).collect()
    });
    for squares in opaque {
        let rows = kept[1].iter().map(|row| &squares[row * counts[0]..]);
        *squares = rows.flat_map(|row| kept[0].iter().map(|at| row[*at])).collect();
    }
    for (lines, kept) in lines.iter_mut().zip(&kept) {
        let last = lines[lines.len() - 1];
        *lines = kept.iter().map(|at| lines[*at]).chain([last]).collect();
    }
}

/// Takes away rows and columns at the ends of which less than half is opaque, up to this width at each: what a hinge adds to a leaf
/// is no part of its edge.
pub(super) fn trim(lines: &mut [Vec<f32>; 2], opaque: &mut [Vec<bool>; 2], most_m: f32) {
    for axis in 0..2 {
        let counts = [lines[0].len() - 1, lines[1].len() - 1];
        let is_bare = |at: usize| {
            let ends = lines[1 - axis].windows(2).enumerate();
            let whole_m = lines[1 - axis][counts[1 - axis]] - lines[1 - axis][0];
            let opaque = ends.filter(|(other, _)| {
                opaque
                    .iter()
                    .any(|squares| squares[number(counts[0], axis, [at, *other])])
            });
            opaque.map(|(_, ends)| ends[1] - ends[0]).sum::<f32>() < 0.5 * whole_m
        };
        let ends = [lines[axis][0] + most_m, lines[axis][counts[axis]] - most_m];
        let low = (0..counts[axis])
            .take_while(|at| lines[axis][at + 1] <= ends[0] && is_bare(*at))
            .count();
        let high = (0..counts[axis])
            .rev()
            .take_while(|at| lines[axis][*at] >= ends[1] && is_bare(*at))
            .count();
        if low + high == 0 || low + high >= counts[axis] {
            continue;
        }
        let kept = low..counts[axis] - high;
        for squares in opaque.iter_mut() {
            let rows = squares.chunks(counts[0]).enumerate();
            let rows = rows.filter(|(row, _)| axis == 0 || kept.contains(row));
            let whole = 0..counts[0];
            let columns = if axis == 0 { &kept } else { &whole };
            *squares = rows.flat_map(|(_, row)| row[columns.clone()].to_vec()).collect();
        }
        lines[axis] = lines[axis][kept.start..=kept.end].to_vec();
    }
}

/// Places of a square, as shares of its edges.
const PLACES: [[f32; 2]; 5] = [[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]];

/// The squares of a grid, rows of them along the first axis.
struct Squares<'l> {
    lines: &'l [Vec<f32>; 2],
    grow_m: f32,
}

impl Squares<'_> {
    fn count(&self) -> usize {
        self.lines.iter().map(|lines| lines.len() - 1).product()
    }

    /// Columns and rows that a face, grown by a little, may meet.
    fn near(&self, face: &[Vec2; 3]) -> [Range<usize>; 2] {
        let min = face[0].min(face[1]).min(face[2]);
        let max = face[0].max(face[1]).max(face[2]);
        [0, 1].map(|axis| {
            let lines = &self.lines[axis];
            let first = lines.partition_point(|line| *line <= min[axis] - self.grow_m);
            let end = lines.partition_point(|line| *line < max[axis] + self.grow_m);
            first.saturating_sub(1)..end.min(lines.len() - 1)
        })
    }

    /// Calls with the number and the corners of each square in some columns and rows.
    fn each(&self, [columns, rows]: &[Range<usize>; 2], mut visit: impl FnMut(usize, [Vec2; 2])) {
        let [u, v] = self.lines;
        for j in rows.clone() {
            for i in columns.clone() {
                let corners = [Vec2::new(u[i], v[j]), Vec2::new(u[i + 1], v[j + 1])];
                visit(j * (u.len() - 1) + i, corners);
            }
        }
    }
}

/// Takes a triangle, grown by a little, away from polygons.
struct Knife {
    /// Where each edge begins, and which way it leads around, counter-clockwise; then each corner that is sharper than a right angle,
    /// and which way one goes around past it.
    edges: [[Vec2; 2]; 6],
    /// How many of these there are.
    count: usize,
    grow_m: f32,
}

impl Knife {
    /// `None` where an edge has no length.
    fn of(face: &[Vec2; 3], grow_m: f32) -> Option<Self> {
        let mut face = *face;
        if (face[1] - face[0]).perp_dot(face[2] - face[0]) < 0.0 {
            face.swap(1, 2);
        }
        let along = |i: usize| (face[(i + 1) % 3] - face[i]).try_normalize();
        let along = [along(0)?, along(1)?, along(2)?];
        let mut edges = [[Vec2::ZERO; 2]; 6];
        let mut count = 3;
        for i in 0..3 {
            edges[i] = [face[i], along[i]];
            let (comes, goes) = (along[(i + 2) % 3], along[i]);
            if comes.dot(goes) < 0.0 {
                edges[count] = [face[i], (comes - goes).perp().normalize()];
                count += 1;
            }
        }
        Some(Self { edges, count, grow_m })
    }

    fn edges(&self) -> &[[Vec2; 2]] {
        &self.edges[..self.count]
    }

    /// Positive inside of an edge, also for what is within the growth.
    fn inside(&self, [from, along]: &[Vec2; 2], p: Vec2) -> f32 {
        along.perp_dot(p - *from) + self.grow_m
    }

    /// Whether a place lies in the triangle or hardly outside of it.
    fn may_take(&self, p: Vec2) -> bool {
        self.edges().iter().all(|edge| self.inside(edge, p) >= -self.grow_m)
    }

    /// Adds to `pieces` what is left of a convex polygon: convex polygons again.
    fn cut(&self, polygon: Vec<Vec2>, pieces: &mut Vec<Vec<Vec2>>) {
        // Most polygons lie beside the triangle or in it.
        let mut is_in = true;
        for edge in self.edges() {
            let (mut some_in, mut some_out) = (false, false);
            for p in &polygon {
                let height = self.inside(edge, *p);
                some_in |= height > 0.0;
                some_out |= height < 0.0;
            }
            if !some_in {
                pieces.push(polygon);
                return;
            }
            is_in &= !some_out;
        }
        if is_in {
            return;
        }
        let before = pieces.len();
        let mut rest = polygon.clone();
        for edge in self.edges() {
            let outer = clipped(&rest, |p| -self.inside(edge, p));
            if outer.len() > 2 {
                pieces.push(outer);
            }
            rest = clipped(&rest, |p| self.inside(edge, p));
            if rest.len() < 3 {
                pieces.truncate(before);
                pieces.push(polygon);
                return;
            }
        }
    }
}

/// The part of a convex polygon where a linear function is not negative.
fn clipped(polygon: &[Vec2], height: impl Fn(Vec2) -> f32) -> Vec<Vec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (here, there) = (height(*a), height(b));
        if here >= 0.0 {
            kept.push(*a);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            kept.push(*a + here / (here - there) * (b - *a));
        }
    }
    let area: f32 = (2..kept.len())
        .map(|i| (kept[i - 1] - kept[0]).perp_dot(kept[i] - kept[0]))
        .sum();
    if area <= f32::MIN_POSITIVE { Vec::new() } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: Tolerance = Tolerance {
        plane_m: 1e-5,
        hole_m: 1e-3,
    };

    fn p(u: f32, v: f32) -> Vec2 {
        Vec2::new(u, v)
    }

    #[test]
    fn two_triangles_cover_their_rectangle_and_a_cut_corner_does_not() {
        let lines = [vec![0.0, 2.0, 4.0], vec![0.0, 3.0]];
        let faces = [[p(0., 0.), p(4., 0.), p(4., 3.)], [p(0., 0.), p(4., 3.), p(0., 3.)]];
        assert_eq!(covered(faces.iter(), &lines, TOLERANCE), [true, true]);
        let cut = [[p(0., 0.), p(4., 0.), p(4., 3.)], [p(0., 0.), p(4., 3.), p(1., 3.)]];
        assert_eq!(covered(cut.iter(), &lines, TOLERANCE), [false, true]);
    }

    #[test]
    fn a_fan_of_slivers_closes_no_more_before_its_tip_than_one_face_does() {
        const SLIVERS: usize = 900;
        let tip = p(1.0, 1.0);
        let rim = |i: usize| {
            let (sin, cos) = (std::f32::consts::FRAC_PI_2 * i as f32 / SLIVERS as f32).sin_cos();
            tip + p(cos, sin)
        };
        let fan: Vec<_> = (0..SLIVERS).map(|i| [tip, rim(i), rim(i + 1)]).collect();
        // A square hole before the tip, as wide as a sharp corner would reach without a limit.
        let hole_m = 0.1 * TOLERANCE.hole_m * SLIVERS as f32;
        let lines = [vec![1.0 - hole_m, 1.0], vec![1.0 - hole_m, 1.0]];
        assert_eq!(covered(fan.iter(), &lines, TOLERANCE), [false]);
        let lines = [vec![1.0 - 0.3e-3, 1.0], vec![1.0 - 0.3e-3, 1.0]];
        assert_eq!(
            covered(fan.iter(), &lines, TOLERANCE),
            [true],
            "a gap that is narrower than a hole"
        );
    }

    #[test]
    fn a_square_that_falls_into_too_many_pieces_is_open() {
        let is_covered = |fields: usize| {
            let field = |(i, j): (usize, usize)| {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| p(i as f32, j as f32));
                [[a, b, c], [a, c, d]]
            };
            // The dark fields of a chessboard, then one face that covers it all.
            let all = (0..fields).flat_map(|i| (0..fields).map(move |j| (i, j)));
            let dark = all.filter(|(i, j)| (i + j) % 2 == 0).flat_map(field);
            let size = fields as f32;
            let faces: Vec<_> = dark
                .chain([[p(-size, -size), p(4.0 * size, -size), p(-size, 4.0 * size)]])
                .collect();
            let lines = [0, 1].map(|_| vec![0.0, size]);
            covered(faces.iter(), &lines, TOLERANCE)
        };
        assert_eq!([is_covered(20), is_covered(80)], [[true], [false]]);
    }

    #[test]
    fn a_gap_as_wide_as_a_hole_stays_open() {
        let lines = [vec![0.0, 2.0], vec![0.0, 1.0]];
        let rectangle = |a: f32, b: f32| [[p(a, 0.), p(b, 0.), p(b, 1.)], [p(a, 0.), p(b, 1.), p(a, 1.)]];
        let with_gap = |gap_m: f32| [rectangle(0.0, 1.0), rectangle(1.0 + gap_m, 2.0)].concat();
        assert_eq!(covered(with_gap(0.9e-3).iter(), &lines, TOLERANCE), [true]);
        assert_eq!(covered(with_gap(1.2e-3).iter(), &lines, TOLERANCE), [false]);
    }
}
