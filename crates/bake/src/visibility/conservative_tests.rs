//! Are conservative sets right, and how tight are they? On small cities, where rays can look everywhere.

use std::collections::BTreeSet;

use glam::Vec3;

use super::{
    Method,
    conservative::{ConservativeSettings, Observer, Scenery},
    prover::Proofs,
    random::Random,
    targets,
};
use crate::{city::City, occluders::Region, world::World};

const ONE_BODY: ConservativeSettings = ConservativeSettings {
    proofs: Proofs {
        bodies: true,
        walls: false,
    },
    fusion: false,
    halvings: 0,
    target_halvings: 0,
    steps: u32::MAX,
};
const FUSED: ConservativeSettings = ConservativeSettings {
    fusion: true,
    ..ONE_BODY
};
const WALLS: ConservativeSettings = ConservativeSettings {
    proofs: Proofs {
        bodies: false,
        walls: true,
    },
    ..ONE_BODY
};
const CELLS: usize = 12;

/// A city with cells in its streets, and what each cell surely sees.
struct Town {
    world: World,
    scenery: Scenery,
    cells: Vec<Region>,
    seen: Vec<Vec<u32>>,
}

impl Town {
    fn new(city: City) -> Self {
        Self::with_cells_grown(city, 0.0)
    }

    /// With cells that reach so much further to all sides on their floor, into houses too.
    fn with_cells_grown(city: City, by_m: f32) -> Self {
        let world = World::new(&city.scene()).unwrap();
        let scenery = Scenery::of(&world);
        let relative = |point: glam::DVec3| world.relative(point.to_array());
        let grown = Vec3::new(by_m, 0.0, by_m);
        let cells: Vec<_> = city
            .street_cells(CELLS)
            .into_iter()
            .map(|[min, max]| Region::of_box(relative(min) - grown, relative(max) + grown))
            .collect();
        let seen = cells
            .iter()
            .enumerate()
            .map(|(i, cell)| look(&world, cell, &mut Random::stream(5, i as u64)))
            .collect();
        Self {
            world,
            scenery,
            cells,
            seen,
        }
    }

    fn not_hidden(&self, settings: ConservativeSettings) -> Vec<Vec<u32>> {
        let mut observer = Observer::new(&self.scenery, settings);
        self.cells.iter().map(|cell| observer.visible(cell, &[])).collect()
    }
}

/// Objects that random rays see, and rays to points of each object from corners, edges and faces of the cell.
fn look(world: &World, cell: &Region, random: &mut Random) -> Vec<u32> {
    let mut seen = BTreeSet::new();
    let mut passed = Vec::new();
    let size = cell.max - cell.min;
    for _ in 0..60_000 {
        let eye = cell.min + random.cube() * size;
        seen.extend(
            world
                .cast(eye, random.direction(), f32::MAX, &mut passed)
                .map(|hit| hit.object),
        );
    }
    for object in 0..world.object_bounds().len() as u32 {
        for _ in 0..400 {
            let snap = |x: f32, snaps: bool| if snaps { x.round() } else { x };
            let at = random.cube().to_array().map(|x| snap(x, random.unit() < 0.5));
            let eye = cell.min + (Vec3::from(at) * 0.999_8 + 0.000_1) * size;
            let target = targets::on_object(world, object, random).unwrap();
            seen.extend(
                world
                    .cast(eye, target - eye, f32::MAX, &mut passed)
                    .map(|hit| hit.object),
            );
        }
    }
    seen.into_iter().collect()
}

const BLOCKS: [usize; 2] = [12, 9];

fn towns() -> [Town; 2] {
    let blocks = BLOCKS;
    [City::DENSE, City::SPARSE].map(|city| Town::new(City { blocks, ..city }))
}

#[test]
fn whatever_rays_see_is_in_every_conservative_set() {
    let blocks = BLOCKS;
    // Eyes inside a house look out through the backs of its walls.
    let reaching_into_houses = Town::with_cells_grown(City { blocks, ..City::DENSE }, 4.0);
    let indoors = reaching_into_houses.cells.iter().filter(|cell| {
        let bodies = &reaching_into_houses.scenery.blocker.occluders.bodies;
        bodies.iter().any(|body| body.may_hold(cell))
    });
    assert!(indoors.count() > 0);
    for town in towns().into_iter().chain([reaching_into_houses]) {
        let all = Method::Conservative.proofs();
        for settings in [ONE_BODY, FUSED, WALLS, all] {
            for ((sets, seen), cell) in town.not_hidden(settings).iter().zip(&town.seen).zip(&town.cells) {
                let missing: Vec<_> = seen.iter().filter(|o| sets.binary_search(o).is_err()).collect();
                assert!(missing.is_empty(), "{missing:?} from {:?} with {settings:?}", cell.min);
            }
        }
    }
}

#[test]
fn more_proofs_leave_less_and_all_of_them_little_more_than_rays_see() {
    let count = |sets: &[Vec<u32>]| sets.iter().map(Vec::len).sum::<usize>();
    for (town, worst) in towns().iter().zip([1.2, 1.3]) {
        let [one, fused, all] = [ONE_BODY, FUSED, Method::Conservative.proofs()].map(|s| count(&town.not_hidden(s)));
        assert!(one > fused && fused > all, "{one} {fused} {all}");
        let ratio = all as f64 / count(&town.seen) as f64;
        assert!(ratio <= worst, "{ratio} times what rays see");
    }
}

#[test]
fn what_an_observer_knows_to_be_visible_changes_no_set() {
    let [town, _] = towns();
    let settings = Method::Conservative.proofs();
    let unaided = town.not_hidden(settings);
    let mut observer = Observer::new(&town.scenery, settings);
    for ((cell, seen), unaided) in town.cells.iter().zip(&town.seen).zip(&unaided) {
        let aided = observer.visible(cell, seen);
        assert!(seen.iter().all(|o| aided.binary_search(o).is_ok()));
        let extra: Vec<_> = aided.iter().filter(|o| unaided.binary_search(o).is_err()).collect();
        assert!(extra.is_empty(), "{extra:?}");
    }
}

#[test]
fn a_witness_is_named_for_what_is_hidden_and_none_for_what_is_seen() {
    let [town, _] = towns();
    let mut observer = Observer::new(&town.scenery, FUSED);
    let mut named = 0;
    for (cell, seen) in town.cells.iter().zip(&town.seen) {
        let sets = observer.visible(cell, &[]);
        for object in 0..town.world.object_bounds().len() as u32 {
            let witness = observer.witness(cell, object);
            assert!(witness.is_none() || seen.binary_search(&object).is_err());
            assert_eq!(
                witness.is_none(),
                sets.binary_search(&object).is_ok(),
                "object {object}"
            );
            named += usize::from(witness.is_some());
        }
    }
    assert!(named > 0);
}
