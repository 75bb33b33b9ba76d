//! How is a polygon filled with triangles? By cutting off its ears (Meisters 1975).
//!
//! Polygons lie in a plane with axes x and z and are seen from above, that is from +y: so that a turn from z to x is
//! counter-clockwise.

use crate::procedural::affine::dot;
use crate::procedural::problem::Problem;

/// Twice the signed area, positive when the corners are counter-clockwise.
fn twice_area(corners: &[[f64; 2]]) -> f64 {
    let next = |i: usize| corners[(i + 1) % corners.len()];
    corners.iter().enumerate().fold(0.0, |sum, (i, &[x, z])| {
        let [to_x, to_z] = next(i);
        sum + (z * to_x - x * to_z)
    })
}

/// The corners counter-clockwise, whichever way round they were given.
pub(crate) fn outline(corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut corners = corners.to_vec();
    if twice_area(&corners) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Twice the signed area of a triangle.
#[inline]
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Finds triangles that fill polygons, one after the other.
#[derive(Debug, Default)]
pub(super) struct Ears {
    /// Corners that are not cut off.
    left: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Ears {
    /// Triangles that fill a polygon whose corners are counter-clockwise.
    ///
    /// # Errors
    /// When it crosses itself or has no area.
    pub(super) fn cut_off(&mut self, corners: &[[f64; 2]]) -> Result<&[[u32; 3]], Problem> {
        let Self { left, triangles } = self;
        left.clear();
        left.extend(0..corners.len() as u32);
        triangles.clear();
        while left.len() > 2 {
            let count = left.len();
            let around = |i: usize| {
                let before = if i == 0 { count - 1 } else { i - 1 };
                let after = if i + 1 == count { 0 } else { i + 1 };
                [left[before], left[i], left[after]]
            };
            let turns = |[a, b, c]: [u32; 3]| turn(corners[a as usize], corners[b as usize], corners[c as usize]);
            // What is left may lie in a line; a corner in a line bounds nothing.
            let is_ear = |ear: [u32; 3]| turns(ear) > 0.0 && is_empty(ear, left, corners);
            let ear = (0..count).find(|&i| is_ear(around(i)));
            if let Some(ear) = ear {
                triangles.push(around(ear));
            }
            match ear.or_else(|| (0..count).find(|&i| turns(around(i)) == 0.0)) {
                Some(cut) => left.remove(cut),
                None => return Err(Problem::Polygon),
            };
        }
        if triangles.is_empty() {
            Err(Problem::Polygon)
        } else {
            Ok(triangles)
        }
    }
}

/// Whether no other corner lies in a triangle, its border included, but for those that lie on one of its corners.
fn is_empty(triangle: [u32; 3], left: &[u32], corners: &[[f64; 2]]) -> bool {
    let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
    let is_inside = |p: [f64; 2]| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    let is_corner = |p: [f64; 2]| p == a || p == b || p == c;
    left.iter().all(|&other| {
        let p = corners[other as usize];
        triangle.contains(&other) || !is_inside(p) || is_corner(p)
    })
}

/// Whether a triangle is counter-clockwise, or a quadrangle is cut into two that are, from its first corner to the last but
/// one, the first of which holds nothing of the second: as [`Ears`] cut.
#[inline]
pub(super) fn is_convex(corners: &[[f64; 2]]) -> bool {
    match *corners {
        [a, b, c] => turn(c, a, b) > 0.0,
        [a, b, c, d] => {
            let is_outside = turn(d, a, c) < 0.0 || turn(a, b, c) < 0.0 || turn(b, d, c) < 0.0;
            turn(d, a, b) > 0.0 && is_outside && turn(d, b, c) > 0.0
        }
        _ => false,
    }
}

/// The normal of a polygon in space, as long as twice its area (Newell).
#[inline]
pub(super) fn newell(corners: &[[f64; 3]]) -> [f64; 3] {
    let mut normal = [0.0; 3];
    for (i, [ax, ay, az]) in corners.iter().enumerate() {
        let [bx, by, bz] = corners.get(i + 1).unwrap_or(&corners[0]);
        normal[0] += (ay - by) * (az + bz);
        normal[1] += (az - bz) * (ax + bx);
        normal[2] += (ax - bx) * (ay + by);
    }
    normal
}

/// How far the corners of a polygon may lie off its plane, as a part of the longest side of a box around it.
const MOST_UNEVEN: f64 = 0.01;

/// That all corners lie in a plane, but for a little.
///
/// # Errors
/// When they do not.
pub(super) fn flat(corners: &[[f64; 3]]) -> Result<(), Problem> {
    let count = corners.len() as f64;
    let normal = newell(corners);
    let (mut size, mut middle) = (0.0, [0.0; 3]);
    for (axis, middle) in middle.iter_mut().enumerate() {
        let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for corner in corners {
            low = f64::min(low, corner[axis]);
            high = f64::max(high, corner[axis]);
            sum += corner[axis];
        }
        size = f64::max(size, high - low);
        *middle = sum / count;
    }
    let off = corners.iter().fold(0.0, |most, corner| {
        let [x, y, z] = [0, 1, 2].map(|axis| normal[axis] * (corner[axis] - middle[axis]));
        f64::max(most, (x + y + z).abs())
    });
    let whole = size * dot(normal, normal).sqrt();
    // What has no area is refused for that.
    if off <= MOST_UNEVEN * whole || whole == 0.0 {
        return Ok(());
    }
    let percent = (100.0 * (off / whole)).ceil();
    Err(Problem::NotFlat { percent })
}
