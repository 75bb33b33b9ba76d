//! Which bodies hide nothing from a region, because some of it may lie inside them?
//!
//! A sight line that enters a body from outside crosses a front and ends there. An eye inside looks out through backs, which
//! need not be drawn; and where several bodies that touch fill one solid, it looks through all of them. So none of these
//! hides anything from a region that reaches into one. Cells do reach into things: a city's houses stand off the grid that
//! cells are cut on, and rooms are furnished.
//!
//! What bodies leave of a shape that is not convex is known as bodies that hide nothing ([`crate::occluders`], `rest`).

use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::segment::{self, each_in};
use crate::{
    groups::Groups,
    occluders::{Body, Region},
};

/// What is filled by bodies that touch.
pub(super) struct Solids {
    /// All bodies.
    tree: Bvh2,
    /// The first body of the solid that each body is part of.
    first: Vec<u32>,
    /// Bodies lie so far inside what they fill.
    inset_m: f32,
}

impl Solids {
    /// Bodies of one object whose boxes are nearer to each other than a gap fill one solid. Each lies `inset_m` inside of it.
    pub(super) fn of(bodies: &[Body], gap_m: f32, inset_m: f32) -> Self {
        let tree = segment::tree(bodies.iter().map(|b| [b.min, b.max]), 0.0);
        let mut solids = Groups::of_one(bodies.len());
        for (index, body) in (0u32..).zip(bodies) {
            let around = Region::of_box(body.min - gap_m, body.max + gap_m);
            each_in(&tree, &around, |other| {
                let touches = other < index && {
                    let other = &bodies[other as usize];
                    other.object == body.object && around.overlaps(&Region::of_box(other.min, other.max))
                };
                if touches {
                    solids.join(index, other);
                }
            });
        }
        let first = (0..bodies.len() as u32).map(|body| solids.root(body)).collect();
        Self { tree, first, inset_m }
    }

    /// The solid that a body is part of.
    pub(super) fn of_body(&self, body: u32) -> u32 {
        self.first[body as usize]
    }

    /// Whether a point lies in one of them.
    pub(super) fn holds(&self, bodies: &[Body], point: Vec3) -> bool {
        let mut held = false;
        let place = Region::of_box(point, point);
        each_in(&self.tree, &place, |body| held |= bodies[body as usize].contains(point));
        held
    }

    /// The solids that may hold some of a region, rising.
    pub(super) fn around(&self, bodies: &[Body], eye: &Region) -> Vec<u32> {
        let mut solids = Vec::new();
        let near = Region::of_box(eye.min - self.inset_m, eye.max + self.inset_m);
        each_in(&self.tree, &near, |body| {
            if bodies[body as usize].may_hold(eye, self.inset_m) {
                solids.push(self.of_body(body));
            }
        });
        solids.sort_unstable();
        solids.dedup();
        solids
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(object: u32, min: [f32; 3], max: [f32; 3]) -> Body {
        Body {
            min: Vec3::from(min),
            max: Vec3::from(max),
            planes: Vec::new(),
            stands_m: 0.0,
            open_below: false,
            hides: true,
            object,
        }
    }

    #[test]
    fn a_region_that_reaches_into_one_storey_is_inside_the_whole_tower_but_not_inside_its_neighbours() {
        let bodies = [
            body(0, [0.0, 0.0, 0.0], [4.0, 4.0, 4.0]),
            body(0, [1.0, 4.001, 1.0], [3.0, 8.0, 3.0]),
            body(0, [1.5, 8.001, 1.5], [2.5, 12.0, 2.5]),
            body(0, [9.0, 0.0, 0.0], [10.0, 4.0, 4.0]),
            body(1, [4.0, 0.0, 0.0], [8.0, 4.0, 4.0]),
        ];
        let solids = Solids::of(&bodies, 0.01, 0.0);
        assert_eq!([0, 1, 2, 3, 4].map(|body| solids.of_body(body)), [0, 0, 0, 3, 4]);
        let around =
            |min: [f32; 3], max: [f32; 3]| solids.around(&bodies, &Region::of_box(Vec3::from(min), Vec3::from(max)));
        assert_eq!(around([1.6, 11.0, 1.6], [5.0, 13.0, 5.0]), [0]);
        assert!(
            around([-3.0, 0.0, 0.0], [0.0, 4.0, 4.0]).is_empty(),
            "touching is not inside"
        );
        assert_eq!(around([3.9, 0.0, 0.0], [4.1, 1.0, 1.0]), [0, 4]);
        let inside = Solids::of(&bodies, 0.01, 0.1);
        let reaching = |x: f32| {
            inside.around(
                &bodies,
                &Region::of_box(Vec3::new(-3.0, 0.0, 0.0), Vec3::new(x, 4.0, 4.0)),
            )
        };
        assert_eq!(reaching(-0.05), [0], "what a body fills reaches further than the body");
        assert!(reaching(-0.15).is_empty());
    }
}
