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

/// Triangles that fill a polygon whose corners are counter-clockwise.
///
/// # Errors
/// When it crosses itself or has no area.
pub(super) fn triangulated(corners: &[[f64; 2]]) -> Result<Vec<[usize; 3]>, Problem> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::new();
    while left.len() > 2 {
        let count = left.len();
        let around = |i: usize| [left[(i + count - 1) % count], left[i], left[(i + 1) % count]];
        let is_ear = |i: usize| {
            let [before, corner, after] = around(i);
            let [a, b, c] = [corners[before], corners[corner], corners[after]];
            let is_inside = |p: [f64; 2]| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            let others = left.iter().filter(|other| ![before, corner, after].contains(other));
            let mut others = others.map(|&other| corners[other]).filter(|p| ![a, b, c].contains(p));
            turn(a, b, c) > 0.0 && !others.any(is_inside)
        };
        match (0..count).find(|&i| is_ear(i)) {
            Some(ear) => {
                triangles.push(around(ear));
                left.remove(ear);
            }
            // What is left may lie in a line; a corner in a line bounds nothing.
            None => match (0..count).find(|&i| {
                let [a, b, c] = around(i).map(|corner| corners[corner]);
                turn(a, b, c) == 0.0
            }) {
                Some(straight) => {
                    left.remove(straight);
                }
                None => return Err(Problem::Polygon),
            },
        }
    }
    if triangles.is_empty() {
        Err(Problem::Polygon)
    } else {
        Ok(triangles)
    }
}

/// The normal of a polygon in space, as long as twice its area (Newell).
pub(super) fn newell(corners: &[[f64; 3]]) -> [f64; 3] {
    let mut normal = [0.0; 3];
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        for (axis, sum) in normal.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += (a[u] - b[u]) * (a[v] + b[v]);
        }
    }
    normal
}
