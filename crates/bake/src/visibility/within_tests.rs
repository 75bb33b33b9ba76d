//! Does a cell that reaches into walls by a hair get all that an eye in there sees?
//!
//! Does an eye in what is hollow inside a thing get what stands in there, and one beside a thing that leans or crosses itself what
//! is beyond?
//!
//! A maze of boxes, turned about the vertical, so that no wall stands along a side of a cell: how far cells reach into
//! walls is then a matter of chance, and may be as little as one likes.

use glam::{DMat4, Vec3};

use super::{
    Method,
    blocker::AT_FACE,
    conservative::{Observer, Scenery},
    random::Random,
    targets,
};
use crate::{cells::plan::Builder, occluders::Region, world::World};

/// Walls along both axes of a square grid, in m.
const ROOMS: usize = 4;
const ROOM_M: f32 = 2.0;
const THICK_M: f32 = 0.2;

struct Maze {
    world: World,
    scenery: Scenery,
    /// A point in the middle of each wall's front, and the way out of it, level.
    fronts: Vec<(Vec3, Vec3)>,
}

fn maze(angle: f64) -> Maze {
    let mut random = Random::stream(11, (angle * 1e3) as u64);
    let mut builder = Builder::default();
    let size = ROOMS as f32 * ROOM_M;
    builder.block("floor", [-1.0, -0.2, -1.0], [size + 1.0, 0.0, size + 1.0]);
    let mut fronts = Vec::new();
    for line in 0..=ROOMS {
        for room in 0..ROOMS {
            for along_x in [true, false] {
                if (1..ROOMS).contains(&line) && random.unit() < 0.3 {
                    continue;
                }
                let (at, from) = (line as f32 * ROOM_M, room as f32 * ROOM_M);
                let place = |along: f32, across: f32, y: f32| {
                    if along_x {
                        [along, y, across]
                    } else {
                        [across, y, along]
                    }
                };
                // Clear of the walls across, so that each is a solid of its own.
                let ends = [from + 1.5 * THICK_M, from + ROOM_M - 0.5 * THICK_M];
                builder.block("wall", place(ends[0], at, 0.0), place(ends[1], at + THICK_M, 3.0));
                let out = Vec3::from(place(0.0, -1.0, 0.0));
                fronts.push((Vec3::from(place(from + 0.5 * ROOM_M, at, 1.0)), out));
            }
        }
    }
    let turn = DMat4::from_rotation_y(angle);
    for object in &mut builder.scene.objects {
        object.world_from_object = turn * object.world_from_object;
    }
    let world = World::new(&builder.scene).unwrap();
    let turned = |v: Vec3| turn.transform_vector3(v.as_dvec3());
    let fronts = fronts.into_iter().map(|(place, out)| {
        let place = world.relative(turned(place).to_array());
        (place, turned(out).as_vec3())
    });
    Maze {
        fronts: fronts.collect(),
        scenery: Scenery::of(&world),
        world,
    }
}

#[test]
fn an_eye_a_hair_inside_a_wall_sees_nothing_that_its_cell_lacks() {
    let mut looked_through = 0;
    for angle in [0.4, 1.1, 2.7] {
        let Maze { world, scenery, fronts } = maze(angle);
        let tolerance = scenery.blocker.occluders.tolerance;
        let mut observer = Observer::new(&scenery, Method::Conservative.proofs());
        let mut random = Random::stream(12, 1);
        let mut passed = Vec::new();
        for (number, (front, out)) in fronts.into_iter().enumerate() {
            let shares = [1.6, 2.0, 4.0, 8.0, 16.0].into_iter().cycle();
            for share in shares.skip(number % 5).step_by(2).take(2) {
                // The corner of the cell that lies deepest in the wall.
                let depth_m = share * AT_FACE * tolerance.plane_m;
                let corner = front - depth_m * out;
                let other = corner + Vec3::new(0.7 * out.x.signum(), 0.5, 0.7 * out.z.signum());
                let cell = Region::of_box(corner.min(other), corner.max(other));
                let set = observer.visible(&cell, &[]);
                for _ in 0..2_000 {
                    let (eye, direction) = (front - depth_m * random.unit() * out, random.direction());
                    if eye.clamp(cell.min, cell.max) != eye {
                        continue;
                    }
                    if let Some(hit) = world.cast(eye, direction, f32::MAX, &mut passed) {
                        let known = set.binary_search(&hit.object).is_ok();
                        assert!(known, "{angle}: {} is seen from {eye}, {depth_m} m inside", hit.object);
                        looked_through += usize::from(direction.dot(out) < 0.0);
                    }
                }
            }
        }
    }
    assert!(
        looked_through > 1_000,
        "{looked_through} sight lines through the backs of walls"
    );
}

/// Shells in one thing: boxes seen from outside, and, `inwards`, from inside.
#[derive(Default)]
struct Shells {
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

impl Shells {
    fn add(&mut self, [min, max]: [Vec3; 2], inwards: bool) {
        let mut block = Builder::default();
        block.block("", min.to_array(), max.to_array());
        let primitive = &block.scene.models[0].primitives[0];
        let first = self.positions.len() as u32;
        self.positions.extend(&primitive.positions);
        let triangles = primitive.indices.chunks_exact(3);
        self.indices.extend(triangles.flat_map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|corner| first + corner);
            if inwards { [a, c, b] } else { [a, b, c] }
        }));
    }
}

/// A part of a box, somewhere in it and clear of its sides.
fn some_part(random: &mut Random, [min, max]: [Vec3; 2]) -> [Vec3; 2] {
    let size = max - min;
    let low = min + size * (0.05 + 0.4 * random.cube());
    let high = max - size * (0.05 + 0.4 * random.cube());
    [low.min(high), low.max(high)]
}

/// A thing of 8 × 3.6 × 6 m with rooms, in which there may be hollow pillars, one in the other; things stand in all of these.
fn hollow_thing(seed: u64) -> World {
    let mut random = Random::stream(13, seed);
    let mut builder = Builder::default();
    let whole = [Vec3::ZERO, Vec3::new(8.0, 3.6, 6.0)];
    let rooms = match seed % 3 {
        0 => vec![[whole[0] + 0.3, whole[1] - 0.3]],
        1 => vec![some_part(&mut random, whole)],
        _ => {
            let wall_m = 3.0 + 2.0 * random.unit();
            vec![
                [whole[0] + 0.3, Vec3::new(wall_m, 3.3, 5.7)],
                [Vec3::new(wall_m + 0.2, 0.3, 0.3), whole[1] - 0.3],
            ]
        }
    };
    let mut shells = Shells::default();
    shells.add(whole, false);
    let mut air = rooms;
    for depth in 0..2 {
        let mut deeper = Vec::new();
        for room in &air {
            shells.add(*room, true);
            let size = room[1] - room[0];
            for _ in 0..3 {
                let at = room[0] + size * (0.02 + 0.9 * random.cube());
                builder.block("thing", at.to_array(), (at + 0.04 * size).to_array());
            }
            if depth == 0 && random.unit() < 0.5 {
                let pillar = some_part(&mut random, *room);
                shells.add(pillar, false);
                deeper.push(some_part(&mut random, pillar));
            }
        }
        air = deeper;
    }
    builder.mesh("hollow", shells.positions, shells.indices);
    builder.block("beyond", [9.0, 0.0, 0.0], [9.5, 3.0, 6.0]);
    World::new(&builder.scene).unwrap()
}

/// Looks from cells between two corners; answers how many sight lines met something, and how often something was proved hidden.
fn look_around(world: &World, seed: u64, [min, max]: [Vec3; 2]) -> (usize, usize) {
    let scenery = Scenery::of(world);
    let mut observer = Observer::new(&scenery, Method::Conservative.proofs());
    let mut random = Random::stream(14, seed);
    let (mut looked, mut hidden, mut passed) = (0, 0, Vec::new());
    for _ in 0..40 {
        let middle = world.relative(min.as_dvec3().to_array()) + random.cube() * (max - min);
        let half = 0.05 * random.cube() * (max - min).min_element();
        let cell = Region::of_box(middle - half, middle + half);
        let set = observer.visible(&cell, &[]);
        hidden += world.object_bounds().len() - set.len();
        for i in 0..1_000 {
            let eye = cell.min + random.cube() * (cell.max - cell.min);
            let aimed = i % world.object_bounds().len() as u32;
            let aim = (i % 2 == 0)
                .then(|| targets::on_object(world, aimed, &mut random))
                .flatten();
            let direction = aim.map_or_else(|| random.direction(), |target| target - eye);
            if let Some(hit) = world.cast(eye, direction, f32::MAX, &mut passed) {
                let known = set.binary_search(&hit.object).is_ok();
                assert!(known, "{seed}: {} is seen from {eye} in {cell:?}", hit.object);
                looked += 1;
            }
        }
    }
    (looked, hidden)
}

/// The same in many worlds, with so many sight lines and proofs that it says something.
fn look_around_all(seeds: u64, thing: fn(u64) -> World, corners: impl Fn(u64) -> [Vec3; 2]) {
    let found = (0..seeds).map(|seed| look_around(&thing(seed), seed, corners(seed)));
    let (looked, hidden) = found.fold((0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
    assert!(
        looked > 100_000 && hidden > 500,
        "{looked} sight lines, {hidden} proved hidden"
    );
}

#[test]
fn an_eye_in_a_cavity_sees_nothing_that_its_cell_lacks() {
    look_around_all(24, hollow_thing, |_| [Vec3::ZERO, Vec3::new(8.0, 3.6, 6.0)]);
}

/// Ramps and bridges that rise by less than two in a hundred, blocks with tops that fall by as little to both sides, and posts beside
/// them, low and high.
fn leaning_things(seed: u64) -> World {
    let mut random = Random::stream(15, seed);
    let mut builder = Builder::default();
    for thing in 0..4 {
        // Nothing stands in the box around one, so that it is a body as it is.
        let at = Vec3::new(20.0 * random.unit(), 0.0, 25.0 * thing as f32);
        let place = |x: f32, y: f32, z: f32| (Vec3::new(x, y, z) + at).to_array();
        let (rise_m, thick_m) = (0.8 + 0.8 * random.unit(), 0.5 + 2.5 * (thing % 2) as f32);
        let mut positions = Vec::new();
        for x in [-50.0, 0.0, 50.0] {
            let (low_m, high_m) = match thing % 2 {
                0 => (0.01 * (x + 50.0) * rise_m, 0.01 * (x + 50.0) * rise_m + thick_m),
                _ => (0.0, thick_m + rise_m * (1.0 - f32::abs(x) / 50.0)),
            };
            positions.extend([place(x, low_m, -5.0), place(x, low_m, 5.0)]);
            positions.extend([place(x, high_m, 5.0), place(x, high_m, -5.0)]);
        }
        let quads = [0, 4]
            .into_iter()
            .flat_map(|near| (0..4).map(move |k| [near + k, near + (k + 1) % 4, near + 4 + (k + 1) % 4, near + 4 + k]));
        let ends = [[0, 3, 2, 1], [8, 9, 10, 11]];
        let quads = quads.chain(ends).flat_map(|[a, b, c, d]| [a, c, b, a, d, c]);
        builder.mesh("leaning", positions, quads.collect());
        for _ in 0..6 {
            let (x, z) = (100.0 * random.unit() - 50.0, 5.5 + 3.0 * random.unit());
            let z = if random.unit() < 0.5 { z } else { -z - 0.3 };
            for y in [0.0, thick_m + 0.3 + random.unit()] {
                let foot = Vec3::from(place(x, y, z));
                builder.block("post", foot.to_array(), (foot + Vec3::new(0.3, 0.6, 0.3)).to_array());
            }
        }
    }
    World::new(&builder.scene).unwrap()
}

#[test]
fn an_eye_beside_what_leans_sees_nothing_that_its_cell_lacks() {
    let highest_m = |seed: u64| 2.0 + 3.0 * (seed % 2) as f32;
    look_around_all(12, leaning_things, |seed| {
        [Vec3::new(-40.0, 0.1, -10.0), Vec3::new(70.0, highest_m(seed), 90.0)]
    });
}

/// Houses over outlines that cross themselves, as maps have them: one lobe the right way round, a smaller one inside out.
fn crossed_things(seed: u64) -> World {
    let mut random = Random::stream(16, seed);
    let mut builder = Builder::default();
    for _ in 0..3 {
        let at = Vec3::new(20.0 * random.unit(), 0.0, 20.0 * random.unit());
        let (height_m, end_m) = (3.0 + random.unit(), 8.0 + 2.0 * random.unit());
        let outline = [
            [0.0, 0.0],
            [0.0, 6.0],
            [6.0, 6.0],
            [end_m, 6.0],
            [end_m, end_m],
            [6.0, end_m],
            [6.0, 6.0],
            [6.0, 0.0],
        ];
        let floors = [0.0, height_m].into_iter();
        let corners = floors.flat_map(|y| outline.iter().map(move |[x, z]| Vec3::new(*x, y, *z)));
        let positions = corners.map(|corner| (corner + at).to_array()).collect();
        let walls = (0..8).flat_map(|i| {
            let next = (i + 1) % 8;
            [i, next, next + 8, i, next + 8, i + 8]
        });
        let caps = [[0, 1, 2], [0, 2, 7], [3, 4, 5], [3, 5, 6]].into_iter();
        let caps = caps.flat_map(|[a, b, c]| [a, c, b, a + 8, b + 8, c + 8]);
        builder.mesh("house", positions, walls.chain(caps).collect());
        for _ in 0..8 {
            let foot = at + Vec3::new(12.0 * random.unit(), 0.0, 12.0 * random.unit());
            builder.block("post", foot.to_array(), (foot + Vec3::new(0.3, 1.0, 0.3)).to_array());
        }
    }
    World::new(&builder.scene).unwrap()
}

#[test]
fn an_eye_beside_what_crosses_itself_sees_nothing_that_its_cell_lacks() {
    look_around_all(12, crossed_things, |_| {
        [Vec3::new(-5.0, 0.1, -5.0), Vec3::new(35.0, 4.0, 35.0)]
    });
}
