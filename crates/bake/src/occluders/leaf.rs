//! Where is the leaf of a door when it is closed?
//!
//! Across the thinnest side of the door, where most of its faces lie: the smallest rectangle around all of it. A door that stands
//! askew is thin across its own faces and ends at its own edges, not along axes of the world: a rectangle along those would hide
//! what is beside the door.
//!
//! The leaf hides where faces that hide cover it: not through glass, holes or an arch's corners, and not from a side whose faces are
//! culled. It is looked at in squares half as wide as the gap that a closed door leaves around itself; those at its border are grown
//! by that gap.

use glam::{Vec2, Vec3};

use super::{DOOR_GAP, Tolerance, Wall, Way, squares};
use crate::world::{Triangle, World};

/// So many directions are tried, those of the largest faces and the longest edges first.
const DIRECTIONS: usize = 16;
/// Directions whose angle has a smaller sine than this are the same.
const SAME: f32 = 1e-3;
/// Faces across which sight lines run at a smaller sine than this cover nothing.
const EDGE_ON: f32 = 1e-3;
/// So many squares from end to end at most; as many as [`DOOR_GAP`] asks for, but for rounding.
const MOST_STEPS: f32 = 80.0;
/// What is smaller by less than this is no better.
const BETTER: f32 = 0.95;

/// The leaves of all doors of a world.
pub(super) fn leaves(world: &World, tolerance: Tolerance) -> impl Iterator<Item = Wall> {
    let of = move |door: &u32| {
        let triangles: Vec<_> = world.triangles_of(*door).iter().map(|face| face.closed()).collect();
        (!triangles.is_empty()).then(|| leaf(*door, &triangles, tolerance))
    };
    world.doors().iter().filter_map(of)
}

fn leaf(door: u32, triangles: &[Triangle], tolerance: Tolerance) -> Wall {
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
    let axes = across(first);
    let extents = axes.map(extent);
    let longest_m = extents.iter().map(|[low, high]| high - low).fold(0.0, f32::max);
    let gap_m = DOOR_GAP * longest_m;
    let mut lines = extents.map(|extent| cut_up(extent, 0.5 * gap_m));
    let mut opaque = [Way::Against, Way::Along].map(|way| {
        let faces = triangles.iter().filter(|triangle| hides(triangle, normal, way));
        let flat: Vec<[Vec2; 3]> = faces
            .map(|triangle| triangle.corners.map(|p| Vec2::new(axes[0].dot(p), axes[1].dot(p))))
            .collect();
        let mut squares = squares::covered(flat.iter(), &lines, tolerance);
        close_rim(&mut squares, lines.each_ref().map(|lines| lines.len() - 1));
        squares
    });
    for lines in &mut lines {
        let last = lines.len() - 1;
        lines[0] -= gap_m;
        lines[last] += gap_m;
    }
    squares::join(&mut lines, &mut opaque);
    let mut leaf = Wall::new(normal, middle(triangles, normal), axes, lines, opaque);
    leaf.door = Some(door);
    leaf
}

/// Takes squares at the border for opaque where those beside them are: rounded corners and hinges leave no gap wider than the one
/// around a door.
fn close_rim(squares: &mut [bool], [columns, rows]: [usize; 2]) {
    if columns > 2 {
        for row in squares.chunks_mut(columns) {
            row[0] |= row[1];
            row[columns - 1] |= row[columns - 2];
        }
    }
    if rows > 2 {
        for i in 0..columns {
            squares[i] |= squares[columns + i];
            squares[(rows - 1) * columns + i] |= squares[(rows - 2) * columns + i];
        }
    }
}

/// Whether a face hides what is behind it from sight lines that cross a plane this way.
fn hides(triangle: &Triangle, normal: Vec3, way: Way) -> bool {
    let [a, b, c] = triangle.corners;
    let turned = (b - a).cross(c - a).normalize_or_zero().dot(normal);
    let met_in_front = (turned > 0.0) == (way == Way::Against);
    turned.abs() > EDGE_ON
        && if met_in_front {
            triangle.hides_from_front()
        } else {
            triangle.hides_from_back()
        }
}

/// How far out the faces across a normal lie, by their areas: a handle does not count.
fn middle(triangles: &[Triangle], normal: Vec3) -> f32 {
    let (mut sum, mut areas) = (0.0, 0.0);
    for triangle in triangles {
        let [a, b, c] = triangle.corners;
        let area = (b - a).cross(c - a).dot(normal).abs().max(f32::MIN_POSITIVE);
        sum += area * normal.dot(a + b + c) / 3.0;
        areas += area;
    }
    sum / areas
}

/// Lines from one end to the other, no further apart than this.
fn cut_up([low, high]: [f32; 2], widest_m: f32) -> Vec<f32> {
    let steps = ((high - low) / widest_m).ceil().clamp(1.0, MOST_STEPS) as u32;
    let inner = (1..steps).map(|step| low + (high - low) * step as f32 / steps as f32);
    let mut lines: Vec<f32> = std::iter::once(low).chain(inner).collect();
    lines.push(high);
    lines
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

    const TOLERANCE: Tolerance = Tolerance {
        plane_m: 1e-6,
        hole_m: 1e-5,
    };

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
            let [a, c] = [corner(0.0, 0.0), corner(1.0, 1.0)];
            let [mut b, mut d] = [corner(1.0, 0.0), corner(0.0, 1.0)];
            if end == 0.0 {
                std::mem::swap(&mut b, &mut d);
            }
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
                    let leaf = leaf(7, &triangles, TOLERANCE);
                    assert_eq!(leaf.door, Some(7));
                    assert!(leaf.is_filled(), "{turn}: {leaf:?}");
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

    /// A sheet in the plane z = 0.5 around a hole from 0.4 to 0.6 of its edges, seen from its front, with a handle before it.
    fn sheet() -> Vec<Triangle> {
        let rectangle = |[left, right]: [f32; 2], [low, high]: [f32; 2], z: f32| {
            let [a, b, c, d] =
                [[left, low], [right, low], [right, high], [left, high]].map(|[x, y]| Vec3::new(x, y, z));
            [Triangle::between([a, b, c]), Triangle::between([a, c, d])]
        };
        [
            rectangle([0.0, 2.0], [0.0, 0.8], 0.5),
            rectangle([0.0, 2.0], [1.2, 2.0], 0.5),
            rectangle([0.0, 0.8], [0.8, 1.2], 0.5),
            rectangle([1.2, 2.0], [0.8, 1.2], 0.5),
            rectangle([1.8, 1.9], [1.0, 1.1], 0.6),
        ]
        .concat()
    }

    #[test]
    fn a_leaf_hides_where_it_is_opaque_and_from_the_side_of_its_faces() {
        let leaf = leaf(0, &sheet(), TOLERANCE);
        assert!(!leaf.is_filled());
        assert!(
            (leaf.offset - 0.5).abs() < 1e-3,
            "in the sheet, not half way to the handle: {}",
            leaf.offset
        );
        let way = if leaf.normal.z > 0.0 {
            [Way::Against, Way::Along]
        } else {
            [Way::Along, Way::Against]
        };
        let opaque = |way: Way, x: f32, y: f32| leaf.opaque_at(way, leaf.place(Vec3::new(x, y, 0.5)));
        let hides = |x: f32, y: f32| opaque(way[0], x, y);
        assert!(hides(0.3, 0.3) && hides(1.0, 1.5) && hides(0.5, 1.0));
        assert!(hides(-0.05, 1.0) && hides(2.05, 2.05), "the gap around it is closed");
        assert!(!hides(-0.07, 1.0));
        assert!(
            !hides(1.0, 1.0) && !hides(0.81, 0.81) && !hides(1.19, 1.0),
            "its hole is not"
        );
        assert!(!leaf.hides(way[1]), "nor is its back");
    }

    #[test]
    fn a_hinge_opens_no_gap() {
        let mut triangles = door(0.04, Quat::IDENTITY);
        let hinge = Vec3::new(2.98, 1.0, 1.0);
        triangles.push(Triangle::between([hinge, hinge + 0.1 * Vec3::X, hinge + 0.1 * Vec3::Y]));
        let leaf = leaf(0, &triangles, TOLERANCE);
        assert!(leaf.is_filled(), "{:?}", leaf.lines);
    }
}
