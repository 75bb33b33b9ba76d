//! From where in a cell does one see an object?
//!
//! Eyes stand into the cell as in [`check`](crate::check), each draws one [`Cube`], and a pixel of the object counts once
//! a single sight line in double precision arrives. Where no picture shows it, sight lines are aimed at its faces. What is
//! found is proof that the object is visible; what is not found proves nothing.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::{
    blockade::Blockade,
    check::Cell,
    cube::Cube,
    eyes::{Eye, Place, in_polygon},
    random::Random,
    scene::Scene,
    sight::{Doubt, point_seen},
};

/// At most so many pixels of the object are confirmed from one eye.
const RAYS_AN_EYE: usize = 64;
/// So many lines are aimed at an object that no picture shows.
pub const AIMED: u64 = 20_000;
/// A line arrives when it is blocked only this share of its length before its end.
const ARRIVED: f64 = 1e-6;
/// The eyes are always the same.
const SEED: u64 = 1;

/// A segment on which nothing hides the far end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SightLine {
    /// Where it starts, in world space, metres.
    pub eye: [f64; 3],
    /// What kind of place that is.
    pub place: Place,
    /// Where it ends, on the object.
    pub point: [f64; 3],
}

impl SightLine {
    fn from(eye: &Eye, point: glam::DVec3) -> Self {
        Self {
            eye: eye.position.to_array(),
            place: eye.place,
            point: point.to_array(),
        }
    }
}

/// A sight line from the cell to the object, if one of so many eyes finds one on cube faces of `size_px`² pixels, or else one of
/// [`AIMED`] that are aimed. All doors are open.
#[must_use]
pub fn sight_line(scene: &Scene, cell: &Cell, object: u32, eyes: u64, size_px: usize) -> Option<SightLine> {
    pictured(scene, cell, object, eyes, size_px).or_else(|| aimed(scene, cell, object))
}

fn aimed(scene: &Scene, cell: &Cell, object: u32) -> Option<SightLine> {
    let (blockade, all_open) = (Blockade::of(scene), BTreeSet::new());
    let faces = scene.triangles_of(object as usize);
    let mut random = Random::of([SEED, cell.id.0.into(), object.into()]);
    (0..AIMED).filter(|_| !faces.is_empty()).find_map(|number| {
        let eye = cell.eye(scene, SEED, number);
        let target = in_polygon(&faces[random.below(faces.len())], &mut random);
        let arrives = blockade.reach(eye.position, target, &all_open) >= 1.0 - ARRIVED;
        let seen = || point_seen(scene, eye.position, target - eye.position, object, Doubt::Hides);
        Some(SightLine::from(&eye, arrives.then(seen)??))
    })
}

fn pictured(scene: &Scene, cell: &Cell, object: u32, eyes: u64, size_px: usize) -> Option<SightLine> {
    // The cube lists where the unexpected shows.
    let mut expected = vec![true; scene.objects.len()];
    *expected.get_mut(object as usize)? = false;
    let mut cube = Cube::new(size_px);
    (0..eyes).find_map(|number| {
        let eye = cell.eye(scene, SEED, number);
        cube.draw(scene, eye.position, &expected);
        let sightings = cube.unexpected();
        let rays = sightings.len().min(RAYS_AN_EYE);
        let mut tried = (0..rays).map(|ray| &sightings[ray * sightings.len() / rays]);
        let point = tried.find_map(|at| {
            let direction = cube.direction(at.face.into(), at.x.into(), at.y.into());
            point_seen(scene, eye.position, direction, object, Doubt::Hides)
        })?;
        Some(SightLine::from(&eye, point))
    })
}

#[cfg(test)]
mod tests {
    use belvedere_scene::record::Guarantee;
    use glam::DVec3;

    use super::*;
    use crate::{
        sight::sees,
        testing::{OPAQUE, cell, quad, scene},
    };

    #[test]
    fn a_line_ends_on_what_looks_out_behind_a_wall_and_on_nothing_that_does_not() {
        let wall = quad([-4.0, -4.0], [4.0, 4.0], -2.0, OPAQUE);
        let hidden = quad([-1.0, -1.0], [1.0, 1.0], -2.5, OPAQUE);
        let looks_out = quad([3.0, -1.0], [6.0, 1.0], -2.5, OPAQUE);
        let scene = scene(vec![wall, hidden, looks_out]);
        let cell = cell(&[0, 2], Guarantee::Conservative);
        let line = |object| sight_line(&scene, &cell, object, 40, 64);
        assert_eq!((line(1), line(3)), (None, None));
        let aimed = aimed(&scene, &cell, 2).expect("a line");
        assert!(aimed.point[0] > 3.0, "{aimed:?}");
        let found = line(2).expect("a line");
        assert!(found.eye.iter().all(|x| x.abs() <= 1.0), "{found:?}");
        assert!((found.point[2] + 2.5).abs() < 1e-9 && found.point[0] > 3.0, "{found:?}");
        let (eye, point) = (DVec3::from(found.eye), DVec3::from(found.point));
        assert!(sees(&scene, eye, point - eye, 2, Doubt::Hides), "{found:?}");
    }
}
