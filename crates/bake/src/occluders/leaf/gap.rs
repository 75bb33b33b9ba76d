//! On which sides does a closed door fill its opening but for a gap? Where something else stands along all of a side: a frame, a
//! floor, a wall. There the leaf is grown over the gap. Beside one of two leaves the way is open as long as the other is, and beside a door
//! that is narrower than its opening always: from there one sees past it.

use glam::{DVec3, Vec3};

use super::{
    super::{DOOR_GAP, Tolerance, squares},
    Door,
};
use crate::{cells::meets_box, world::World};

/// A side is looked at in stretches of this share of the widest gap.
const STRETCH: f32 = 0.25;

/// How wide a gap may be beside a leaf whose longest edge is this long.
pub(super) fn most_m(longest_m: f32) -> f32 {
    DOOR_GAP * longest_m
}

/// Faces around a door that hide, and are of no door.
pub(super) fn beside(world: &World, door: u32) -> Vec<[Vec3; 3]> {
    let bounds = &world.object_bounds()[door as usize];
    let room = Vec3::splat(most_m(bounds.diagonal_m() as f32));
    let mut faces = Vec::new();
    world.near(
        world.relative(bounds.min) - room,
        world.relative(bounds.max) + room,
        &mut |triangle| {
            let hides = triangle.hides_from_front() || triangle.hides_from_back();
            if hides && world.doors().binary_search(&triangle.object).is_err() {
                faces.push(triangle.corners);
            }
        },
    );
    faces
}

impl Door {
    /// Grows a leaf over the gap around it, but not on sides where nothing stands, or where glass or culled faces of the door go on.
    pub(super) fn close_gap(
        &self,
        (lines, opaque): (&mut [Vec<f32>; 2], &[Vec<bool>; 2]),
        gap_m: f32,
        tolerance: Tolerance,
    ) {
        let open = self.sheets.iter().filter(|sheet| sheet.hides != [true; 2]);
        let corners: Vec<_> = open.flat_map(|sheet| sheet.face).collect();
        let grown = [0, 1].map(|axis| {
            let (low, high) = (lines[axis][0], lines[axis][lines[axis].len() - 1]);
            let goes_on = [
                corners.iter().any(|corner| corner[axis] < low - tolerance.hole_m),
                corners.iter().any(|corner| corner[axis] > high + tolerance.hole_m),
            ];
            [0, 1].map(|end| !goes_on[end] && self.is_framed((lines, opaque), (axis, end), gap_m))
        });
        for (lines, [below, above]) in lines.iter_mut().zip(grown) {
            let last = lines.len() - 1;
            lines[0] -= if below { gap_m } else { 0.0 };
            lines[last] += if above { gap_m } else { 0.0 };
        }
    }

    /// Whether something stands beside a side of a leaf, no further than a gap away, wherever the leaf is opaque there.
    fn is_framed(
        &self,
        (lines, opaque): (&[Vec<f32>; 2], &[Vec<bool>; 2]),
        (axis, end): (usize, usize),
        gap_m: f32,
    ) -> bool {
        let counts = [0, 1].map(|axis| lines[axis].len() - 1);
        let along = &lines[1 - axis];
        let border = if end == 0 { 0 } else { counts[axis] - 1 };
        let is_opaque = |at: f32| {
            let other = along[1..].partition_point(|line| *line < at).min(counts[1 - axis] - 1);
            let square = squares::number(counts[0], axis, [border, other]);
            opaque.iter().any(|squares| squares[square])
        };
        let length_m = along[along.len() - 1] - along[0];
        let places = (length_m / (STRETCH * gap_m)).ceil().max(1.0) as u32;
        let step_m = length_m / places as f32;
        // From within the leaf on, so that a frame that it touches is met.
        let outwards = if end == 0 { -0.25 } else { 0.25 };
        let edge = f64::from(lines[axis][if end == 0 { 0 } else { counts[axis] }]);
        let [front, back] = self.around.map(|corner| corner.z);
        let stands_at = |at: f32| {
            let mut middle = DVec3::splat(0.5 * (front + back));
            middle[axis] = edge + outwards * f64::from(gap_m);
            middle[1 - axis] = at.into();
            // A door may also lie before its opening.
            let mut half = Vec3::splat(0.5 * (back - front) as f32 + gap_m);
            half[axis] = 0.75 * gap_m;
            half[1 - axis] = 0.5 * step_m;
            let mut faces = self.beside.iter();
            faces.any(|face| meets_box(&face.map(|corner| (corner - middle).as_vec3()), half))
        };
        let places = (0..places).map(|place| along[0] + (place as f32 + 0.5) * step_m);
        let mut opaque = places.filter(|at| is_opaque(*at)).peekable();
        opaque.peek().is_some() && opaque.all(stands_at)
    }
}
