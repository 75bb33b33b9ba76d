//! Is every straight way from one box to another blocked? A proof, by geometry alone.
//!
//! All ways between two convex things cross a plane between them inside the hull of the crossings of ways between their corners.
//! Where faces in that plane cover the hull, everything is blocked. Where none does, the larger box is halved, and both
//! halves must be blocked. So a room that is walled in is proved hidden at once, and one behind two doorways that are not in
//! line after a few halvings.
//!
//! A closed leaf that is thinner than its wall is in no plane with it. So where that does not do, a plane is taken step by step:
//! whatever its faces leave of the hull, in convex pieces, each way that crosses a piece must be blocked before it or behind it,
//! between the one box and the box around the piece, or between that and the other.
//!
//! Guarantee: conservative, but for gaps between faces that are narrower than four times the error of what is published:
//! these are closed. Cost: at most twice as many pairs of boxes as are allowed, each with a few planes.

use std::collections::BTreeSet;

use belvedere_scene::ObjectId;
use glam::{DVec2, DVec3};

use crate::{
    block::Block,
    blockade::{Blockade, Face},
    flat::{Plane, area, crossings, hull, without},
    scene::ERRORS,
};

/// Faces in one plane are told from others by so much of the distance between the boxes, beside the error.
const FLAT: f64 = 1e-6;
/// What is left of a hull in more pieces than this is not covered.
const MOST_PIECES: usize = 256;
/// What a plane leaves open in more pieces than this is not looked into.
const MOST_OPEN: usize = 16;
/// So many planes are passed behind one another …
const MOST_STEPS: u32 = 6;
/// … and boxes are halved so often.
const MOST_HALVINGS: u32 = 48;

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
        if self.is_shut_in_parts((*from, *to), closed, slack_m, &mut parts_left) {
            return true;
        }
        parts_left = parts;
        self.is_shut_in_steps(
            (*from, *to),
            closed,
            slack_m,
            (MOST_STEPS, MOST_HALVINGS),
            &mut parts_left,
        )
    }

    /// Whether all parts of two boxes are shut off from each other by a plane each.
    fn is_shut_in_parts(
        &self,
        boxes: (Block, Block),
        closed: &BTreeSet<ObjectId>,
        slack_m: f64,
        parts_left: &mut u32,
    ) -> bool {
        let mut open = vec![boxes];
        while let Some((from, to)) = open.pop() {
            if *parts_left == 0 || self.sees(from.middle(), to.middle(), closed) {
                return false;
            }
            *parts_left -= 1;
            if !self
                .open_between(&from, &to, closed, slack_m)
                .is_some_and(|open| open.is_empty())
            {
                open.extend(halved((from, to)));
            }
        }
        true
    }

    /// The same where what one plane leaves open may be shut by others before and behind it.
    fn is_shut_in_steps(
        &self,
        (from, to): (Block, Block),
        closed: &BTreeSet<ObjectId>,
        slack_m: f64,
        (steps, halvings): (u32, u32),
        parts_left: &mut u32,
    ) -> bool {
        if *parts_left == 0 || self.sees(from.middle(), to.middle(), closed) {
            return false;
        }
        *parts_left -= 1;
        if let Some(open) = self.open_between(&from, &to, closed, slack_m)
            && (open.is_empty() || steps > 0)
        {
            let mut shuts =
                |a: Block, b: Block| self.is_shut_in_steps((a, b), closed, slack_m, (steps - 1, halvings), parts_left);
            if open.into_iter().all(|piece| shuts(from, piece) || shuts(piece, to)) {
                return true;
            }
        }
        halvings > 0
            && halved((from, to))
                .all(|halves| self.is_shut_in_steps(halves, closed, slack_m, (steps, halvings - 1), parts_left))
    }

    /// What the faces in one plane leave open of all ways from one box to another: boxes around the pieces. Of several planes, the one
    /// that leaves the least; none where none leaves few pieces.
    fn open_between(&self, from: &Block, to: &Block, closed: &BTreeSet<ObjectId>, slack_m: f64) -> Option<Vec<Block>> {
        let (near, far) = (from.corners(), to.corners());
        let mut tried: Vec<Plane> = Vec::new();
        let mut least: Option<(f64, Vec<Block>)> = None;
        self.faces_along(from.middle(), to.middle(), closed, &mut |face| {
            let Some(plane) = face.plane().map(Plane::new) else {
                return false;
            };
            if tried.iter().any(|other| other.is_like(&plane, FLAT, slack_m)) {
                return false;
            }
            tried.push(plane);
            let height = |point: &DVec3| plane.height(*point);
            // Ways lead from the side that hides, or from either; boxes may touch the plane.
            let side = height(&from.middle()).signum();
            let parts =
                near.iter().all(|p| side * height(p) >= -slack_m) && far.iter().all(|p| -side * height(p) >= -slack_m);
            if !parts {
                return false;
            }
            let points = crossings(&near, &far, &height, slack_m);
            let left = self.uncovered(face, &plane, &points, closed, slack_m);
            let left_m2: f64 = left.iter().map(|piece| area(piece)).sum();
            if left.len() <= MOST_OPEN && least.as_ref().is_none_or(|(least_m2, _)| left_m2 < *least_m2) {
                let around = |piece: &Vec<DVec2>| Block::around(piece.iter().map(|point| plane.raised(*point)));
                least = Some((left_m2, left.iter().map(around).collect()));
            }
            left.is_empty()
        });
        least.map(|(_, open)| open)
    }

    /// What faces in the plane of one of them, which hide from the same side, leave of the hull of some points in it.
    fn uncovered(
        &self,
        face: &Face,
        plane: &Plane,
        points: &[DVec3],
        closed: &BTreeSet<ObjectId>,
        slack_m: f64,
    ) -> Vec<Vec<DVec2>> {
        let hull = hull(points.iter().map(|point| plane.flat(*point)).collect());
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
                .all(|corner| plane.height(*corner).abs() <= slack_m);
            if hides && lies_in {
                let mut corners = other.corners.map(|corner| plane.flat(corner));
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
        left
    }
}

/// The larger of two boxes in halves, each with the other one.
fn halved((from, to): (Block, Block)) -> impl Iterator<Item = (Block, Block)> {
    let of_from = from.longest_m() >= to.longest_m();
    let halves = if of_from { from.halves() } else { to.halves() };
    halves
        .into_iter()
        .map(move |half| if of_from { (half, to) } else { (from, half) })
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
        let random = &mut Random::of([1, 2, 3]);
        let (mut proved, mut found) = (0, 0);
        let worlds = [walls(true), doorway(0.7), doorway(1.0)];
        let blockades = worlds.map(|models| Blockade::of(&scene(models)));
        for n in 0..300 {
            let blockade = &blockades[n % blockades.len()];
            let mut part = |z: f64| {
                let low = DVec3::new(14.0 * random.unit() - 7.0, 4.0 * random.unit() - 2.0, z);
                Block {
                    min: low,
                    max: low + DVec3::new(6.0 * random.unit(), 1.0, 0.5),
                }
            };
            let (from, to) = (part(-1.0), part(2.5));
            let hidden = shuts(blockade, &from, &to);
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
        assert!(proved >= 80 && found >= 30, "{proved} proved, {found} seen");
    }

    /// With other axes in the place of x, y and z.
    fn turned(mut model: Model, axes: [usize; 3]) -> Model {
        for position in &mut model.positions {
            *position = axes.map(|axis| position[axis]).into();
        }
        model
    }

    /// A wall across z from 1 to 1.5 with a doorway that is so high, which a leaf of this width shuts at 1.2.
    fn doorway(leaf: f32) -> Vec<Model> {
        const SIZE: f32 = 4.0;
        let face = |z: f32| {
            [
                quad([-SIZE, -SIZE], [-0.5, SIZE], z, BOTH_SIDES),
                quad([0.5, -SIZE], [SIZE, SIZE], z, BOTH_SIDES),
                quad([-0.5, 1.0], [0.5, SIZE], z, BOTH_SIDES),
                quad([-0.5, -SIZE], [0.5, -1.0], z, BOTH_SIDES),
            ]
        };
        // Across x and y: what the doorway shows of the wall, as far as the wall goes.
        let jambs = [-0.5, 0.5].map(|x| turned(quad([-SIZE, 1.0], [SIZE, 1.5], x, BOTH_SIDES), [2, 0, 1]));
        let sills = [-1.0, 1.0].map(|y| turned(quad([1.0, -0.5], [1.5, 0.5], y, BOTH_SIDES), [1, 2, 0]));
        let leaf = quad([-0.5, -1.0], [leaf - 0.5, 1.0], 1.2, BOTH_SIDES);
        let all = [face(1.0), face(1.5)].into_iter().flatten();
        all.chain(jambs).chain(sills).chain([leaf]).collect()
    }

    #[test]
    fn a_leaf_that_is_thinner_than_its_wall_shuts_the_doorway() {
        let room = |z: f64| block([-3.0, -2.0, z], [3.0, 2.0, z + 4.0]);
        let (here, there) = (room(-3.0), room(1.5));
        let blockade = Blockade::of(&scene(doorway(1.0)));
        assert!(shuts(&blockade, &here, &there) && shuts(&blockade, &there, &here));
        for narrow in [0.0, 0.5, 0.9, 0.99] {
            let blockade = Blockade::of(&scene(doorway(narrow)));
            assert!(!shuts(&blockade, &here, &there), "there is a gap beside {narrow}");
        }
    }
}
