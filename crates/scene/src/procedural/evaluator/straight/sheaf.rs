//! Which triangles do the meshes of several turns have? Their faces are the same in each turn: so what is computed of a
//! triangle, as [`Solid::write`](crate::procedural::solid::Solid::write) does it, is computed of it in all turns side by side.

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
    /// Of each turn: a box that holds it, and whether its frame turns left into right.
    around: Vec<(Bounds, bool)>,
    /// How many vertices a turn has.
    vertices: usize,
}

/// A vector for each of several turns.
type Vectors<const N: usize> = [[f64; N]; 3];

impl Sheaf {
    /// Places the same triangles between other points in each turn; whether each is sound, that is, cut off from its first
    /// corner on as [`Ears`](crate::procedural::solid) would.
    #[inline(always)]
    pub(super) fn place<const N: usize>(
        &mut self,
        numbers: &[[f64; N]],
        frame: &Frame,
        (points, triangles): (&[Register], &[[u32; 3]]),
    ) -> bool {
        let frame: [&[f64; N]; 12] = frame.map(|register| &numbers[register as usize]);
        let (normals, mirrored) = normals_of(frame);
        let point = |p: u32| {
            let [x, y, z] = points.as_chunks::<3>().0[p as usize];
            [&numbers[x as usize], &numbers[y as usize], &numbers[z as usize]]
        };
        self.vertices = 3 * triangles.len();
        self.positions.resize(N * self.vertices, [0.0; 3]);
        self.normals.resize(N * self.vertices, [0.0; 3]);
        let mut are_sound = true;
        for (t, &corners) in triangles.iter().enumerate() {
            let corners = corners.map(point);
            for (vertex, corner) in (3 * t..).zip(corners) {
                let placed = placed(frame, corner);
                for (turn, position) in self.positions[vertex..].iter_mut().step_by(self.vertices).enumerate() {
                    *position = [placed[0][turn], placed[1][turn], placed[2][turn]];
                }
            }
            let (normal, is_sound) = facing(&normals, corners);
            are_sound &= is_sound;
            for (turn, three) in self.normals[3 * t..].chunks_mut(self.vertices).enumerate() {
                three[..3].fill([normal[0][turn], normal[1][turn], normal[2][turn]]);
            }
        }
        let around = bounds_of(frame, (0..points.len() as u32 / 3).map(point));
        self.around.clear();
        self.around.extend(around.into_iter().zip(mirrored));
        are_sound
    }

    /// A box that holds it in a turn.
    pub(super) fn bounds(&self, turn: usize) -> Bounds {
        self.around[turn].0
    }

    /// Adds the triangles of a turn.
    pub(super) fn write(&self, turn: usize, mesh: &mut Mesh) {
        let first = mesh.positions.len() as u32;
        let here = turn * self.vertices..(turn + 1) * self.vertices;
        mesh.positions.extend_from_slice(&self.positions[here.clone()]);
        mesh.normals.extend_from_slice(&self.normals[here]);
        let order = if self.around[turn].1 { [2, 1, 0] } else { [2, 0, 1] };
        let before = mesh.indices.len();
        mesh.indices.resize(before + self.vertices, 0);
        let triangles = mesh.indices[before..].as_chunks_mut::<3>().0;
        for (corner, triangle) in (first..).step_by(3).zip(triangles) {
            *triangle = order.map(|i| corner + i);
        }
    }
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

/// As [`Affine::bounds`](crate::procedural::affine::Affine::bounds) of the box around some points.
#[inline(always)]
fn bounds_of<'n, const N: usize>(
    frame: [&[f64; N]; 12],
    points: impl Iterator<Item = [&'n [f64; N]; 3]>,
) -> [Bounds; N] {
    let (mut min, mut max) = ([[f64::INFINITY; N]; 3], [[f64::NEG_INFINITY; N]; 3]);
    for point in points {
        for axis in 0..3 {
            for i in 0..N {
                let along = point[axis][i];
                min[axis][i] = if along < min[axis][i] { along } else { min[axis][i] };
                max[axis][i] = if along > max[axis][i] { along } else { max[axis][i] };
            }
        }
    }
    let mut ends = [[[0.0; N]; 3]; 2];
    for along in 0..3 {
        for i in 0..N {
            let term = |axis: usize| ordered(frame[3 * axis + along][i], min[axis][i], max[axis][i]);
            let (x, y, z, origin) = (term(0), term(1), term(2), frame[9 + along][i]);
            ends[0][along][i] = x[0] + y[0] + z[0] + origin;
            ends[1][along][i] = x[1] + y[1] + z[1] + origin;
        }
    }
    std::array::from_fn(|i| {
        let [min, max] = ends.map(|end| end.map(|along| along[i]));
        Bounds { min, max }
    })
}

/// The products of both ends of a span with a factor, the lesser first.
#[inline(always)]
fn ordered(factor: f64, min: f64, max: f64) -> [f64; 2] {
    if factor >= 0.0 {
        [factor * min, factor * max]
    } else {
        [factor * max, factor * min]
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
