//! What do whole views show that the sets do not hold?

use glam::Vec3;

use super::{
    Method, SampledSettings, Views, VisibilitySettings, of_some,
    oracle::ItemBuffer,
    random::Random,
    targets::Lookout,
    tests::{sampled, set_of},
};
use crate::{
    cells::{
        self, CellGraph, CellSettings,
        plan::{Builder, museum},
    },
    memory::Forgetful,
    occluders::Hiders,
    progress::Silent,
    world::World,
};

/// What item buffers of 512² pixels a face from many eyes in some cells see that the sets of these do not hold.
fn missed_in_views(
    world: &World,
    graph: &CellGraph,
    cells: &[usize],
    sets: &[Vec<u32>],
    eyes: usize,
) -> (usize, Vec<String>) {
    use rayon::prelude::*;
    let lookouts = Lookout::all(world, graph);
    let missed: Vec<Vec<String>> = (cells, sets)
        .into_par_iter()
        .map_init(
            || ItemBuffer::new(512, world.object_bounds().len()),
            |buffer, (cell, set)| {
                let cell = *cell;
                let mut random = Random::stream(7, cell as u64);
                let mut missed = Vec::new();
                for i in 0..eyes {
                    let eye: Vec3 = match i % 3 {
                        0 => lookouts[cell].uniform(&mut random),
                        1 => lookouts[cell].surface(&mut random),
                        _ => lookouts[cell].clamp(lookouts[cell].in_portal(&mut random)),
                    };
                    buffer.draw(world, eye);
                    for object in 0..world.object_bounds().len() as u32 {
                        let pixels = buffer.pixels[object as usize];
                        if pixels > 0 && !set.contains(&object) && buffer.confirms(world, eye, object) {
                            missed.push(format!("cell {cell} eye {eye}: object {object}, {pixels} px of 512²"));
                        }
                    }
                }
                missed
            },
        )
        .collect();
    (eyes * cells.len(), missed.concat())
}

/// One of so many cells is looked from: no cell's set depends on that of another.
const STEP: usize = 3;

/// The same of sampled sets of some cells of a scene, as a bake finds them.
fn missed_from_some(builder: &Builder, viewpoint: [f64; 3], eyes: usize) -> Vec<String> {
    let world = World::new(&builder.scene).unwrap();
    let graph = cells::build(&world, &[viewpoint], &CellSettings::default(), &Silent).unwrap();
    let some: Vec<usize> = (0..graph.cells.len()).step_by(STEP).collect();
    let settings = VisibilitySettings {
        method: Method::Sampled,
        sampled: Some(SampledSettings::default()),
    };
    let hiders = Hiders::of(&world, Vec::new());
    let views = Views::of(&world, &graph, &hiders);
    let sets = of_some(&views, &some, &settings, &Forgetful, &Silent).unwrap();
    missed_in_views(&world, &graph, &some, &sets, eyes).1
}

#[test]
fn views_of_a_small_museum_show_nothing_unknown() {
    let missed = missed_from_some(&museum([2, 1], 8), [4.0, 1.6, 4.0], 3);
    assert!(
        missed.is_empty(),
        "{}: {:#?}",
        missed.len(),
        &missed[..missed.len().min(30)]
    );
}

/// Houses in houses, three deep, whose walls have slits here and there, and things in the innermost ones.
fn hollow_houses(count: usize) -> Builder {
    const WALL_M: f32 = 0.1;
    let mut builder = Builder::default();
    let mut random = Random::stream(17, 0);
    let size_m = 12.0 * count as f32;
    builder.block("ground", [0.0, -0.5, 0.0], [size_m, 0.0, size_m]);
    for house in 0..count * count {
        let middle = [house % count, house / count].map(|i| 12.0 * i as f32 + 6.0);
        for (shell, half_m) in [4.0, 2.8, 1.6].into_iter().enumerate() {
            let top = 3.0 - 0.3 * shell as f32;
            let [x, z] = middle;
            let roof_m = half_m + WALL_M;
            builder.block(
                "roof",
                [x - roof_m, top, z - roof_m],
                [x + roof_m, top + 0.1, z + roof_m],
            );
            for side in 0..4 {
                let width_m = [0.05, 0.15, 0.4, 0.9][random.below(4)];
                let from = -half_m + 0.3 + random.unit() * (2.0 * half_m - 0.6 - width_m);
                for [start, end] in [[-roof_m, from], [from + width_m, roof_m]] {
                    // Along x before and behind, along z at the sides.
                    let away = if side % 2 == 0 { half_m } else { -half_m - WALL_M };
                    let [min, max] = if side < 2 {
                        [[x + start, 0.0, z + away], [x + end, top, z + away + WALL_M]]
                    } else {
                        [[x + away, 0.0, z + start], [x + away + WALL_M, top, z + end]]
                    };
                    builder.block("wall", min, max);
                }
            }
        }
        for _ in 0..3 {
            let [x, z] = middle.map(|m| m - 1.2 + 2.2 * random.unit());
            builder.block("thing", [x, 0.0, z], [x + 0.2, 0.3 + random.unit(), z + 0.2]);
        }
    }
    builder
}

/// What sampled sets promise: nothing is missing that covers more than 4 pixels of a face of 1024², one of 512².
#[test]
fn views_into_hollow_houses_show_nothing_large_unknown() {
    let missed = missed_from_some(&hollow_houses(2), [0.5, 1.6, 0.5], 4);
    let large: Vec<_> = missed.iter().filter(|line| !line.ends_with(" 1 px of 512²")).collect();
    assert!(large.is_empty(), "{}: {large:#?}", large.len());
}

/// The scene that `BELVEDERE_SCENE` names, or a museum of a thousand things.
fn measured_scene() -> Builder {
    use crate::import::{FileError, Limits, SourceFiles, import};
    struct Folder(std::path::PathBuf);
    impl SourceFiles for Folder {
        fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
            std::fs::read(self.0.join(relative)).map_err(|_| FileError::Denied)
        }
    }
    let Ok(path) = std::env::var("BELVEDERE_SCENE").map(std::path::PathBuf::from) else {
        return museum([6, 7], 24);
    };
    let folder = Folder(path.parent().unwrap().to_owned());
    let name = path.file_name().unwrap().to_str().unwrap();
    let imported = import(
        name,
        std::fs::read(&path).unwrap(),
        &folder,
        &Limits::default(),
        &Silent,
    )
    .unwrap();
    Builder { scene: imported.scene }
}

/// Prints figures: run with `--ignored --nocapture a_large_scene`. `BELVEDERE_EYES` sets the number of eyes for each
/// cell, `BELVEDERE_SCENE` a file to measure instead of the museum.
#[test]
#[ignore = "takes minutes: measures misses and cost on a large scene"]
#[allow(clippy::disallowed_types, reason = "a measurement needs a clock")]
fn a_large_scene_measured() {
    let eyes = std::env::var("BELVEDERE_EYES").map_or(20, |v| v.parse().unwrap());
    let builder = measured_scene();
    let world = World::new(&builder.scene).unwrap();
    let viewpoints: Vec<_> = builder
        .scene
        .viewpoints
        .iter()
        .map(|v| v.world_from_camera.w_axis.truncate().to_array())
        .collect();
    let start = std::time::Instant::now();
    let graph = cells::build(&world, &viewpoints, &CellSettings::default(), &Silent).unwrap();
    let cells_s = start.elapsed().as_secs_f64();
    let start = std::time::Instant::now();
    let settings = SampledSettings::for_cells(graph.cells.len());
    let visible = sampled(&world, &graph, &settings, &Silent).unwrap();
    let visibility_s = start.elapsed().as_secs_f64();
    let objects = world.object_bounds().len();
    let rays: u64 = visible.iter().map(|v| v.rays).sum();
    let seen: usize = visible.iter().map(|v| v.objects.len()).sum();
    let culled = 1.0 - seen as f64 / (objects * graph.cells.len()) as f64;
    println!(
        "{} cells, {objects} objects, {} triangles, voxel {} m: cells {cells_s:.1} s, visibility {visibility_s:.1} s, \
         {:.1} M rays, {:.1} % culled, bound {:e}",
        graph.cells.len(),
        world.triangle_count(),
        graph.voxel_m,
        rays as f64 / 1e6,
        100.0 * culled,
        visible.iter().map(|v| v.miss_bound).fold(0.0, f64::max),
    );
    let all: Vec<usize> = (0..graph.cells.len()).collect();
    let sets: Vec<Vec<u32>> = visible
        .iter()
        .map(|visible| set_of(visible).into_iter().collect())
        .collect();
    let (views, missed) = missed_in_views(&world, &graph, &all, &sets, eyes);
    println!("{views} views, {} misses", missed.len());
    for line in missed.iter().take(40) {
        println!("  {line}");
    }
    assert!(missed.is_empty());
}
