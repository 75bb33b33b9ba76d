//! Do cells stay only where what is published differs? Among vines, in two yards and in rooms.

use std::sync::Mutex;

use belvedere_scene::{BlobName, manifest::Manifest};
use glam::{DMat4, DVec3};

use crate::{
    BakeSettings, Host, Source,
    cells::{
        self, CellGraph, CellSettings, Partition,
        plan::{Builder, museum},
    },
    cutting::Cutting,
    defect::Defects,
    memory::Forgetful,
    occluders::Hiders,
    pipeline::bake,
    progress::Silent,
    records::{BlobSink, SinkError, Written},
    source::SourceObject,
    visibility::{self, Method, Views, VisibilitySettings, conservative::Scenery},
    world::World,
};

/// A number between -1 and 1 by the place where it is asked for.
fn noise(plant: u32, leaf: u32, axis: u32) -> f32 {
    (((plant * 131 + leaf) * 7 + axis) as f32 * 12.9898).sin() * 43_758.547 % 1.0
}

/// A plant of leaves that lie in no plane together.
fn vine(builder: &mut Builder, plant: u32) -> u32 {
    const LEAVES: u32 = 90;
    let mut positions = Vec::new();
    for leaf in 0..LEAVES {
        let along = |axis: u32| noise(plant, leaf, axis);
        let [x, y, z] = [0.9 * along(0), 1.3 + along(1), 0.3 * along(2)];
        positions.push([x, y, z]);
        positions.push([x + 0.35, y + 0.3 * along(3), z + 0.2 * along(4)]);
        positions.push([x + 0.2 * along(5), y + 0.4, z + 0.2 * along(6)]);
    }
    builder.mesh("vine", positions, (0..3 * LEAVES).collect())
}

/// Rows of vines of a few kinds, and, if so, a wall across them.
fn vineyard(walled: bool) -> Builder {
    const KINDS: u32 = 4;
    let mut builder = Builder::default();
    builder.block("ground", [-25., -0.5, -25.], [25., 0., 25.]);
    if walled {
        builder.block("wall", [-25., 0., -0.2], [25., 4., 0.2]);
    }
    let kinds: Vec<u32> = (0..KINDS).map(|kind| vine(&mut builder, kind)).collect();
    let objects = &mut builder.scene.objects;
    let kinds: Vec<SourceObject> = objects.split_off(kinds[0] as usize);
    for (number, (row, plant)) in (0..16)
        .flat_map(|row| (0..24).map(move |plant| (row, plant)))
        .enumerate()
    {
        let place = DVec3::new(2.0 * f64::from(plant) - 23.0, 0.0, 3.0 * f64::from(row) - 22.5);
        objects.push(SourceObject {
            world_from_object: DMat4::from_translation(place),
            ..kinds[number % kinds.len()].clone()
        });
    }
    builder
}

struct Nowhere;

impl BlobSink for Nowhere {
    fn put(&self, _: &BlobName, _: Vec<u8>) -> Result<(), SinkError> {
        Ok(())
    }
}

/// The first revision and the last.
fn baked(builder: &Builder) -> [Manifest; 2] {
    let first = Mutex::new(None);
    let take = |written: &Written| -> Result<(), SinkError> {
        *first.lock().unwrap() = Some(written.manifest.clone());
        Ok(())
    };
    let source = Source {
        scene: builder.scene.clone(),
        title: String::new(),
        bytes: 0,
    };
    let host = Host {
        first: Some(&take),
        ..Host::taking(&Nowhere)
    };
    let last = bake(source, &BakeSettings::default(), &mut Defects::default(), &host)
        .unwrap()
        .manifest;
    [first.into_inner().unwrap().unwrap(), last]
}

/// How a scene is cut by what rays see.
fn by_rays(world: &World, viewpoints: &[[f64; 3]]) -> Partition {
    let scenery = Scenery::of(world);
    let estimate = |graph: &CellGraph| visibility::glance(world, &scenery, graph, &Silent);
    cells::build_refined(world, viewpoints, &CellSettings::default(), &estimate, &Silent).unwrap()
}

#[test]
fn where_proofs_hide_nothing_a_vineyard_is_a_few_cells() {
    let builder = vineyard(false);
    let world = World::new(&builder.scene).unwrap();
    let by_rays = by_rays(&world, &[]).graph(&world);
    assert!(
        by_rays.cells.len() > 32,
        "leaves hide from rays: {}",
        by_rays.cells.len()
    );
    let [first, last] = baked(&builder);
    let most = by_rays.cells.len() as u32 / 16;
    assert!(
        first.counts.cells <= most && last.counts.cells <= most,
        "{}",
        last.visibility.reason
    );
    assert!(last.visibility.mean_visible > 0.95 * f64::from(last.counts.objects));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| baked(&builder)), [first, last]);
}

/// What is seen from a cell that was joined is in the set of what it was joined to.
#[test]
fn a_wall_across_a_vineyard_stays_a_cut() {
    let builder = vineyard(true);
    let world = World::new(&builder.scene).unwrap();
    let hiders = Hiders::of(&world, Vec::new());
    let partition = by_rays(&world, &[[0.0, 1.6, 5.0]]);
    let graph = partition.graph(&world);
    let views = Views::of(&world, &graph, &hiders);
    let cutting = Cutting {
        world: &world,
        hiders: &hiders,
        partition: Some(partition),
        bytes: vec![1.0; builder.scene.objects.len()],
    };
    let settings = VisibilitySettings {
        method: Method::Conservative,
        sampled: None,
    };
    let rough = visibility::rough(&views, &Silent).unwrap();
    let memory = Forgetful;
    let joined = cutting
        .tried(&views, &rough, &settings, &memory, &Silent)
        .unwrap()
        .unwrap();
    assert!(
        2 * joined.cells.len() < graph.cells.len(),
        "{} of {}",
        joined.cells.len(),
        graph.cells.len()
    );
    let standing = |z: f64| joined.cell_at([3.0, 1.6, z]).expect("free") as usize;
    assert_ne!(standing(5.0), standing(-5.0));
    let over_the_wall = joined.cells.iter().any(|cell| {
        let [min, max] = [cell.bounds.min, cell.bounds.max];
        min[1] < 3.0 && min[2] < -1.0 && max[2] > 1.0
    });
    assert!(!over_the_wall, "a cell leads through the wall");
    let parts: Vec<usize> = (0..graph.cells.len()).step_by(9).collect();
    let from_parts = visibility::of_some(&views, &parts, &settings, &memory, &Silent).unwrap();
    let wholes: Vec<usize> = (0..joined.cells.len()).collect();
    let joined_views = Views::of(&world, &joined, &hiders);
    let from_wholes = visibility::of_some(&joined_views, &wholes, &settings, &memory, &Silent).unwrap();
    for (part, set) in parts.iter().zip(&from_parts) {
        let whole = joined.cell_at(graph.cells[*part].center()).expect("no place is lost") as usize;
        assert!(
            set.iter().all(|object| from_wholes[whole].contains(object)),
            "cell {part} in {whole}"
        );
    }
}

/// Rooms with things in them: their walls hide, and where they do cells stay.
#[test]
fn rooms_stay_what_they_were() {
    let builder = museum([2, 1], 6);
    let world = World::new(&builder.scene).unwrap();
    let hiders = Hiders::of(&world, Vec::new());
    let partition = by_rays(&world, &[[4.0, 1.6, 4.0]]);
    let graph = partition.graph(&world);
    let views = Views::of(&world, &graph, &hiders);
    let cutting = Cutting {
        world: &world,
        hiders: &hiders,
        partition: Some(partition),
        bytes: vec![1.0; builder.scene.objects.len()],
    };
    let settings = VisibilitySettings::default();
    let rough = visibility::rough(&views, &Silent).unwrap();
    let tried = cutting
        .tried(&views, &rough, &settings, &Forgetful, &Silent)
        .unwrap()
        .unwrap();
    let (first, _) = cutting.preview(&views, &rough, &Silent).unwrap();
    for graph in [&tried, &first] {
        let room = |i: u32| graph.cell_at([4.0 + 8.0 * f64::from(i % 2), 3.0, 4.0 + 8.0 * f64::from(i / 2)]);
        let rooms: std::collections::BTreeSet<_> = (0..2).map(room).collect();
        assert_eq!(rooms.len(), 2);
    }
    let mean = |graph: &CellGraph| {
        let found = visibility::compute(&Views::of(&world, graph, &hiders), &settings, &Forgetful, &Silent).unwrap();
        found.cells.iter().map(|cell| cell.objects.len()).sum::<usize>() as f64 / found.cells.len() as f64
    };
    let (before, after) = (mean(&graph), mean(&tried));
    assert!(
        after <= 1.1 * before,
        "{after} objects are published of a cell, {before} before"
    );
}
