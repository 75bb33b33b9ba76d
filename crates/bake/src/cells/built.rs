//! Where in a scene is anything built?
//!
//! There the grid is fine. What decides is where walls stand, by their area: objects tell little, since one can be a chair or a town.

use belvedere_scene::Bounds;
use glam::Vec3;

use super::meets_box;
use crate::world::{FAR, MainPart, Triangle, World};

/// A face stands upright when its normal rises no more than this.
const UPRIGHT: f32 = 0.05;
/// This share of what stands upright may lie beyond either end of what counts as built …
const OUTLIERS: f64 = 0.01;
/// … with so much of its size around it as room.
const ROOM: f32 = 0.05;
/// What is built takes all of a scene of which it takes more than this share.
const MOSTLY: f32 = 0.5;
/// A scene is far higher than what is built in it when it is so many times as high as that is wide.
const FAR_HIGHER: f32 = 8.0;
/// What is built is no smaller than this share of the scene.
const MIN_BUILT: f32 = 1.0 / 64.0;

/// The box that holds nearly all of what stands upright and hides, with some room around it, rounded so that a house that
/// moves hardly ever changes it; all of the scene where that is no smaller. In height it is all of the scene too, unless a sky
/// or something far up makes that far higher than what it is of is wide.
pub(super) fn built(world: &World, [min, max]: [Vec3; 2]) -> [Vec3; 2] {
    let part = MainPart::of(world.object_bounds()).filter(|part| f64::from(world.scale_m()) > FAR * part.width_m);
    let sky = part.as_ref().map(|part| Sky::around(world, part));
    let faces = || {
        let faces = world.triangles().filter(stands_upright);
        faces.filter(|face| sky.as_ref().is_none_or(|sky| !sky.holds(face)))
    };
    let [mut low, mut high] = [min, max];
    let narrowed = |axis: usize, ends: [Option<f32>; 2]| {
        let [Some(from), Some(to)] = ends else {
            return [min[axis], max[axis]];
        };
        let size = (to - from).max(MIN_BUILT * (max - min).max_element());
        let step = size.log2().floor().exp2() / 8.0;
        let start = (((from - ROOM * size) / step).floor() * step).max(min[axis]);
        let end = (((to + ROOM * size) / step).ceil() * step).min(max[axis]);
        if end - start < MOSTLY * (max[axis] - min[axis]) {
            [start, end]
        } else {
            [min[axis], max[axis]]
        }
    };
    for axis in [0, 2] {
        let middle = |t: &Triangle| (t.corners[0][axis] + t.corners[1][axis] + t.corners[2][axis]) / 3.0;
        let places: Vec<_> = faces().map(|t| (middle(&t), breadth_m2(&t))).collect();
        [low[axis], high[axis]] = narrowed(axis, [-1.0, 1.0].map(|way| end_of(&places, way)));
    }
    if max.y - min.y > FAR_HIGHER * (high - low).x.max((high - low).z) {
        let top = |t: &Triangle, way: f32| way * t.corners.iter().fold(f32::NEG_INFINITY, |top, p| top.max(way * p.y));
        [low.y, high.y] = narrowed(
            1,
            [-1.0, 1.0].map(|way| {
                let places: Vec<_> = faces().map(|t| (top(&t, way), breadth_m2(&t))).collect();
                end_of(&places, way)
            }),
        );
    }
    [low, high]
}

/// What surrounds the main part of a scene: skies, and mountains at the horizon. Any piece of them is far wider than the main part, and
/// no further from it than it is wide.
struct Sky {
    /// Objects that come nowhere near the main part, rising.
    objects: Vec<u32>,
    middle: Vec3,
    far_wider_m: f32,
}

impl Sky {
    fn around(world: &World, part: &MainPart) -> Self {
        let boxes = || (0u32..).zip(world.object_bounds());
        let held = boxes().filter(|(_, bounds)| part.holds(bounds));
        let around = held.fold(Bounds::EMPTY, |all, (_, bounds)| all.union(bounds));
        let [min, max] = [around.min, around.max].map(|corner| world.relative(corner));
        let mut sky = Self {
            objects: Vec::new(),
            middle: 0.5 * (min + max),
            far_wider_m: (FAR * part.width_m) as f32,
        };
        let comes_near = |object: u32| {
            let triangles = world.triangles_of(object);
            let near = |t: &Triangle| meets_box(&t.corners.map(|p| p - sky.middle), 0.5 * (max - min));
            triangles.iter().any(near)
        };
        let of_it = |object: u32, bounds: &Bounds| {
            let away_m = bounds.distance_m(world.absolute(sky.middle));
            sky.surrounds(bounds.diagonal_m() as f32, away_m as f32) && !comes_near(object)
        };
        let found = boxes().filter(|(object, bounds)| !bounds.is_empty() && of_it(*object, bounds));
        sky.objects = found.map(|(object, _)| object).collect();
        sky
    }

    fn surrounds(&self, width_m: f32, away_m: f32) -> bool {
        width_m > self.far_wider_m && width_m >= away_m
    }

    fn holds(&self, face: &Triangle) -> bool {
        let away_m = face
            .corners
            .map(|p| p.distance(self.middle))
            .into_iter()
            .fold(f32::INFINITY, f32::min);
        self.surrounds(breadth_m2(face).sqrt() as f32, away_m) || self.objects.binary_search(&face.object).is_ok()
    }
}

fn stands_upright(triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.corners;
    let doubled = (b - a).cross(c - a);
    triangle.hides() && doubled.y.abs() <= UPRIGHT * doubled.length()
}

/// The square of the least height of a triangle: about its area, but little for the long thin sides of a slab of ground.
fn breadth_m2(triangle: &Triangle) -> f64 {
    let [a, b, c] = triangle.corners;
    let longest_m = (b - a).length().max((c - b).length()).max((a - c).length());
    f64::from(2.0 * triangle.area_m2() / longest_m.max(f32::MIN_POSITIVE)).powi(2)
}

/// The furthest place one way, but for the outliers.
fn end_of(places: &[(f32, f64)], way: f32) -> Option<f32> {
    let mut places = places.to_vec();
    places.sort_by(|a, b| (way * b.0).total_cmp(&(way * a.0)));
    let mut most_m2 = OUTLIERS * places.iter().map(|(_, area)| area).sum::<f64>();
    let place = places.into_iter().find(|(_, area)| {
        most_m2 -= area;
        most_m2 < 0.0
    });
    place.map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::plan::{Builder, floor_plan};

    fn in_a_house(add: impl FnOnce(&mut Builder)) -> ([Vec3; 2], Bounds) {
        let (mut builder, _) = floor_plan(
            "##########
             #...#....#
             #........#
             #...#....#
             ##########",
        );
        for at in 0..60 {
            let [x, z] = [1.5 + (at % 10) as f32 * 0.5, 1.5 + (at / 10) as f32 * 0.3];
            builder.block("chair", [x, 0.0, z], [x + 0.2, 0.5, z + 0.2]);
        }
        let house = World::new(&builder.scene).unwrap().bounds();
        add(&mut builder);
        let world = World::new(&builder.scene).unwrap();
        let bounds = world.bounds();
        let built = built(&world, [bounds.min, bounds.max].map(|corner| world.relative(corner)));
        (built.map(|corner| corner + world.origin().as_vec3()), house)
    }

    fn assert_around(([low, high], house): ([Vec3; 2], Bounds), room_m: [f32; 3]) {
        for axis in 0..3 {
            let (before, after) = (house.min[axis] as f32 - low[axis], high[axis] - house.max[axis] as f32);
            assert!(
                (-1e-3..room_m[axis]).contains(&before) && (-1e-3..room_m[axis]).contains(&after),
                "axis {axis}: {before} m before the house, {after} m behind it"
            );
        }
    }

    #[test]
    fn a_sky_is_nothing_built() {
        let sky = |builder: &mut Builder| {
            builder.ball("sky", [3.0, 0.0, 2.0], 1000.0, 64);
        };
        assert_around(in_a_house(sky), [15.0; 3]);
        // As a box it has walls as large as it.
        let six_sides = |builder: &mut Builder| {
            builder.block("sky", [-800.0, -800.0, -800.0], [800.0, 800.0, 800.0]);
        };
        assert_around(in_a_house(six_sides), [15.0; 3]);
        // Or as the quarters that a bake makes of it.
        let quarters = |builder: &mut Builder| {
            for [x, z] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
                for (name, from, to) in [
                    ("west", [900.0, 0.0], [900.0, 900.0]),
                    ("north", [0.0, 900.0], [900.0, 900.0]),
                ] {
                    let corner = |[x_m, z_m]: [f32; 2], y: f32| [x * x_m, y, z * z_m];
                    builder.quad(
                        name,
                        [
                            corner(from, -900.0),
                            corner(to, -900.0),
                            corner(to, 900.0),
                            corner(from, 900.0),
                        ],
                    );
                }
            }
        };
        assert_around(in_a_house(quarters), [15.0; 3]);
    }

    #[test]
    fn a_sliver_far_up_is_nothing_built() {
        let sliver = |builder: &mut Builder| {
            let corners = [[1.0, 1.0, 1.0], [2000.0, 3000.0, 2500.0], [2000.0, 3000.0, 2500.01]];
            builder.mesh("sliver", corners.to_vec(), vec![0, 1, 2]);
        };
        assert_around(in_a_house(sliver), [50.0; 3]);
    }

    #[test]
    fn hills_around_a_house_are_fine_in_height() {
        let hill = |builder: &mut Builder| {
            let corners = [[-900.0, -0.5, -900.0], [900.0, -0.5, -900.0], [0.0, 30.0, 2000.0]];
            builder.mesh("hill", corners.to_vec(), vec![0, 1, 2]);
        };
        let ([low, high], _) = in_a_house(hill);
        assert!(low.y <= -0.49 && high.y >= 29.9, "from {} m to {} m", low.y, high.y);
        assert!(high.x - low.x < 200.0, "{} m wide", high.x - low.x);
    }
}
