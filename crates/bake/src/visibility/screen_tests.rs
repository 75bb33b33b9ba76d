//! Closed doors hide what is behind them and nothing else.

use glam::{DMat4, Vec3};

use super::{blocker::Blocker, oracle::first_hiding_face, random::Random, screen::Screening};
use crate::{
    cells::plan::Builder,
    occluders::{Occluders, Region},
    source::Role,
    world::World,
};

const STEPS: u32 = 20_000;

/// What a door is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Leaf {
    Filled,
    Glass,
    /// A frame as thick as the leaf around a hole.
    Hole,
    /// A face to the west, with a culled back.
    Sheet,
}

/// Rooms on both sides of a wall of this thickness at x = 0, with a door in it, and a window if there is one.
struct House {
    world: World,
    /// The same with the door as a thing like any other.
    shut: World,
    blocker: Blocker,
    doors: Vec<u32>,
    thick_m: f32,
}

impl Leaf {
    fn add_to(self, builder: &mut Builder) -> u32 {
        let whole = |builder: &mut Builder| builder.block("door", [-0.03, 0.0, -0.5], [0.03, 2.2, 0.5]);
        match self {
            Self::Filled => whole(builder),
            Self::Glass => {
                let door = whole(builder);
                builder.paint(door, true, true);
                door
            }
            Self::Sheet => {
                let corners = [[0.0, -0.5], [0.0, 0.5], [2.2, 0.5], [2.2, -0.5]];
                builder.quad("door", corners.map(|[y, z]| [0.0, y, z]))
            }
            Self::Hole => {
                let bars = [
                    ([0.0, -0.5], [1.4, 0.5]),
                    ([1.8, -0.5], [2.2, 0.5]),
                    ([1.4, -0.5], [1.8, -0.2]),
                    ([1.4, 0.2], [1.8, 0.5]),
                ];
                let first = builder.scene.models.len();
                for (min, max) in bars {
                    builder.block("bar", [-0.03, min[0], min[1]], [0.03, max[0], max[1]]);
                }
                let bars: Vec<_> = builder
                    .scene
                    .models
                    .drain(first..)
                    .flat_map(|bar| bar.primitives)
                    .collect();
                builder.scene.objects.truncate(builder.scene.objects.len() - 4);
                let door = builder.mesh("door", Vec::new(), Vec::new());
                builder.scene.models[first].primitives = bars;
                door
            }
        }
    }
}

impl House {
    fn new(thick_m: f32, window: bool) -> Self {
        Self::turned(thick_m, window, 0.0)
    }

    /// Turned by this angle.
    fn turned(thick_m: f32, window: bool, angle: f64) -> Self {
        Self::with(Leaf::Filled, thick_m, window, angle)
    }

    fn with(leaf: Leaf, thick_m: f32, window: bool, angle: f64) -> Self {
        let mut builder = Builder::default();
        builder.block("floor", [-6.0, -0.2, -4.0], [6.0, 0.0, 4.0]);
        builder.block("ceiling", [-6.0, 3.0, -4.0], [6.0, 3.2, 4.0]);
        for z in [-4.2, 4.0] {
            builder.block("side", [-6.0, 0.0, z], [6.0, 3.0, z + 0.2]);
        }
        let (from, to) = (-0.5 * thick_m, 0.5 * thick_m);
        let mut wall = |min: [f32; 2], max: [f32; 2]| {
            if thick_m > 0.0 {
                builder.block("wall", [from, min[0], min[1]], [to, max[0], max[1]]);
            } else {
                let corner = |y: f32, z: f32| [0.0, y, z];
                let [a, b] = [corner(min[0], min[1]), corner(max[0], min[1])];
                let [c, d] = [corner(max[0], max[1]), corner(min[0], max[1])];
                builder.quad("front", [a, b, c, d]);
                builder.quad("back", [d, c, b, a]);
            }
        };
        wall([0.0, -4.0], [3.0, -0.5]);
        wall([2.2, -0.5], [3.0, 0.5]);
        wall([0.0, 0.5], [3.0, if window { 1.0 } else { 4.0 }]);
        if window {
            wall([0.0, 1.0], [1.0, 4.0]);
            wall([1.5, 1.0], [3.0, 4.0]);
        }
        let door = leaf.add_to(&mut builder);
        for object in &mut builder.scene.objects {
            object.world_from_object = DMat4::from_rotation_y(angle) * object.world_from_object;
        }
        let shut = World::new(&builder.scene).unwrap();
        builder.scene.objects[door as usize].role = Role::Door;
        let world = World::new(&builder.scene).unwrap();
        Self {
            blocker: Blocker::new(Occluders::of(&world)),
            doors: world.doors().to_vec(),
            world,
            shut,
            thick_m,
        }
    }

    fn region(&self, min: [f32; 3], max: [f32; 3]) -> Region {
        let [min, max] = [min, max].map(|p| self.world.relative(p.map(f64::from)));
        Region::of_box(min, max)
    }

    /// The rooms, up to the wall; the eastern one off it by a hair.
    fn rooms(&self) -> [Region; 2] {
        let half = 0.5 * self.thick_m;
        [
            self.region([-6.0, 0.0, -4.0], [-half, 3.0, 4.0]),
            self.region([half + 2e-4, 2e-4, -3.9998], [6.0, 2.9998, 3.9998]),
        ]
    }

    /// Whether any of many sight lines gets from one to the other beside the leaves.
    fn leaks(&self, eye: &Region, target: &Region) -> bool {
        let mut random = Random::stream(3, 1);
        let mut within = |region: &Region| {
            let share = Vec3::from_array([0; 3].map(|_| random.unit()));
            region.min + share * (region.max - region.min)
        };
        (0..20_000).any(|_| {
            let (from, to) = (within(eye), within(target));
            let passes_a_leaf = self.doors.iter().any(|door| self.blocker.door_is_on(*door, from, to));
            !passes_a_leaf && first_hiding_face(&self.world, from.as_dvec3(), to.as_dvec3()).is_none()
        })
    }
}

#[test]
fn a_closed_door_shuts_a_room_off_whether_its_wall_is_thick_or_thin() {
    for thick_m in [0.0, 0.06, 0.3] {
        let house = House::new(thick_m, false);
        let [west, east] = house.rooms();
        assert!(!house.leaks(&west, &east), "{thick_m}");
        assert!(
            Screening::new(&house.blocker, &house.doors, STEPS)
                .hides(&west, &east)
                .is_some(),
            "{thick_m}"
        );
        let back = Screening::new(&house.blocker, &house.doors, STEPS).hides(&east, &west);
        assert!(back.is_some() || thick_m == 0.0);
        assert!(
            Screening::new(&house.blocker, &[], STEPS).hides(&west, &east).is_none(),
            "it is open"
        );
    }
}

#[test]
fn a_window_beside_a_closed_door_shows_all_behind_it() {
    for thick_m in [0.0, 0.3] {
        let house = House::new(thick_m, true);
        let [west, east] = house.rooms();
        assert!(house.leaks(&west, &east), "{thick_m}");
        assert!(
            Screening::new(&house.blocker, &house.doors, STEPS)
                .hides(&west, &east)
                .is_none(),
            "{thick_m}"
        );
    }
}

#[test]
fn a_closed_door_that_stands_askew_hides_only_what_is_behind_it() {
    let mut random = Random::stream(4, 2);
    let mut hidden = [0, 0];
    for (turned, angle) in [(0, 0.0), (1, 0.6), (1, 2.2)] {
        let house = House::turned(0.06, false, angle);
        let mut screening = Screening::new(&house.blocker, &house.doors, u32::MAX);
        for _ in 0..60 {
            let mut part = || {
                let low = [0; 3].map(|_| 7.0 * random.unit() - 3.5);
                let low = [low[0], 0.3 * low[1].abs(), low[2]];
                house.region(low, low.map(|low| low + 0.1 + 0.5 * random.unit()))
            };
            let (eye, target) = (part(), part());
            if screening.hides(&eye, &target).is_none() {
                continue;
            }
            hidden[turned] += 1;
            for _ in 0..2_000 {
                let mut within = |region: &Region| {
                    let share = Vec3::from_array([0; 3].map(|_| random.unit()));
                    (region.min + share * (region.max - region.min)).as_dvec3()
                };
                let (from, to) = (within(&eye), within(&target));
                let face = first_hiding_face(&house.shut, from, to);
                assert!(face.is_some(), "{angle}: {from} sees {to}");
            }
        }
    }
    assert!(hidden.iter().all(|hidden| *hidden > 5), "{hidden:?}");
}

#[test]
fn a_closed_door_hides_only_where_it_is_opaque() {
    let mut random = Random::stream(7, 3);
    for leaf in [Leaf::Filled, Leaf::Glass, Leaf::Hole, Leaf::Sheet] {
        let house = House::with(leaf, 0.06, false, 0.0);
        let mut closed = Screening::new(&house.blocker, &house.doors, u32::MAX);
        let mut open = Screening::new(&house.blocker, &[], u32::MAX);
        // From the west, and from the east.
        let mut hidden_by_the_door = [0, 0];
        for round in 0..300 {
            let mut part = |side: f32| {
                let low = [side * 1.5, 1.2, 0.0].map(|middle| middle + random.unit() - 0.5);
                house.region(low, low.map(|low| low + 0.05 + 0.3 * random.unit()))
            };
            let from = round % 2;
            let side = if from == 0 { -1.0 } else { 1.0 };
            let (eye, target) = (part(side), part(-side));
            if closed.hides(&eye, &target).is_none() {
                continue;
            }
            hidden_by_the_door[from] += usize::from(open.hides(&eye, &target).is_none());
            for _ in 0..500 {
                let mut within = |region: &Region| {
                    let share = Vec3::from_array([0; 3].map(|_| random.unit()));
                    (region.min + share * (region.max - region.min)).as_dvec3()
                };
                let (from, to) = (within(&eye), within(&target));
                let face = first_hiding_face(&house.shut, from, to);
                assert!(face.is_some(), "{leaf:?}: {from} sees {to}");
            }
        }
        let [west, east] = hidden_by_the_door;
        match leaf {
            Leaf::Filled | Leaf::Hole => assert!(west > 5 && east > 5, "{leaf:?}: {west}, {east}"),
            Leaf::Glass => assert_eq!([west, east], [0, 0]),
            Leaf::Sheet => assert!(west > 5 && east == 0, "{west}, {east}"),
        }
    }
}

#[test]
fn what_is_proved_hidden_no_ray_finds() {
    let mut random = Random::stream(9, 4);
    let (mut hidden, mut seen) = (0, 0);
    for window in [false, true] {
        let house = House::new(0.3, window);
        let mut screening = Screening::new(&house.blocker, &house.doors, u32::MAX);
        for _ in 0..30 {
            let mut part = |from: f32| {
                let low = [from, 0.1, -3.0].map(|low| low + 2.0 * random.unit());
                let low = [low[0], low[1], 2.5 * low[2] + 4.5];
                house.region(low, low.map(|low| low + 0.1 + 0.8 * random.unit()))
            };
            let (eye, target) = (part(-5.0), part(1.0));
            let leaks = house.leaks(&eye, &target);
            let proved = screening.hides(&eye, &target).is_some();
            assert!(!(proved && leaks), "{eye:?} sees {target:?}");
            hidden += usize::from(proved);
            seen += usize::from(leaks);
        }
    }
    assert!(hidden >= 20 && seen >= 3, "{hidden} hidden, {seen} seen");
}

#[test]
fn a_proof_tells_the_doors_that_it_takes() {
    // Three rooms in a row, with a door in each wall between two.
    let mut builder = Builder::default();
    builder.block("floor", [-9.0, -0.2, -4.0], [9.0, 0.0, 12.0]);
    builder.block("ceiling", [-9.0, 3.0, -4.0], [9.0, 3.2, 12.0]);
    for z in [-4.2, 12.0] {
        builder.block("side", [-9.0, 0.0, z], [9.0, 3.0, z + 0.2]);
    }
    let mut doors = Vec::new();
    for x in [-3.0, 3.0] {
        builder.block("wall", [x - 0.1, 0.0, -4.0], [x + 0.1, 3.0, -0.5]);
        builder.block("wall", [x - 0.1, 2.2, -0.5], [x + 0.1, 3.0, 0.5]);
        builder.block("wall", [x - 0.1, 0.0, 0.5], [x + 0.1, 3.0, 12.0]);
        doors.push(builder.block("door", [x - 0.03, 0.0, -0.5], [x + 0.03, 2.2, 0.5]));
    }
    for door in &doors {
        builder.scene.objects[*door as usize].role = Role::Door;
    }
    let world = World::new(&builder.scene).unwrap();
    let blocker = Blocker::new(Occluders::of(&world));
    let room = |from: f32, to: f32| {
        let [min, max] = [[from, 0.1, -3.9], [to, 2.9, 11.9]].map(|p: [f32; 3]| world.relative(p.map(f64::from)));
        Region::of_box(min, max)
    };
    let [west, middle, east] = [room(-8.0, -3.2), room(-2.8, 2.8), room(3.2, 8.0)];
    let mut screening = Screening::new(&blocker, &doors, STEPS);
    let [first, second] = [doors[0], doors[1]];
    assert_eq!(screening.hides(&west, &middle), Some([first].into()));
    assert_eq!(screening.hides(&middle, &east), Some([second].into()));
    assert!(screening.hides(&west, &east).is_some());
    // Either does alone, and none when both are open.
    for other in doors {
        screening.close(vec![other], STEPS);
        assert_eq!(screening.hides(&west, &east), Some([other].into()));
    }
    screening.close(Vec::new(), STEPS);
    assert_eq!(screening.hides(&west, &east), None);
}
