//! Do Rust and TypeScript find the same views of an impostor? `tests/golden/impostors.json` holds directions and what is
//! found for them; `viewer/core/documents/impostors.test.ts` reads the same file. `make bless` writes it.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::fs;
use std::path::Path;

use belvedere_scene::impostor::octahedral::{Axes, Mapping};
use serde_json::{Value as Json, json};

const MAPPINGS: [Mapping; 2] = [Mapping::Octahedral, Mapping::HemiOctahedral];

/// Directions on a spiral around a ball, and the awkward ones: along axes, in the planes between them, none at all.
fn directions() -> Vec<[f64; 3]> {
    let turn = 2.399_963_229_728_653_f64;
    let spiral = (0..40).map(|i| {
        let (up, angle) = (1.0 - (2.0 * f64::from(i) + 1.0) / 40.0, turn * f64::from(i));
        let level = (1.0 - up * up).sqrt();
        [level * angle.cos(), up, level * angle.sin()].map(|x| (x * 1e4).round() / 1e3)
    });
    let steps = [-1.0, 0.0, 1.0];
    let axes = steps
        .iter()
        .flat_map(|x| steps.iter().flat_map(move |y| steps.map(|z| [*x, *y, z])));
    spiral.chain(axes).collect()
}

/// Nine digits after the point: more than a graphics card has, fewer than roundings reach.
fn rounded(x: f64) -> f64 {
    (x * 1e9).round() / 1e9 + 0.0
}

#[test]
fn the_same_views_are_found_as_before() {
    let mut found = Vec::new();
    for mapping in MAPPINGS {
        for (direction, views) in directions().into_iter().zip([2, 5, 8, 12].into_iter().cycle()) {
            let nearest = mapping.nearest(direction, views);
            let nearest = nearest.map(|near| json!([near.view[0], near.view[1], rounded(near.weight)]));
            let axes = Axes::of(direction);
            found.push(json!({
                "mapping": mapping,
                "direction": direction,
                "views": views,
                "point": mapping.point(direction).map(rounded),
                "nearest": nearest,
                "right": axes.right.map(rounded),
                "up": axes.up.map(rounded),
            }));
        }
    }
    let text = format!("{:#}\n", Json::from(found));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/impostors.json");
    if std::env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let same = fs::read_to_string(&path).unwrap() == text;
    assert!(same, "impostors.json differs; if that is meant, `make bless`");
}

#[test]
fn every_direction_is_that_of_its_point_and_lies_among_its_views() {
    for mapping in MAPPINGS {
        for direction in directions() {
            let length = dot(direction, direction).sqrt();
            let below = mapping == Mapping::HemiOctahedral && direction[1] < 0.0;
            if length == 0.0 || below {
                continue;
            }
            let unit = direction.map(|x| x / length);
            let again = mapping.direction(mapping.point(direction));
            assert!(dot(again, unit) > 1.0 - 1e-9, "{mapping:?} {direction:?} {again:?}");
            for views in [4, 8, 12] {
                let nearest = mapping.nearest(direction, views);
                let sum: f64 = nearest.iter().map(|near| near.weight).sum();
                assert!((sum - 1.0).abs() < 1e-9 && nearest.iter().all(|near| near.weight > -1e-9));
                // No view that counts is further away than the grid is wide where it is widest.
                let step = 5.0 / f64::from(views - 1);
                for near in nearest.iter().filter(|near| near.weight > 1e-6) {
                    let of_view = mapping.of_view(near.view, views);
                    let off = dot(of_view, unit).clamp(-1.0, 1.0).acos();
                    assert!(off < step, "{mapping:?} {views} {direction:?} {near:?} {off} {step}");
                }
            }
        }
    }
}

#[test]
fn what_lies_below_the_horizon_lies_on_it_where_nobody_looks_from_below() {
    let hemi = Mapping::HemiOctahedral;
    assert_eq!(hemi.point([3.0, -2.0, 1.0]), hemi.point([3.0, 0.0, 1.0]));
    assert!(hemi.point([0.0, -1.0, 0.0]).iter().all(|x| x.is_finite()));
}

#[test]
fn axes_are_at_right_angles_and_right_is_level() {
    for direction in directions().into_iter().filter(|d| dot(*d, *d) > 0.0) {
        let Axes { right, up, towards } = Axes::of(direction);
        for (a, b) in [(right, up), (up, towards), (towards, right)] {
            assert!(
                dot(a, b).abs() < 1e-9 && (dot(a, a) - 1.0).abs() < 1e-9,
                "{direction:?}"
            );
        }
        let handed = dot(
            right,
            [
                up[1] * towards[2] - up[2] * towards[1],
                up[2] * towards[0] - up[0] * towards[2],
                up[0] * towards[1] - up[1] * towards[0],
            ],
        );
        assert!(right[1] == 0.0 && handed > 0.0 && up[1] >= 0.0, "{direction:?}");
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}
