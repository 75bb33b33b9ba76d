use std::collections::BTreeSet;

use super::{
    oracle::first_hiding_face,
    random::Random,
    targets::{Lookout, facing},
    *,
};
use crate::{
    cells::{
        self, CellSettings,
        plan::{Builder, floor_plan, museum},
    },
    memory::Forgetful,
    progress::{Counted, Silent, Stage},
    source::Topology,
};

fn quick() -> SampledSettings {
    SampledSettings {
        rays_per_cell: 40_000,
        ..SampledSettings::default()
    }
}

pub(super) fn bake(
    builder: &Builder,
    viewpoint: [f64; 3],
    settings: &SampledSettings,
) -> (World, CellGraph, Vec<CellVisibility>) {
    let world = World::new(&builder.scene).unwrap();
    let graph = cells::build(&world, &[viewpoint], &CellSettings::default(), &Silent).unwrap();
    let visible = sampled(&world, &graph, settings, &Silent).unwrap();
    (world, graph, visible)
}

/// What rays see from each cell.
pub(super) fn sampled(
    world: &World,
    graph: &CellGraph,
    settings: &SampledSettings,
    progress: &dyn Progress,
) -> Result<Vec<CellVisibility>, Cancelled> {
    let settings = VisibilitySettings {
        method: Method::Sampled,
        sampled: Some(*settings),
    };
    let hiders = Hiders::of(world, Vec::new());
    compute(&Views::of(world, graph, &hiders), &settings, &Forgetful, progress).map(|visibility| visibility.cells)
}

pub(super) fn set_of(visible: &CellVisibility) -> BTreeSet<u32> {
    visible.objects.iter().map(|seen| seen.object).collect()
}

/// Checks which letters of a plan see which: one clause for each letter.
#[track_caller]
fn check(plan: &str, expected: &str) {
    let (builder, letters) = floor_plan(plan);
    let (_, graph, visible) = bake(&builder, letters[0].2, &quick());
    let found: Vec<_> = letters
        .iter()
        .map(|(letter, _, at)| {
            let set = set_of(&visible[graph.cell_at(*at).expect("free space") as usize]);
            let seen: String = letters
                .iter()
                .filter(|(_, o, _)| set.contains(o))
                .map(|(l, ..)| *l)
                .collect();
            format!("{letter} sees {seen}")
        })
        .collect();
    assert_eq!(found.join("; "), expected);
}

#[test]
fn a_wall_hides_what_stands_behind_it() {
    check(
        "############
         #....#.....#
         #.a..#..b..#
         #....#.....#
         #....#.....#
         ####.#.#####
         #..........#
         #....c.....#
         ############",
        "a sees ac; b sees bc; c sees abc",
    );
}

#[test]
fn what_only_a_wall_hides_is_not_hidden_by_bodies() {
    let mut builder = Builder::default();
    let sheet = builder.quad(
        "sheet",
        [[0., -50., -50.], [0., 50., -50.], [0., 50., 50.], [0., -50., 50.]],
    );
    builder.paint(sheet, false, true);
    let thing = builder.block("thing", [5.0, 0.0, -1.0], [6.0, 1.0, 1.0]);
    let world = World::new(&builder.scene).unwrap();
    let hiders = Hiders::of(&world, Vec::new());
    let graph = CellGraph {
        cells: vec![cells::ViewCell::of_box(belvedere_scene::Bounds {
            min: [-6.0, 0.2, -1.0],
            max: [-5.0, 1.5, 0.0],
        })],
        voxel_m: 0.25,
        reason: String::new(),
    };
    let holds_thing = |method| {
        let settings = VisibilitySettings {
            method,
            sampled: Some(quick()),
        };
        let found = compute(&Views::of(&world, &graph, &hiders), &settings, &Forgetful, &Silent).unwrap();
        set_of(&found.cells[0]).contains(&thing)
    };
    assert_eq!(
        [Method::Occluders, Method::Portals, Method::Conservative].map(holds_thing),
        [true, false, false]
    );
}

#[test]
fn one_sees_through_a_row_of_doors() {
    check(
        "##################
         #....#.....#.....#
         #....#.....#.....#
         #.a.....b.....c..#
         #....#.....#.....#
         #....#.....#...d.#
         ##################",
        "a sees abc; b sees abcd; c sees abcd; d sees abcd",
    );
}

#[test]
fn around_two_corners_nothing_is_seen() {
    check(
        "###############
         #a.#..........#
         #..#..........#
         #..#..........#
         #..#..####..###
         #.....#..#..#.#
         ##########..#.#
         #b............#
         ###############",
        "a sees a; b sees b",
    );
}

/// Every sight line that a plain loop over all triangles finds from random eyes must be in the set.
fn assert_nothing_is_missing(world: &World, graph: &CellGraph, visible: &[CellVisibility], lines: usize) {
    let mut random = Random::stream(99, 1);
    for (cell, lookout) in Lookout::all(world, graph).iter().enumerate() {
        let set = set_of(&visible[cell]);
        for i in 0..lines {
            let eye = if i % 2 == 0 {
                lookout.uniform(&mut random)
            } else {
                lookout.surface(&mut random)
            };
            let object = random.below(world.object_bounds().len()) as u32;
            if let Some(target) = facing(world, object, eye, &mut random)
                && let Some(first) = first_hiding_face(world, eye.as_dvec3(), target.as_dvec3())
            {
                assert!(
                    set.contains(&first),
                    "cell {cell} at {eye}: object {first} is seen towards {target}"
                );
            }
        }
    }
}

#[test]
fn an_unblocked_sight_line_from_a_cell_implies_membership() {
    for plan in [
        "################
         #a....#....#..b#
         #.....#....#...#
         #..............#
         #.....#....#...#
         ###.#######.####
         #.....#....#...#
         #..c..#..d.....#
         #.....#....#..e#
         ################",
        "#########
         #a.#..#b#
         #..#..#.#
         #.......#
         ##.###.##
         #..#c#..#
         #d.....e#
         #########",
    ] {
        let (mut builder, letters) = floor_plan(plan);
        builder.ball("lamp", [3.5, 2.6, 3.5], 0.1, 6);
        let (world, graph, visible) = bake(&builder, letters[0].2, &quick());
        assert_nothing_is_missing(&world, &graph, &visible, 3_000);
    }
}

#[test]
fn the_same_sets_come_from_one_and_two_threads() {
    let builder = museum([2, 1], 5);
    let world = World::new(&builder.scene).unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let graph = cells::build(&world, &[[4.0, 1.6, 4.0]], &CellSettings::default(), &Silent).unwrap();
            let visible = sampled(&world, &graph, &quick(), &Silent).unwrap();
            (graph, visible)
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn glass_and_culled_backs_hide_nothing() {
    let room = "###########
                #....#....#
                #.a..#..b.#
                #....#....#
                ###########";
    let pane = |see_through: bool, double_sided: bool, flipped: bool| {
        let (mut builder, letters) = floor_plan(room);
        // The wall between the rooms gives way to one face, which is seen from its front by `a`, or by `b`.
        for object in &mut builder.scene.objects {
            let model = &mut builder.scene.models[object.model];
            let positions = &model.primitives[0].positions;
            if object.source_node == "wall" && positions.iter().all(|p| (5.0..=6.0).contains(&p[0])) {
                model.primitives[0].indices.clear();
            }
        }
        let mut corners = [[5.5, 0., 1.], [5.5, 0., 4.], [5.5, 3., 4.], [5.5, 3., 1.]];
        if flipped {
            corners.reverse();
        }
        let quad = builder.quad("pane", corners);
        builder.paint(quad, see_through, double_sided);
        let world = World::new(&builder.scene).unwrap();
        let eyes = [letters[0].2, letters[1].2];
        let graph = cells::build(&world, &eyes, &CellSettings::default(), &Silent).unwrap();
        let visible = sampled(&world, &graph, &quick(), &Silent).unwrap();
        [0, 1].map(|i| {
            let set = set_of(&visible[graph.cell_at(eyes[i]).unwrap() as usize]);
            (set.contains(&letters[1 - i].1), set.contains(&quad))
        })
    };
    assert_eq!(pane(true, true, false), [(true, true); 2], "glass");
    assert_eq!(pane(false, true, false), [(false, true); 2], "a wall");
    let [a, b] = pane(false, false, false);
    assert_ne!(a.0, b.0, "one way");
    let [a_flipped, b_flipped] = pane(false, false, true);
    assert_eq!((a.0, b.0), (b_flipped.0, a_flipped.0));
    assert!(a.1 && b.1, "a culled face counts as seen");
}

#[test]
fn mirroring_an_object_keeps_its_front_outside() {
    let (mut builder, letters) = floor_plan(
        "#######
         #a...b#
         #######",
    );
    for object in &mut builder.scene.objects {
        object.world_from_object = glam::DMat4::from_scale(glam::DVec3::new(-1.0, 1.0, 1.0)) * object.world_from_object;
    }
    let [x, y, z] = letters[0].2;
    let (world, graph, visible) = bake(&builder, [-x, y, z], &quick());
    assert_eq!(set_of(&visible[0]).len(), world.object_bounds().len());
    assert_nothing_is_missing(&world, &graph, &visible, 500);
}

#[test]
fn points_and_lines_are_found_and_hidden() {
    let (mut builder, letters) = floor_plan(
        "###########
         #....#....#
         #.a..#..b.#
         #....#....#
         ###########",
    );
    let dots = builder.shape("dots", Topology::Points, vec![[2., 1., 2.], [2.5, 1., 2.]], vec![0, 1]);
    let wire = builder.shape("wire", Topology::Lines, vec![[7., 1., 2.], [8., 1., 2.]], vec![0, 1]);
    let (_, graph, visible) = bake(&builder, letters[0].2, &quick());
    let set = set_of(&visible[graph.cell_at(letters[0].2).unwrap() as usize]);
    assert!(set.contains(&dots) && !set.contains(&wire));
}

#[test]
fn empty_and_tiny_scenes_have_answers() {
    let (_, graph, visible) = bake(&Builder::default(), [0.0; 3], &quick());
    assert_eq!((graph.cells.len(), visible[0].objects.len()), (1, 0));
    let mut builder = Builder::default();
    builder.mesh(
        "triangle",
        vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]],
        vec![0, 1, 2],
    );
    let (_, _, visible) = bake(&builder, [0.2, 0.2, 1.0], &quick());
    assert!(visible.iter().all(|v| v.objects.len() == 1));
}

#[test]
fn measures_are_what_they_say() {
    let (builder, letters) = floor_plan(
        "########
         #a.....#
         #......#
         ########",
    );
    let (_, _, visible) = bake(&builder, letters[0].2, &quick());
    let total: f32 = visible[0].objects.iter().map(|o| o.solid_angle).sum();
    assert!(
        (total - 4.0 * std::f32::consts::PI).abs() < 0.2,
        "a closed room fills the view: {total} sr"
    );
    assert!(
        visible[0]
            .objects
            .iter()
            .all(|o| o.fraction > 0.0 && o.fraction <= 1.0 && o.solid_angle > 0.0)
    );
    assert!(visible[0].objects.is_sorted_by(|a, b| a.solid_angle >= b.solid_angle));
    let floor = visible[0].objects.iter().find(|o| o.object == 0).unwrap();
    // Three eighths of it are not under walls; 32 rays tell that to within a sixth, twice their deviation.
    assert!((0.2..0.55).contains(&floor.fraction), "{floor:?}");
    assert!(visible[0].miss_bound < 1e-3);
}

#[test]
fn cells_see_each_other_or_do_not() {
    let (builder, letters) = floor_plan(
        "###############
         #a.#..........#
         #..#..........#
         #..#..........#
         #..#..####..###
         #.....#..#..#.#
         ##########..#.#
         #b............#
         ###############",
    );
    let (_, graph, visible) = bake(&builder, letters[0].2, &quick());
    let [a, b] = [0, 1].map(|i| graph.cell_at(letters[i].2).unwrap());
    assert!(!visible[a as usize].cells.contains(&b));
    for (cell, v) in visible.iter().enumerate() {
        assert!(v.cells.is_sorted() && !v.cells.contains(&(cell as u32)));
        assert!(
            v.cells
                .iter()
                .all(|other| visible[*other as usize].cells.contains(&(cell as u32)))
        );
        assert!(graph.cells[cell].adjacent.iter().all(|other| v.cells.contains(other)));
    }
}

#[test]
fn whoever_cancels_gets_no_result() {
    struct Impatient;
    impl Progress for Impatient {
        fn start(&self, _: Stage, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (builder, _) = floor_plan("###\n#.#\n###");
    let world = World::new(&builder.scene).unwrap();
    let graph = cells::build(&world, &[], &CellSettings::default(), &Silent).unwrap();
    assert_eq!(
        cells::build(&world, &[], &CellSettings::default(), &Impatient),
        Err(Cancelled)
    );
    assert_eq!(sampled(&world, &graph, &quick(), &Impatient), Err(Cancelled));
}

#[test]
fn the_steps_announced_are_the_steps_made() {
    let world = World::new(&museum([2, 1], 3).scene).unwrap();
    let counted = Counted::default();
    let graph = cells::build(&world, &[], &CellSettings::default(), &counted).unwrap();
    sampled(&world, &graph, &quick(), &counted).unwrap();
    assert_eq!(counted.announced.into_inner(), counted.made.into_inner());
}
