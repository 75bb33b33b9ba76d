//! Which triangles of an object enclose something together?
//!
//! Those that hang together by their edges, as the surface of one thing does. Where just two faces meet that run along their edge
//! in opposite directions, they are of one surface. Where more do, as where the gables and the roof of a house stand on the
//! block below, a face goes on in the one that its back meets first, turning about the edge, if that one's back is towards it:
//! between the two lies the inside. So a block stays closed whatever stands on its corners, and two that touch are two.
//!
//! Cost: n log n in triangles.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::{groups::Groups, world::Triangle};

/// Faces whose directions from an edge differ by less than this, in radians, lie upon each other.
const SAME_ANGLE: f64 = 1e-5;

/// Triangles that hang together.
pub(super) struct Part<'a> {
    pub(super) triangles: Vec<&'a Triangle>,
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

/// A face as it meets an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Meeting {
    /// The numbers of the edge's corners, rising.
    edge: [u32; 2],
    face: u32,
    /// Which of its corners is not on the edge.
    apex: u8,
    /// Whether it runs along the edge from the first to the second corner.
    forth: bool,
}

/// The bits of a point by which equal points are known.
pub(super) fn bits(point: Vec3) -> [u32; 3] {
    // Adding zero turns −0 into 0.
    (point + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// The parts of an object, in the order of their first triangles.
pub(super) fn parts(triangles: &[Triangle]) -> Vec<Part<'_>> {
    let mut meetings = meetings(triangles);
    meetings.sort_unstable();
    let mut groups = Groups::of_one(triangles.len());
    for around in meetings.chunk_by(|a, b| a.edge == b.edge) {
        for [a, b] in joined(triangles, around) {
            groups.join(a, b);
        }
    }
    let mut index_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut parts: Vec<Part<'_>> = Vec::new();
    for (number, triangle) in (0u32..).zip(triangles) {
        let index = *index_of.entry(groups.root(number)).or_insert_with(|| {
            parts.push(Part {
                triangles: Vec::new(),
                min: Vec3::INFINITY,
                max: Vec3::NEG_INFINITY,
            });
            parts.len() - 1
        });
        let part = &mut parts[index];
        for corner in triangle.corners {
            part.min = part.min.min(corner);
            part.max = part.max.max(corner);
        }
        part.triangles.push(triangle);
    }
    parts
}

#[allow(
    clippy::disallowed_types,
    reason = "corners are looked up only, millions of them, and never gone through in the map's own order"
)]
fn meetings(triangles: &[Triangle]) -> Vec<Meeting> {
    let mut numbers: std::collections::HashMap<[u32; 3], u32> =
        std::collections::HashMap::with_capacity(triangles.len());
    let mut meetings = Vec::with_capacity(3 * triangles.len());
    for (face, triangle) in (0u32..).zip(triangles) {
        let corners = triangle.corners.map(|corner| {
            let next = numbers.len() as u32;
            *numbers.entry(bits(corner)).or_insert(next)
        });
        for apex in 0..3u8 {
            let [from, to] = [1, 2].map(|step| corners[(apex as usize + step) % 3]);
            if from != to {
                meetings.push(Meeting {
                    edge: [from.min(to), from.max(to)],
                    face,
                    apex,
                    forth: from < to,
                });
            }
        }
    }
    meetings
}

/// Which of the faces around an edge are of one surface.
fn joined(triangles: &[Triangle], around: &[Meeting]) -> Vec<[u32; 2]> {
    let all = || around.windows(2).map(|pair| [pair[0].face, pair[1].face]).collect();
    let opposite = |a: &Meeting, b: &Meeting| a.forth != b.forth;
    match around {
        [_] => Vec::new(),
        [a, b] if opposite(a, b) => all(),
        [_, _] => Vec::new(),
        _ => {
            let is_closed = 2 * around.iter().filter(|meeting| meeting.forth).count() == around.len();
            let Some(order) = turning(triangles, around) else {
                return if is_closed { all() } else { Vec::new() };
            };
            // The back of who runs forth looks where one turns to.
            let next = order.iter().cycle().skip(1);
            let pairs: Vec<_> = order
                .iter()
                .zip(next)
                .filter(|(a, b)| a.forth && !b.forth)
                .map(|(a, b)| [a.face, b.face])
                .collect();
            // Faces that close the edge, but not so, are left to who asks what they enclose.
            if is_closed && 2 * pairs.len() < around.len() {
                return all();
            }
            pairs
        }
    }
}

/// Faces around an edge, turning clockwise for who looks along it; `None` when one of them has no area.
fn turning(triangles: &[Triangle], around: &[Meeting]) -> Option<Vec<Meeting>> {
    let ends = |meeting: &Meeting| {
        let corners = triangles[meeting.face as usize].corners.map(|corner| corner.as_dvec3());
        let apex = meeting.apex as usize;
        let [from, to] = [1, 2].map(|step| corners[(apex + step) % 3]);
        let [from, to] = if meeting.forth { [from, to] } else { [to, from] };
        (from, to, corners[apex])
    };
    let (from, to, _) = ends(&around[0]);
    let along = (to - from).try_normalize()?;
    let away = |meeting: &Meeting| {
        let (from, _, apex) = ends(meeting);
        let reach = apex - from;
        (reach - along * along.dot(reach)).try_normalize()
    };
    let ahead = away(&around[0])?;
    let aside = along.cross(ahead);
    let mut turned = Vec::with_capacity(around.len());
    for meeting in around {
        let away: DVec3 = away(meeting)?;
        turned.push((-aside.dot(away).atan2(ahead.dot(away)), *meeting));
    }
    let zero = |angle: f64| {
        if angle.abs() < SAME_ANGLE {
            0.0
        } else {
            angle.rem_euclid(std::f64::consts::TAU)
        }
    };
    for (angle, _) in &mut turned {
        *angle = zero(*angle);
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // Of faces upon each other, those come first that end what lies before them.
    let mut order = Vec::with_capacity(turned.len());
    for same in turned.chunk_by(|a, b| b.0 - a.0 < SAME_ANGLE) {
        let (begin, end): (Vec<_>, Vec<_>) = same.iter().map(|(_, meeting)| *meeting).partition(|m| m.forth);
        order.extend(end);
        order.extend(begin);
    }
    Some(order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cells::plan::Builder, world::World};

    /// The box between two corners, facing outwards.
    fn block(min: [f32; 3], max: [f32; 3]) -> Vec<Triangle> {
        let mut builder = Builder::default();
        builder.block("block", min, max);
        let world = World::new(&builder.scene).unwrap();
        let origin = world.origin().as_vec3();
        let placed = |t: &Triangle| Triangle::between(t.corners.map(|corner| corner + origin));
        world.triangles_of(0).iter().map(placed).collect()
    }

    fn face(corners: [[f32; 3]; 3]) -> Triangle {
        Triangle::between(corners.map(Vec3::from))
    }

    fn sizes(triangles: &[Triangle]) -> Vec<usize> {
        parts(triangles).iter().map(|part| part.triangles.len()).collect()
    }

    #[test]
    fn a_roof_on_its_corners_does_not_open_a_block() {
        let mut house = block([0.0; 3], [4.0, 3.0, 6.0]);
        // Gables and a roof without a floor, on the upper edges.
        let ridge = [[2.0, 5.0, 0.0], [2.0, 5.0, 6.0]];
        let eaves = [[0.0, 3.0, 0.0], [4.0, 3.0, 0.0], [4.0, 3.0, 6.0], [0.0, 3.0, 6.0]];
        house.push(face([eaves[1], eaves[0], ridge[0]]));
        house.push(face([eaves[3], eaves[2], ridge[1]]));
        for [a, b, c, d] in [
            [eaves[2], eaves[1], ridge[0], ridge[1]],
            [eaves[0], eaves[3], ridge[1], ridge[0]],
        ] {
            house.push(face([a, b, c]));
            house.push(face([a, c, d]));
        }
        assert_eq!(sizes(&house), [12, 6]);
        // Without the block's upper side it is one thing.
        let open: Vec<_> = house
            .into_iter()
            .filter(|t| t.corners.iter().any(|corner| corner.y != 3.0))
            .collect();
        assert_eq!(sizes(&open), [16]);
    }

    #[test]
    fn blocks_that_touch_are_several() {
        let lower = block([0.0; 3], [1.0, 1.0, 1.0]);
        for beside in [[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]] {
            let upper = block(beside, beside.map(|low| low + 1.0));
            assert_eq!(sizes(&[lower.clone(), upper].concat()), [12, 12], "{beside:?}");
        }
    }

    #[test]
    fn a_sheet_on_a_block_is_a_part_of_its_own() {
        let mut flagged = block([0.0; 3], [1.0, 1.0, 1.0]);
        flagged.push(face([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.5, 2.0, 0.0]]));
        flagged.push(face([[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.5]]));
        assert_eq!(sizes(&flagged), [12, 1, 1]);
    }

    #[test]
    fn faces_without_area_close_what_they_close() {
        // A side of the block is cut finer than its neighbour, and a sliver closes the seam.
        let mut cut = block([0.0; 3], [2.0, 2.0, 2.0]);
        let first = cut.remove(0);
        let [a, b, c] = first.corners;
        let middle = 0.5 * (a + b);
        cut.extend([[a, middle, c], [middle, b, c], [a, b, middle]].map(Triangle::between));
        assert_eq!(sizes(&cut), [14]);
    }
}
