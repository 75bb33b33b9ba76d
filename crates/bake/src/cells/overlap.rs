//! How deep do two convex polyhedra overlap? Separating axes (Gottschalk, Lin & Manocha, *OBBTree*, 1996): the least
//! overlap along any face's normal and any two edges' cross product.

use glam::DVec3;

use super::hull::{CellHull, normal};

/// The least distance in metres by which one must move for them only to touch; zero when they do not overlap.
pub(super) fn overlap_m(a: &CellHull, b: &CellHull) -> f64 {
    let faces = a.planes.iter().chain(&b.planes).map(normal);
    let straight = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut least = f64::INFINITY;
    for axis in straight.into_iter().chain(faces) {
        least = least.min(along(a, b, axis));
        if least <= 0.0 {
            return 0.0;
        }
    }
    let (a_edges, b_edges) = (a.edges(), b.edges());
    for axis in a_edges.iter().flat_map(|u| b_edges.iter().map(|v| u.cross(*v))) {
        if let Some(axis) = axis.try_normalize() {
            least = least.min(along(a, b, axis));
            if least <= 0.0 {
                return 0.0;
            }
        }
    }
    least
}

fn along(a: &CellHull, b: &CellHull, axis: DVec3) -> f64 {
    let reach = |hull: &CellHull| {
        let heights = hull.shape.points.iter().map(|p| axis.dot(DVec3::from(*p)));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| {
            [low.min(h), high.max(h)]
        })
    };
    let ([a_low, a_high], [b_low, b_high]) = (reach(a), reach(b));
    (a_high - b_low).min(b_high - a_low)
}
