//! Are records and steps as small as they should be, on the city of the papers?

use belvedere_scene::{BlobName, Bounds};
use glam::DVec3;

use super::{BlobSink, Input, Models, SinkError, write};
use crate::{
    cells::{CellGraph, Portal, ViewCell},
    city::City,
    frame::Frame,
    lod::LodSettings,
    memory::Forgetful,
    occluders::Hiders,
    pipeline::in_spatial_order,
    progress::Silent,
    visibility::{self, Method, SampledSettings, Views, VisibilitySettings, conservative::Scenery},
    world::World,
};

/// Runs of free cells of the paper's size, `length` one behind the other, in `count` streets all over the city. A cell
/// is adjacent to the one before and the one behind it.
fn streets(city: &City, count: usize, length: usize) -> CellGraph {
    let houses: Vec<[DVec3; 2]> = city.buildings().into_iter().map(|boxes| boxes[0]).collect();
    let free = |cell: &Bounds| {
        houses
            .iter()
            .all(|[min, max]| cell.min[0] > max.x || cell.max[0] < min.x || cell.min[2] > max.z || cell.max[2] < min.z)
    };
    let mut runs: Vec<Vec<Bounds>> = Vec::new();
    for row in 0..city.blocks[1] - 1 {
        let z = (row as f64 + 0.5) * city.spacing_m - 0.5 * City::CELL_M;
        let steps = ((city.blocks[0] - 1) as f64 * city.spacing_m / City::CELL_M) as usize;
        let cells: Vec<Bounds> = (0..steps)
            .map(|step| Bounds {
                min: [step as f64 * City::CELL_M, 0.0, z],
                max: [(step + 1) as f64 * City::CELL_M, City::CELL_M, z + City::CELL_M],
            })
            .collect();
        let open = cells.split(|cell| !free(cell));
        runs.extend(open.flat_map(|run| run.chunks_exact(length).map(<[Bounds]>::to_vec)));
    }
    let spread = runs.len() / count;
    let chosen = runs.iter().skip(spread / 2).step_by(spread).take(count);
    let mut cells: Vec<ViewCell> = Vec::new();
    for run in chosen {
        let first = cells.len();
        for (step, bounds) in run.iter().enumerate() {
            let (min, max) = (bounds.min, bounds.max);
            let opening = |to: usize, x: f64| Portal {
                to: to as u32,
                polygon: vec![
                    [x, min[1], min[2]],
                    [x, max[1], min[2]],
                    [x, max[1], max[2]],
                    [x, min[1], max[2]],
                ],
                door: None,
            };
            let back = (step > 0).then(|| opening(first + step - 1, min[0]));
            let ahead = (step + 1 < length).then(|| opening(first + step + 1, max[0]));
            let portals: Vec<_> = back.into_iter().chain(ahead).collect();
            cells.push(ViewCell {
                bounds: *bounds,
                hull: None,
                adjacent: portals.iter().map(|portal| portal.to).collect(),
                portals,
            });
        }
    }
    CellGraph {
        cells,
        voxel_m: 0.25,
        reason: String::new(),
    }
}

struct Nowhere;

impl BlobSink for Nowhere {
    fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
        Ok(())
    }
}

#[test]
fn records_and_steps_of_a_city_are_small() {
    let scene = in_spatial_order(City::DENSE.scene());
    let world = World::new(&scene).unwrap();
    let graph = streets(&City::DENSE, 8, 5);
    let settings = VisibilitySettings {
        method: Method::Occluders,
        sampled: Some(SampledSettings::for_cells(4096)),
    };
    let hiders = Hiders::of(&world, Vec::new());
    let scenery = Scenery::with(&world, hiders.occluders());
    let visibility = visibility::compute(&Views::of(&world, &graph, &hiders), &settings, &Forgetful, &Silent).unwrap();
    let input = Input {
        scene: &scene,
        title: "City",
        source_bytes: 0,
        world: &world,
        frame: Frame::SOURCE,
        bounds: world.object_bounds(),
        graph: &graph,
        scenery: &scenery,
        foliage: &Default::default(),
        visibility: &visibility,
    };
    let models = Models::write(&scene, &LodSettings::default(), &Nowhere, &Silent).unwrap();
    let manifest = write(input, &models, &Nowhere, &Silent).unwrap().manifest;
    let [record, record_set, step, step_set] = manifest.records.means();
    let visible = manifest.visibility.mean_visible;
    println!(
        "{visible:.1} of {} objects visible; a record {record:.1} B, its set {record_set:.1} B; a step {step:.1} B, \
         its set {step_set:.1} B",
        scene.objects.len()
    );
    assert!(record_set <= 60.0, "sets of {record_set} bytes");
    assert!(step_set <= 30.0, "steps whose sets have {step_set} bytes");
    // With solid angles, fractions, hull, portals and sizes.
    assert!(record <= 200.0, "records of {record} bytes");
    assert!(step <= 0.5 * record, "steps of {step} bytes to records of {record}");
}
