//! A closed door closes the gap around it, and hides nothing on the other side of what frames it, however thin that is.

use glam::{DMat4, DVec3, Vec3};

use super::{blocker::Blocker, oracle::first_hiding_face, random::Random, screen::Screening};
use crate::{
    cells::plan::Builder,
    occluders::{Occluders, Region},
    source::Role,
    world::World,
};

const STEPS: u32 = 20_000;

/// A world with a door, and the same world with what fills all of its opening instead.
struct Scene {
    world: World,
    shut: World,
    blocker: Blocker,
    doors: Vec<u32>,
}

/// Faces of no thickness that are seen from both sides.
fn sheet(builder: &mut Builder, corners: [[f32; 3]; 4]) {
    let sheet = builder.quad("sheet", corners);
    builder.paint(sheet, false, true);
}

fn anywhere(random: &mut Random, min: [f32; 3], max: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| min[i] + random.unit() * (max[i] - min[i]))
}

fn level(builder: &mut Builder, y: f32, x: [f32; 2], z: [f32; 2]) {
    let corners = [[x[0], z[0]], [x[0], z[1]], [x[1], z[1]], [x[1], z[0]]];
    sheet(builder, corners.map(|[x, z]| [x, y, z]));
}

fn upright(builder: &mut Builder, z: f32, x: [f32; 2], y: [f32; 2]) {
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    sheet(builder, corners.map(|[x, y]| [x, y, z]));
}

impl Scene {
    /// What stands around, the door as it is, and what fills its opening.
    fn of(around: impl Fn(&mut Builder), door: impl Fn(&mut Builder) -> u32, filled: impl Fn(&mut Builder)) -> Self {
        let mut shut = Builder::default();
        around(&mut shut);
        filled(&mut shut);
        let mut builder = Builder::default();
        around(&mut builder);
        let door = door(&mut builder);
        builder.scene.objects[door as usize].role = Role::Door;
        let world = World::new(&builder.scene).unwrap();
        Self {
            blocker: Blocker::new(Occluders::of(&world)),
            doors: world.doors().to_vec(),
            shut: World::new(&shut.scene).unwrap(),
            world,
        }
    }

    fn region(&self, min: [f32; 3], max: [f32; 3]) -> Region {
        let [min, max] = [min, max].map(|p| self.world.relative(p.map(f64::from)));
        Region::of_box(min, max)
    }

    /// Asks about boxes at random places, and looks along rays from one to the other where nothing shall be seen. Returns how many
    /// the door hides.
    fn check(&self, seed: u64, rounds: u32, mut place: impl FnMut(&mut Random) -> [[f32; 3]; 2]) -> u32 {
        let mut random = Random::stream(seed, 5);
        let mut closed = Screening::new(&self.blocker, &self.doors, u32::MAX);
        let mut hidden = 0;
        for _ in 0..rounds {
            let [eye, target] = place(&mut random);
            let mut sized = |at: [f32; 3], most_m: f32| {
                let half = [0; 3].map(|_| 0.5 * most_m * random.unit());
                self.region([0, 1, 2].map(|i| at[i] - half[i]), [0, 1, 2].map(|i| at[i] + half[i]))
            };
            let (eye, target) = (sized(eye, 0.01), sized(target, 0.04));
            if closed.hides(&eye, &target).is_none() {
                continue;
            }
            hidden += 1;
            for _ in 0..60 {
                let mut within = |region: &Region| -> DVec3 {
                    let share = Vec3::from_array([0; 3].map(|_| random.unit()));
                    (region.min + share * (region.max - region.min)).as_dvec3()
                };
                let (from, to) = (within(&eye), within(&target));
                let face = first_hiding_face(&self.shut, from, to);
                let [from, to] = [from, to].map(|p| p + self.world.origin());
                assert!(face.is_some(), "{from} sees {to}");
            }
        }
        hidden
    }
}

/// A passage of thin floors, ceilings and sides along x that hangs in a larger house, with a door that leaves 1 cm on all
/// sides of it; where there is a step, the floor lies 3 cm lower in one half.
fn passage(step: bool) -> Scene {
    let floor = |z: f32| if step && z > 0.0 { -0.04 } else { -0.01 };
    let around = move |builder: &mut Builder| {
        for [from, to] in [[-0.51, 0.0], [0.0, 0.51]] {
            level(builder, floor(0.5 * (from + to)), [-3.0, 3.0], [from, to]);
        }
        level(builder, 2.21, [-3.0, 3.0], [-0.51, 0.51]);
        for z in [-0.51, 0.51] {
            upright(builder, z, [-3.0, 3.0], [-0.04, 2.21]);
        }
        if step {
            upright(builder, 0.0, [-3.0, 3.0], [-0.04, -0.01]);
        }
        level(builder, -1.5, [-3.0, 3.0], [-2.0, 2.0]);
        level(builder, 4.0, [-3.0, 3.0], [-2.0, 2.0]);
    };
    let door = |builder: &mut Builder| builder.block("door", [-0.03, 0.0, -0.5], [0.03, 2.2, 0.5]);
    let filled = move |builder: &mut Builder| {
        for [from, to] in [[-0.51, 0.0], [0.0, 0.51]] {
            builder.block("filled", [-0.03, floor(0.5 * (from + to)), from], [0.03, 2.21, to]);
        }
    };
    Scene::of(around, door, filled)
}

#[test]
fn a_closed_door_hides_what_is_in_its_passage_and_nothing_beside_it() {
    for step in [false, true] {
        let scene = passage(step);
        let rooms = [-1.0, 1.0].map(|side: f32| {
            let [from, to] = [side * 0.05, side * 2.9];
            scene.region([from.min(to), 0.01, -0.49], [from.max(to), 2.19, 0.49])
        });
        let hides = |closed: &[u32]| Screening::new(&scene.blocker, closed, STEPS).hides(&rooms[0], &rooms[1]);
        assert!(hides(&scene.doors).is_some() && hides(&[]).is_none(), "step: {step}");

        let hidden = scene.check(11, 300, |random| {
            [-1.0, 1.0].map(|side| {
                let [x, y, z] = anywhere(random, [0.1, 0.1, -0.45], [1.1, 2.1, 0.45]);
                [side * x, y, z]
            })
        });
        assert!(hidden > 200, "step: {step}, {hidden}");
        // Outside, nearer to a thin side, floor or ceiling than a gap might be wide.
        let hidden = scene.check(12, 2_000, |random| {
            let side = (4.0 * random.unit()) as u32;
            let mut at = |x: f32| {
                let off_m = 0.026 + 0.04 * random.unit();
                let [y, z] = [2.2 * random.unit(), random.unit() - 0.5];
                let x = x * (0.06 + random.unit());
                match side {
                    0 => [x, y, -0.51 - off_m],
                    1 => [x, y, 0.51 + off_m],
                    2 => [x, -0.04 - off_m, z],
                    _ => [x, 2.21 + off_m, z],
                }
            };
            [at(-1.0), at(1.0)]
        });
        assert_eq!(hidden, 0, "step: {step}, nothing is between them");
        // Anywhere around it, on either side of the door.
        let hidden = scene.check(13, 2_000, |random| {
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            [side, -side].map(|side| {
                let [x, y, z] = anywhere(random, [0.06, -1.0, -1.5], [2.0, 3.0, 1.5]);
                [side * x, y, z]
            })
        });
        assert!(hidden > 100, "step: {step}, {hidden}");
    }
}

#[test]
fn a_gate_on_a_thin_floor_hides_nothing_below_it() {
    // Two storeys; a gate of 4 × 4 m fills all of the upper one's width.
    let around = |builder: &mut Builder| {
        for y in [0.0, 3.0, 8.0] {
            level(builder, y, [0.0, 12.0], [0.0, 4.0]);
        }
        for z in [0.0, 4.0] {
            upright(builder, z, [0.0, 12.0], [0.0, 8.0]);
        }
        sheet(
            builder,
            [[6.0, 7.0, 0.0], [6.0, 7.0, 4.0], [6.0, 8.0, 4.0], [6.0, 8.0, 0.0]],
        );
    };
    let gate = |builder: &mut Builder| builder.block("gate", [5.97, 3.0, 0.0], [6.03, 7.0, 4.0]);
    let scene = Scene::of(around, gate, |builder| _ = gate(builder));
    let below = scene.check(21, 500, |random| {
        [1.0, 7.0].map(|x| anywhere(random, [x, 2.9, 0.1], [x + 4.0, 2.975, 3.9]))
    });
    assert_eq!(below, 0);
    let above = scene.check(22, 300, |random| {
        [1.0, 7.0].map(|x| anywhere(random, [x, 3.1, 0.1], [x + 4.0, 7.9, 3.9]))
    });
    assert!(above > 200, "{above}");
}

#[test]
fn a_door_that_stands_ajar_hides_nothing_beyond_its_hinge() {
    // A wall of no thickness with an opening of 1 × 2.1 m, and a leaf that is turned about one of its edges.
    for angle in [0.3, 0.7, 1.4] {
        let around = |builder: &mut Builder| {
            for y in [0.0, 3.0] {
                level(builder, y, [-3.0, 4.0], [-3.0, 3.0]);
            }
            upright(builder, 0.0, [-3.0, 0.0], [0.0, 3.0]);
            upright(builder, 0.0, [1.0, 4.0], [0.0, 3.0]);
            upright(builder, 0.0, [0.0, 1.0], [2.1, 3.0]);
        };
        let leaf = |builder: &mut Builder| {
            let door = builder.block("door", [0.0, 0.0, -0.02], [1.0, 2.1, 0.02]);
            builder.scene.objects[door as usize].world_from_object = DMat4::from_rotation_y(angle);
            door
        };
        let scene = Scene::of(around, leaf, |builder| _ = leaf(builder));
        // What an eye in the door itself sees is not asked.
        let is_in_it = |at: [f32; 3]| {
            let own = DMat4::from_rotation_y(-angle).transform_point3(DVec3::from(at.map(f64::from)));
            own.z.abs() < 0.05 && -0.03 < own.x && own.x < 1.03 && own.y < 2.13
        };
        let outside = |random: &mut Random, min: [f32; 3], max: [f32; 3]| {
            loop {
                let at = anywhere(random, min, max);
                if !is_in_it(at) {
                    return at;
                }
            }
        };
        let hinge = scene.check(31, 3_000, |random| {
            [(); 2].map(|()| outside(random, [-0.2, 0.1, -0.2], [0.2, 2.1, 0.2]))
        });
        let all = scene.check(32, 2_000, |random| {
            [(); 2].map(|()| outside(random, [-1.0, 0.1, -1.5], [2.0, 2.9, 1.5]))
        });
        assert!(hinge > 20 && all > 20, "{angle}: {hinge}, {all}");
    }
}
