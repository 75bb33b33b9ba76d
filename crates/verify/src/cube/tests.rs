use super::*;
use crate::{
    scene::Model,
    sight::{Doubt, sees},
    testing::{BOTH_SIDES, GLASS, OPAQUE, block, object, quad, scene},
};
use glam::DMat4;
use proptest::prelude::*;

const AHEAD: u8 = 5;

fn drawn(scene: &Scene, size: usize, eye: DVec3) -> Cube {
    let mut cube = Cube::new(size);
    cube.draw(scene, eye, &vec![true; scene.objects.len()]);
    cube
}

fn pixels(scene: &Scene) -> Vec<u32> {
    drawn(scene, 64, DVec3::ZERO).pixels().to_vec()
}

/// How many pixel middles of a face lie in a rectangle of the face's plane at distance 1.
fn middles(size: usize, min: [f64; 2], max: [f64; 2]) -> u32 {
    let along = |axis: usize| {
        (0..size)
            .map(|i| (2 * i + 1) as f64 / size as f64 - 1.0)
            .filter(|at| (min[axis]..=max[axis]).contains(at))
            .count() as u32
    };
    along(0) * along(1)
}

#[test]
fn a_quad_covers_exactly_the_pixels_whose_middles_it_holds() {
    for size in [16, 63, 64] {
        let scene = scene(vec![quad([-0.62, -0.33], [0.71, 0.57], -2.0, OPAQUE)]);
        let cube = drawn(&scene, size, DVec3::ZERO);
        let expected = middles(size, [-0.31, -0.165], [0.355, 0.285]);
        assert_eq!(cube.pixels(), [expected], "{size}");
        assert_eq!(cube.covered(), u64::from(expected));
    }
}

#[test]
fn a_picture_is_neither_turned_nor_mirrored() {
    // Up and to the right of an eye that looks along −Z.
    let model = quad([0.5, 0.5], [1.0, 1.0], -1.0, OPAQUE);
    let mut cube = Cube::new(4);
    cube.draw(&scene(vec![model]), DVec3::ZERO, &[false]);
    let at = |face, x, y| Sighting { object: 0, face, x, y };
    assert_eq!(cube.unexpected(), [at(AHEAD, 3, 0)]);
    assert!((cube.direction(5, 3, 0) - DVec3::new(0.75, 0.75, -1.0)).length() < 1e-12);
    for (face, [right, up, ahead]) in FACES.iter().map(|f| {
        let (right, up) = (f.direction(1.0, 0.0), f.direction(0.0, 1.0));
        let ahead = f.direction(0.0, 0.0);
        (f.name, [right - ahead, up - ahead, ahead])
    }) {
        assert_eq!(right.cross(up), -ahead, "{face}");
    }
}

#[test]
fn every_direction_leads_back_to_its_pixel() {
    let cube = Cube::new(5);
    for face in 0..6 {
        for (x, y) in (0..25).map(|i| (i % 5, i / 5)) {
            assert_eq!(cube.pixel_towards(7.0 * cube.direction(face, x, y)), Some((face, x, y)));
        }
    }
}

#[test]
fn what_surrounds_the_eye_covers_every_pixel_once() {
    let scene = scene(vec![block([3.0; 3], [-3.0; 3], BOTH_SIDES)]);
    for eye in [DVec3::ZERO, DVec3::new(2.9999, -2.9999, 1.0), DVec3::splat(2.9)] {
        assert_eq!(drawn(&scene, 32, eye).pixels(), [6 * 32 * 32], "from {eye}");
    }
}

/// A ball of many triangles around the origin: rings of latitude, with vertices shared.
fn ball(rings: u32, segments: u32, turn: glam::DQuat) -> Model {
    let at = |ring: u32, segment: u32| {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        let around = std::f64::consts::TAU * f64::from(segment % segments) / f64::from(segments);
        let (across, up) = polar.sin_cos();
        // All corners at a pole are one point.
        let across = if ring == rings { 0.0 } else { across };
        (turn * DVec3::new(across * around.cos(), up, across * around.sin())).as_vec3()
    };
    let mut model = Model::default();
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let first = model.positions.len() as u32;
            let corners = [
                (ring, segment),
                (ring + 1, segment),
                (ring + 1, segment + 1),
                (ring, segment + 1),
            ];
            model.positions.extend(corners.map(|(ring, segment)| at(ring, segment)));
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    model.add_triangles(&triangles, BOTH_SIDES);
    model
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Also where pixels' middles lie exactly on edges, as they do when nothing is turned.
    #[test]
    fn a_closed_surface_has_no_cracks(
        rings in 2u32..40,
        segments in 3u32..60,
        turn in prop::option::of(prop::array::uniform3(-3.0f64..3.0)),
        eye in prop::array::uniform3(-0.3f64..0.3),
    ) {
        let turn = turn.map_or(glam::DQuat::IDENTITY, |v| glam::DQuat::from_scaled_axis(v.into()));
        let scene = scene(vec![ball(rings, segments, turn)]);
        let size = 33;
        for eye in [DVec3::ZERO, DVec3::from(eye) * 0.1] {
            prop_assert_eq!(drawn(&scene, size, eye).covered(), 6 * (size * size) as u64);
        }
    }
}

#[test]
fn near_things_hide_far_ones_in_any_order() {
    let near = || quad([-0.5, -0.5], [0.5, 0.5], -1.0, OPAQUE);
    let far = || quad([-1.0, -1.0], [1.0, 1.0], -2.0, OPAQUE);
    assert_eq!(pixels(&scene(vec![near(), far()])), [32 * 32, 0]);
    assert_eq!(pixels(&scene(vec![far(), near()])), [0, 32 * 32]);
}

#[test]
fn a_floor_that_reaches_behind_the_eye_is_clipped_and_its_depth_is_right() {
    // Below the eye, from far behind it to far before it, and a plate just above or below the floor.
    let mut floor = quad([-50.0, -50.0], [50.0, 50.0], 0.0, OPAQUE);
    let mut plate = quad([-1.0, -1.0], [1.0, 1.0], 0.01, OPAQUE);
    for model in [&mut floor, &mut plate] {
        for p in &mut model.positions {
            *p = Vec3::new(p.x, p.z - 1.0, -p.y);
        }
    }
    // Patches know the box around their vertices, so they are made again.
    let again = |model: Model| {
        let mut new = Model {
            positions: model.positions,
            ..Model::default()
        };
        new.add_triangles(&model.patches[0].triangles, OPAQUE);
        new
    };
    let seen = pixels(&scene(vec![again(floor), again(plate)]));
    // The plate fills the face that looks down, and, seen from its middle, nothing of any other.
    assert!(seen[1] >= 64 * 64, "{seen:?}");
    // The floor fills all of the lower halves of four faces up to near the horizon.
    assert!(seen[0] > 4 * 64 * 29 && seen[0] <= 4 * 64 * 32, "{seen:?}");
}

#[test]
fn a_back_is_culled_unless_the_material_is_double_sided() {
    let behind = quad([-1.0, -1.0], [1.0, 1.0], -2.0, OPAQUE);
    let turned = |surface| {
        let mut model = quad([-1.0, -1.0], [1.0, 1.0], -1.0, surface);
        model.patches.clear();
        model.add_triangles(&[[0, 2, 1], [0, 3, 2]], surface);
        model
    };
    assert_eq!(pixels(&scene(vec![turned(OPAQUE), behind.clone()])), [0, 32 * 32]);
    assert_eq!(pixels(&scene(vec![turned(BOTH_SIDES), behind])), [64 * 64, 0]);
}

#[test]
fn a_mirrored_object_shows_its_front() {
    let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let turn = DMat4::from_rotation_y(std::f64::consts::PI);
    let model = quad([-1.0, -1.0], [1.0, 1.0], -1.0, OPAQUE);
    let with = |matrix| Scene::new(vec![model.clone()], vec![object(0, matrix)]);
    assert_eq!(
        pixels(&with(mirror)),
        [64 * 64],
        "mirrored, the front stays towards the eye"
    );
    // Turned by half a turn it stands behind the eye, its front still towards it.
    assert_eq!(pixels(&with(turn)), [64 * 64]);
    // Mirrored along z it stands behind the eye and shows its front too.
    let flipped = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
    assert_eq!(pixels(&with(flipped)), [64 * 64]);
    // Moved through the eye without mirroring, it shows its back.
    assert_eq!(pixels(&with(DMat4::from_translation(DVec3::new(0.0, 0.0, 2.0)))), [0]);
}

#[test]
fn glass_shows_and_hides_nothing_in_any_number_of_layers() {
    let pane = |z| quad([-10.0, -10.0], [10.0, 10.0], z, GLASS);
    let wall = quad([-1.0, -1.0], [1.0, 1.0], -2.0, OPAQUE);
    let seen = pixels(&scene(vec![pane(-1.0), wall, pane(-1.5), pane(-3.0)]));
    assert_eq!(seen[1], 32 * 32, "the wall through two panes");
    assert!(seen[0] > 64 * 64 && seen[2] > 64 * 64, "both panes, on several faces");
    let whole = pixels(&scene(vec![pane(-3.0)]))[0];
    assert_eq!(seen[3], whole - 32 * 32, "the last pane around the wall");
}

#[test]
fn a_door_hides_nothing() {
    let model = |z| quad([-5.0, -5.0], [5.0, 5.0], z, OPAQUE);
    let mut objects = vec![object(0, DMat4::IDENTITY), object(1, DMat4::IDENTITY)];
    objects[0].door = true;
    let seen = pixels(&Scene::new(vec![model(-1.0), model(-2.0)], objects));
    assert!(seen[0] > 64 * 64 && seen[1] > 64 * 64, "{seen:?}");
}

#[test]
fn lines_and_points_are_one_pixel_wide_and_hide_nothing() {
    let mut thin = Model {
        positions: vec![
            Vec3::new(-1.0, 0.01, -1.0),
            Vec3::new(1.0, 0.01, -1.0),
            Vec3::new(0.0, 0.5, -1.0),
        ],
        ..Model::default()
    };
    thin.lines.push([0, 1]);
    thin.points.push(2);
    let wall = quad([-1.0, -1.0], [1.0, 1.0], -1.5, OPAQUE);
    let before = pixels(&scene(vec![wall.clone()]))[0];
    assert_eq!(pixels(&scene(vec![thin.clone(), wall])), [64 + 1, before]);
    let nearer = quad([-1.0, -1.0], [1.0, 1.0], -0.5, OPAQUE);
    assert_eq!(pixels(&scene(vec![thin, nearer]))[0], 0);
}

#[test]
fn where_two_surfaces_lie_in_one_plane_the_expected_one_shows() {
    let wall = quad([-1.0, -1.0], [1.0, 1.0], -1.3, OPAQUE);
    let both = scene(vec![wall.clone(), wall]);
    for expected in [[true, false], [false, true]] {
        let mut cube = Cube::new(64);
        cube.draw(&both, DVec3::new(0.1, 0.2, 0.3), &expected);
        assert_eq!(cube.unexpected(), [], "{expected:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Walls of all sizes at all distances, some of them before others; the second picture draws everything.
    #[test]
    fn skipping_what_is_hidden_changes_nothing(
        quads in prop::collection::vec((prop::array::uniform3(-3.0f32..3.0), 0.05f32..3.0, any::<bool>()), 4..40),
        eye in prop::array::uniform3(-0.5f64..0.5),
    ) {
        let models: Vec<_> = quads
            .iter()
            .map(|([x, y, z], half, glass)| {
                let surface = if *glass { GLASS } else { BOTH_SIDES };
                quad([x - half, y - half], [x + half, y + half], *z, surface)
            })
            .collect();
        let scene = scene(models);
        let expected: Vec<_> = (0..quads.len()).map(|i| i % 3 != 0).collect();
        let [skipping, plain] = [usize::MAX >> 8, 0].map(|effort| {
            let mut cube = Cube::new(48);
            cube.effort = effort;
            cube.draw(&scene, DVec3::from(eye), &expected);
            cube
        });
        prop_assert_eq!(skipping.pixels(), plain.pixels());
        prop_assert_eq!(skipping.unexpected(), plain.unexpected());
        prop_assert_eq!(&skipping.inverse_depth, &plain.inverse_depth);
    }
}

prop_compose! {
    fn triangle()(corners in prop::array::uniform3(prop::array::uniform3(-4.0f32..4.0)), both in any::<bool>()) -> Model {
        let mut model = Model {
            positions: corners.map(Vec3::from).to_vec(),
            ..Model::default()
        };
        model.add_triangles(&[[0, 1, 2]], if both { BOTH_SIDES } else { OPAQUE });
        model
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn an_exact_ray_confirms_every_pixel(models in prop::collection::vec(triangle(), 1..12), glass in quad_glass()) {
        let scene = scene(models.into_iter().chain([glass]).collect());
        let eye = DVec3::new(0.2, -0.1, 0.3);
        let mut cube = Cube::new(16);
        cube.draw(&scene, eye, &vec![false; scene.objects.len()]);
        for at in cube.unexpected() {
            let direction = cube.direction(at.face.into(), at.x.into(), at.y.into());
            prop_assert!(sees(&scene, eye, direction, at.object, Doubt::Shows), "{at:?}");
        }
        // And the other way round: what is surely seen is drawn.
        for face in 0..6 {
            for at in 0..16 * 16 {
                let (x, y) = (at % 16, at / 16);
                let direction = cube.direction(face, x, y);
                for object in 0..scene.objects.len() as u32 {
                    let at = Sighting { object, face: face as u8, x: x as u16, y: y as u16 };
                    if cube.unexpected().binary_search(&at).is_err() {
                        prop_assert!(!surely_seen(&scene, eye, direction, object), "{at:?}");
                    }
                }
            }
        }
    }
}

prop_compose! {
    fn quad_glass()(z in -3.0f32..-0.5) -> Model {
        quad([-1.0, -1.0], [1.0, 2.0], z, GLASS)
    }
}

/// Whether an object is seen not only in a direction but also a little beside it.
fn surely_seen(scene: &Scene, eye: DVec3, direction: DVec3, object: u32) -> bool {
    let (u, v) = direction.normalize().any_orthonormal_pair();
    [DVec3::ZERO, u, -u, v, -v]
        .iter()
        .all(|aside| sees(scene, eye, direction.normalize() + 1e-4 * *aside, object, Doubt::Hides))
}
