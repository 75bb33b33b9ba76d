//! Which faces lie in one plane? What authors draw is never exact to the last bit, and neighbours must leave no gap.
//!
//! Each face takes the first plane of those before it in which all of it lies, give or take the tolerance. Which planes come into question
//! is known from where the face is and which way it looks: its triangle tells how far a plane may lean in which it still lies.

use std::collections::BTreeMap;

use belvedere_scene::convex::HalfSpace;
use glam::DVec3;

use super::{
    author::{Checked, FacePlane, height},
    hull::{area_m2, normal},
};

/// Planes are told apart by which way they look to one part in so many.
const STEPS: f64 = 32.0;
/// Where a face tells no more than that planes lean by as much as this, all are asked.
const MOST_LEAN: f64 = 0.125;
/// Rounding, beside 1 and as a share of lengths.
const ROUNDING: f64 = 1e-9;

/// Puts faces that lie in one plane, give or take the tolerance, on exactly one, turned either way.
pub(super) fn share_planes(cells: &mut [Checked]) {
    let mut known = Planes::default();
    for cell in cells {
        for face in &mut cell.faces {
            let near = |half: &HalfSpace| lies_in(face, half, cell.tolerance_m);
            let straight = (0..3).find_map(|axis| {
                let mut half = [0.0; 4];
                half[axis] = face.half[axis].signum();
                half[3] = half[axis] * face.triangles[0][0][axis];
                near(&half).then_some(half)
            });
            let own = straight.unwrap_or(face.half);
            let turned = |half: &HalfSpace| half.map(|x| -x);
            let shared = known.first_of(face, cell.tolerance_m).map(|half| {
                let same_way = normal(&half).dot(normal(&own)) > 0.0;
                if same_way { half } else { turned(&half) }
            });
            face.half = shared.unwrap_or_else(|| {
                known.add(own);
                own
            });
        }
    }
}

fn lies_in(face: &FacePlane, half: &HalfSpace, tolerance_m: f64) -> bool {
    let mut corners = face.triangles.iter().flatten();
    corners.all(|p| height(half, p).abs() <= tolerance_m)
}

/// Planes by which way they look.
#[derive(Default)]
struct Planes {
    /// In the order in which they came.
    halves: Vec<HalfSpace>,
    alike: BTreeMap<[i32; 3], Alike>,
}

/// Planes that look about the same way.
struct Alike {
    /// The first one's normal.
    normal: DVec3,
    /// The others' differ from it by no more than this.
    spread: f64,
    /// Places among all, by how far out planes are.
    by_offset: BTreeMap<InOrder, Vec<usize>>,
}

/// A number that can be looked up.
#[derive(Clone, Copy)]
struct InOrder(f64);

impl Ord for InOrder {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for InOrder {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for InOrder {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for InOrder {}

fn step(x: f64) -> i32 {
    (x * STEPS).round() as i32
}

impl Planes {
    fn add(&mut self, half: HalfSpace) {
        let place = self.halves.len();
        self.halves.push(half);
        let normal = normal(&half);
        let alike = self.alike.entry(normal.to_array().map(step)).or_insert_with(|| Alike {
            normal,
            spread: 0.0,
            by_offset: BTreeMap::new(),
        });
        alike.spread = alike.spread.max((normal - alike.normal).length());
        alike.by_offset.entry(InOrder(half[3])).or_default().push(place);
    }

    /// The first plane in which a face lies.
    fn first_of(&self, face: &FacePlane, tolerance_m: f64) -> Option<HalfSpace> {
        let lean = most_lean(face, tolerance_m);
        let mut first: Option<usize> = None;
        let mut ask = |alike: &Alike| {
            for place in alike.through(&face.triangles[0][0], tolerance_m) {
                if first.is_none_or(|first| place < first) && lies_in(face, &self.halves[place], tolerance_m) {
                    first = Some(place);
                }
            }
        };
        if lean > MOST_LEAN {
            self.alike.values().for_each(&mut ask);
        } else {
            for way in [normal(&face.half), -normal(&face.half)] {
                let steps = |axis: usize| step(way[axis] - lean)..=step(way[axis] + lean);
                for x in steps(0) {
                    for y in steps(1) {
                        for z in steps(2) {
                            self.alike.get(&[x, y, z]).into_iter().for_each(&mut ask);
                        }
                    }
                }
            }
        }
        first.map(|place| self.halves[place])
    }
}

impl Alike {
    /// The planes that may come so near to a point, and perhaps others.
    fn through(&self, point: &DVec3, tolerance_m: f64) -> impl Iterator<Item = usize> {
        let at = self.normal.dot(*point);
        let reach_m = tolerance_m + (self.spread + ROUNDING) * point.length();
        let ends = [InOrder(at - reach_m), InOrder(at + reach_m)];
        let found = (ends[0] <= ends[1]).then(|| self.by_offset.range(ends[0]..=ends[1]));
        found.into_iter().flatten().flat_map(|(_, places)| places).copied()
    }
}

/// How much the normal of a plane in which a face lies may differ from the face's own, either way round. Along no direction is a triangle
/// narrower than its least height, and over that the plane may rise by twice the tolerance.
fn most_lean(face: &FacePlane, tolerance_m: f64) -> f64 {
    let [a, b, c] = face.triangles[0];
    let longest_m = (b - a).length().max((c - b).length()).max((a - c).length());
    let height_m = 2.0 * area_m2(&face.triangles[0]) / longest_m;
    // The difference of two unit vectors is at most √2 times the sine of the angle between them, up to a right angle.
    std::f64::consts::SQRT_2 * 2.0 * tolerance_m / height_m + ROUNDING
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The same, asking every plane.
    fn first_of_all(known: &[HalfSpace], face: &FacePlane, tolerance_m: f64) -> Option<HalfSpace> {
        known.iter().copied().find(|half| lies_in(face, half, tolerance_m))
    }

    /// Triangles of which many lie about in one plane, large ones and slivers, near and far out.
    fn faces() -> impl Strategy<Value = Vec<FacePlane>> {
        let lean = prop::sample::select(vec![0.0, 1e-4, 3e-3, 0.4, 1.57]);
        let one = (0..3usize, 0..4i32, lean, prop::array::uniform2(0.0..1.0f64), 0..5usize);
        let far = prop::sample::select(vec![0.0, 1e3, 1e6]);
        (far, prop::collection::vec(one, 1..80)).prop_map(|(far, all)| {
            let face = |(axis, at, lean, [along, off], size): (usize, i32, f64, [f64; 2], usize)| {
                let size_m = [0.0012, 0.01, 0.3, 4.0, 50.0][size];
                let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
                axes.rotate_left(axis);
                let [n, u, v] = axes;
                let n = (n + lean * u).normalize();
                let u = v.cross(n);
                let corner = (f64::from(at) + 0.002 * off) * axes[0] + far * along * u + far * v;
                let [a, b, c] = [corner, corner + size_m * u, corner + size_m * v];
                let n = (b - a).cross(c - a).normalize();
                FacePlane {
                    half: [n.x, n.y, n.z, n.dot(a)],
                    triangles: vec![[a, b, c]],
                }
            };
            all.into_iter().map(face).collect()
        })
    }

    proptest! {
        #[test]
        fn the_first_plane_that_a_face_lies_in_is_found_as_if_each_was_asked(faces in faces()) {
            const TOLERANCE_M: f64 = 1e-3;
            let mut known = Planes::default();
            for face in &faces {
                let found = known.first_of(face, TOLERANCE_M);
                prop_assert_eq!(found, first_of_all(&known.halves, face, TOLERANCE_M));
                if found.is_none() {
                    known.add(face.half);
                }
            }
        }
    }
}
