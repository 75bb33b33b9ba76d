//! How is geometry made? Boxes, surfaces of revolution, tubes along paths and free grids, gathered by finish.
//!
//! Faces are counter-clockwise from outside and normals are unit length: flat for boxes, smooth for grids, with a crease
//! where the profile of a surface of revolution turns sharply. Lengths are metres, +Y is up, a piece faces +Z.

use super::finish::{Finish, Palette};
use crate::source::{Primitive, SourceModel};
use glam::{Affine3A, Mat3, Vec3};
use std::f32::consts::TAU;

const WHITE: [f32; 4] = [1.0; 4];
/// A profile that turns by more than this has an edge there: cosine of 35°.
const CREASE_COS: f32 = 0.82;

/// Geometry under construction.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    parts: Vec<(Finish, Primitive)>,
    pose: Affine3A,
    tint: Option<[f32; 3]>,
}

impl Mesh {
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// Everything that `draw` adds is placed by `pose`.
    pub(super) fn posed(&mut self, pose: Affine3A, draw: impl FnOnce(&mut Self)) {
        let outer = self.pose;
        self.pose = outer * pose;
        draw(self);
        self.pose = outer;
    }

    /// Moved by `offset`.
    pub(super) fn moved(&mut self, offset: Vec3, draw: impl FnOnce(&mut Self)) {
        self.posed(Affine3A::from_translation(offset), draw);
    }

    /// Everything that follows gets this linear vertex colour, until it is changed.
    pub(super) fn tint(&mut self, linear: Option<[f32; 3]>) {
        self.tint = linear;
    }

    fn part(&mut self, finish: &Finish) -> &mut Primitive {
        let at = match self.parts.iter().position(|(known, _)| known == finish) {
            Some(at) => at,
            None => {
                self.parts.push((finish.clone(), Primitive::default()));
                self.parts.len() - 1
            }
        };
        &mut self.parts[at].1
    }

    /// A smooth or flat set of triangles; `vertices` are (position, normal, linear colour) before the pose.
    fn add(&mut self, finish: &Finish, vertices: &[(Vec3, Vec3, [f32; 4])], triangles: &[[u32; 3]]) {
        let pose = self.pose;
        let normals = Mat3::from(pose.matrix3).inverse().transpose();
        let part = self.part(finish);
        let first = part.positions.len() as u32;
        for &(position, normal, colour) in vertices {
            part.positions.push(pose.transform_point3(position).to_array());
            part.normals.push((normals * normal).normalize_or(Vec3::Y).to_array());
            part.colors.push(colour);
        }
        part.indices.extend(triangles.iter().flatten().map(|i| first + i));
    }

    fn colour(&self) -> [f32; 4] {
        self.tint.map_or(WHITE, |[r, g, b]| [r, g, b, 1.0])
    }

    /// A flat, convex polygon, counter-clockwise from its front, in the current tint.
    pub(super) fn polygon(&mut self, finish: &Finish, corners: &[Vec3]) {
        let colours = vec![self.colour(); corners.len()];
        self.shaded_polygon(finish, corners, &colours);
    }

    /// A flat, convex polygon with a linear colour for each corner.
    pub(super) fn shaded_polygon(&mut self, finish: &Finish, corners: &[Vec3], colours: &[[f32; 4]]) {
        let spread: Vec3 = (1..corners.len().saturating_sub(1))
            .map(|i| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]))
            .sum();
        let Some(normal) = spread.try_normalize() else { return };
        let vertices: Vec<_> = corners.iter().zip(colours).map(|(&p, &c)| (p, normal, c)).collect();
        let triangles: Vec<_> = (1..corners.len() as u32 - 1).map(|i| [0, i, i + 1]).collect();
        self.add(finish, &vertices, &triangles);
    }

    /// A box by its extreme corners.
    pub(super) fn cuboid(&mut self, finish: &Finish, min: Vec3, max: Vec3) {
        self.hexahedron(finish, [min, max], [min, max]);
    }

    /// A box by its width, height and depth, standing on y with its middle at x, z.
    pub(super) fn block(&mut self, finish: &Finish, foot: [f32; 3], size: [f32; 3]) {
        let half = Vec3::new(size[0] / 2.0, 0.0, size[2] / 2.0);
        let foot = Vec3::from(foot);
        self.cuboid(finish, foot - half, foot + half + Vec3::Y * size[1]);
    }

    /// A truncated pyramid: the bottom rectangle lies at `bottom[0].y`, the top one at `top[1].y`.
    pub(super) fn hexahedron(&mut self, finish: &Finish, bottom: [Vec3; 2], top: [Vec3; 2]) {
        let ring = |[min, max]: [Vec3; 2], y: f32| {
            [(min.x, max.z), (max.x, max.z), (max.x, min.z), (min.x, min.z)].map(|(x, z)| Vec3::new(x, y, z))
        };
        let (low, high) = (ring(bottom, bottom[0].y), ring(top, top[1].y));
        for i in 0..4 {
            let j = (i + 1) % 4;
            self.polygon(finish, &[low[i], low[j], high[j], high[i]]);
        }
        self.polygon(finish, &high);
        self.polygon(finish, &[low[3], low[2], low[1], low[0]]);
    }

    /// A smooth grid of `columns` × `rows` quads through `at(u, v)`, u and v in 0..=1, whose front is ∂u × ∂v. With
    /// `closed`, u = 0 and u = 1 are the same line.
    pub(super) fn grid(
        &mut self,
        finish: &Finish,
        (columns, rows, closed): (usize, usize, bool),
        at: impl Fn(f32, f32) -> Vec3,
    ) {
        self.coloured_grid(finish, (columns, rows, closed), |u, v| (at(u, v), None));
    }

    /// As [`Self::grid`], with a linear colour for each vertex where one is given.
    pub(super) fn coloured_grid(
        &mut self,
        finish: &Finish,
        (columns, rows, closed): (usize, usize, bool),
        at: impl Fn(f32, f32) -> (Vec3, Option<[f32; 3]>),
    ) {
        let across = if closed { columns } else { columns + 1 };
        let plain = self.colour();
        let mut vertices: Vec<(Vec3, Vec3, [f32; 4])> = Vec::with_capacity(across * (rows + 1));
        for row in 0..=rows {
            for column in 0..across {
                let (position, colour) = at(column as f32 / columns as f32, row as f32 / rows as f32);
                vertices.push((position, Vec3::ZERO, colour.map_or(plain, |[r, g, b]| [r, g, b, 1.0])));
            }
        }
        let mut triangles = Vec::with_capacity(columns * rows * 2);
        for row in 0..rows {
            for column in 0..columns {
                let next = if closed { (column + 1) % columns } else { column + 1 };
                let corner = |c: usize, r: usize| (r * across + c) as u32;
                let [a, b, c, d] = [
                    corner(column, row),
                    corner(next, row),
                    corner(next, row + 1),
                    corner(column, row + 1),
                ];
                for triangle in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = triangle.map(|i| vertices[i as usize].0);
                    let spread = (q - p).cross(r - p);
                    if spread.length_squared() > 1e-14 {
                        triangles.push(triangle);
                        for i in triangle {
                            vertices[i as usize].1 += spread;
                        }
                    }
                }
            }
        }
        self.add(finish, &vertices, &triangles);
    }

    /// A surface of revolution about Y through (radius, height) points from bottom to top.
    pub(super) fn lathe(&mut self, finish: &Finish, profile: &[(f32, f32)], segments: usize) {
        self.fluted_lathe(finish, profile, segments, |_, _| 1.0);
    }

    /// A surface of revolution whose radius is multiplied by `flute(angle, height)`.
    pub(super) fn fluted_lathe(
        &mut self,
        finish: &Finish,
        profile: &[(f32, f32)],
        segments: usize,
        flute: impl Fn(f32, f32) -> f32,
    ) {
        let direction = |i: usize| {
            let ((r0, y0), (r1, y1)) = (profile[i], profile[i + 1]);
            glam::Vec2::new(r1 - r0, y1 - y0).normalize_or_zero()
        };
        let mut start = 0;
        for i in 1..profile.len() {
            let last = i + 1 == profile.len();
            if last || direction(i - 1).dot(direction(i)) < CREASE_COS {
                let piece = &profile[start..=i];
                self.grid(finish, (segments, piece.len() - 1, true), |u, v| {
                    let (r, y) = piece[(v * (piece.len() - 1) as f32).round() as usize];
                    let r = r * flute(u * TAU, y);
                    Vec3::new(r * (u * TAU).sin(), y, r * (u * TAU).cos())
                });
                start = i;
            }
        }
    }

    /// A round tube through `path`, each point with its radius; ends are closed.
    pub(super) fn tube(&mut self, finish: &Finish, path: &[(Vec3, f32)], sides: usize) {
        let Some((first, last)) = path.first().zip(path.last()) else {
            return;
        };
        let mut rings: Vec<(Vec3, f32)> = Vec::with_capacity(path.len() + 2);
        rings.push((first.0, 0.0));
        rings.extend_from_slice(path);
        rings.push((last.0, 0.0));
        let tangent = |i: usize| {
            let i = i.saturating_sub(1).min(path.len() - 1);
            (path[(i + 1).min(path.len() - 1)].0 - path[i.saturating_sub(1)].0).normalize_or(Vec3::Y)
        };
        let mut side = tangent(0).any_orthonormal_vector();
        let frames: Vec<(Vec3, Vec3)> = (0..rings.len())
            .map(|i| {
                let t = tangent(i);
                side = (side - t * side.dot(t)).normalize_or(t.any_orthonormal_vector());
                (side, side.cross(t))
            })
            .collect();
        self.grid(finish, (sides, rings.len() - 1, true), |u, v| {
            let i = (v * (rings.len() - 1) as f32).round() as usize;
            let (sin, cos) = (u * TAU).sin_cos();
            rings[i].0 + rings[i].1 * (frames[i].0 * sin + frames[i].1 * cos)
        });
    }

    /// An ellipsoid by its middle and three radii.
    pub(super) fn ellipsoid(&mut self, finish: &Finish, middle: Vec3, radii: Vec3, segments: usize) {
        self.grid(finish, (segments, segments / 2, true), |u, v| {
            middle + radii * on_sphere(u, v)
        });
    }

    /// The finished model; colours are kept only where something is coloured.
    pub(super) fn into_model(self, name: String, palette: &mut Palette) -> SourceModel {
        let primitives =
            self.parts
                .into_iter()
                .filter(|(_, part)| !part.indices.is_empty())
                .map(|(finish, mut part)| {
                    if part.colors.iter().all(|c| *c == WHITE) {
                        part.colors.clear();
                    }
                    part.material = Some(palette.index(&finish));
                    part
                });
        SourceModel {
            name,
            primitives: primitives.collect(),
            ..SourceModel::default()
        }
    }
}

/// A point of the unit sphere; u goes around, v from the bottom to the top.
pub(super) fn on_sphere(u: f32, v: f32) -> Vec3 {
    let (sin, cos) = (u * TAU).sin_cos();
    let (up, out) = ((v - 0.5) * TAU / 2.0).sin_cos();
    let out = if v <= 0.0 || v >= 1.0 { 0.0 } else { out };
    Vec3::new(out * sin, up, out * cos)
}

/// A smooth curve of `count` + 1 points through `knots` (Catmull & Rom 1974, uniform), x, y, z and radius together.
pub(super) fn curve(knots: &[(Vec3, f32)], count: usize) -> Vec<(Vec3, f32)> {
    let last = knots.len() - 1;
    let knot = |i: isize| {
        let (p, r) = knots[i.clamp(0, last as isize) as usize];
        p.extend(r)
    };
    (0..=count)
        .map(|k| {
            let x = k as f32 / count as f32 * last as f32;
            let i = (x as usize).min(last - 1) as isize;
            let t = x - i as f32;
            let [a, b, c, d] = [knot(i - 1), knot(i), knot(i + 1), knot(i + 2)];
            let p = 0.5
                * (2.0 * b
                    + (c - a) * t
                    + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
                    + (3.0 * b - a - 3.0 * c + d) * t * t * t);
            (p.truncate(), p.w.max(0.001))
        })
        .collect()
}
