use super::*;
use crate::{
    scene::Model,
    testing::{BOTH_SIDES, OPAQUE, cell, quad, scene},
    verdict::failures,
};

/// A wall and, behind it, something that sticks out on one side by `out` metres.
fn wall_and_pole(out: f32) -> Scene {
    let wall = quad([-4.0, -4.0], [4.0, 4.0], -2.0, OPAQUE);
    let pole = quad([0.0, -1.0], [4.0 + out, 1.0], -2.5, BOTH_SIDES);
    scene(vec![wall, pole])
}

fn settings(size_px: usize) -> Settings {
    Settings {
        eyes: 40,
        size_px,
        seed: 1,
    }
}

fn checked(scene: &Scene, cell: Cell, size_px: usize) -> Outcome {
    check(scene, &[cell], &settings(size_px), &|| {})
}

#[test]
fn a_complete_record_is_clean_and_its_tightness_counts_what_is_never_seen() {
    let outcome = checked(&wall_and_pole(-1.0), cell(&[0, 1], Guarantee::Conservative), 64);
    assert_eq!((outcome.misses.len(), outcome.unconfirmed.len()), (0, 0));
    assert_eq!(outcome.eyes, 40);
    assert_eq!(outcome.cells[0].seen, 1);
    assert_eq!(
        (outcome.tightness_mean(), outcome.tightness_of_entries()),
        (Some(2.0), Some(2.0))
    );
    assert_eq!(outcome.blind, []);
    assert!(failures(&outcome).is_empty());
}

#[test]
fn a_visible_object_that_is_not_listed_is_named_with_cell_and_eye() {
    let scene = wall_and_pole(3.0);
    let outcome = checked(&scene, cell(&[0], Guarantee::Sampled), 64);
    let [miss] = &outcome.misses[..] else {
        panic!("{:?}", outcome.misses)
    };
    assert_eq!((miss.cell, miss.object), (CellId(4), ObjectId(1)));
    assert!(miss.eye.iter().all(|x| x.abs() < 1.0));
    assert!(miss.pixels > verdict_pixels());
    assert!(outcome.missed_pixels > 0 && outcome.false_negative_rate() < 1.0);
    assert!(!failures(&outcome).is_empty());
}

/// The same scene where a third thing stands off by itself, whose error and that of the pole are these.
fn beside_something_coarse(pole_error_m: f64, coarse_error_m: f64) -> Outcome {
    let coarse = quad([30.0, 30.0], [31.0, 31.0], -2.0, OPAQUE);
    let scene = wall_and_pole(3.0);
    let models: Vec<Model> = scene.models.iter().cloned().chain([coarse]).collect();
    let mut objects = [0, 1, 2].map(|model| crate::testing::object(model, glam::DMat4::IDENTITY));
    objects[1].error_m = pole_error_m;
    objects[2].error_m = coarse_error_m;
    let scene = Scene::new(models, objects.to_vec());
    checked(&scene, cell(&[0, 2], Guarantee::Conservative), 64)
}

#[test]
fn a_coarse_thing_blinds_to_itself_only() {
    let exact = beside_something_coarse(0.0, 0.0);
    assert_eq!(
        beside_something_coarse(0.0, 5.0),
        exact,
        "what is coarse stands elsewhere"
    );
    assert_eq!(exact.misses.len(), 1);
    let coarse = beside_something_coarse(5.0, 0.0);
    assert_eq!((coarse.misses.len(), coarse.unconfirmed.len()), (0, 1));
}

fn verdict_pixels() -> u64 {
    crate::verdict::PIXELS
}

#[test]
fn a_hidden_object_need_not_be_listed() {
    let outcome = checked(&wall_and_pole(-1.0), cell(&[0], Guarantee::Conservative), 64);
    assert_eq!((outcome.misses, outcome.unconfirmed), (vec![], vec![]));
}

#[test]
fn a_miss_has_the_same_size_whatever_the_first_picture_had() {
    let scene = wall_and_pole(3.0);
    let [a, b] = [64, 96].map(|size| checked(&scene, cell(&[0], Guarantee::Sampled), size).misses[0].clone());
    assert_eq!((a.eye, a.pixels), (b.eye, b.pixels));
}

#[test]
fn what_is_in_front_by_less_than_rounding_is_counted_apart() {
    let wall = quad([-4.0, -4.0], [4.0, 4.0], -2.0, OPAQUE);
    let poster = quad([-1.0, -1.0], [1.0, 1.0], -2.0 + 1e-6, OPAQUE);
    let outcome = checked(&scene(vec![wall, poster]), cell(&[0], Guarantee::Conservative), 64);
    assert_eq!(outcome.misses, []);
    assert!(failures(&outcome).is_empty());
    assert_eq!(outcome.unconfirmed.len(), 1);
    assert!(outcome.unconfirmed_pixels > 0);
}

#[test]
fn a_cell_from_which_no_eye_sees_anything_is_named_and_proves_nothing() {
    let speck = quad([0.0, 0.0], [1e-6, 1e-6], -900.0, OPAQUE);
    let outcome = checked(&scene(vec![speck]), cell(&[0], Guarantee::Conservative), 16);
    assert_eq!((outcome.pixels, &outcome.blind[..]), (0, &[CellId(4)][..]));
    assert_eq!((outcome.tightness_mean(), outcome.tightness_of_entries()), (None, None));
    assert_eq!(failures(&outcome).len(), 1);
}

#[test]
fn what_is_surely_seen_in_a_few_pixels_among_many_doubtful_ones_is_a_miss() {
    let wall = quad([-4.0, -4.0], [4.0, 4.0], -2.0, OPAQUE);
    // In front by less than rounding, but for a small leaf that stands off.
    let mut poster = quad([-2.0, -2.0], [2.0, 2.0], -2.0 + 1e-6, OPAQUE);
    let first = poster.positions.len() as u32;
    let leaf = [[0.30, 0.30], [0.34, 0.30], [0.34, 0.34], [0.30, 0.34]];
    poster.positions.extend(leaf.map(|[x, y]| glam::Vec3::new(x, y, -1.9)));
    poster.add_triangles(
        &[[0, 1, 2], [0, 2, 3]].map(|face| face.map(|corner| first + corner)),
        OPAQUE,
    );
    let one_eye = Settings {
        eyes: 1,
        size_px: 256,
        seed: 1,
    };
    let outcome = check(
        &scene(vec![wall, poster]),
        &[cell(&[0], Guarantee::Conservative)],
        &one_eye,
        &|| {},
    );
    assert_eq!(outcome.misses.len(), 1, "{:?}", outcome.unconfirmed);
    assert!(
        outcome.missed_pixels > 0 && outcome.missed_pixels < 100,
        "{}",
        outcome.missed_pixels
    );
    assert!(outcome.unconfirmed_pixels > 100 * outcome.missed_pixels);
}

#[test]
fn lines_that_are_missing_are_found() {
    let mut line = Model {
        positions: vec![glam::Vec3::new(-1.0, 2.0, -1.5), glam::Vec3::new(1.0, 2.1, -1.5)],
        ..Model::default()
    };
    line.lines.push([0, 1]);
    let scene = scene(vec![quad([-4.0, -4.0], [4.0, 4.0], -2.0, OPAQUE), line]);
    let outcome = checked(&scene, cell(&[0], Guarantee::Conservative), 64);
    assert_eq!(outcome.misses.len(), 1);
    assert_eq!(outcome.unconfirmed_pixels, 0);
}

#[test]
fn every_cell_has_an_eye_and_no_eye_is_lost() {
    for (cells, eyes) in [(7, 3), (7, 7), (7, 20), (1, 5)] {
        let sum: u64 = (0..cells).map(|i| eyes_in(i, cells, eyes)).sum();
        assert_eq!(sum, eyes_of(cells, eyes), "{cells} cells, {eyes} eyes");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| checked(&wall_and_pole(3.0), cell(&[0], Guarantee::Sampled), 32))
    };
    assert_eq!(with(1), with(3));
}
