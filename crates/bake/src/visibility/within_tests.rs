//! Does a cell that reaches into walls by a hair get all that an eye in there sees?
//!
//! A maze of boxes, turned about the vertical, so that no wall stands along a side of a cell: how far cells reach into
//! walls is then a matter of chance, and may be as little as one likes.

use glam::{DMat4, Vec3};

use super::{
    Method,
    blocker::AT_FACE,
    conservative::{Observer, Scenery},
    random::Random,
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
        for (front, out) in fronts {
            for share in [1.6, 2.0, 4.0, 8.0, 16.0] {
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
