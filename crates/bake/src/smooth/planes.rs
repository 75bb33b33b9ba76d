//! Which planes does each vertex lie on? Those of its triangles, and upright ones where the surface ends.
//!
//! After Garland & Heckbert, *Surface simplification using quadric error metrics* (1997), §6: what has a border would
//! shrink for nothing without planes that keep it in place.

use glam::DVec3;

use super::quadric::Quadric;
use crate::radix;

/// Unit vectors point to the same side when their mean is as long.
const SAME_SIDE: f64 = 0.9;

/// The quadrics of all vertices.
pub(super) fn quadrics(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); positions.len()];
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(3 * triangles.len());
    let mut normals = Vec::with_capacity(triangles.len());
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        for (side, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
            edges.push((edge, 3 * t as u32 + side as u32));
        }
        let [p, q, r] = [a, b, c].map(|v| positions[v as usize]);
        let normal = unit((q - p).cross(r - p));
        normals.push(normal.map(|(normal, _)| normal));
        if let Some((normal, area)) = normal {
            let quadric = Quadric::plane(normal, p, area / 2.0);
            for vertex in [a, b, c] {
                quadrics[vertex as usize].add(&quadric);
            }
        }
    }
    radix::sort(&mut edges);
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        add_border(&mut quadrics, positions, triangles, &normals, same);
    }
    quadrics
}

/// Upright planes along an edge where the surface ends: all its triangles, be it one or a double layer, lie to the
/// same side of it. Without them what is flat would shrink for nothing.
fn add_border(
    quadrics: &mut [Quadric],
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    normals: &[Option<DVec3>],
    same: &[(u64, u32)],
) {
    let ends = |corner: u32| {
        let (triangle, side) = (triangles[corner as usize / 3], corner as usize % 3);
        (triangle[side], triangle[(side + 1) % 3])
    };
    let upright = |corner: u32| {
        let (from, to) = ends(corner);
        let along = positions[to as usize] - positions[from as usize];
        unit(normals[corner as usize / 3]?.cross(along))
    };
    let (mut inwards, mut count) = (DVec3::ZERO, 0.0);
    for (upright, _) in same.iter().filter_map(|&(_, corner)| upright(corner)) {
        inwards += upright;
        count += 1.0;
    }
    if inwards.length_squared() < (SAME_SIDE * count) * (SAME_SIDE * count) {
        return;
    }
    for &(_, corner) in same {
        if let Some((upright, length)) = upright(corner) {
            let (from, to) = ends(corner);
            let quadric = Quadric::plane(upright, positions[from as usize], length * length);
            quadrics[from as usize].add(&quadric);
            quadrics[to as usize].add(&quadric);
        }
    }
}

/// A direction without its length, and that; `None` when there is none.
fn unit(direction: DVec3) -> Option<(DVec3, f64)> {
    let length = direction.length();
    (length > 0.0).then(|| (direction / length, length))
}
