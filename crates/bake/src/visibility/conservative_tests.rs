//! Are conservative sets right, and how tight are they? On small cities, where rays can look everywhere.

use std::collections::BTreeSet;

use glam::{DMat4, DVec3, Vec3};

use super::{
    Method,
    conservative::{ConservativeSettings, Observer, Scenery},
    narrow::{Blind, Faces},
    prover::Proofs,
    random::Random,
    targets,
};
use crate::{
    city::City,
    occluders::Region,
    source::{Primitive, SourceScene},
    world::World,
};

const ONE_BODY: ConservativeSettings = ConservativeSettings {
    proofs: Proofs {
        bodies: true,
        walls: false,
    },
    fusion: false,
    halvings: 0,
    cuts: 0,
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
        Self::built(city, &city.scene(), by_m)
    }

    /// With other houses on the same lots.
    fn built(city: City, scene: &SourceScene, by_m: f32) -> Self {
        let world = World::new(scene).unwrap();
        let scenery = Scenery::of(&world);
        let relative = |point: glam::DVec3| world.relative(point.to_array());
        let grown = Vec3::new(by_m, 0.0, by_m);
        let cells: Vec<_> = city
            .street_cells(CELLS)
            .into_iter()
            .map(|[min, max]| Region::of_box(relative(min) - grown, relative(max) + grown))
            .collect();
        let mut town = Self {
            world,
            scenery,
            cells,
            seen: Vec::new(),
        };
        town.look();
        town
    }

    /// Puts cells into houses, where these have an inside that no body fills.
    fn stand_in_what_bodies_leave(&mut self) {
        let bodies = &self.scenery.blocker.occluders.bodies;
        let places = bodies.iter().filter(|body| !body.hides).map(|body| {
            let (middle, half) = (0.5 * (body.min + body.max), 0.1 * (body.max - body.min));
            Region::of_box(middle - half, middle + half)
        });
        let clear = places.filter(|place| {
            let mut held = bodies.iter().filter(|body| body.may_hold(place, 0.0));
            held.all(|body| !body.hides)
        });
        self.cells = clear.step_by(40).take(CELLS).collect();
        assert_eq!(self.cells.len(), CELLS);
        self.look();
    }

    /// Sees what each cell surely sees.
    fn look(&mut self) {
        let cells = self.cells.iter().enumerate();
        self.seen = cells
            .map(|(i, cell)| look(&self.world, cell, &mut Random::stream(5, i as u64)))
            .collect();
    }

    fn not_hidden(&self, settings: ConservativeSettings) -> Vec<Vec<u32>> {
        let mut observer = Observer::new(&self.scenery, settings);
        let mut faces = Faces(&self.world);
        let cells = self.cells.iter();
        cells
            .map(|cell| observer.visible_or_found(cell, &[], &mut faces))
            .collect()
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
        bodies.iter().any(|body| body.may_hold(cell, 0.0))
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

/// A prism, closed but for its bottom: over a ground plan, or, `lying`, over the outline of its gable.
fn prism(outline: &[[f32; 2]], caps: &[[u32; 3]], length_m: f32, lying: bool) -> Primitive {
    let corners = outline.len() as u32;
    let ends = [0.0, length_m].into_iter();
    let positions: Vec<[f32; 3]> = ends
        .flat_map(|along| {
            outline
                .iter()
                .map(move |[a, b]| if lying { [*a, *b, along] } else { [*a, along, *b] })
        })
        .collect();
    let mut indices = Vec::new();
    for i in 0..corners {
        let (next, up) = ((i + 1) % corners, corners);
        // The first side of what lies is its bottom.
        if !(lying && i == 0) {
            indices.extend([i, next, next + up, i, next + up, i + up]);
        }
    }
    for [a, b, c] in caps {
        let [near, far] = [[*a, *b, *c], [*a + corners, *b + corners, *c + corners]];
        if lying {
            indices.extend(near);
        }
        let [a, b, c] = far;
        indices.extend(if lying { [c, b, a] } else { [a, b, c] });
    }
    Primitive {
        positions,
        indices,
        ..Primitive::default()
    }
}

/// What a house looks like.
#[derive(Clone, Copy)]
enum Form {
    L,
    Courtyard,
    Gable,
    /// A block with a pyramid on it.
    Hip,
}

/// A city whose houses have these forms in turn, and stand askew.
fn askew(city: City, forms: &[Form]) -> SourceScene {
    turned(city, forms, 0.37)
}

/// A city whose houses have these forms in turn, each turned by so much more than the one before.
fn turned(city: City, forms: &[Form], turn: f64) -> SourceScene {
    let mut scene = city.scene();
    for (index, (model, object)) in scene.models.iter_mut().zip(&mut scene.objects).enumerate() {
        model.primitives = vec![match forms[index % forms.len()] {
            Form::L => {
                let plan = [
                    [0.0, 0.0],
                    [0.0, 10.0],
                    [3.0, 10.0],
                    [3.0, 3.0],
                    [10.0, 3.0],
                    [10.0, 0.0],
                ];
                prism(&plan, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 12.0, false)
            }
            Form::Courtyard => {
                let plan = [
                    [0.0, 0.0],
                    [0.0, 10.0],
                    [4.0, 10.0],
                    [4.0, 4.0],
                    [6.0, 4.0],
                    [6.0, 10.0],
                    [10.0, 10.0],
                    [10.0, 0.0],
                ];
                let caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 7], [7, 4, 5], [7, 5, 6]];
                prism(&plan, &caps, 16.0, false)
            }
            Form::Gable => {
                let gable = [[0.0, 0.0], [10.0, 0.0], [10.0, 7.0], [5.0, 12.0], [0.0, 7.0]];
                prism(&gable, &[[0, 4, 3], [0, 3, 2], [0, 2, 1]], 11.0, true)
            }
            Form::Hip => {
                let plan = [[0.0, 0.0], [0.0, 10.0], [10.0, 10.0], [10.0, 0.0]];
                let mut house = prism(&plan, &[[0, 1, 2], [0, 2, 3]], 8.0, false);
                let first = house.positions.len() as u32;
                house.positions.extend(plan.map(|[x, z]| [x, 8.0, z]));
                house.positions.push([5.0, 12.0, 5.0]);
                let roof = [0, 2, 1, 0, 3, 2, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4];
                house.indices.extend(roof.map(|corner| first + corner));
                house
            }
        }];
        let turn = DMat4::from_rotation_y(turn * index as f64);
        let middle = DMat4::from_translation(DVec3::new(-5.0, 0.0, -5.0));
        object.world_from_object *= DMat4::from_translation(DVec3::new(4.0, 0.0, 4.0)) * turn * middle;
    }
    scene
}

#[test]
fn whatever_rays_see_among_houses_of_many_forms_is_in_every_conservative_set() {
    let blocks = [9, 7];
    let city = City { blocks, ..City::DENSE };
    let scene = askew(city, &[Form::L, Form::Courtyard, Form::Gable]);
    let mut towns = [0.0, 3.0, 0.0].map(|by_m| Town::built(city, &scene, by_m));
    towns[2].stand_in_what_bodies_leave();
    let mut hidden = 0;
    for town in &towns {
        for settings in [ONE_BODY, FUSED, Method::Conservative.proofs()] {
            for ((set, seen), cell) in town.not_hidden(settings).iter().zip(&town.seen).zip(&town.cells) {
                let missing: Vec<_> = seen.iter().filter(|o| set.binary_search(o).is_err()).collect();
                assert!(missing.is_empty(), "{missing:?} from {:?} with {settings:?}", cell.min);
                hidden += town.scenery.targets.len() - set.len();
            }
        }
    }
    assert!(hidden > 0);
}

#[test]
fn whatever_rays_see_among_houses_with_hip_roofs_is_in_every_conservative_set() {
    let blocks = [9, 7];
    let city = City { blocks, ..City::SPARSE };
    let scene = turned(city, &[Form::Hip], 0.0);
    let mut town = Town::built(city, &scene, 0.0);
    let bodies = &town.scenery.blocker.occluders.bodies;
    let on_a_block = bodies
        .iter()
        .filter(|body| !body.planes.is_empty() && body.stands_m < body.min.y - 7.0);
    assert!(on_a_block.count() > 20, "roofs stand where their houses do");
    // Wider than any house, so that only one body alone hides, or several parts of these eyes.
    for cell in &mut town.cells {
        let middle = cell.center();
        let half = Vec3::new(7.0, 0.5 * (cell.max.y - cell.min.y), 7.0);
        *cell = Region::of_box(middle - half, middle + half);
    }
    town.look();
    let mut hidden = 0;
    for settings in [ONE_BODY, FUSED, Method::Occluders.proofs()] {
        for ((set, seen), cell) in town.not_hidden(settings).iter().zip(&town.seen).zip(&town.cells) {
            let missing: Vec<_> = seen.iter().filter(|o| set.binary_search(o).is_err()).collect();
            assert!(missing.is_empty(), "{missing:?} from {:?} with {settings:?}", cell.min);
            hidden += town.scenery.targets.len() - set.len();
        }
    }
    assert!(hidden > 0);
}

#[test]
fn bodies_that_stand_askew_hide_together_too() {
    let city = City {
        blocks: BLOCKS,
        ..City::DENSE
    };
    let town = Town::built(city, &askew(city, &[Form::Gable]), 0.0);
    let count = |settings| town.not_hidden(settings).iter().map(Vec::len).sum::<usize>();
    let (one, fused) = (count(ONE_BODY), count(FUSED));
    assert!(
        fused * 20 < one * 19,
        "{one} are hidden by no body alone, {fused} by none together"
    );
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
fn what_an_observer_knows_to_be_visible_makes_sets_hardly_larger() {
    let [town, _] = towns();
    let settings = Method::Conservative.proofs();
    let unaided = town.not_hidden(settings);
    let mut observer = Observer::new(&town.scenery, settings);
    let (mut extra, mut all) = (0, 0);
    for ((cell, seen), unaided) in town.cells.iter().zip(&town.seen).zip(&unaided) {
        let aided = observer.visible_or_found(cell, seen, &mut Faces(&town.world));
        assert!(seen.iter().all(|o| aided.binary_search(o).is_ok()));
        // Which proofs are tried depends on what worked for other objects.
        extra += aided.iter().filter(|o| unaided.binary_search(o).is_err()).count();
        all += unaided.len();
    }
    assert!(extra * 100 <= all, "{extra} beside {all}");
}

#[test]
fn a_witness_is_named_for_what_is_hidden_and_none_for_what_is_seen() {
    let [town, _] = towns();
    let mut observer = Observer::new(&town.scenery, FUSED);
    let mut named = 0;
    for (cell, seen) in town.cells.iter().zip(&town.seen) {
        let sets = observer.visible(cell, &[]);
        for object in 0..town.world.object_bounds().len() as u32 {
            let reasons = observer.reasons(cell, object, &mut Blind);
            assert!(reasons.is_none() || seen.binary_search(&object).is_err());
            assert_eq!(
                reasons.is_none(),
                sets.binary_search(&object).is_ok(),
                "object {object}"
            );
            named += usize::from(reasons.is_some_and(|reasons| !reasons.is_empty()));
        }
    }
    assert!(named > 0);
}
