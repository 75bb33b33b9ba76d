//! Is what was found used again just where nothing has changed? On a city in which one building is moved.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Mutex,
};

use belvedere_scene::Bounds;
use glam::{DMat4, DVec3};

use super::{conservative::Scenery, *};
use crate::{
    cells::{self, CellSettings, ViewCell},
    city::City,
    digest::Digest,
    memory::Forgetful,
    progress::Silent,
    source::SourceScene,
};

const CELLS: usize = 60;

#[derive(Default)]
struct Notebook(Mutex<BTreeMap<Digest, String>>);

impl Memory for Notebook {
    fn recall(&self, key: &Digest) -> Option<String> {
        self.0.lock().unwrap().get(key).cloned()
    }

    fn keep(&self, key: &Digest, result: &str) {
        self.0.lock().unwrap().insert(*key, result.to_owned());
    }
}

fn streets(city: &City) -> CellGraph {
    let cells = city.street_cells(CELLS).into_iter().map(|[min, max]| {
        ViewCell::of_box(Bounds {
            min: min.to_array(),
            max: max.to_array(),
        })
    });
    CellGraph {
        cells: cells.collect(),
        voxel_m: 0.25,
        reason: String::new(),
    }
}

fn seen_in(scene: &SourceScene, graph: &CellGraph, memory: &dyn Memory) -> Visibility {
    let world = World::new(scene).unwrap();
    let hiders = Hiders::of(&world, Vec::new());
    let settings = VisibilitySettings {
        method: Method::Occluders,
        sampled: Some(SampledSettings {
            rays_per_cell: 1 << 12,
            ..SampledSettings::default()
        }),
    };
    compute(&Views::of(&world, graph, &hiders), &settings, memory, &Silent).unwrap()
}

#[test]
fn a_bake_that_goes_on_finds_what_one_in_one_go_finds() {
    let city = City {
        blocks: [14, 10],
        ..City::DENSE
    };
    let (scene, graph, notebook) = (city.scene(), streets(&city), Notebook::default());
    let in_one_go = seen_in(&scene, &graph, &notebook);
    assert_eq!(in_one_go.remembered, 0);
    // Killed after some of the cells.
    notebook.0.lock().unwrap().retain(|key, _| key.0[0] < 128);
    let kept = notebook.0.lock().unwrap().len() as u32;
    assert!((10..50).contains(&kept), "{kept}");
    let gone_on = seen_in(&scene, &graph, &notebook);
    assert_eq!(gone_on.remembered, kept);
    assert_eq!(gone_on.cells, in_one_go.cells);
    // What makes no sense any more is found anew.
    notebook
        .0
        .lock()
        .unwrap()
        .values_mut()
        .for_each(|text| text.insert(1, '?'));
    let after_damage = seen_in(&scene, &graph, &notebook);
    assert_eq!((after_damage.remembered, after_damage.cells), (0, in_one_go.cells));
}

#[test]
fn one_building_that_moves_concerns_those_who_may_see_it_and_nobody_else() {
    let (city, graph, notebook) = (City::DENSE, streets(&City::DENSE), Notebook::default());
    let scene = city.scene();
    let before = seen_in(&scene, &graph, &notebook);
    let mut looked_anew = 0;
    const MOVED: [usize; 2] = [100, 1_130];
    for building in MOVED {
        let mut moved = scene.clone();
        let place = &mut moved.objects[building].world_from_object;
        *place = DMat4::from_translation(DVec3::new(0.4, 0.0, -0.3)) * *place;
        let again = seen_in(
            &moved,
            &graph,
            &Notebook(Mutex::new(notebook.0.lock().unwrap().clone())),
        );
        let from_scratch = seen_in(&moved, &graph, &Forgetful);
        assert_eq!(again.cells, from_scratch.cells, "building {building}");
        let may_see = |visibility: &Visibility| -> BTreeSet<usize> {
            let sees = |cell: &usize| {
                visibility.cells[*cell]
                    .objects
                    .iter()
                    .any(|s| s.object as usize == building)
            };
            (0..CELLS).filter(sees).collect()
        };
        let concerned = may_see(&before).union(&may_see(&from_scratch)).count();
        let anew = CELLS - again.remembered as usize;
        assert!(
            anew >= concerned,
            "building {building}: {anew} looked anew, {concerned} may see it"
        );
        looked_anew += anew;
    }
    let share = looked_anew as f64 / (MOVED.len() * CELLS) as f64;
    assert!(share <= 0.05, "{:.1} % of cells looked from anew", 100.0 * share);
}

/// The city with a floor under every building: all of them lie in one plane.
fn with_floors(city: &City) -> SourceScene {
    let mut scene = city.scene();
    for (model, boxes) in scene.models.iter_mut().zip(city.buildings()) {
        let [x, _, z] = (boxes[0][1] - boxes[0][0]).as_vec3().to_array();
        let primitive = &mut model.primitives[0];
        let first = primitive.positions.len() as u32;
        let floor = [[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, 0.0, z], [0.0, 0.0, z]];
        primitive.positions.extend(floor);
        primitive
            .indices
            .extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    scene
}

#[test]
fn a_plane_that_all_buildings_share_concerns_nobody_who_may_not_see_them() {
    let city = City {
        blocks: [22, 18],
        ..City::DENSE
    };
    let graph = streets(&city);
    let [open, closed] = [city.scene(), with_floors(&city)].map(|scene| {
        let notebook = Notebook::default();
        seen_in(&scene, &graph, &notebook);
        let mut moved = scene.clone();
        let place = &mut moved.objects[200].world_from_object;
        *place = DMat4::from_translation(DVec3::new(0.4, 0.0, -0.3)) * *place;
        let again = seen_in(&moved, &graph, &notebook);
        assert_eq!(again.cells, seen_in(&moved, &graph, &Forgetful).cells);
        CELLS - again.remembered as usize
    });
    assert!(open > 0 && open < CELLS / 2, "{open} of {CELLS}");
    assert!(closed <= open + 1, "{closed} with floors, {open} without");
}

/// As [`seen_in`], from cells that the bake cuts.
fn cut_and_seen(scene: &SourceScene, memory: &dyn Memory) -> (CellGraph, Visibility) {
    let world = World::new(scene).unwrap();
    let scenery = Scenery::of(&world);
    let estimate = |graph: &CellGraph| glance(&world, &scenery, graph, &Silent);
    let settings = CellSettings::default();
    let partition = cells::build_refined(&world, &[], &settings, &estimate, &Silent).unwrap();
    let graph = partition.graph(&world);
    let visibility = seen_in(scene, &graph, memory);
    (graph, visibility)
}

#[test]
fn of_cells_that_the_bake_cuts_only_those_are_looked_from_again_that_may_see_what_moved_or_are_cut_otherwise() {
    let city = City {
        blocks: [12, 12],
        closed_after: 4,
        ..City::QUARTERS
    };
    const MOVED: usize = 6 * 12 + 6;
    let (scene, notebook) = (city.scene(), Notebook::default());
    let (before, seen_before) = cut_and_seen(&scene, &notebook);
    let mut moved = scene.clone();
    let place = &mut moved.objects[MOVED].world_from_object;
    *place = DMat4::from_translation(DVec3::new(1.0, 0.0, 0.0)) * *place;
    let (after, again) = cut_and_seen(&moved, &notebook);
    assert_eq!(again.cells, seen_in(&moved, &after, &Forgetful).cells);
    let sees = |seen: &CellVisibility| seen.objects.iter().any(|object| object.object as usize == MOVED);
    let known: BTreeMap<_, _> = before
        .cells
        .iter()
        .map(ViewCell::digest)
        .zip(&seen_before.cells)
        .collect();
    let concerned = after.cells.iter().zip(&again.cells).filter(|(cell, seen)| {
        let before = known.get(&cell.digest());
        sees(seen) || before.is_none_or(|before| sees(before))
    });
    let (concerned, cells) = (concerned.count(), after.cells.len());
    let anew = cells - again.remembered as usize;
    assert!(
        anew >= concerned,
        "{anew} of {cells} looked anew, {concerned} concerned"
    );
    // Though some of all cells are cut otherwise, and each sees into some of these.
    assert!(
        after.cells.iter().any(|cell| !known.contains_key(&cell.digest())),
        "all cells are as they were: the test tests nothing"
    );
    assert!(
        5 * anew <= 4 * cells,
        "{anew} of {cells} looked anew, {concerned} concerned"
    );
}

/// The digest of what decides what one cell of a small city sees, and that of what it sees.
fn looked_at() -> [String; 2] {
    let city = City {
        blocks: [7, 6],
        ..City::DENSE
    };
    let notebook = Notebook::default();
    let mut graph = streets(&city);
    graph.cells.truncate(1);
    seen_in(&city.scene(), &graph, &notebook);
    let notes = notebook.0.into_inner().unwrap();
    let (key, found) = notes.first_key_value().expect("one cell");
    let mut digester = crate::digest::Digester::default();
    digester.text(found);
    [key.to_string(), digester.finish().to_string()]
}

#[test]
fn what_is_found_never_changes_under_the_same_key() {
    const KEY: &str = "289167430b93637c5add5e3324364ed3a6c9848da169ff9b5f172d08c8c15cdf";
    const FOUND: &str = "4a1592f9cff3903b98ec93d22f9ff33a7020a359e80878bfe3c19df1eb7e4daa";
    let [key, found] = looked_at();
    assert!(
        key != KEY || found == FOUND,
        "the same surroundings give another answer, {found}: raise VERSION in look.rs, so that no bake takes the old one"
    );
    assert_eq!([&*key, &*found], [KEY, FOUND], "both have changed: write them here");
}
