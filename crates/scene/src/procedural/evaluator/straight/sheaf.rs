//! Which triangles do the meshes of several turns have? Their faces are the same in each turn: so what is computed of a
//! triangle, as [`Solid::write`](crate::procedural::solid::Solid::write) does it, is computed of it in all turns side by side.

use std::ops::Range;

use super::code::Register;
use super::plan::Frame;
use crate::Bounds;
use crate::procedural::affine::{cross, dot};
use crate::procedural::solid::Mesh;

/// Vertices of a mesh in several turns, those of each turn one behind the other.
#[derive(Debug, Default)]
pub(super) struct Sheaf {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// The corners of all triangles by the numbers of the vertices, in so many turns as there were at most, and for which frames:
    /// whether that of a turn turns left into right.
    corners: Vec<u32>,
    mirrored: Vec<bool>,
    /// Boxes that hold it: for each turn the least x, then for each the most x, and so on up to the most z. They are not known where
    /// all turns lie within the bounds that were there before.
    ends: Vec<f64>,
    is_within: bool,
    /// How many vertices a turn has.
    vertices: usize,
    /// As they are written: along each axis where each point lies in all turns, then where each triangle faces.
    written: Vec<f32>,
}

/// A vector for each of several turns.
type Vectors<const N: usize> = [[f64; N]; 3];

impl Sheaf {
    /// Places the same triangles between other points in each turn, where some lie within `bounds` already; whether each is sound,
    /// that is, cut off from its first corner on as [`Ears`](crate::procedural::solid) would.
    #[inline(always)]
    pub(super) fn place<const N: usize>(
        &mut self,
        numbers: &[[f64; N]],
        frame: &Frame,
        (points, triangles): (&[Register], &[[u32; 3]]),
        bounds: &Bounds,
    ) -> bool {
        let frame: [&[f64; N]; 12] = frame.map(|register| &numbers[register as usize]);
        let (normals, mirrored) = normals_of(frame);
        let point = |p: u32| {
            let [x, y, z] = points.as_chunks::<3>().0[p as usize];
            [&numbers[x as usize], &numbers[y as usize], &numbers[z as usize]]
        };
        let points = points.len() / 3;
        self.written.resize(3 * N * (points + triangles.len()), 0.0);
        let written = self.written.as_chunks_mut::<N>().0.as_chunks_mut::<3>().0;
        let (places, directions) = written.split_at_mut(points);
        let mut farthest = [[0.0; N]; 3];
        for (p, place) in (0..).zip(&mut *places) {
            let point = point(p);
            *place = placed(frame, point);
            widen(&mut farthest, point);
        }
        let mut are_sound = true;
        for (&[a, b, c], direction) in triangles.iter().zip(&mut *directions) {
            let (facing, is_sound) = facing(&normals, [point(a), point(b), point(c)]);
            *direction = facing;
            are_sound &= is_sound;
        }
        self.vertices = 3 * triangles.len();
        self.positions.resize(N * self.vertices, [0.0; 3]);
        self.normals.resize(N * self.vertices, [0.0; 3]);
        let positions = self.positions.as_chunks_mut::<3>().0;
        let normals = self.normals.as_chunks_mut::<3>().0;
        for (triangle, (&[a, b, c], direction)) in triangles.iter().zip(&*directions).enumerate() {
            let corners = [&places[a as usize], &places[b as usize], &places[c as usize]];
            for turn in 0..N {
                let here = turn * triangles.len() + triangle;
                for (written, [x, y, z]) in positions[here].iter_mut().zip(corners) {
                    *written = [x[turn], y[turn], z[turn]];
                }
                let [x, y, z] = direction;
                normals[here] = [[x[turn], y[turn], z[turn]]; 3];
            }
        }
        if self.mirrored.get(..N) != Some(&mirrored[..]) {
            self.mirrored.clear();
            self.mirrored.extend(mirrored);
            self.corners.clear();
            let turns = mirrored.iter().enumerate();
            let corners = turns.flat_map(|(turn, &mirrored)| corners_of(turn * self.vertices, self.vertices, mirrored));
            self.corners.extend(corners);
        }
        self.is_within = is_within(frame, &farthest, bounds);
        if !self.is_within {
            self.ends.resize(6 * N, 0.0);
            let ends = self.ends.as_chunks_mut::<N>().0.as_chunks_mut::<2>().0;
            put_bounds(frame, (0..points as u32).map(point), ends);
        }
        are_sound
    }

    /// A box that holds what some turns have beyond the bounds that were there before.
    pub(super) fn bounds(&self, turns: Range<usize>) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        if self.is_within {
            return bounds;
        }
        let rows = self.ends.chunks_exact(self.ends.len() / 6);
        let mut rows = rows.map(|row| &row[turns.clone()]);
        for (min, max) in bounds.min.iter_mut().zip(&mut bounds.max) {
            let least = |least: f64, &end: &f64| if end < least { end } else { least };
            let most = |most: f64, &end: &f64| if end > most { end } else { most };
            *min = rows.next().unwrap_or_default().iter().fold(*min, least);
            *max = rows.next().unwrap_or_default().iter().fold(*max, most);
        }
        bounds
    }

    /// Adds the triangles of some turns.
    pub(super) fn write(&self, turns: Range<usize>, mesh: &mut Mesh) {
        let first = mesh.positions.len() as u32;
        let here = turns.start * self.vertices..turns.end * self.vertices;
        mesh.positions.extend_from_slice(&self.positions[here.clone()]);
        mesh.normals.extend_from_slice(&self.normals[here.clone()]);
        // The first of these vertices is the next of the mesh.
        let shift = first.wrapping_sub(here.start as u32);
        let corners = self.corners[here].iter();
        mesh.indices.extend(corners.map(|corner| corner.wrapping_add(shift)));
    }
}

/// The corners of triangles between so many vertices, three for each, from one on.
fn corners_of(first: usize, vertices: usize, mirrored: bool) -> impl Iterator<Item = u32> {
    let order = if mirrored { [2, 1, 0] } else { [2, 0, 1] };
    let triangles = (first..first + vertices).step_by(3);
    triangles.flat_map(move |corner| order.map(|i| corner as u32 + i))
}

/// As [`Affine::normals`](crate::procedural::affine::Affine::normals), and whether the frame turns left into right.
#[inline(always)]
fn normals_of<const N: usize>(
    [ax, ay, az, bx, by, bz, cx, cy, cz, ..]: [&[f64; N]; 12],
) -> ([Vectors<N>; 3], [bool; N]) {
    let (mut normals, mut mirrored) = ([[[0.0; N]; 3]; 3], [false; N]);
    for i in 0..N {
        let (a, b, c) = (
            vector([ax, ay, az], i),
            vector([bx, by, bz], i),
            vector([cx, cy, cz], i),
        );
        let (x, y, z) = (cross(b, c), cross(c, a), cross(a, b));
        mirrored[i] = dot(a, x) < 0.0;
        let sign = if mirrored[i] { -1.0 } else { 1.0 };
        for axis in 0..3 {
            normals[0][axis][i] = x[axis] * sign;
            normals[1][axis][i] = y[axis] * sign;
            normals[2][axis][i] = z[axis] * sign;
        }
    }
    (normals, mirrored)
}

/// Where a point comes to lie, as it is written.
#[inline(always)]
fn placed<const N: usize>(frame: [&[f64; N]; 12], [x, y, z]: [&[f64; N]; 3]) -> [[f32; N]; 3] {
    let mut placed = [[0.0; N]; 3];
    for (axis, placed) in placed.iter_mut().enumerate() {
        let [a, b, c, origin] = [frame[axis], frame[3 + axis], frame[6 + axis], frame[9 + axis]];
        for i in 0..N {
            placed[i] = (a[i] * x[i] + b[i] * y[i] + c[i] * z[i] + origin[i]) as f32;
        }
    }
    placed
}

/// The normal of a triangle as it is written, and whether it is counter-clockwise in all turns where it has most area.
#[inline(always)]
fn facing<const N: usize>(normals: &[Vectors<N>; 3], [a, b, c]: [[&[f64; N]; 3]; 3]) -> ([[f32; N]; 3], bool) {
    let (mut written, mut sound) = ([[0.0; N]; 3], 0);
    for i in 0..N {
        let (a, b, c) = (vector(a, i), vector(b, i), vector(c, i));
        // Newell's normal, and the areas along each axis as cutting off ears measures them.
        let (x, y, z) = (
            newell(a, b, c, [1, 2]),
            newell(a, b, c, [2, 0]),
            newell(a, b, c, [0, 1]),
        );
        let [area_x, area_y, area_z] = cross(
            [a[0] - c[0], a[1] - c[1], a[2] - c[2]],
            [b[0] - c[0], b[1] - c[1], b[2] - c[2]],
        );
        let (steep, area) = if y.abs() > x.abs() { (y, area_y) } else { (x, area_x) };
        let (steep, area) = if z.abs() > steep.abs() {
            (z, area_z)
        } else {
            (steep, area)
        };
        let towards = if steep < 0.0 { -area } else { area };
        sound += u32::from(towards > 0.0);
        let mut direction = [0.0; 3];
        for axis in 0..3 {
            direction[axis] = normals[0][axis][i] * x + normals[1][axis][i] * y + normals[2][axis][i] * z;
        }
        let length = dot(direction, direction).sqrt();
        for axis in 0..3 {
            let upright = if axis == 1 { 1.0 } else { 0.0 };
            let shortened = direction[axis] / length;
            written[axis][i] = if length > 0.0 { shortened as f32 } else { upright };
        }
    }
    (written, sound == N as u32)
}

/// How far points lie from the origin along each axis, either way, with one point more.
#[inline(always)]
fn widen<const N: usize>(farthest: &mut Vectors<N>, point: [&[f64; N]; 3]) {
    for axis in 0..3 {
        let (along, far) = (point[axis].map(f64::abs), farthest[axis]);
        farthest[axis] = std::array::from_fn(|i| if along[i] > far[i] { along[i] } else { far[i] });
    }
}

/// Whether points that lie so far from the origin of a frame, at most, are within bounds in all turns. The corners of the
/// [box](put_bounds) around them lie no farther, as rounding keeps order.
#[inline(always)]
fn is_within<const N: usize>(frame: [&[f64; N]; 12], farthest: &Vectors<N>, bounds: &Bounds) -> bool {
    let mut is_within = true;
    for along in 0..3 {
        let [a, b, c, origin] = [frame[along], frame[3 + along], frame[6 + along], frame[9 + along]];
        for i in 0..N {
            let reach = a[i].abs() * farthest[0][i] + b[i].abs() * farthest[1][i] + c[i].abs() * farthest[2][i];
            is_within &= (origin[i] - reach >= bounds.min[along]) & (origin[i] + reach <= bounds.max[along]);
        }
    }
    is_within
}

/// As [`Affine::bounds`](crate::procedural::affine::Affine::bounds) of the box around some points: along each axis the least and
/// the most.
#[inline(always)]
fn put_bounds<'n, const N: usize>(
    frame: [&[f64; N]; 12],
    points: impl Iterator<Item = [&'n [f64; N]; 3]>,
    ends: &mut [[[f64; N]; 2]],
) {
    let (mut min, mut max) = ([[f64::INFINITY; N]; 3], [[f64::NEG_INFINITY; N]; 3]);
    for point in points {
        for axis in 0..3 {
            let (along, low, high) = (point[axis], min[axis], max[axis]);
            min[axis] = std::array::from_fn(|i| if along[i] < low[i] { along[i] } else { low[i] });
            max[axis] = std::array::from_fn(|i| if along[i] > high[i] { along[i] } else { high[i] });
        }
    }
    for (along, [least, most]) in ends.iter_mut().enumerate() {
        // What is added to −0 stays what it is.
        (*least, *most) = ([-0.0; N], [-0.0; N]);
        for axis in 0..3 {
            add_terms(frame[3 * axis + along], [&min[axis], &max[axis]], least, most);
        }
        for i in 0..N {
            least[i] += frame[9 + along][i];
            most[i] += frame[9 + along][i];
        }
    }
}

/// Adds the products of both ends of a span with a factor, the lesser to the least.
#[inline(always)]
fn add_terms<const N: usize>(factor: &[f64; N], [min, max]: [&[f64; N]; 2], least: &mut [f64; N], most: &mut [f64; N]) {
    for i in 0..N {
        let (of_min, of_max) = (factor[i] * min[i], factor[i] * max[i]);
        let is_upwards = factor[i] >= 0.0;
        least[i] += if is_upwards { of_min } else { of_max };
        most[i] += if is_upwards { of_max } else { of_min };
    }
}

/// Newell's normal of a triangle along one axis, by the coordinates along the two others.
#[inline(always)]
fn newell(a: [f64; 3], b: [f64; 3], c: [f64; 3], [u, v]: [usize; 2]) -> f64 {
    0.0 + (a[u] - b[u]) * (a[v] + b[v]) + (b[u] - c[u]) * (b[v] + c[v]) + (c[u] - a[u]) * (c[v] + a[v])
}

/// That of one turn.
#[inline(always)]
fn vector<const N: usize>([x, y, z]: [&[f64; N]; 3], turn: usize) -> [f64; 3] {
    [x[turn], y[turn], z[turn]]
}
