use super::{
    plan::{Builder, floor_plan, museum},
    *,
};
use crate::{progress::Silent, world::World};

fn cut(builder: &Builder, viewpoints: &[[f64; 3]]) -> CellGraph {
    build(
        &World::new(&builder.scene).unwrap(),
        viewpoints,
        &CellSettings::default(),
        &Silent,
    )
    .unwrap()
}

/// Cells that can be walked to, each with the number of steps.
fn steps_from(graph: &CellGraph, start: u32) -> Vec<Option<u32>> {
    let mut steps = vec![None; graph.cells.len()];
    steps[start as usize] = Some(0);
    let mut queue = std::collections::VecDeque::from([start]);
    while let Some(cell) = queue.pop_front() {
        for next in &graph.cells[cell as usize].adjacent {
            if steps[*next as usize].is_none() {
                steps[*next as usize] = steps[cell as usize].map(|n| n + 1);
                queue.push_back(*next);
            }
        }
    }
    steps
}

fn assert_sound(graph: &CellGraph) {
    for (id, cell) in graph.cells.iter().enumerate() {
        assert!(!cell.bounds.is_empty());
        for portal in &cell.portals {
            let other = &graph.cells[portal.to as usize];
            assert!(
                other
                    .portals
                    .iter()
                    .any(|p| p.to == id as u32 && p.polygon == portal.polygon)
            );
            for corner in portal.polygon.iter().copied() {
                assert!(cell.bounds.distance_m(corner) < 1e-3 && other.bounds.distance_m(corner) < 1e-3);
            }
        }
        for (other_id, other) in graph.cells.iter().enumerate().skip(id + 1) {
            let overlap: f64 = (0..3)
                .map(|a| {
                    (cell.bounds.max[a].min(other.bounds.max[a]) - cell.bounds.min[a].max(other.bounds.min[a])).max(0.0)
                })
                .product();
            assert!(overlap < 1e-6, "cells {id} and {other_id} overlap by {overlap} m³");
        }
    }
}

#[test]
fn rooms_become_cells_and_a_doorway_connects_them() {
    let (builder, letters) = floor_plan(
        "###############
         #......#......#
         #.a....#....b.#
         #.............#
         #......#......#
         #......#......#
         ###############",
    );
    let graph = cut(&builder, &[letters[0].2]);
    assert_sound(&graph);
    let [a, b] = [0, 1].map(|i| graph.cell_at(letters[i].2).expect("free space"));
    assert_ne!(a, b);
    assert_eq!(steps_from(&graph, a)[b as usize], Some(2), "through the doorway");
    assert_eq!(graph.cells.len(), 3, "two rooms and a doorway: {graph:#?}");
    let room = graph.cells[a as usize].bounds;
    for (axis, (min, max)) in [(1.0, 7.0), (0.0, 3.0), (1.0, 6.0)].into_iter().enumerate() {
        assert!(
            (room.min[axis] - min).abs() < 1e-4 && (room.max[axis] - max).abs() < 1e-4,
            "{room:?}"
        );
    }
}

#[test]
fn a_sealed_room_is_not_entered() {
    let (builder, letters) = floor_plan(
        "###############
         #......#......#
         #.a....#....b.#
         #......#......#
         ###############",
    );
    let graph = cut(&builder, &[letters[0].2]);
    assert_eq!(graph.cells.len(), 1);
    assert_eq!(graph.cell_at(letters[1].2), None);
}

#[test]
fn without_viewpoints_open_space_and_rooms_are_kept_but_not_joined() {
    let (builder, letters) = floor_plan(
        "###############
         #......#......#
         #.a....#....b.#
         #......#......#
         ###############",
    );
    let graph = cut(&builder, &[]);
    assert_sound(&graph);
    let [a, b] = [0, 1].map(|i| graph.cell_at(letters[i].2).expect("free space"));
    assert_ne!(a, b);
    assert!(steps_from(&graph, a)[b as usize].is_none());
    assert!(graph.cell_at([-1.0, 1.0, 2.0]).is_some(), "outside");
    assert!(graph.cells[a as usize].adjacent.is_empty());
}

#[test]
fn walls_without_thickness_separate() {
    let mut builder = Builder::default();
    let (w, d, h) = (8.3, 4.1, 3.0);
    builder.quad("floor", [[0., 0., 0.], [0., 0., d], [w, 0., d], [w, 0., 0.]]);
    builder.quad("ceiling", [[0., h, 0.], [w, h, 0.], [w, h, d], [0., h, d]]);
    for x in [0.0, 3.77, w] {
        builder.quad("wall", [[x, 0., 0.], [x, h, 0.], [x, h, d], [x, 0., d]]);
    }
    for z in [0.0, d] {
        builder.quad("wall", [[0., 0., z], [w, 0., z], [w, h, z], [0., h, z]]);
    }
    let graph = cut(&builder, &[[1.0, 1.0, 1.0]]);
    assert_eq!(graph.cells.len(), 1);
    assert!((graph.cells[0].bounds.max[0] - 3.77).abs() < 1e-3);
    let graph = cut(&builder, &[[1.0, 1.0, 1.0], [5.0, 1.0, 1.0]]);
    assert_eq!(graph.cells.len(), 2);
    assert!(graph.cells.iter().all(|cell| cell.adjacent.is_empty()));
}

#[test]
fn a_slanted_wall_separates() {
    let mut builder = Builder::default();
    builder.block("floor", [-5., -1., -5.], [5., 0., 5.]);
    builder.block("ceiling", [-5., 3., -5.], [5., 4., 5.]);
    for [x0, x1, z0, z1] in [
        [-5., -4., -5., 5.],
        [4., 5., -5., 5.],
        [-5., 5., -5., -4.],
        [-5., 5., 4., 5.],
    ] {
        builder.block("wall", [x0, 0., z0], [x1, 3., z1]);
    }
    builder.quad(
        "slanted",
        [[-4.5, 0., -4.2], [4.5, 0., 4.6], [4.5, 3., 4.6], [-4.5, 3., -4.2]],
    );
    let graph = cut(&builder, &[[3.0, 1.0, -3.0]]);
    assert_sound(&graph);
    assert!(graph.cell_at([3.0, 1.0, -3.0]).is_some());
    assert_eq!(graph.cell_at([-3.0, 1.0, 3.0]), None, "{graph:?}");
}

#[test]
fn furniture_does_not_split_a_room() {
    let (mut builder, letters) = floor_plan(
        "##########
         #a.......#
         #........#
         #........#
         #........#
         #........#
         ##########",
    );
    builder.block("table", [3., 0.7, 3.], [5., 0.75, 4.]);
    builder.block("cupboard", [6.0, 0.0, 1.0], [8.0, 2.0, 1.6]);
    assert_eq!(cut(&builder, &[letters[0].2]).cells.len(), 1);
}

#[test]
fn a_scene_without_walls_is_one_or_few_cells() {
    let mut builder = Builder::default();
    builder.mesh(
        "triangle",
        vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]],
        vec![0, 1, 2],
    );
    let graph = cut(&builder, &[]);
    assert_sound(&graph);
    assert!((1..8).contains(&graph.cells.len()), "{}", graph.cells.len());
    assert_eq!(cut(&Builder::default(), &[]).cells.len(), 1);
    let mut flat = Builder::default();
    flat.quad(
        "ground",
        [[0., 0., 0.], [0., 0., 500.], [500., 0., 500.], [500., 0., 0.]],
    );
    let graph = cut(&flat, &[]);
    assert_sound(&graph);
    assert!((20..400).contains(&graph.cells.len()), "{}", graph.cells.len());
}

#[test]
fn far_from_zero_cells_are_the_same() {
    let plan = "##########
                #a..#...b#
                #...#....#
                #........#
                ##########";
    let (builder, letters) = floor_plan(plan);
    let near = cut(&builder, &[letters[0].2]);
    let (mut builder, _) = floor_plan(plan);
    let by = glam::DVec3::new(1e7, -2e6, 3e7);
    builder.shift(by);
    let far = cut(&builder, &[(glam::DVec3::from(letters[0].2) + by).to_array()]);
    assert_eq!(near.cells.len(), far.cells.len());
    for (near, far) in near.cells.iter().zip(&far.cells) {
        assert_eq!(near.adjacent, far.adjacent);
        for axis in 0..3 {
            assert!((near.bounds.min[axis] + by[axis] - far.bounds.min[axis]).abs() < 1e-3);
        }
    }
}

#[test]
fn a_dolls_house_has_the_rooms_of_a_house() {
    const SCALE: f64 = 0.1;
    let plan = "##########
                #a.#.....#
                #..#.....#
                #......b.#
                #..#.....#
                ##########";
    let (house, letters) = floor_plan(plan);
    let (mut dolls_house, _) = floor_plan(plan);
    let models = dolls_house.scene.models.iter_mut();
    let positions = models
        .flat_map(|model| &mut model.primitives)
        .flat_map(|p| &mut p.positions);
    positions.flatten().for_each(|at| *at *= SCALE as f32);
    let small = letters[0].2.map(|at| SCALE * at);
    let cells = cut(&house, &[letters[0].2]).cells;
    let small_cells = cut(&dolls_house, &[small]).cells;
    assert!(cells.len() >= 3, "two rooms and a doorway: {cells:#?}");
    assert_eq!(cells.len(), small_cells.len());
    for (cell, small) in cells.iter().zip(&small_cells) {
        assert_eq!(cell.adjacent, small.adjacent);
        let corners = cell.bounds.min.iter().chain(&cell.bounds.max);
        let small_corners = small.bounds.min.iter().chain(&small.bounds.max);
        assert!(
            corners
                .zip(small_corners)
                .all(|(at, small)| (SCALE * at - small).abs() < 1e-4)
        );
    }
    let [a, b] = [0, 1].map(|i| letters[i].2.map(|at| SCALE * at));
    let refined = refined(&dolls_house, a);
    assert_ne!(refined.cell_at(a).expect("free"), refined.cell_at(b).expect("free"));
}

#[test]
fn a_viewpoint_inside_a_thing_counts_as_beside_it() {
    let (mut builder, _) = floor_plan(
        "##########
         #........#
         #........#
         #........#
         ##########",
    );
    builder.ball("ball", [5.0, 1.0, 2.0], 0.3, 8);
    let graph = cut(&builder, &[[5.0, 1.0, 2.0]]);
    assert_eq!(graph.cells.len(), 1);
    assert!(graph.cells[0].bounds.max[0] > 8.9, "{graph:?}");
}

#[test]
fn a_viewpoint_inside_a_wall_counts_as_beside_it_however_long_the_wall_is() {
    let mut builder = Builder::default();
    builder.block("floor", [0., -0.3, 0.], [8., 0., 6.]);
    builder.block("ceiling", [0., 3., 0.], [8., 3.3, 6.]);
    builder.block("west", [-0.4, 0., 0.], [0., 3., 6.]);
    builder.block("east", [8., 0., 0.], [8.4, 3., 6.]);
    builder.block("south", [0., 0., -0.4], [8., 3., 0.]);
    builder.block("north", [0., 0., 6.], [8., 3., 6.4]);
    let graph = cut(&builder, &[[8.2, 1.5, 3.0]]);
    let beside = [[4.0, 1.5, 3.0], [9.5, 1.5, 3.0]];
    assert!(
        beside.iter().any(|place| graph.cell_at(*place).is_some()),
        "{}",
        graph.reason
    );
}

#[test]
fn a_museum_has_a_cell_for_each_room_and_doorway() {
    let graph = cut(&museum([3, 3], 6), &[[4.0, 1.6, 4.0]]);
    assert_sound(&graph);
    let rooms: std::collections::BTreeSet<_> = (0..9)
        .map(|i| graph.cell_at([4.0 + 8.0 * f64::from(i % 3), 3.0, 4.0 + 8.0 * f64::from(i / 3)]))
        .collect();
    assert_eq!(rooms.len(), 9);
    assert!(!rooms.contains(&None));
    assert!(graph.cells.len() < 60, "{}", graph.cells.len());
    assert!(
        steps_from(&graph, 0).iter().all(Option::is_some),
        "everything is connected"
    );
}

#[test]
fn the_number_of_cells_is_capped() {
    let settings = CellSettings {
        max_cells: 5,
        ..CellSettings::default()
    };
    let world = World::new(&museum([3, 3], 1).scene).unwrap();
    assert_eq!(build(&world, &[], &settings, &Silent).unwrap().cells.len(), 5);
}

fn refined(builder: &Builder, viewpoint: [f64; 3]) -> CellGraph {
    let world = World::new(&builder.scene).unwrap();
    let scenery = crate::visibility::conservative::Scenery::of(&world);
    let estimate = |graph: &CellGraph| crate::visibility::glance(&world, &scenery, graph, &Silent);
    build_refined(&world, &[viewpoint], &CellSettings::default(), &estimate, &Silent)
        .unwrap()
        .graph(&world)
}

/// From over the wall both yards are seen, from where people stand one.
#[test]
fn a_yard_ends_above_peoples_heads() {
    let mut builder = Builder::default();
    builder.block("ground", [-20., -1., -20.], [20., 0., 20.]);
    builder.block("wall", [-20., 0., -0.2], [20., 4., 0.2]);
    builder.block("mast", [-20., 0., -20.], [-19., 16., -19.]);
    for thing in 0..40 {
        let (x, z) = (thing % 8 * 4 - 14, thing / 8 * 8 - 16);
        builder.block("thing", [x as f32, 0., z as f32], [x as f32 + 0.5, 0.5, z as f32 + 0.5]);
    }
    let graph = refined(&builder, [3.0, 1.6, 5.0]);
    assert_sound(&graph);
    let holder = |point: [f64; 3]| &graph.cells[graph.cell_at(point).expect("free") as usize].bounds;
    let standing = holder([3.0, 1.6, 5.0]);
    assert!(
        (2.5..5.0).contains(&standing.max[1]) && standing.min[2] > 0.0,
        "{standing:?}"
    );
    assert!(holder([3.0, 10.0, 5.0]).min[1] >= standing.max[1]);
}

#[test]
fn a_high_hall_is_not_cut_above_peoples_heads_for_nothing() {
    let mut builder = Builder::default();
    builder.block("floor", [0., -0.3, 0.], [12., 0., 12.]);
    builder.block("ceiling", [0., 9., 0.], [12., 9.3, 12.]);
    builder.block("west", [-0.4, 0., 0.], [0., 9., 12.]);
    builder.block("east", [12., 0., 0.], [12.4, 9., 12.]);
    builder.block("south", [0., 0., -0.4], [12., 9., 0.]);
    builder.block("north", [0., 0., 12.], [12., 9., 12.4]);
    assert_eq!(refined(&builder, [6.0, 1.6, 6.0]).cells.len(), 1);
}

/// The share of places in the streets of a city that lie in cells without houses, and its cells.
fn clear_streets(city: &crate::city::City, scene: &crate::source::SourceScene) -> (f64, CellGraph) {
    let world = World::new(scene).unwrap();
    let scenery = crate::visibility::conservative::Scenery::of(&world);
    let estimate = |graph: &CellGraph| crate::visibility::glance(&world, &scenery, graph, &Silent);
    let viewpoint = [8.5, 1.65, 8.5];
    let graph = build_refined(&world, &[viewpoint], &CellSettings::default(), &estimate, &Silent)
        .unwrap()
        .graph(&world);
    assert_sound(&graph);
    let houses = city.buildings();
    let (mut clear, mut all) = (0, 0);
    for street in 0..city.blocks[1] {
        for along in 0..30 {
            let (across, along) = (8.5 + 17.0 * street as f64, 2.0 * f64::from(along));
            let mut eyes = vec![[across, 1.65, along.min(51.0)]];
            if street < 3 {
                eyes.push([along, 1.65, across]);
            }
            for eye in eyes {
                let cell = &graph.cells[graph.cell_at(eye).expect("a street is free") as usize].bounds;
                let in_cell = |[min, max]: [glam::DVec3; 2]| {
                    (0..3).all(|a| min[a] + 0.3 < cell.max[a] && cell.min[a] + 0.3 < max[a])
                };
                all += 1;
                clear += usize::from(!houses.iter().flatten().any(|house| in_cell(*house)));
            }
        }
    }
    (clear as f64 / f64::from(all), graph)
}

const SMALL_CITY: crate::city::City = crate::city::City {
    blocks: [5, 4],
    ..crate::city::City::DENSE
};

/// In a city streets are cells: whoever stands in the middle of one is in a cell without houses, longer than wide.
#[test]
fn streets_of_a_city_become_cells() {
    let (clear, graph) = clear_streets(&SMALL_CITY, &SMALL_CITY.scene());
    assert!(
        clear >= 0.9,
        "{clear} of all places in streets are in cells without houses"
    );
    assert!(graph.cells.len() <= 128);
}

/// However wide the fields around it.
#[test]
fn a_town_in_wide_fields_keeps_its_streets() {
    let mut fields = Builder::default();
    fields.block("fields", [-900., -1., -900.], [1000., 0., 1000.]);
    let mut scene = SMALL_CITY.scene();
    let first = scene.models.len();
    scene.models.append(&mut fields.scene.models);
    scene.objects.extend(
        fields
            .scene
            .objects
            .into_iter()
            .map(|object| crate::source::SourceObject {
                model: first + object.model,
                ..object
            }),
    );
    let (clear, graph) = clear_streets(&SMALL_CITY, &scene);
    assert!(
        clear >= 0.75,
        "{clear} of all places in streets, {} cells",
        graph.cells.len()
    );
}
