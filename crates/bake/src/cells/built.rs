//! Where in a scene is anything built?
//!
//! There the grid is fine. What decides is where walls stand, by their area: objects tell little, since one can be a chair or a town.

use belvedere_scene::Bounds;
use glam::Vec3;

use super::meets_box;
use crate::world::{MainPart, Triangle, World};

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
/// A sky is so many times as wide as what a scene is of …
const SKY_WIDER: f32 = 16.0;
/// … and no lower than this share of its own width.
const SKY_HEIGHT: f64 = 0.25;
/// A piece of one is no narrower than this share of how far away it is.
const SKY_PIECE: f32 = 0.25;
/// What is built is no smaller than this share of the scene.
const MIN_BUILT: f32 = 1.0 / 64.0;

/// The box that holds nearly all of what stands upright and hides, with some room around it, rounded so that a house that
/// moves hardly ever changes it; all of the scene where that is no smaller. In height it is all of the scene too, unless a sky
/// or something far up makes that far higher than what it is of is wide.
pub(super) fn built(world: &World, [min, max]: [Vec3; 2]) -> [Vec3; 2] {
    let sky = world.main_part().map(|part| Sky::around(world, part));
    let faces = || {
        let faces = world.triangles().filter(stands_upright);
        faces.filter(|face| sky.as_ref().is_none_or(|sky| !sky.holds(face)))
    };
    let [mut low, mut high] = [min, max];
    let narrowed = |axis: usize, [from, to]: [f32; 2]| {
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
        let ends = nearly_all(faces().map(|t| (middle(&t), breadth_m2(&t))));
        [low[axis], high[axis]] = ends.map_or([min[axis], max[axis]], |ends| narrowed(axis, ends));
    }
    if max.y - min.y > FAR_HIGHER * (high - low).x.max((high - low).z) {
        let end = |of: fn([f32; 3]) -> f32| nearly_all(faces().map(|t| (of(t.corners.map(|p| p.y)), breadth_m2(&t))));
        let lows = end(|[a, b, c]| a.min(b).min(c));
        let highs = end(|[a, b, c]| a.max(b).max(c));
        if let (Some([from, _]), Some([_, to])) = (lows, highs) {
            [low.y, high.y] = narrowed(1, [from, to]);
        }
    }
    [low, high]
}

/// What surrounds the main part of a scene: skies, and mountains at the horizon.
struct Sky {
    /// Objects that come nowhere near the main part and are high, rising: the shell of a hall is not.
    objects: Vec<u32>,
    /// The middle of the main part.
    middle: Vec3,
    /// Any piece of a sky is wider than this.
    wider_m: f32,
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
            wider_m: SKY_WIDER * part.width_m as f32,
        };
        let comes_near = |object: u32| {
            let triangles = world.triangles_of(object);
            let near = |t: &Triangle| meets_box(&t.corners.map(|p| p - sky.middle), 0.5 * (max - min));
            triangles.iter().any(near)
        };
        let of_it = |object: u32, bounds: &Bounds| {
            let [x, y, z] = bounds.size_m();
            let away_m = bounds.distance_m(world.absolute(sky.middle)) as f32;
            y > SKY_HEIGHT * x.max(z) && sky.surrounds(bounds.diagonal_m() as f32, away_m) && !comes_near(object)
        };
        let found = boxes().filter(|(object, bounds)| !bounds.is_empty() && of_it(*object, bounds));
        sky.objects = found.map(|(object, _)| object).collect();
        sky
    }

    fn surrounds(&self, width_m: f32, away_m: f32) -> bool {
        width_m > self.wider_m && width_m > SKY_PIECE * away_m
    }

    /// Whether a face is of it: by its object, or because it is such a piece alone, as the sides of a box that stands on the ground are.
    fn holds(&self, face: &Triangle) -> bool {
        let [a, b, c] = face.corners;
        let away_m = (b - a).cross(c - a).normalize_or_zero().dot(self.middle - a).abs();
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

/// Between which two places nearly all is that has a place and an area; `None` for nothing.
fn nearly_all(places: impl Iterator<Item = (f32, f64)>) -> Option<[f32; 2]> {
    let mut places: Vec<_> = places.collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let most_m2 = OUTLIERS * places.iter().map(|(_, area)| area).sum::<f64>();
    Some([after(places.iter(), most_m2)?, after(places.iter().rev(), most_m2)?])
}

/// The first place after so much area.
fn after<'a>(mut places: impl Iterator<Item = &'a (f32, f64)>, mut area_m2: f64) -> Option<f32> {
    let place = places.find(|(_, area)| {
        area_m2 -= area;
        area_m2 < 0.0
    });
    place.map(|(place, _)| *place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::plan::{Builder, floor_plan};

    /// In the space of the scene.
    fn built_of(builder: &Builder) -> [Vec3; 2] {
        let world = World::new(&builder.scene).unwrap();
        let ends = [world.bounds().min, world.bounds().max].map(|corner| world.relative(corner));
        built(&world, ends).map(|corner| corner + world.origin().as_vec3())
    }

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
        (built_of(&builder), house)
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
        // Or with the ground for its bottom.
        let on_the_ground = |builder: &mut Builder| {
            builder.block("sky", [-900.0, 0.0, -900.0], [900.0, 900.0, 900.0]);
        };
        assert_around(in_a_house(on_the_ground), [15.0; 3]);
    }

    #[test]
    fn a_house_that_is_one_object_stands_under_a_sky_too() {
        let mut builder = Builder::default();
        builder.block("house", [0.0, 0.0, 0.0], [10.0, 6.0, 10.0]);
        builder.ball("sky", [5.0, 0.0, 5.0], 900.0, 64);
        let [low, high] = built_of(&builder);
        assert!((high - low).max_element() < 100.0, "{} built", high - low);
    }

    /// Chairs in its middle are most of its objects, and its walls one.
    #[test]
    fn the_walls_of_a_large_hall_are_built() {
        let mut builder = Builder::default();
        for at in 0..80 {
            let [x, z] = [65.0 + (at % 10) as f32, 65.0 + (at / 10) as f32];
            builder.block("chair", [x, 0.0, z], [x + 0.4, 0.8, z + 0.4]);
        }
        let corners = [[0.0, 0.0], [150.0, 0.0], [150.0, 150.0], [0.0, 150.0]];
        let positions = [0.0, 12.0].map(|y| corners.map(|[x, z]| [x, y, z])).concat();
        let wall = |at: u32| [at, (at + 1) % 4, at + 4, at + 4, (at + 1) % 4, (at + 1) % 4 + 4];
        builder.mesh("walls", positions, (0..4).flat_map(wall).collect());
        let [low, high] = built_of(&builder);
        assert!((high - low).x > 149.0 && (high - low).z > 149.0, "{} built", high - low);
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
