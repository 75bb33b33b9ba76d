use glam::{DMat4, DVec3};

use super::*;
use crate::{
    cells::plan::Builder,
    source::{Primitive, Topology},
};

fn facing_z(z: f32) -> [[f32; 3]; 4] {
    [[-1., -1., z], [1., -1., z], [1., 1., z], [-1., 1., z]]
}

/// Casts a ray along -z from far in front; the object that ends it and those that it passes.
fn along_z(world: &World) -> (Option<u32>, Vec<u32>) {
    let mut passed = Vec::new();
    let eye = world.relative([0.1, 0.2, 10.0]);
    let end = world.cast(eye, Vec3::NEG_Z, f32::MAX, &mut passed);
    let mut passed: Vec<_> = passed.iter().map(|hit| hit.object).collect();
    passed.sort_unstable();
    (end.map(|hit| hit.object), passed)
}

#[test]
fn a_ray_ends_on_the_first_face_that_hides() {
    let mut builder = Builder::default();
    let glass = builder.quad("glass", facing_z(3.0));
    builder.paint(glass, true, true);
    let mut back = facing_z(2.0);
    back.reverse();
    let culled = builder.quad("culled", back);
    let wall = builder.quad("wall", facing_z(1.0));
    let behind = builder.quad("glass behind", facing_z(0.0));
    builder.paint(behind, true, false);
    builder.quad("wall behind", facing_z(-1.0));
    let world = World::new(&builder.scene).unwrap();
    assert_eq!(along_z(&world), (Some(wall), vec![glass, culled]));
}

#[test]
fn a_mirrored_face_keeps_its_front() {
    let mut builder = Builder::default();
    let quad = builder.quad("wall", facing_z(0.0));
    builder.scene.objects[0].world_from_object = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    assert_eq!(along_z(&World::new(&builder.scene).unwrap()), (Some(quad), vec![]));
    builder.scene.objects[0].world_from_object = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
    assert_eq!(along_z(&World::new(&builder.scene).unwrap()), (None, vec![quad]));
}

#[test]
fn no_ray_slips_through_a_shared_edge() {
    let mut builder = Builder::default();
    builder.ball("ball", [0.3, -0.2, 0.1], 1.0, 16);
    let world = World::new(&builder.scene).unwrap();
    let mut passed = Vec::new();
    let outside = Vec3::new(3.0, 1.0, 2.0);
    for triangle in world.triangles() {
        let [a, b, _] = triangle.corners;
        for i in 0..=20 {
            let direction = (a.lerp(b, i as f32 / 20.0) * 0.99 - outside).normalize();
            assert!(world.cast(outside, direction, f32::MAX, &mut passed).is_some());
        }
    }
}

#[test]
fn nothing_and_flat_nothing_are_worlds() {
    let mut passed = Vec::new();
    let world = World::new(&SourceScene::default()).unwrap();
    assert!(world.bounds().is_empty());
    assert_eq!(world.cast(Vec3::ZERO, Vec3::X, f32::MAX, &mut passed), None);
    let mut builder = Builder::default();
    builder.mesh(
        "line",
        vec![[0., 0., 0.], [1., 0., 0.], [2., 0., 0.]],
        vec![0, 1, 2, 0, 0, 0],
    );
    let world = World::new(&builder.scene).unwrap();
    assert_eq!(
        world.cast(Vec3::new(0.0, 1.0, 0.0), Vec3::NEG_Y, f32::MAX, &mut passed),
        None
    );
}

#[test]
fn one_point_is_not_too_wide() {
    let mut builder = Builder::default();
    builder.quad("point", [[0.0; 3]; 4]);
    assert!(!World::new(&builder.scene).unwrap().is_too_wide());
}

#[test]
fn lines_beside_triangles_are_known_of_an_object() {
    let mut builder = Builder::default();
    builder.quad("wall", facing_z(0.0));
    let plain = World::new(&builder.scene).unwrap().digest_of(0);
    let line = Primitive {
        topology: Topology::Lines,
        positions: facing_z(0.0)[..2].to_vec(),
        indices: vec![0, 1],
        ..Primitive::default()
    };
    builder.scene.models[0].primitives.push(line);
    let lined = World::new(&builder.scene).unwrap().digest_of(0);
    assert_ne!(plain, lined);
}

#[test]
fn far_from_zero_millimetres_are_kept() {
    let mut builder = Builder::default();
    builder.quad("wall", facing_z(0.0));
    builder.quad("poster", facing_z(0.001));
    let by = DVec3::new(1e7, -1e7, 3e7);
    builder.shift(by);
    let world = World::new(&builder.scene).unwrap();
    let eye = world.relative((by + DVec3::new(0.0, 0.0, 5.0)).to_array());
    let hit = world.cast(eye, Vec3::NEG_Z, f32::MAX, &mut Vec::new()).unwrap();
    assert_eq!(hit.object, 1);
}

#[test]
fn what_is_too_small_to_be_cut_is_refused() {
    let sized = |metres: f64| {
        let mut builder = Builder::default();
        builder.quad("speck", facing_z(0.0));
        builder.scene.objects[0].world_from_object = DMat4::from_scale(DVec3::splat(metres));
        World::new(&builder.scene).err()
    };
    for metres in [1e-44, 1e-22, 1e-14, 1e-5] {
        let refused = sized(metres).expect("too small").to_string();
        assert!(
            refused.ends_with("at least 1e-4 m are needed: scale it up"),
            "{refused}"
        );
    }
    assert_eq!((sized(1e-3), sized(0.0)), (None, None));
}

#[test]
fn what_cannot_be_held_is_refused_with_its_place() {
    let mut builder = Builder::default();
    builder.quad("near", facing_z(0.0));
    builder.quad("far", facing_z(0.0));
    for reach in [1e12, 1e300] {
        builder.scene.objects[1].world_from_object = DMat4::from_translation(DVec3::new(reach, 0.0, 0.0));
        let Err(refused) = World::new(&builder.scene) else {
            panic!("accepted {reach} m");
        };
        assert!(refused.to_string().contains("at most 1e9 m"), "{refused}");
    }
    let mut builder = Builder::default();
    builder.mesh(
        "dense",
        vec![[0.; 3], [1., 0., 0.], [0., 1., 0.]],
        [0, 1, 2].repeat(70_000),
    );
    // Where each copy is flattened because it is flat itself.
    let mut object = builder.scene.objects[0].clone();
    object.world_from_object = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0));
    builder.scene.objects = vec![object.clone(); 1000];
    let refused = |scene: &SourceScene| World::new(scene).err().expect("accepted too many triangles");
    assert_eq!(
        refused(&builder.scene),
        WorldError::TooManyTriangles { count: 70_000_000 }
    );
    object.world_from_object = DMat4::IDENTITY;
    builder.scene.objects = vec![object; 70_000];
    assert_eq!(
        refused(&builder.scene),
        WorldError::TooManyCopies { count: 4_900_000_000 }
    );
}

#[test]
fn points_and_lines_have_samples_and_bounds() {
    let mut builder = Builder::default();
    let dots = builder.shape("dots", Topology::Points, vec![[1.0; 3], [9.0; 3], [2.0; 3]], vec![0, 2]);
    let wire = builder.shape("wire", Topology::Lines, vec![[0.0; 3], [4.0, 0.0, 0.0]], vec![0, 1]);
    let world = World::new(&builder.scene).unwrap();
    assert_eq!(world.object_bounds()[0].max, [2.0; 3], "unused vertices do not count");
    assert_eq!((world.points_of(dots).len(), world.points_of(wire).len()), (2, 3));
    assert!(world.points_of(wire).contains(&world.relative([2.0, 0.0, 0.0])));
    assert_eq!(world.triangle_at_share(dots, 0.5), None);
}

/// Run with `--ignored --nocapture two_million`.
#[test]
#[ignore = "takes long: measures a large scene"]
#[allow(clippy::disallowed_types, reason = "a measurement needs a clock")]
fn two_million_triangles_measured() {
    let mut builder = Builder::default();
    builder.ball("ball", [0.0; 3], 10.0, 700);
    let start = std::time::Instant::now();
    let world = World::new(&builder.scene).unwrap();
    println!(
        "{} triangles: {:.1} s",
        world.triangle_count(),
        start.elapsed().as_secs_f64()
    );
    let start = std::time::Instant::now();
    let graph = crate::cells::build(&world, &[], &Default::default(), &crate::progress::Silent).unwrap();
    println!("{} cells: {:.1} s", graph.cells.len(), start.elapsed().as_secs_f64());
    assert!(world.triangle_count() > 1_900_000);
}

/// Balls that stand in many places: moved, turned, mirrored, stretched; one flattened to nothing; a quad of glass; a door.
fn many_balls() -> SourceScene {
    let mut builder = Builder::default();
    builder.ball("ball", [0.2, -0.1, 0.4], 1.0, 9);
    builder.quad("glass", facing_z(0.0));
    builder.paint(1, true, true);
    let [ball, glass] = [0, 1].map(|object: usize| builder.scene.objects[object].clone());
    let place = |object: &crate::source::SourceObject, matrix: DMat4| crate::source::SourceObject {
        world_from_object: matrix,
        ..object.clone()
    };
    builder.scene.objects.clear();
    for number in 0..60 {
        let (x, z) = (f64::from(number % 8) * 3.1, f64::from(number / 8) * 2.7);
        let scale = match number % 4 {
            0 => DVec3::ONE,
            1 => DVec3::new(-1.0, 1.2, 1.0),
            2 => DVec3::new(0.5, 2.0, 1.0),
            _ => DVec3::splat(0.7),
        };
        let turn = DMat4::from_rotation_y(0.7 * f64::from(number)) * DMat4::from_rotation_x(0.3 * f64::from(number));
        let matrix = DMat4::from_translation(DVec3::new(x, 0.3 * z, z)) * turn * DMat4::from_scale(scale);
        let object = if number % 7 == 3 { &glass } else { &ball };
        builder.scene.objects.push(place(object, matrix));
    }
    builder.scene.objects[8].world_from_object *= DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0));
    builder.scene.objects[16].role = Role::Door;
    builder.scene
}

#[test]
fn what_is_held_once_is_met_where_it_would_be_flattened() {
    let scene = many_balls();
    let [flat, once] = [usize::MAX, 0].map(|most| World::flattening(&scene, most).unwrap());
    assert!(flat.is_flat() && !once.is_flat());
    assert!(once.flat.triangles.len() < flat.flat.triangles.len() / 20);
    assert_eq!(flat.triangle_count(), once.triangle_count());
    assert!(flat.triangles().eq(once.triangles()));
    let (mut hits, mut differ) = (0, 0);
    let mut random = crate::visibility::random::Random::stream(7, 0);
    let [mut by_flat, mut by_once] = [Vec::new(), Vec::new()];
    for _ in 0..20_000 {
        let eye = Vec3::new(-13.0, -4.0, -11.0) + Vec3::new(26.0, 8.0, 22.0) * random.cube();
        let direction = random.direction();
        let a = flat.cast(eye, direction, f32::MAX, &mut by_flat);
        let b = once.cast(eye, direction, f32::MAX, &mut by_once);
        let same = match (a, b) {
            (Some(a), Some(b)) => {
                hits += 1;
                (a.triangle, a.object) == (b.triangle, b.object) && (a.t - b.t).abs() < 1e-4 * (1.0 + a.t)
            }
            (a, b) => a.is_none() && b.is_none(),
        };
        let triangles = |hits: &[Hit]| hits.iter().map(|hit| hit.triangle).collect::<Vec<_>>();
        differ += u32::from(!same || triangles(&by_flat) != triangles(&by_once));
    }
    // Rays along an edge may meet either of its faces.
    assert!(hits > 3_000 && differ <= 20, "{differ} of {hits} differ");
}

#[test]
fn what_is_held_once_answers_like_what_is_flattened() {
    let scene = many_balls();
    let [flat, once] = [usize::MAX, 0].map(|most| World::flattening(&scene, most).unwrap());
    for object in 0..scene.objects.len() as u32 {
        assert_eq!(flat.triangles_of(object), once.triangles_of(object));
        assert_eq!(flat.digest_of(object), once.digest_of(object));
        assert_eq!(flat.triangle_of(object, 1), once.triangle_of(object, 1));
        for share in [0.0, 0.5, 1.0] {
            assert_eq!(once.triangle_at_share(object, share).unwrap().object, object);
        }
    }
    for number in (0..flat.triangle_count() as u32).step_by(97) {
        assert_eq!(flat.triangle(number), once.triangle(number));
    }
    let near = |world: &World, min: Vec3| {
        let (mut near, half) = (Vec::new(), Vec3::splat(0.75));
        world.near(min, min + 2.0 * half, &mut |triangle| {
            // Those beside the box are nobody's business.
            if crate::cells::meets_box(&triangle.corners.map(|p| p - min - half), half) {
                near.push(format!("{triangle:?}"));
            }
        });
        near.sort();
        near
    };
    let mut met = 0;
    for x in 0..12 {
        let min = Vec3::new(2.0 * x as f32 - 12.0, -1.0, 0.9 * x as f32 - 7.0);
        let found = near(&flat, min);
        met += found.len();
        assert_eq!(found, near(&once, min));
    }
    assert!(met > 300, "{met} triangles near twelve places");
}

#[test]
fn only_what_saves_most_is_held_once() {
    let mut scene = many_balls();
    let triangles = |model: usize| scene.models[model].triangle_count();
    let all: usize = scene.objects.iter().map(|object| triangles(object.model)).sum();
    assert_eq!(Once::of(&scene, all).0, [false, false]);
    assert_eq!(Once::of(&scene, all - 1).0, [true, false]);
    assert_eq!(Once::of(&scene, 0).0, [true, true]);
    // Far from the zero of its own space, rays would lose too much there.
    for p in &mut scene.models[0].primitives[0].positions {
        p[0] += 1e4;
    }
    assert_eq!(Once::of(&scene, 0).0, [false, true]);
}

#[test]
fn a_plain_around_a_city_does_not_make_its_houses_small() {
    let city = crate::city::City {
        blocks: [6, 5],
        ..crate::city::City::DENSE
    };
    let with_plain = |half_m: f64| {
        let mut scene = city.scene();
        let mut plain = scene.models[0].clone();
        for (corner, position) in plain.primitives[0].positions.iter_mut().enumerate() {
            let side = |bit: usize| if corner >> bit & 1 == 0 { -half_m } else { half_m };
            *position = [side(0) as f32, 0.0, side(2) as f32];
        }
        scene.models.push(plain);
        scene.objects.push(crate::source::SourceObject {
            model: scene.models.len() - 1,
            world_from_object: DMat4::IDENTITY,
            ..scene.objects[0].clone()
        });
        World::new(&scene).unwrap()
    };
    let alone = World::new(&city.scene()).unwrap();
    assert_eq!(alone.small_m(), 1e-3 * alone.scale_m());
    let wide = with_plain(300.0);
    assert!(wide.scale_m() > 5.0 * alone.scale_m());
    assert!(
        wide.small_m() < 1.5 * alone.small_m() && !wide.is_too_wide(),
        "{} m",
        wide.small_m()
    );
    let too_wide = with_plain(1e6);
    assert!(
        too_wide.is_too_wide() && too_wide.small_m() > 100.0,
        "{} m",
        too_wide.small_m()
    );
}

#[test]
fn what_is_small_does_not_shrink_with_many_small_things() {
    let mut scene = crate::city::City::DENSE.scene();
    let leaf = scene.objects[0].clone();
    for at in 0..20_000 {
        let place = DVec3::new(0.05 * f64::from(at), 1.0, 0.03 * f64::from(at));
        scene.objects.push(crate::source::SourceObject {
            world_from_object: DMat4::from_translation(place) * DMat4::from_scale(DVec3::splat(1e-3)),
            ..leaf.clone()
        });
    }
    let world = World::new(&scene).unwrap();
    assert_eq!(world.small_m(), 1e-3 * world.scale_m());
}
