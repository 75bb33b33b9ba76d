//! Does an author's occluder hide what can be seen?
//!
//! That it lies inside something opaque is taken on his word. Where it reaches across a slit or a window, or sticks out of a wall, proofs
//! hide what is seen there. So rays look through each body: one that leads from where an eye may stand, through the body, to what is
//! visible is a sight line that the body must not block.
//!
//! Guarantee: what is found is surely seen, but not all that is seen is found. Eyes stand in cells and in nothing solid, no culled back is
//! before or behind them, as of a wall that they are in, and what one sees is also seen from a little to all sides, by as much as holes are closed. Cost:
//! 2¹⁴ pairs of rays for a body, fewer of each of many bodies.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{conservative::Scenery, random::Random};
use crate::{
    cells::{CellGraph, CellsByPlace},
    occluders::Body,
    world::{Hit, World},
};

/// Tries for each body …
const TRIES: usize = 1 << 14;
/// … and for all together, …
const ALL_TRIES: usize = 1 << 22;
/// … but never fewer than this for each.
const LEAST_TRIES: usize = 1 << 10;
/// Where random streams start.
const SEED: u64 = 0xB0DE_5EE4;
/// A sight line is as wide as so many times the width of a hole that is closed.
const WIDE: f32 = 2.0;

/// Looks through bodies that an author drew.
pub(crate) struct Vouched<'a> {
    pub(crate) world: &'a World,
    pub(crate) scenery: &'a Scenery,
    pub(crate) graph: &'a CellGraph,
}

impl Vouched<'_> {
    /// A place in each body, in world space, at which a sight line passes it, where one was found.
    pub(crate) fn passed(&self, bodies: &[&Body]) -> Vec<Option<DVec3>> {
        let tries = (ALL_TRIES / bodies.len().max(1)).clamp(LEAST_TRIES, TRIES);
        if bodies.is_empty() {
            return Vec::new();
        }
        let cells = self.graph.by_place();
        let look = |(number, body): (usize, &&Body)| {
            let (mut random, mut met) = (Random::stream(SEED, number as u64), Vec::new());
            let place = (0..tries).find_map(|_| self.passed_at(body, &cells, (&mut random, &mut met)))?;
            Some(DVec3::from(self.world.absolute(place)))
        };
        bodies.par_iter().enumerate().map(look).collect()
    }

    /// A place in a body, if some sight line passes it there.
    fn passed_at(
        &self,
        body: &Body,
        cells: &CellsByPlace<'_>,
        (random, met): (&mut Random, &mut Vec<Hit>),
    ) -> Option<Vec3> {
        let place = body.min + random.cube() * (body.max - body.min);
        if !body.contains(place) {
            return None;
        }
        let direction = random.direction();
        let reach_m = self.scenery.blocker.occluders.tolerance.scale_m();
        let end = self.world.cast(place, -direction, reach_m, met);
        if met
            .first()
            .is_some_and(|first| self.world.triangle(first.triangle).hides())
        {
            return None;
        }
        let clear_m = met.first().or(end.as_ref()).map_or(reach_m, |first| first.t);
        let eye = place - clear_m * random.unit() * direction;
        let stands = cells.cell_at(self.world.absolute(eye)).is_some() && !self.scenery.blocker.holds(eye);
        let wide_m = WIDE * self.scenery.blocker.occluders.tolerance.hole_m;
        let (u, v) = direction.any_orthonormal_pair();
        let mut eyes = [Vec3::ZERO, u, -u, v, -v].into_iter().map(|aside| eye + wide_m * aside);
        (stands && eyes.all(|eye| self.sees_through(body, eye, direction, met))).then_some(place)
    }

    /// Whether an eye sees another thing than the body's own behind the body.
    fn sees_through(&self, body: &Body, eye: Vec3, direction: Vec3, met: &mut Vec<Hit>) -> bool {
        let Some(seen) = self.world.cast(eye, direction, f32::MAX, met) else {
            return false;
        };
        seen.object != body.object
            && body.enters(eye, eye + seen.t * direction, false).is_some()
            && !met.iter().any(|passed| self.world.triangle(passed.triangle).hides())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        cells::{
            author,
            plan::{Builder, prism},
        },
        defect::Defects,
        occluders::Hiders,
        source::Authored,
    };

    /// What is found of an occluder that spans a wall across x, 20 cm thick, in which `slit` is open; another thing stands on either side.
    fn passed_in_wall(slit: [f32; 2], occluder: [[f64; 2]; 2]) -> Option<DVec3> {
        let mut builder = Builder::default();
        builder.block("floor", [0., -0.5, 0.], [8., 0., 6.]);
        builder.block("wall", [3.9, 0., 0.], [4.1, 3., slit[0]]);
        builder.block("wall", [3.9, 0., slit[1]], [4.1, 3., 6.]);
        builder.block("thing", [1., 0., 1.], [1.5, 2., 5.]);
        builder.block("thing", [6., 0., 1.], [6.5, 2., 5.]);
        let world = World::new(&builder.scene).unwrap();
        let [[x0, x1], [z0, z1]] = occluder;
        let authored = Authored {
            cells: vec![
                prism("cell:a", &[[0.1, 0.], [4.0, 0.], [4.0, 6.], [0.1, 6.]], [0.0, 3.0]),
                prism("cell:b", &[[4.0, 0.], [7.9, 0.], [7.9, 6.], [4.0, 6.]], [0.0, 3.0]),
            ],
            occluders: vec![prism(
                "occluder:w",
                &[[x0, z0], [x1, z0], [x1, z1], [x0, z1]],
                [0.1, 2.9],
            )],
            ..Authored::default()
        };
        let defects = &mut Defects::default();
        let graph = author::build(&world, &authored, defects).unwrap();
        let drawn = author::occluders(&world, &authored, defects);
        let bodies: Vec<&Body> = drawn.iter().map(|drawn| &drawn.body).collect();
        assert_eq!(bodies.len(), 1, "{defects:?}");
        let hiders = Hiders::of(&world, vec![bodies[0].clone()]);
        let vouched = Vouched {
            world: &world,
            scenery: &Scenery::with(&world, hiders.occluders()),
            graph: &graph,
        };
        vouched.passed(&bodies)[0]
    }

    #[test]
    fn a_slit_behind_an_occluder_is_found_where_it_is() {
        let place = passed_in_wall([2.0, 2.05], [[3.95, 4.05], [0.5, 5.5]]).expect("a sight line");
        assert!(
            (3.95..4.05).contains(&place.x) && (2.0..2.05).contains(&place.z),
            "{place}"
        );
    }

    /// The cells reach into the wall: from in there one sees out through its culled backs.
    #[test]
    fn one_inside_a_wall_is_taken_at_its_word() {
        assert_eq!(passed_in_wall([2.0, 2.0], [[3.95, 4.05], [0.5, 1.9]]), None);
        assert_eq!(
            passed_in_wall([2.0, 2.05], [[3.95, 4.05], [2.1, 5.5]]),
            None,
            "beside the slit"
        );
    }

    #[test]
    fn one_that_sticks_out_of_a_wall_is_found() {
        let place = passed_in_wall([2.0, 2.0], [[3.7, 4.25], [0.5, 1.9]]).expect("a sight line");
        assert!(!(3.9..4.1).contains(&place.x), "{place}");
    }
}
