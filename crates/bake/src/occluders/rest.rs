//! Where is the inside of a thing that its bodies leave?
//!
//! Bodies lie inside a shape. What they leave of one that is not convex is inside all the same: an eye in there looks out
//! through backs, so the bodies of the shape hide nothing from it (`visibility/within.rs`). A coarse grid cuts the shape
//! into pieces, and each piece becomes a convex body around it that hides nothing.
//!
//! The piece in a voxel is the hull of the corners of what the shape's faces leave of the voxel: of the faces clipped to the
//! voxel, and the voxel's corners inside the shape. All its extreme points are among these. Inside is what the faces wind
//! around (Van Oosterom & Strackee, *The solid angle of a plane triangle*, 1983), by half or more of a turn of theirs, so
//! that a missing bottom counts as closed and a cavity as outside.
//!
//! Guarantee: a point inside the shape is in a piece, if it is further than the margin from its surface.

use glam::{DVec3, Vec3, Vec4};

use super::fill::Triangle;

/// The grid has so many voxels along an axis …
const VOXELS: usize = 4;
/// … between these shares of the shape's box, off wherever authors like to put faces.
const LINES: [f32; VOXELS + 1] = [0.0, 0.237_1, 0.487_3, 0.743_9, 1.0];
/// Where pieces meet, each reaches so many times the slack into the other.
const OVERLAP: f32 = 3.0;
/// A piece has at most so many faces that are no sides of its box.
const MAX_PLANES: usize = 8;
/// Wound around by more than this share, a point is inside: half of it in the plane of a missing bottom.
const INSIDE: f64 = 0.25;

/// A convex region around a part of a shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piece {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    /// `xyz · p ≤ w`, with normals of length 1.
    pub(super) planes: Vec<Vec4>,
}

/// Convex pieces that hold all of the inside of a surface, which is closed but for a flat bottom, and still do so when each
/// is made smaller by `slack_m` on all sides, but for what is that near to the surface. Planes that so much of a piece reaches
/// across count as its faces.
pub(super) fn pieces(surface: &[Triangle], min: Vec3, max: Vec3, slack_m: f32) -> Vec<Piece> {
    let line = |at: [usize; 3]| {
        Vec3::from([0, 1, 2].map(|axis| match at[axis] {
            // The last one exactly, whatever rounding makes of it.
            VOXELS => max[axis],
            k => min[axis] + LINES[k] * (max[axis] - min[axis]),
        }))
    };
    let lines = VOXELS + 1;
    let number = |at: [usize; 3]| (at[2] * lines + at[1]) * lines + at[0];
    let mut inside = vec![false; lines * lines * lines];
    for at in all(lines) {
        inside[number(at)] = turns_around(line(at), surface).abs() > INSIDE;
    }
    let mut pieces = Vec::new();
    for at in all(VOXELS) {
        let (low, high) = (line(at), line(at.map(|k| k + 1)));
        let mut points: Vec<Vec3> = (0..8)
            .map(|corner| [0, 1, 2].map(|axis| at[axis] + (corner >> axis & 1)))
            .filter(|corner| inside[number(*corner)])
            .map(line)
            .collect();
        let mut planes: Vec<Vec4> = Vec::new();
        for triangle in surface {
            let clipped = clipped(triangle, low, high);
            if clipped.is_empty() {
                continue;
            }
            points.extend(clipped);
            let [a, b, c] = *triangle;
            if let Some(normal) = (b - a).cross(c - a).try_normalize() {
                planes.push(normal.extend(normal.dot(a)));
            }
        }
        if !points.is_empty() {
            let mut min = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let mut max = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            // Pieces overlap inside, so that no eye stands between two of them.
            for axis in 0..3 {
                if at[axis] > 0 && min[axis] <= low[axis] {
                    min[axis] -= OVERLAP * slack_m;
                }
                if at[axis] + 1 < VOXELS && max[axis] >= high[axis] {
                    max[axis] += OVERLAP * slack_m;
                }
            }
            pieces.push(Piece {
                min,
                max,
                planes: faces(&planes, &points, slack_m),
            });
        }
    }
    pieces
}

/// Every place of a cube of so many places along each axis.
fn all(count: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..count).flat_map(move |z| (0..count).flat_map(move |y| (0..count).map(move |x| [x, y, z])))
}

/// Those planes, either way round, that have all points on one side.
fn faces(planes: &[Vec4], points: &[Vec3], slack_m: f32) -> Vec<Vec4> {
    let mut faces: Vec<Vec4> = Vec::new();
    for plane in planes.iter().flat_map(|plane| [*plane, -*plane]) {
        let normal = plane.truncate();
        let known = |face: &Vec4| face.truncate().dot(normal) > 1.0 - 1e-6 && (face.w - plane.w).abs() <= slack_m;
        if faces.len() < MAX_PLANES
            && normal.abs().max_element() < 1.0 - 1e-6
            && !faces.iter().any(known)
            && points.iter().all(|p| normal.dot(*p) <= plane.w + slack_m)
        {
            faces.push(plane);
        }
    }
    faces
}

/// How often a surface winds around a point: 1 inside, −1 inside one whose faces look inwards, 0 outside.
fn turns_around(point: Vec3, surface: &[Triangle]) -> f64 {
    let point = point.as_dvec3();
    let angles = surface.iter().map(|triangle| {
        let [a, b, c]: [DVec3; 3] = triangle.map(|p| p.as_dvec3() - point);
        let [x, y, z] = [a, b, c].map(DVec3::length);
        let volume = a.dot(b.cross(c));
        2.0 * volume.atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    });
    angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// The corners of what a box leaves of a triangle (Sutherland & Hodgman, *Reentrant polygon clipping*, 1974).
fn clipped(triangle: &Triangle, low: Vec3, high: Vec3) -> Vec<Vec3> {
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        for (side, sign) in [(low[axis], 1.0), (high[axis], -1.0)] {
            let height = |p: Vec3| sign * (p[axis] - side);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let (here, there) = (height(*a), height(b));
                if here >= 0.0 {
                    kept.push(*a);
                }
                if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                    let mut crossing = a.lerp(b, here / (here - there));
                    crossing[axis] = side;
                    kept.push(crossing);
                }
            }
            polygon = kept;
            if polygon.is_empty() {
                return polygon;
            }
        }
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The walls, top and bottom of a prism over a ground plan that is seen from above in clockwise order, two triangles
    /// a wall; `caps` are its triangles.
    fn prism(plan: &[[f32; 2]], caps: &[[usize; 3]], height_m: f32) -> Vec<Triangle> {
        let at = |i: usize, y: f32| Vec3::new(plan[i % plan.len()][0], y, plan[i % plan.len()][1]);
        let walls = (0..plan.len()).flat_map(|i| {
            let [a, b, c, d] = [at(i, 0.0), at(i + 1, 0.0), at(i + 1, height_m), at(i, height_m)];
            [[a, b, c], [a, c, d]]
        });
        let caps = caps.iter().flat_map(|cap| {
            let [a, b, c] = *cap;
            [[a, b, c].map(|i| at(i, height_m)), [c, b, a].map(|i| at(i, 0.0))]
        });
        walls.chain(caps).collect()
    }

    fn turned(surface: &[Triangle], angle: f32) -> Vec<Triangle> {
        let turn = glam::Quat::from_rotation_y(angle);
        surface.iter().map(|t| t.map(|p| turn * p)).collect()
    }

    fn around(surface: &[Triangle]) -> [Vec3; 2] {
        let points = || surface.iter().flatten().copied();
        [
            points().fold(Vec3::INFINITY, Vec3::min),
            points().fold(Vec3::NEG_INFINITY, Vec3::max),
        ]
    }

    const SLACK_M: f32 = 1e-3;

    /// Whether a piece that was made smaller holds a point.
    fn holds(piece: &Piece, point: Vec3) -> bool {
        let below = |plane: &Vec4| plane.truncate().dot(point) <= plane.w - SLACK_M;
        point.cmpge(piece.min + SLACK_M).all()
            && point.cmple(piece.max - SLACK_M).all()
            && piece.planes.iter().all(below)
    }

    /// Whether a point is inside and no nearer to the surface than a few times the slack: so are all points around it.
    fn well_inside(point: Vec3, surface: &[Triangle]) -> bool {
        all(3).all(|at| {
            let around = point + 4.0 * SLACK_M * (Vec3::from(at.map(|k| k as f32)) - 1.0);
            turns_around(around, surface) > 0.5
        })
    }

    /// An L of 6 × 6 m with arms 2 m wide.
    fn l_shape() -> Vec<Triangle> {
        let plan = [[0.0, 0.0], [0.0, 6.0], [2.0, 6.0], [2.0, 2.0], [6.0, 2.0], [6.0, 0.0]];
        prism(&plan, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 3.0)
    }

    #[test]
    fn whatever_is_inside_is_in_a_piece_and_little_else_is() {
        for angle in [0.0, 0.3, 1.0] {
            let surface = turned(&l_shape(), angle);
            let [min, max] = around(&surface);
            let pieces = pieces(&surface, min, max, SLACK_M);
            let (mut inside, mut outside, mut too_much) = (0, 0, 0);
            // Places all over, and on the planes where pieces meet.
            let share = |k: usize| match k {
                24.. => LINES[k - 23],
                _ => (k as f32 + 0.5) / 24.0,
            };
            for at in all(24 + VOXELS - 1) {
                let point = min + Vec3::from(at.map(share)) * (max - min);
                let held = pieces.iter().any(|piece| holds(piece, point));
                if well_inside(point, &surface) {
                    inside += 1;
                    assert!(held, "{point} at {angle}");
                } else if turns_around(point, &surface) < 0.5 {
                    outside += 1;
                    too_much += usize::from(held);
                }
            }
            assert!(inside > 3_000 && outside > 3_000);
            // Around the inner corner.
            assert!(
                too_much * 12 < outside,
                "{too_much} of {outside} places outside at {angle}"
            );
        }
    }

    #[test]
    fn a_house_without_a_floor_is_full_and_a_cavity_is_not() {
        let plan = [[0.0, 0.0], [0.0, 4.0], [4.0, 4.0], [4.0, 0.0]];
        let caps = [[0, 1, 2], [0, 2, 3]];
        let whole = prism(&plan, &caps, 4.0);
        let [min, max] = around(&whole);
        let no_floor: Vec<_> = whole.iter().copied().filter(|t| t.iter().any(|p| p.y > 0.0)).collect();
        let held =
            |surface: &[Triangle], point: Vec3| pieces(surface, min, max, SLACK_M).iter().any(|p| holds(p, point));
        for y in [0.1, 2.0, 3.9] {
            assert!(held(&no_floor, Vec3::new(2.1, y, 1.9)), "{y}");
        }
        // A room in its middle, seen from inside.
        let room = whole.iter().map(|[a, b, c]| [*a, *c, *b].map(|p| 1.0 + 0.5 * p));
        let shell: Vec<Triangle> = whole.iter().copied().chain(room).collect();
        assert!(held(&shell, Vec3::splat(0.5)));
        assert!(!held(&shell, Vec3::splat(2.1)));
    }
}
