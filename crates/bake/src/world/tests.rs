use glam::{DMat4, DVec3};

use super::*;
use crate::{cells::plan::Builder, source::Topology};

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
    let object = builder.scene.objects[0].clone();
    builder.scene.objects = vec![object; 1000];
    let Err(refused) = World::new(&builder.scene) else {
        panic!("accepted 70 million triangles");
    };
    assert_eq!(refused, WorldError::TooManyTriangles { count: 70_000_000 });
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
        world.triangles().len(),
        start.elapsed().as_secs_f64()
    );
    let start = std::time::Instant::now();
    let graph = crate::cells::build(&world, &[], &Default::default(), &crate::progress::Silent).unwrap();
    println!("{} cells: {:.1} s", graph.cells.len(), start.elapsed().as_secs_f64());
    assert!(world.triangles().len() > 1_900_000);
}
