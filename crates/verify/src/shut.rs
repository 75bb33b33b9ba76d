//! Is every straight way from one box to another blocked? A proof, by geometry alone.
//!
//! All ways between two convex things cross a plane between them inside the hull of the crossings of ways between their corners.
//! Where faces in that plane cover the hull, everything is blocked. Where none does, the larger box is halved, and both
//! halves must be blocked. So a room that is walled in is proved hidden at once, and one behind two doorways that are not in
//! line after a few halvings.
//!
//! Guarantee: conservative, but for gaps between faces that are narrower than four times the error of what is published:
//! these are closed. Cost: at most as many pairs of boxes as are allowed, each with a few planes.

use std::collections::BTreeSet;

use belvedere_scene::ObjectId;
use glam::{DVec2, DVec3};

use crate::blockade::{Blockade, Face};

/// Faces in one plane are told from others by so much of the distance between the boxes, beside the error.
const FLAT: f64 = 1e-6;
/// Gaps of so many times the error are closed.
const ERRORS: f64 = 2.0;
/// What is left of a hull in more pieces than this is not covered.
const MOST_PIECES: usize = 256;

/// A box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl Block {
    pub(crate) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let none = Self {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
        };
        points.fold(none, |all, point| Self {
            min: all.min.min(point),
            max: all.max.max(point),
        })
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether a straight way meets it.
    pub(crate) fn is_passed(&self, from: DVec3, way: DVec3) -> bool {
        let (a, b) = ((self.min - from) / way, (self.max - from) / way);
        // Where the way runs along a side, 0 / 0 is no number, which `min` and `max` leave out.
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            enter = enter.max(a[axis].min(b[axis]));
            leave = leave.min(a[axis].max(b[axis]));
        }
        enter <= leave
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    fn middle(&self) -> DVec3 {
        self.min.midpoint(self.max)
    }

    fn longest_m(&self) -> f64 {
        (self.max - self.min).max_element()
    }

    fn halves(&self) -> [Self; 2] {
        let axis = (self.max - self.min).max_position();
        let mut halves = [*self, *self];
        halves[0].max[axis] = self.middle()[axis];
        halves[1].min[axis] = self.middle()[axis];
        halves
    }
}

impl Blockade {
    /// Whether faces block every straight way from one box to another while these doors are closed, as far as that can be
    /// proved with so many pairs of parts of the boxes.
    pub(crate) fn shuts(
        &self,
        from: &Block,
        to: &Block,
        closed: &BTreeSet<ObjectId>,
        error_m: f64,
        parts: u32,
    ) -> bool {
        let apart_m = (to.middle() - from.middle()).length();
        let slack_m = FLAT * apart_m + ERRORS * error_m;
        let mut parts_left = parts;
        let mut open = vec![(*from, *to)];
        while let Some((from, to)) = open.pop() {
            let [a, b] = [from.middle(), to.middle()];
            if parts_left == 0 || self.sees(a, b, closed) {
                return false;
            }
            parts_left -= 1;
            if self.is_shut(&from, &to, closed, slack_m) {
                continue;
            }
            if from.longest_m() >= to.longest_m() {
                open.extend(from.halves().map(|half| (half, to)));
            } else {
                open.extend(to.halves().map(|half| (from, half)));
            }
        }
        true
    }

    /// Whether the faces in one plane do.
    fn is_shut(&self, from: &Block, to: &Block, closed: &BTreeSet<ObjectId>, slack_m: f64) -> bool {
        let (near, far) = (from.corners(), to.corners());
        let mut tried: Vec<(DVec3, f64)> = Vec::new();
        self.faces_along(from.middle(), to.middle(), closed, &mut |face| {
            let Some((normal, offset)) = face.plane() else {
                return false;
            };
            if tried
                .iter()
                .any(|(n, o)| n.dot(normal) > 1.0 - FLAT && (o - offset).abs() <= slack_m)
            {
                return false;
            }
            tried.push((normal, offset));
            let height = |point: &DVec3| normal.dot(*point) - offset;
            // Ways lead from the side that hides, or from either; boxes may touch the plane.
            let side = height(&from.middle()).signum();
            let parts =
                near.iter().all(|p| side * height(p) >= -slack_m) && far.iter().all(|p| -side * height(p) >= -slack_m);
            parts
                && self.covers(
                    face,
                    (normal, offset),
                    &crossings(&near, &far, &height, slack_m),
                    closed,
                    slack_m,
                )
        })
    }

    /// Whether faces in the plane of one of them, which hide from the same side, cover the hull of some points in it.
    fn covers(
        &self,
        face: &Face,
        (normal, offset): (DVec3, f64),
        points: &[DVec3],
        closed: &BTreeSet<ObjectId>,
        slack_m: f64,
    ) -> bool {
        let axes = [
            normal.any_orthonormal_vector(),
            normal.cross(normal.any_orthonormal_vector()),
        ];
        let flat = |point: DVec3| DVec2::new(axes[0].dot(point), axes[1].dot(point));
        let hull = hull(points.iter().copied().map(flat).collect());
        let around = Block::around(points.iter().copied());
        let around = Block {
            min: around.min - slack_m,
            max: around.max + slack_m,
        };
        let mut left = vec![hull];
        self.faces_in(&around, &mut |other| {
            let hides = other.hides_like(face, closed);
            let lies_in = other
                .corners
                .iter()
                .all(|corner| (normal.dot(*corner) - offset).abs() <= slack_m);
            if hides && lies_in {
                let mut corners = other.corners.map(flat);
                if (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) < 0.0 {
                    corners.swap(1, 2);
                }
                left = left
                    .iter()
                    .flat_map(|piece| without(piece, &corners, slack_m))
                    .collect();
            }
            left.is_empty() || left.len() > MOST_PIECES
        });
        left.is_empty()
    }
}

/// Where ways between corners cross a plane; both ends of those that run along it.
fn crossings(near: &[DVec3], far: &[DVec3], height: &dyn Fn(&DVec3) -> f64, slack_m: f64) -> Vec<DVec3> {
    let cross = |a: &DVec3, b: &DVec3| {
        let falls_m = height(a) - height(b);
        if falls_m.abs() <= slack_m {
            vec![*a, *b]
        } else {
            vec![a.lerp(*b, (height(a) / falls_m).clamp(0.0, 1.0))]
        }
    };
    near.iter()
        .flat_map(|a| far.iter().flat_map(move |b| cross(a, b)))
        .collect()
}

/// The convex hull, counter-clockwise (Andrew, *Another Efficient Algorithm for Convex Hulls in Two Dimensions*, 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut lower = chain(&mut points.iter().copied());
    lower.extend(chain(&mut points.iter().rev().copied()));
    lower
}

/// What a triangle, grown by the slack, leaves of a convex polygon.
fn without(piece: &[DVec2], triangle: &[DVec2; 3], slack_m: f64) -> Vec<Vec<DVec2>> {
    let mut left = Vec::new();
    let mut inside = piece.to_vec();
    for i in 0..3 {
        let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
        let inward = (to - from).perp().normalize_or_zero();
        let depth = |point: DVec2| inward.dot(point - from) + slack_m;
        left.push(cut(&inside, &|point| -depth(point)));
        inside = cut(&inside, &depth);
    }
    if inside.len() < 3 {
        // It is not met at all.
        return vec![piece.to_vec()];
    }
    left.retain(|piece| piece.len() >= 3);
    left
}

/// What of a convex polygon has a height above zero.
fn cut(polygon: &[DVec2], height: &dyn Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (height(*a), height(b));
        if at_a > 0.0 {
            kept.push(*a);
        }
        if (at_a > 0.0) != (at_b > 0.0) {
            kept.push(a.lerp(b, at_a / (at_a - at_b)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        random::Random,
        scene::Model,
        testing::{BOTH_SIDES, OPAQUE, quad, scene},
    };

    fn block(min: [f64; 3], max: [f64; 3]) -> Block {
        Block {
            min: min.into(),
            max: max.into(),
        }
    }

    fn shuts(blockade: &Blockade, from: &Block, to: &Block) -> bool {
        blockade.shuts(from, to, &BTreeSet::new(), 1e-5, 4_096)
    }

    /// Walls across z at 1, with a doorway, and at 2, with another one to the right of it when there is one.
    fn walls(second_doorway: bool) -> Vec<Model> {
        let tiles = |doorway: i32, z: f32| {
            let tiles = (-8..8).filter(move |x| *x != doorway);
            tiles.map(move |x| quad([x as f32, -8.0], [x as f32 + 1.0, 8.0], z, BOTH_SIDES))
        };
        let second = if second_doorway { 0 } else { 99 };
        tiles(-2, 1.0).chain(tiles(second, 2.0)).collect()
    }

    const HERE: ([f64; 3], [f64; 3]) = ([-4.0, -1.0, -3.0], [0.0, 1.0, 0.0]);

    #[test]
    fn tiles_in_a_plane_shut_together_and_a_wall_hides_from_the_side_that_it_shows() {
        let here = block(HERE.0, HERE.1);
        let there = block([-4.0, -1.0, 3.0], [0.0, 1.0, 6.0]);
        assert!(shuts(&Blockade::of(&scene(walls(false))), &here, &there));
        let tiles = |surface| Blockade::of(&scene(vec![quad([-9.0, -9.0], [9.0, 9.0], 1.0, surface)]));
        assert!(!shuts(&tiles(OPAQUE), &here, &there), "seen from behind");
        assert!(shuts(&tiles(OPAQUE), &there, &here));
    }

    #[test]
    fn rooms_on_both_sides_of_a_wall_that_touch_it_are_shut_off() {
        let room = |z: f64| block([-4.0, -1.0, z], [4.0, 1.0, z + 2.0]);
        let wall = || vec![quad([-4.0, -1.0], [4.0, 1.0], 1.0, BOTH_SIDES)];
        assert!(shuts(&Blockade::of(&scene(wall())), &room(-1.0), &room(1.0)));
        let smaller = vec![quad([-4.0, -1.0], [3.9, 1.0], 1.0, BOTH_SIDES)];
        assert!(!shuts(&Blockade::of(&scene(smaller)), &room(-1.0), &room(1.0)));
    }

    #[test]
    fn what_is_proved_hidden_no_ray_finds_and_doorways_out_of_line_hide() {
        let blockade = Blockade::of(&scene(walls(true)));
        let random = &mut Random::of([1, 2, 3]);
        let (mut proved, mut found) = (0, 0);
        for _ in 0..200 {
            let mut part = |z: f64| {
                let low = DVec3::new(14.0 * random.unit() - 7.0, 4.0 * random.unit() - 2.0, z);
                Block {
                    min: low,
                    max: low + DVec3::new(6.0 * random.unit(), 1.0, 0.5),
                }
            };
            let (from, to) = (part(-1.0), part(2.5));
            let hidden = shuts(&blockade, &from, &to);
            let seen = (0..4_000).any(|_| {
                let mut point = |block: &Block| {
                    let share = DVec3::new(random.unit(), random.unit(), random.unit());
                    block.min + share * (block.max - block.min)
                };
                let (from, to) = (point(&from), point(&to));
                blockade.sees(from, to, &BTreeSet::new())
            });
            assert!(!(hidden && seen), "{from:?} sees {to:?}");
            proved += usize::from(hidden);
            found += usize::from(seen);
        }
        assert!(proved >= 50 && found >= 10, "{proved} proved, {found} seen");
    }
}
