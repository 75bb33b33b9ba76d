//! What stands beside a door, and what of it lies in the plane of a leaf?
//!
//! Only what that plane cuts bounds a gap in it. What stands before or behind it leaves the plane free, and a leaf that was grown
//! there would hide what one sees past the door.

use glam::{DVec3, Vec3};

use super::{super::Tolerance, Door, Plane, gap::most_m};
use crate::{cells::clipped, world::World};

/// A plane may be moved to the depths of so many faces, or between them.
const MOST_DEPTHS: usize = 32;
/// … where so much more of what is around it stands in it.
const BETTER: f64 = 1.02;

/// A face beside a door, and whether it frames a gap: it hides, and is of no door.
#[derive(Clone, Copy)]
pub(super) struct Neighbour<P> {
    pub(super) corners: [P; 3],
    pub(super) frames: bool,
}

/// What a plane cuts out of a face: a convex polygon, across the door only as thick as rounding.
pub(super) struct Piece {
    pub(super) polygon: Vec<DVec3>,
    pub(super) frames: bool,
}

/// All faces around a door but its own.
pub(super) fn beside(world: &World, door: u32) -> Vec<Neighbour<Vec3>> {
    let bounds = &world.object_bounds()[door as usize];
    let room = Vec3::splat(most_m(bounds.diagonal_m() as f32));
    let mut faces = Vec::new();
    world.near(
        world.relative(bounds.min) - room,
        world.relative(bounds.max) + room,
        &mut |triangle| {
            if triangle.object != door {
                let hides = triangle.hides_from_front() || triangle.hides_from_back();
                faces.push(Neighbour {
                    corners: triangle.corners,
                    frames: hides && world.doors().binary_search(&triangle.object).is_err(),
                });
            }
        },
    );
    faces
}

/// What a plane at this depth cuts out of faces.
pub(super) fn pieces(faces: &[Neighbour<DVec3>], depth: f64, tolerance: Tolerance) -> Vec<Piece> {
    let off_m = f64::from(tolerance.plane_m);
    let cut = |face: &Neighbour<DVec3>| {
        let depths = face.corners.map(|corner| corner.z - depth);
        let is_met = depths.iter().any(|d| *d <= off_m) && depths.iter().any(|d| *d >= -off_m);
        is_met.then(|| Piece {
            polygon: within(&face.corners, 2, [depth - off_m, depth + off_m]),
            frames: face.frames,
        })
    };
    faces.iter().filter_map(cut).collect()
}

/// The part of a convex polygon between two planes across an axis.
pub(super) fn within(polygon: &[DVec3], axis: usize, [low, high]: [f64; 2]) -> Vec<DVec3> {
    let above = clipped(polygon, &|p: &DVec3| low - p[axis], 0.0);
    clipped(&above, &|p: &DVec3| p[axis] - high, 0.0)
}

/// From where to where a polygon reaches along an axis.
pub(super) fn extent(polygon: &[DVec3], axis: usize) -> [f64; 2] {
    polygon
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
            [low.min(p[axis]), high.max(p[axis])]
        })
}

impl Door {
    /// A plane that cuts the same of the door, where most of what is around it stands in it; the same one unless another is better.
    pub(super) fn framed(&self, plane: Plane, tolerance: Tolerance) -> Plane {
        let inset_m = 4.0 * f64::from(tolerance.plane_m);
        let [low, high] = [plane.between[0] + inset_m, plane.between[1] - inset_m];
        let faces = self.beside.iter().filter(|face| face.frames);
        let depths = faces.flat_map(|face| face.corners).map(|corner| corner.z);
        let mut depths: Vec<f64> = depths.filter(|depth| low < *depth && *depth < high).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup_by(|b, a| *b - *a <= inset_m);
        if depths.is_empty() || depths.len() > MOST_DEPTHS {
            return plane;
        }
        let ends: Vec<f64> = [low].into_iter().chain(depths.iter().copied()).chain([high]).collect();
        let between = ends.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]));
        let edges = self.sections(&plane).into_iter().flat_map(|section| section.edges);
        let corners: Vec<DVec3> = edges.flatten().map(|corner| corner.extend(plane.depth)).collect();
        let rectangle = [0, 1].map(|axis| extent(&corners, axis));
        let framed_m = |depth: f64| self.framed_m(rectangle, depth, tolerance);
        let best =
            between
                .chain(depths.iter().copied())
                .fold((plane.depth, BETTER * framed_m(plane.depth)), |best, next| {
                    let framed_m = framed_m(next);
                    if framed_m > best.1 { (next, framed_m) } else { best }
                });
        self.moved(&plane, best.0, tolerance)
    }

    /// How much of the sides of a rectangle has something beside it at this depth, in m.
    fn framed_m(&self, rectangle: [[f64; 2]; 2], depth: f64, tolerance: Tolerance) -> f64 {
        let longest_m = rectangle.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let gap_m = f64::from(most_m(longest_m as f32));
        let pieces = pieces(&self.beside, depth, tolerance);
        let sides = [0, 1]
            .into_iter()
            .flat_map(|axis| rectangle[axis].map(|edge| (axis, edge)));
        sides
            .map(|(axis, edge)| {
                let frames = pieces.iter().filter(|piece| piece.frames);
                let met = frames.map(|piece| within(&piece.polygon, axis, [edge - gap_m, edge + gap_m]));
                let met = met.map(|polygon| within(&polygon, 1 - axis, rectangle[1 - axis]));
                let met = met.filter(|polygon| !polygon.is_empty());
                length_of_union(met.map(|polygon| extent(&polygon, 1 - axis)).collect())
            })
            .sum()
    }
}

fn length_of_union(mut ranges: Vec<[f64; 2]>) -> f64 {
    ranges.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut end = f64::NEG_INFINITY;
    let mut length = 0.0;
    for [from, to] in ranges {
        length += (to - f64::max(from, end)).max(0.0);
        end = end.max(to);
    }
    length
}
