//! Made-up ways of `belvedere walk`: through openings, never through walls, and in order where that is asked for.

use std::collections::BTreeSet;

use belvedere_client::{Client, FolderSource, tour::Script};
use belvedere_scene::CellId;

use crate::program::Data;

/// Twelve rooms with doors between all neighbours.
const TWELVE_ROOMS: &str = "\
#################
#a..#...#...#...#
#...+...+...+...#
#...#...#...#...#
##+###+###+###+##
#...#...#...#...#
#...+...+...+...#
#...#...#...#...#
##+###+###+###+##
#...#...#...#...#
#...+...+...+...#
#...#...#...#...#
#################
";
/// A hall that is one cell, with a block in it.
const ONE_CELL: &str = "called \"cell:hall\" box(8, 3, 6) called \"block\" move(2, 0, 2) box(1, 1, 1)";
const SPEED_MPS: f64 = 5.0 / 3.6;

/// A source, baked and published: where, and what a client opens there.
async fn published(file: &str, text: &str) -> (Data, String, belvedere_client::Scene<FolderSource>) {
    let data = Data::new();
    data.bake(&data.write(file, text), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let tree = data.folder("tree").to_str().expect("UTF-8").to_owned();
    let scene = Client::new(FolderSource::new(&tree));
    let scene = scene.open(&"rooms".parse().expect("a name")).await.expect("a scene");
    (data, tree, scene)
}

/// The way of the first visitor, as a script.
fn way(data: &Data, tree: &str, more: &[&str]) -> Script {
    let file = data.folder("way.jsonl");
    let saved = ["--save-script", file.to_str().expect("UTF-8")];
    let walk = ["walk", tree, "--scene", "rooms", "--bandwidth", "5M"];
    data.ok(&[&walk[..], &saved, more].concat());
    Script::parse(&std::fs::read_to_string(file).expect("a script")).expect("a script")
}

/// The cells of a way in order; each step of it must be in one, at walking speed, and lead to the same or to one next door.
async fn cells_of(scene: &belvedere_client::Scene<FolderSource>, script: &Script) -> Vec<CellId> {
    let mut cells: Vec<CellId> = Vec::new();
    let [from_ms, to_ms] = script.times_ms();
    let mut t_ms = from_ms;
    while t_ms < to_ms {
        let [x, y, z] = script.velocity_mps(t_ms);
        let speed_mps = (x * x + y * y + z * z).sqrt();
        assert!((speed_mps - SPEED_MPS).abs() < 1e-6, "{speed_mps} m/s");
        let at = scene.locate(script.at(t_ms)).await.expect("a cell");
        assert_eq!(
            at.distance_m,
            0.0,
            "at {t_ms} ms, outside every cell: {:?}",
            script.at(t_ms)
        );
        let here = at.cell.cell;
        if let Some(before) = cells.last().filter(|before| **before != here) {
            assert!(
                at.cell.adjacent.contains(before),
                "at {t_ms} ms, from {before} to {here}"
            );
        }
        if cells.last() != Some(&here) {
            cells.push(here);
        }
        t_ms += 20.0;
    }
    cells
}

#[tokio::test]
async fn a_tour_of_the_streets_goes_through_openings_and_comes_further_than_chance() {
    let (data, tree, scene) = published("rooms.plan", TWELVE_ROOMS).await;
    let distinct = |cells: &[CellId]| cells.iter().collect::<BTreeSet<_>>().len();

    let (mut in_order, mut at_random) = (0, 0);
    for seed in ["1", "2", "3"] {
        let long = ["--duration", "45", "--seed", seed];
        let tour = way(&data, &tree, &[&long[..], &["--way", "streets"]].concat());
        assert_eq!(tour, way(&data, &tree, &[&long[..], &["--way", "streets"]].concat()));
        in_order += distinct(&cells_of(&scene, &tour).await);
        at_random += distinct(&cells_of(&scene, &way(&data, &tree, &long)).await);
    }
    assert!(in_order > at_random, "{in_order} cells in order, {at_random} at random");

    // With time enough it has been everywhere in the house, is home again, and goes round once more.
    let long = way(&data, &tree, &["--duration", "300", "--way", "streets"]);
    let cells = cells_of(&scene, &long).await;
    let [_, eye_m, _] = scene.pointer().viewpoints[0].position;
    for number in 0..scene.manifest().counts.cells {
        let cell = scene.cell(CellId(number)).await.expect("the index").expect("a cell");
        let [min, max] = [cell.bounds.min, cell.bounds.max];
        let is_indoors = [min[0], min[2]].iter().all(|from| *from > 0.5) && max[0] < 16.5 && max[2] < 12.5;
        let is_walked = is_indoors && min[1] < eye_m && eye_m < max[1];
        assert!(!is_walked || cells.contains(&cell.cell), "never in {}", cell.cell);
    }
    assert_eq!(long.times_ms()[1], 300_000.0);
    let last_new = (0..cells.len()).filter(|i| !cells[..*i].contains(&cells[*i])).max();
    assert!(cells[last_new.expect("a cell")..].contains(&cells[0]));
}

#[tokio::test]
async fn who_cannot_leave_its_cell_goes_to_and_fro_in_it() {
    let (data, tree, scene) = published("hall.dcg", ONE_CELL).await;
    for manner in ["random", "streets"] {
        let way = way(&data, &tree, &["--duration", "30", "--way", manner]);
        assert_eq!(way.times_ms()[1], 30_000.0);
        assert_eq!(cells_of(&scene, &way).await, [CellId(0)]);
        assert!(way.at(10_000.0) != way.at(20_000.0), "{way:?}");
    }
}

#[test]
fn a_way_is_made_up_or_given() {
    let data = Data::new();
    let output = data.run(&[
        "walk",
        ".",
        "--scene",
        "rooms",
        "--script",
        "way.jsonl",
        "--way",
        "streets",
    ]);
    assert_eq!(output.status.code(), Some(2));
}
