//! How fast and how tight are visible sets? Prints tables; asserts nothing. `cargo bench -p belvedere-bake -- [methods | interior | growth | online]`
//!
//! The scene is the city of Cohen-Or & Zadicario (1998), 2,128 buildings, with street cells of a quarter of a building.
//! Times are CPU time of one thread. The tables of the paper itself: `make evaluation EVALUATION='--only cohen-or'`.

#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

mod timing;

use std::fs;

use belvedere_bake::{
    cells::{self, CellGraph, CellSettings},
    city::City,
    import::plan::parse,
    occluders::Region,
    progress::Silent,
    visibility::{
        self, Method,
        conservative::{ConservativeSettings, Observer, Scenery},
        narrow::{Faces, Scout},
        prover::Proofs,
        surface::Surface,
    },
    world::World,
};
use glam::Vec3;

const CELLS: usize = 48;
/// Rays for the truth, from each cell.
const RAYS: usize = 1_000_000;
/// … and so many at each object that they did not see and that no proof hides, …
const AIMED: usize = 4_000;
/// … after so many between each of the parts that a proof could not separate, …
const BETWEEN: usize = 32;
/// … of so many in all.
const REFERENCE_CUTS: u32 = 1 << 18;

/// The object that covers the museum, and the height of its lower ceilings, in metres.
const ROOF: &str = "Outside/roof";
const CEILING_M: f32 = 4.0;

/// Questions on line …
const QUESTIONS: usize = 500;
/// … each asked so often.
const REPEATS: usize = 16;

fn main() {
    let wanted = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    let tables: [(&str, fn()); 4] = [
        ("methods", methods),
        ("interior", interior),
        ("growth", growth),
        ("online", on_line),
    ];
    for (name, print) in tables {
        if wanted.as_ref().is_none_or(|wanted| wanted == name) {
            print();
        }
    }
}

/// CPU time of this thread so far, in milliseconds.
fn cpu_ms() -> f64 {
    1e3 * timing::cpu_s()
}

/// The least of a few runs, in milliseconds, and what the last one gave.
fn timed<T>(run: impl FnMut() -> T) -> (f64, T) {
    let (least_s, result) = timing::timed(run);
    (1e3 * least_s, result)
}

fn regions(world: &World, city: &City) -> Vec<Region> {
    let relative = |p: glam::DVec3| world.relative(p.to_array());
    let cells = city.street_cells(CELLS).into_iter();
    cells
        .map(|[min, max]| Region::of_box(relative(min), relative(max)))
        .collect()
}

fn settings() -> [(&'static str, ConservativeSettings); 6] {
    let plain = ConservativeSettings {
        proofs: Proofs {
            bodies: true,
            walls: false,
        },
        fusion: false,
        halvings: 0,
        cuts: 0,
        steps: u32::MAX,
    };
    [
        ("one occluder", plain),
        ("fused", ConservativeSettings { fusion: true, ..plain }),
        ("on line", ConservativeSettings::ON_LINE),
        ("`occluders`", Method::Occluders.proofs()),
        ("`portals`", Method::Portals.proofs()),
        ("`conservative`", Method::Conservative.proofs()),
    ]
}

fn methods() {
    println!(
        "\nproofs by the tree of objects; truth: {RAYS} rays from each cell, and {AIMED} aimed at each object left\n"
    );
    table_head();
    for (name, city) in [("dense", City::DENSE), ("sparse", City::SPARSE)] {
        let world = World::new(&city.scene()).unwrap();
        let cells = regions(&world, &city);
        compare(name, &world, &cells);
    }
}

/// The built-in museum: rooms, doors, windows and exhibits.
fn interior() {
    println!("\nthe same in the built-in museum, from every so many cells\n");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fixtures/museum.plan");
    let scene = parse(&fs::read_to_string(path).unwrap()).unwrap().to_scene();
    let world = World::new(&scene).unwrap();
    let origin = |v: &belvedere_bake::source::SourceViewpoint| v.world_from_camera.w_axis.truncate().to_array();
    let viewpoints: Vec<_> = scene.viewpoints.iter().map(origin).collect();
    let scenery = Scenery::of(&world);
    let estimate = |graph: &CellGraph| visibility::glance(&world, &scenery, graph, &Silent);
    let graph = cells::build_refined(&world, &viewpoints, &CellSettings::default(), &estimate, &Silent)
        .unwrap()
        .graph(&world);
    let eyes: Vec<_> = graph.cells.iter().map(|cell| Region::of_cell(&world, cell)).collect();
    let roof = scene
        .objects
        .iter()
        .position(|object| scene.models[object.model].name == ROOF)
        .unwrap();
    let roof = Scenery::targets_of(&world)[roof].clone().unwrap();
    let in_rooms = |eye: &Region| {
        let middle = eye.center();
        let under = middle.cmpgt(roof.min) | glam::BVec3::new(false, true, false);
        under.all() && middle.x < roof.max.x && middle.z < roof.max.z && middle.y < CEILING_M
    };
    let (rooms, around): (Vec<_>, Vec<_>) = eyes.into_iter().partition(in_rooms);
    table_head();
    for (name, eyes) in [("museum, in rooms", rooms), ("museum, around them", around)] {
        let step = eyes.len().div_ceil(CELLS);
        compare(name, &world, &eyes.into_iter().step_by(step).collect::<Vec<_>>());
    }
}

fn table_head() {
    println!(
        "| scene | method | ms for a cell | 99 of 100 asked alone | not hidden | seen by rays | extra | missing |"
    );
    println!("|---|---|---|---|---|---|---|---|");
}

fn compare(name: &str, world: &World, cells: &[Region]) {
    let scenery = Scenery::of(world);
    let count = cells.len() as f64;
    let start_ms = cpu_ms();
    let mut truth: Vec<_> = cells.iter().map(|cell| look(world, cell)).collect();
    let rays_ms = cpu_ms() - start_ms;
    let known = truth.clone();
    let by_rays: usize = truth.iter().map(Vec::len).sum();
    let settings_of_reference = ConservativeSettings {
        cuts: REFERENCE_CUTS,
        ..Method::Conservative.proofs()
    };
    let mut observer = Observer::new(&scenery, settings_of_reference);
    for (cell, seen) in cells.iter().zip(&mut truth) {
        let mut reference = Reference::new(world, seen);
        let open = observer.visible_or_found(cell, &reference.seen.clone(), &mut reference);
        *seen = reference.seen;
        look_at(world, cell, &open, seen);
    }
    let seen: usize = truth.iter().map(Vec::len).sum();
    for (method, settings) in settings() {
        let (ms, sets) = timed(|| {
            let mut observer = Observer::new(&scenery, settings);
            let asked = cells.iter().zip(&known);
            asked
                .map(|(cell, known)| observer.visible_or_found(cell, known, &mut Faces(world)))
                .collect::<Vec<_>>()
        });
        let mut each_ms: Vec<f64> = cells
            .iter()
            .zip(&known)
            .map(|(cell, known)| {
                timed(|| Observer::new(&scenery, settings).visible_or_found(cell, known, &mut Faces(world))).0
            })
            .collect();
        each_ms.sort_by(f64::total_cmp);
        let open: usize = sets.iter().map(Vec::len).sum();
        let missing: usize = truth
            .iter()
            .zip(&sets)
            .map(|(seen, set)| seen.iter().filter(|o| set.binary_search(o).is_err()).count())
            .sum();
        println!(
            "| {name} | {method} | {:.2} | {:.2} | {:.1} | {:.1} | {:+.0} % | {missing} |",
            ms / count,
            each_ms[each_ms.len() * 99 / 100],
            open as f64 / count,
            seen as f64 / count,
            100.0 * (open as f64 / seen as f64 - 1.0)
        );
    }
    println!(
        "| {name} | {RAYS} rays | {:.0} at {:.1} M rays/s | | {:.1} | {:.1} | | |",
        rays_ms / count,
        1e-3 * RAYS as f64 * count / rays_ms,
        by_rays as f64 / count,
        seen as f64 / count,
    );
}

/// Casts rays at parts of objects until one is seen.
struct Reference<'a> {
    world: &'a World,
    seen: Vec<u32>,
    unit: Box<dyn FnMut() -> f32>,
}

impl<'a> Reference<'a> {
    fn new(world: &'a World, seen: &[u32]) -> Self {
        Self {
            world,
            seen: seen.to_vec(),
            unit: Box::new(units()),
        }
    }
}

impl Scout for Reference<'_> {
    fn glances(&mut self, _: u32, _: &Region) -> bool {
        false
    }

    fn surface(&self, object: u32) -> Option<Surface> {
        Surface::of(self.world, object)
    }

    fn looks(&mut self, object: u32, eye: &Region, part: &Surface, _: &[Region]) -> bool {
        let polygons: Vec<_> = part.polygons().collect();
        let mut passed = Vec::new();
        let unit = &mut self.unit;
        let found = (0..BETWEEN).any(|_| {
            let snapped = [0; 3].map(|_| if unit() < 0.6 { unit() } else { unit().round() });
            let eye = within(eye, Vec3::from(snapped));
            // Most places are near a corner.
            let polygon = polygons[(unit() * polygons.len() as f32) as usize];
            let weights: Vec<f32> = polygon.iter().map(|_| unit().powi(4)).collect();
            let sum = polygon.iter().zip(&weights).map(|(corner, weight)| *weight * *corner);
            let target = sum.sum::<Vec3>() / weights.iter().sum::<f32>();
            let hit = self.world.cast(eye, target - eye, f32::MAX, &mut passed);
            passed.iter().chain(&hit).any(|hit| hit.object == object)
        });
        if found {
            self.seen.push(object);
        }
        found
    }
}

/// Adds to what was seen from a cell what aimed rays see of these objects: from corners, edges and faces of the cell to
/// places on their upper halves.
fn look_at(world: &World, cell: &Region, objects: &[u32], seen: &mut Vec<u32>) {
    let mut unit = units();
    let mut passed = Vec::new();
    for object in objects {
        if seen.contains(object) {
            continue;
        }
        let bounds = &world.object_bounds()[*object as usize];
        let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
        let hit = (0..AIMED).any(|_| {
            let snapped = [0; 3].map(|_| if unit() < 0.5 { unit() } else { unit().round() });
            let eye = within(cell, Vec3::from(snapped));
            let at = Vec3::new(unit(), 1.0 - unit() * unit() * unit(), unit());
            let target = min + at * (max - min);
            let hit = world.cast(eye, target - eye, f32::MAX, &mut passed);
            passed.iter().chain(&hit).any(|hit| hit.object == *object)
        });
        if hit {
            seen.push(*object);
        }
    }
    seen.sort_unstable();
}

/// A place in a cell from shares of its edges, a hair off its surface: nobody looks out of a wall.
fn within(cell: &Region, share: Vec3) -> Vec3 {
    cell.min + (share * 0.9998 + 0.0001) * (cell.max - cell.min)
}

/// Random numbers from 0 to 1 (Knuth's MMIX generator).
fn units() -> impl FnMut() -> f32 {
    let mut state = 0x9E37_79B9_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u32 << 24) as f32
    }
}

/// Objects that random rays see from a cell.
fn look(world: &World, cell: &Region) -> Vec<u32> {
    let mut unit = units();
    let mut seen = vec![false; world.object_bounds().len()];
    let mut passed = Vec::new();
    for _ in 0..RAYS {
        let eye = within(cell, Vec3::new(unit(), unit(), unit()));
        // More of them near the horizon, where far things are.
        let (height, turn) = ((2.0 * unit() - 1.0) * unit(), std::f32::consts::TAU * unit());
        let ring = (1.0 - height * height).sqrt();
        let direction = Vec3::new(ring * turn.cos(), height, ring * turn.sin());
        if let Some(hit) = world.cast(eye, direction, f32::MAX, &mut passed) {
            seen[hit.object as usize] = true;
        }
        passed.iter().for_each(|hit| seen[hit.object as usize] = true);
    }
    (0..seen.len() as u32).filter(|o| seen[*o as usize]).collect()
}

fn growth() {
    println!(
        "\ngrowth at equal density: ms for a cell, and what is not hidden; a naive sampler asks every object with 16 sight lines\n"
    );
    println!("| buildings | streets | one occluder | fused | `conservative` | naive sampler |");
    println!("|---|---|---|---|---|---|");
    let sizes = [[28, 19], [56, 38], [112, 76]];
    let cities = [City::DENSE, City::QUARTERS].into_iter();
    for city in cities.flat_map(|city| sizes.map(|blocks| City { blocks, ..city })) {
        let world = World::new(&city.scene()).unwrap();
        let scenery = Scenery::of(&world);
        let cells = regions(&world, &city);
        let per_cell = |settings: ConservativeSettings| {
            let (ms, open) = timed(|| {
                let mut observer = Observer::new(&scenery, settings);
                cells
                    .iter()
                    .map(|cell| observer.visible(cell, &[]).len())
                    .sum::<usize>()
            });
            format!("{:.2}, {:.0}", ms / CELLS as f64, open as f64 / CELLS as f64)
        };
        let all = settings();
        let [one, fused, conservative] = [all[0].1, all[1].1, all[5].1].map(per_cell);
        let naive = timed(|| naive(&world, &cells[..2])).0 / 2.0;
        println!(
            "| {} | {} | {one} | {fused} | {conservative} | {naive:.1} |",
            world.object_bounds().len(),
            if city.closed_after == 0 { "lead on" } else { "end" },
        );
    }
}

/// What `POST …/visible` takes, without HTTP.
fn on_line() {
    println!("\nQuestions on line, {QUESTIONS} boxes of a quarter of a building in the streets of 2,128\n");
    println!("| city | openings | not hidden, mean | ms, median | 99 of 100 | most |");
    println!("|---|---|---|---|---|---|");
    for (name, city) in [("dense", City::DENSE), ("sparse", City::SPARSE)] {
        let world = World::new(&city.scene()).unwrap();
        let scenery = Scenery::of(&world);
        let relative = |p: glam::DVec3| world.relative(p.to_array());
        let eyes = city.street_cells(QUESTIONS).into_iter();
        let eyes: Vec<_> = eyes
            .map(|[min, max]| Region::of_box(relative(min), relative(max)))
            .collect();
        for (openings, settings) in [
            ("no", ConservativeSettings::ON_LINE.rough()),
            ("yes", ConservativeSettings::ON_LINE),
        ] {
            let mut open = 0;
            let ask = |eye: &Region| {
                // The clock of a thread may tick as seldom as every 4 ms.
                let started = cpu_ms();
                for _ in 0..REPEATS {
                    open += Observer::new(&scenery, settings).visible(eye, &[]).len();
                }
                (cpu_ms() - started) / REPEATS as f64
            };
            let mut times: Vec<f64> = eyes.iter().map(ask).collect();
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[((QUESTIONS - 1) as f64 * share) as usize];
            println!(
                "| {name} | {openings} | {:.0} | {:.1} | {:.1} | {:.1} |",
                open as f64 / (QUESTIONS * REPEATS) as f64,
                at(0.5),
                at(0.99),
                at(1.0)
            );
        }
    }
}

/// Sight lines from each cell to points in the box of every object.
fn naive(world: &World, cells: &[Region]) -> usize {
    let mut passed = Vec::new();
    let mut seen = 0;
    for cell in cells {
        for (object, bounds) in world.object_bounds().iter().enumerate() {
            let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
            let hits = (0..16).any(|i| {
                let share = |bit: i32| if i >> bit & 1 == 0 { 0.1 } else { 0.9 };
                let at = Vec3::new(share(0), share(1), share(2));
                let (eye, target) = (cell.min + at * (cell.max - cell.min), min + at * (max - min));
                let hit = world.cast(eye, target - eye, f32::MAX, &mut passed);
                hit.is_some_and(|hit| hit.object == object as u32)
            });
            seen += usize::from(hits);
        }
    }
    seen
}
