use belvedere_scene::{CellId, record::Guarantee};
use glam::{DMat4, DVec3};

use super::*;
use crate::{
    check::Miss,
    scene::{Model, Object, Surface},
    testing::{BOTH_SIDES, GLASS, OPAQUE, block, cell, object, quad},
    verdict::failures,
};

const WALL: [u32; 4] = [0, 1, 2, 3];
const DOOR: ObjectId = ObjectId(4);
const THING: u32 = 5;

/// A wall of four blocks 2 m before the cell with an opening of 1 × 2 m, a door in it whose leaf leaves gaps of `gap_m` on all
/// sides and lies `before_m` before the wall's middle, and a thing 1 m behind. The wall is 20 cm thick and the door 4 cm.
fn doorway(gap_m: f32, before_m: f32, surface: Surface) -> Scene {
    let wall = |x: [f32; 2], y: [f32; 2]| block([x[0], y[0], -2.1], [x[1], y[1], -1.9], OPAQUE);
    let z = -2.0 + before_m;
    let leaf = [
        [-0.5 + gap_m, -1.0 + gap_m, z - 0.02],
        [0.5 - gap_m, 1.0 - gap_m, z + 0.02],
    ];
    let models = vec![
        wall([-9.0, -0.5], [-9.0, 9.0]),
        wall([0.5, 9.0], [-9.0, 9.0]),
        wall([-0.5, 0.5], [-9.0, -1.0]),
        wall([-0.5, 0.5], [1.0, 9.0]),
        block(leaf[0], leaf[1], surface),
        block([-0.8, -0.8, -4.0], [0.8, 0.8, -3.0], OPAQUE),
    ];
    let mut objects: Vec<Object> = (0..models.len()).map(|i| object(i, DMat4::IDENTITY)).collect();
    objects[DOOR.0 as usize].door = true;
    Scene::new(models, objects)
}

/// A cell that lists all of it, and says that the door hides the thing.
fn told() -> Cell {
    let mut cell = cell(
        &[WALL[0], WALL[1], WALL[2], WALL[3], DOOR.0, THING],
        Guarantee::Conservative,
    );
    hide(&mut cell, THING, &[DOOR]);
    cell
}

fn hide(cell: &mut Cell, object: u32, doors: &[ObjectId]) {
    let entry = cell.listed.iter_mut().find(|(listed, _)| listed.0 == object);
    entry.expect("it is listed").1 = doors.to_vec();
}

fn looked(scene: &Scene, cell: Cell, eyes: u64) -> Outcome {
    let settings = Settings {
        eyes,
        size_px: 128,
        seed: 1,
    };
    let cells = [cell];
    let closed = Closed::of(scene, &cells, &settings);
    assert_eq!((closed.doors(), closed.situations()), (1, 1));
    closed.check(scene, &settings, &|| {})
}

fn missed(outcome: &Outcome) -> Vec<(CellId, Vec<ObjectId>, ObjectId)> {
    let told = |miss: &Miss| (miss.cell, miss.closed.clone(), miss.object);
    outcome.misses.iter().map(told).collect()
}

#[test]
fn what_a_closed_door_hides_need_not_be_listed() {
    let outcome = looked(&doorway(0.0, 0.0, OPAQUE), told(), 60);
    assert_eq!((missed(&outcome), outcome.gap_pixels), (vec![], 0));
    assert_eq!(
        (outcome.cells[0].listed, &outcome.cells[0].closed[..]),
        (5, &[DOOR][..])
    );
    assert!((4..=5).contains(&outcome.cells[0].seen), "{:?}", outcome.cells);
    assert!(failures(&outcome).is_empty());
}

#[test]
fn what_is_seen_past_a_closed_door_is_named_with_the_door() {
    // The door hides nothing of a wall that stands beside it.
    let mut wrong = told();
    hide(&mut wrong, WALL[0], &[DOOR]);
    let outcome = looked(&doorway(0.0, 0.0, OPAQUE), wrong, 40);
    assert_eq!(missed(&outcome), [(CellId(4), vec![DOOR], ObjectId(WALL[0]))]);
    assert!(outcome.misses[0].pixels > 1000 && !failures(&outcome).is_empty());
}

#[test]
fn glass_hides_nothing_though_it_is_closed() {
    let outcome = looked(&doorway(0.0, 0.0, GLASS), told(), 20);
    assert_eq!(missed(&outcome), [(CellId(4), vec![DOOR], ObjectId(THING))]);
}

#[test]
fn a_narrow_gap_between_leaf_and_frame_counts_as_closed_and_a_wide_one_does_not() {
    let narrow = looked(&doorway(0.02, 0.0, OPAQUE), told(), 200);
    assert_eq!(missed(&narrow), []);
    assert_eq!(narrow.gap_objects, 1);
    assert!(narrow.gap_pixels > 20, "{}", narrow.gap_pixels);
    // 3 % of 1.8 m are 5.4 cm.
    let wide = looked(&doorway(0.1, 0.0, OPAQUE), told(), 200);
    assert_eq!(missed(&wide), [(CellId(4), vec![DOOR], ObjectId(THING))]);
}

#[test]
fn a_door_that_lies_before_its_opening_keeps_its_gap() {
    for before_m in [0.12, 0.15] {
        let outcome = looked(&doorway(0.02, before_m, OPAQUE), told(), 200);
        assert_eq!(
            missed(&outcome),
            [(CellId(4), vec![DOOR], ObjectId(THING))],
            "{before_m} m"
        );
        assert_eq!(outcome.gap_pixels, 0);
    }
    // It still has something of the wall in its planes.
    let outcome = looked(&doorway(0.02, 0.11, OPAQUE), told(), 200);
    assert_eq!((missed(&outcome), outcome.gap_objects), (vec![], 1));
}

#[test]
fn a_gap_is_closed_as_deep_as_the_frame_reaches_into_the_thickness_of_the_leaf() {
    // The wall ends in the middle of the leaf.
    let world = doorway(0.02, 0.1, OPAQUE);
    let leaf = Leaf::of(&world, DOOR).unwrap();
    let gap = leaf.gap(&world);
    let passes = |x: f64, from: f64| gap.is_passed(DVec3::new(x, 0.0, from), DVec3::new(x, 0.0, -1.0));
    assert!(
        passes(0.49, -3.0) && passes(0.49, -1.9002),
        "through what is left of the opening"
    );
    assert!(!passes(0.49, -1.8998), "from where nothing stands beside the leaf");
    assert!(!passes(2.0, -3.0), "nowhere near it");
}

#[test]
fn either_of_two_closed_doors_hides_what_it_hides() {
    let models = vec![
        quad([-9.0, -9.0], [-0.5, 9.0], -2.0, OPAQUE),
        quad([-0.5, -9.0], [0.5, 9.0], -2.0, BOTH_SIDES),
        quad([0.5, -9.0], [9.0, 9.0], -2.0, BOTH_SIDES),
        quad([-9.0, -9.0], [9.0, 9.0], -3.0, BOTH_SIDES),
        quad([-0.1, -0.1], [0.1, 0.1], -2.5, BOTH_SIDES),
    ];
    let mut objects: Vec<Object> = (0..models.len()).map(|i| object(i, DMat4::IDENTITY)).collect();
    (objects[1].door, objects[2].door) = (true, true);
    let world = Scene::new(models, objects);
    let settings = Settings {
        eyes: 256,
        size_px: 64,
        seed: 3,
    };
    let mut cells = vec![];
    for _ in 0..8 {
        let mut cell = cell(&[0, 1, 2, 3, 4], Guarantee::Conservative);
        hide(&mut cell, 4, &[ObjectId(1)]);
        // Wrong: the other door is open, or it is closed and the wall behind is seen through the first.
        hide(&mut cell, 3, &[ObjectId(2)]);
        cells.push(cell);
    }
    let closed = Closed::of(&world, &cells, &settings);
    assert_eq!((closed.doors(), closed.situations()), (2, 16));
    let outcome = closed.check(&world, &settings, &|| {});
    let both = vec![ObjectId(1), ObjectId(2)];
    assert!(
        outcome.cells.iter().any(|c| c.closed == both && c.listed == 3),
        "{:?}",
        outcome.cells
    );
    let wrong = missed(&outcome);
    assert!(!wrong.is_empty());
    // With both closed nothing is seen behind them.
    assert!(
        wrong
            .iter()
            .all(|(_, closed, object)| closed[..] == [ObjectId(2)] && *object == ObjectId(3))
    );
}

#[test]
fn no_eye_stands_within_a_closed_door() {
    let mut models = vec![block([-0.6, -1.0, -0.6], [0.6, 1.0, 0.6], OPAQUE)];
    models.push(quad([-0.1, -0.1], [0.1, 0.1], -2.5, BOTH_SIDES));
    let mut objects: Vec<Object> = (0..2).map(|i| object(i, DMat4::IDENTITY)).collect();
    objects[0].door = true;
    let world = Scene::new(models, objects);
    let mut cells = [cell(&[0, 1], Guarantee::Conservative)];
    hide(&mut cells[0], 1, &[ObjectId(0)]);
    let settings = Settings {
        eyes: 300,
        size_px: 32,
        seed: 1,
    };
    let closed = Closed::of(&world, &cells, &settings);
    let eyes: Vec<_> = closed.situations.iter().flat_map(|s| &s.eyes).collect();
    assert!(eyes.len() > 250 && eyes.iter().any(|eye| eye.place == Place::Leaf));
    let leaf = Leaf::of(&world, ObjectId(0)).unwrap();
    for eye in eyes {
        let inside = eye.position.abs().cmplt(DVec3::new(0.6, 1.0, 0.6)).all();
        assert!(!inside && !leaf.encloses(eye.position), "{eye:?}");
    }
    assert!(leaf.encloses(DVec3::new(0.59, -0.9, 0.0)) && !leaf.encloses(DVec3::new(0.61, 0.0, 0.0)));
}

#[test]
fn eyes_look_at_a_door_from_beside_it_however_it_is_turned() {
    for degrees in [0.0f64, 33.0] {
        let turned =
            DMat4::from_translation(DVec3::new(0.0, 0.0, -1.02)) * DMat4::from_rotation_y(degrees.to_radians());
        let models = vec![block([-0.5, -0.9, -0.02], [0.5, 0.9, 0.02], OPAQUE), Model::default()];
        let mut objects = vec![object(0, turned), object(1, DMat4::IDENTITY)];
        objects[0].door = true;
        let world = Scene::new(models, objects);
        let leaf = Leaf::of(&world, ObjectId(0)).unwrap();
        let own = |p: DVec3| turned.inverse().transform_point3(p).abs();
        for (across, up, depth) in [(0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0)] {
            let corner = own(leaf.at(across, up, depth));
            assert!(
                (corner - DVec3::new(0.5, 0.9, 0.02)).length() < 1e-6,
                "{degrees}: {corner}"
            );
        }
    }
}
