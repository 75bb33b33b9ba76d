//! Where is the leaf of a door when it is closed?
//!
//! Across the thinnest side of the door, through its middle: the smallest rectangle around all of it, grown by the gap that a leaf
//! leaves open. A door that stands askew is thin across its own faces and ends at its own edges, not along axes of the world: a
//! rectangle along those would hide what is beside the door.

use glam::Vec3;

use super::{DOOR_GAP, Wall};
use crate::world::{Triangle, World};

/// So many directions are tried, those of the largest faces and the longest edges first.
const DIRECTIONS: usize = 16;
/// Directions whose angle has a smaller sine than this are the same.
const SAME: f32 = 1e-3;
/// What is smaller by less than this is no better.
const BETTER: f32 = 0.95;

/// The leaves of all doors of a world.
pub(super) fn leaves(world: &World) -> impl Iterator<Item = Wall> {
    let of = |door: &u32| {
        let triangles = world.triangles_of(*door);
        (!triangles.is_empty()).then(|| leaf(*door, &triangles))
    };
    world.doors().iter().filter_map(of)
}

fn leaf(door: u32, triangles: &[Triangle]) -> Wall {
    let extent = |direction: Vec3| -> [f32; 2] {
        let corners = triangles.iter().flat_map(|triangle| triangle.corners);
        let heights = corners.map(|corner| direction.dot(corner));
        heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], height| {
            [low.min(height), high.max(height)]
        })
    };
    let length = |direction: Vec3| {
        let [low, high] = extent(direction);
        high - low
    };
    let faces = triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.corners;
        (b - a).cross(c - a)
    });
    let normal = least(Vec3::AXES.into_iter().chain(unlike(faces)), length);
    // Of an edge through the door rounding would choose the direction.
    let edges = triangles.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.corners;
        let along = |edge: &Vec3| edge.dot(normal).abs() < 0.5 * edge.length();
        let edges = [b - a, c - b, a - c].into_iter().filter(along);
        edges.map(|edge| edge.reject_from_normalized(normal))
    });
    let across = |first: Vec3| [first, normal.cross(first)];
    let first = least(
        [Wall::axes_across(normal)[0]].into_iter().chain(unlike(edges)),
        |first| across(first).into_iter().map(length).product(),
    );
    let extents = across(first).map(extent);
    let longest_m = extents.iter().map(|[low, high]| high - low).fold(0.0, f32::max);
    let gap_m = DOOR_GAP * longest_m;
    let [front, back] = extent(normal);
    let lines = extents.map(|[low, high]| vec![low - gap_m, high + gap_m]);
    let opaque = [vec![true], vec![true]];
    let mut leaf = Wall::new(normal, 0.5 * (front + back), across(first), lines, opaque);
    leaf.door = Some(door);
    leaf
}

/// The direction with the least size; of those that differ by next to nothing the first.
fn least(directions: impl Iterator<Item = Vec3>, size: impl Fn(Vec3) -> f32) -> Vec3 {
    let sized = directions.map(|direction| (direction, size(direction)));
    let least = sized.reduce(|least, next| if next.1 < BETTER * least.1 { next } else { least });
    least.map_or(Vec3::X, |(direction, _)| direction)
}

/// The directions of the longest of these, none twice.
fn unlike(vectors: impl Iterator<Item = Vec3>) -> impl Iterator<Item = Vec3> {
    let mut vectors: Vec<Vec3> = vectors.collect();
    vectors.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let mut found: Vec<Vec3> = Vec::new();
    for direction in vectors.into_iter().filter_map(Vec3::try_normalize) {
        if found.len() == DIRECTIONS {
            break;
        }
        if found.iter().all(|known| known.cross(direction).length() > SAME) {
            found.push(direction);
        }
    }
    found.into_iter()
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    /// A door of 1 × 2 m, this thick, turned.
    fn door(thick_m: f32, turn: Quat) -> Vec<Triangle> {
        let at = |[u, v, w]: [f32; 3]| Vec3::new(3.0, 0.0, 1.0) + turn * Vec3::new(u, 2.0 * v, (w - 0.5) * thick_m);
        // Each side of a cube by its first axis: two triangles where that is 0, two where it is 1.
        let side = |(axis, end): (usize, f32)| {
            let corner = |v: f32, w: f32| {
                let mut corner = [end; 3];
                corner[(axis + 1) % 3] = v;
                corner[(axis + 2) % 3] = w;
                at(corner)
            };
            let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            [Triangle::between([a, b, c]), Triangle::between([a, c, d])]
        };
        let sides = (0..3).flat_map(|axis| [(axis, 0.0), (axis, 1.0)]);
        sides.flat_map(side).collect()
    }

    #[test]
    fn a_leaf_lies_in_its_door_and_ends_with_it_however_that_is_turned() {
        let level = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        for angle in [0.0, 0.3, 0.61, 1.2, 2.5] {
            for turn in [
                Quat::from_rotation_y(angle),
                Quat::from_rotation_y(angle) * level,
                Quat::from_rotation_z(angle),
            ] {
                for thick_m in [0.0, 0.04] {
                    let triangles = door(thick_m, turn);
                    let leaf = leaf(7, &triangles);
                    assert_eq!(leaf.door, Some(7));
                    for axis in leaf.axes {
                        assert!(axis.dot(leaf.normal).abs() < 1e-5, "{turn}: {axis}");
                    }
                    let corners = triangles.iter().flat_map(|triangle| triangle.corners);
                    let off_m = corners.map(|corner| (leaf.normal.dot(corner) - leaf.offset).abs());
                    let furthest_m = off_m.fold(0.0, f32::max);
                    assert!((furthest_m - 0.5 * thick_m).abs() < 1e-5, "{turn}: {furthest_m}");
                    let mut sizes = leaf.lines.each_ref().map(|lines| lines[1] - lines[0]);
                    sizes.sort_by(f32::total_cmp);
                    assert!((sizes[0] - 1.12).abs() < 1e-4, "{turn}: {sizes:?}");
                    assert!((sizes[1] - 2.12).abs() < 1e-4, "{turn}: {sizes:?}");
                }
            }
        }
    }
}
