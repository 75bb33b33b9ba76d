//! How is a polygon filled with triangles? By cutting off its ears (Meisters 1975).
//!
//! Polygons lie in a plane with axes x and z and are seen from above, that is from +y: so that a turn from z to x is
//! counter-clockwise.

use crate::procedural::error::Problem;

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
            let around = |i: usize| [left[(i + count - 1) % count], left[i], left[(i + 1) % count]];
            let turns = |i: usize| {
                let [a, b, c] = around(i).map(|corner| corners[corner as usize]);
                turn(a, b, c)
            };
            // What is left may lie in a line; a corner in a line bounds nothing.
            let ear = (0..count).find(|&i| turns(i) > 0.0 && is_empty(around(i), left, corners));
            if let Some(ear) = ear {
                triangles.push(around(ear));
            }
            match ear.or_else(|| (0..count).find(|&i| turns(i) == 0.0)) {
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
    let others = left.iter().filter(|other| !triangle.contains(other));
    let mut others = others
        .map(|&other| corners[other as usize])
        .filter(|p| ![a, b, c].contains(p));
    !others.any(is_inside)
}

/// The normal of a polygon in space, as long as twice its area (Newell).
pub(super) fn newell(corners: &[[f64; 3]]) -> [f64; 3] {
    let mut normal = [0.0; 3];
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        for (axis, sum) in normal.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += (a[u] - b[u]) * (a[v] + b[v]);
        }
    }
    normal
}
