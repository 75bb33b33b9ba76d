//! Are conservative sets right from far outside of a scene, and about what stands far from it?

use glam::{DVec3, Vec3};

use super::{
    Method,
    conservative::{ConservativeSettings, Observer, Scenery},
    narrow::Faces,
    oracle::first_hiding_face,
    prover::Proofs,
    random::Random,
    targets,
};
use crate::{cells::plan::Builder, occluders::Region, world::World};

/// Places around the scene at each distance.
const PLACES: usize = 40;
/// Rays to each object from each.
const RAYS: usize = 60;

/// A wall on the ground, things behind, beside and above it, and two panels without thickness with something between them.
fn yard() -> World {
    let mut builder = Builder::default();
    builder.block("ground", [-6.0, -0.2, -6.0], [6.0, 0.0, 6.0]);
    builder.block("wall", [-1.0, 0.0, -2.0], [-0.5, 3.0, 2.0]);
    builder.block("behind", [2.0, 0.0, -0.5], [3.0, 1.0, 0.5]);
    builder.block("beside", [2.0, 0.0, 3.2], [3.0, 1.0, 4.2]);
    builder.block("above", [2.0, 4.0, -0.5], [3.0, 4.5, 0.5]);
    for (name, z) in [("near panel", -5.0), ("far panel", -5.6)] {
        let panel = builder.quad(name, [[-5.0, 0.0, z], [-2.0, 0.0, z], [-2.0, 2.0, z], [-5.0, 2.0, z]]);
        builder.paint(panel, false, true);
    }
    builder.block("between", [-4.0, 0.2, -5.4], [-3.0, 1.0, -5.2]);
    World::new(&builder.scene).unwrap()
}

/// Objects of which a ray meets the middle of a face or the like from the middle of a region.
fn seen_from(world: &World, eye: DVec3, random: &mut Random) -> Vec<u32> {
    let is_seen = |object: &u32| {
        (0..RAYS).any(|_| {
            let target = targets::on_object(world, *object, random).unwrap();
            first_hiding_face(world, eye, target.as_dvec3()) == Some(*object)
        })
    };
    (0..world.object_bounds().len() as u32).filter(is_seen).collect()
}

fn kinds_of_proof() -> [ConservativeSettings; 3] {
    let only = |proofs: Proofs| ConservativeSettings {
        proofs,
        ..ConservativeSettings::ON_LINE
    };
    let [bodies, walls] = [true, false].map(|bodies| only(Proofs { bodies, walls: !bodies }));
    [bodies, walls, Method::Conservative.proofs()]
}

#[test]
fn what_is_in_plain_sight_from_any_distance_is_in_every_set() {
    let world = yard();
    let scenery = Scenery::of(&world);
    let diagonal_m = f64::from(world.scale_m());
    for settings in kinds_of_proof() {
        let mut observer = Observer::new(&scenery, settings);
        let mut hidden = 0;
        for power in 0..9 {
            let mut random = Random::stream(3, power);
            for place in 0..PLACES {
                let mut away = random.direction().as_dvec3();
                // Some look along the ground and along walls.
                away.y = if place % 4 == 0 { 0.02 * away.y } else { away.y.abs() };
                let away = away.normalize() * diagonal_m * 10.0f64.powi(power as i32);
                let at = away.as_vec3();
                let eye = Region::rounded(at, at);
                let set = observer.visible_or_found(&eye, &[], &mut Faces(&world));
                let seen = seen_from(&world, at.as_dvec3(), &mut random);
                let missing: Vec<_> = seen.iter().filter(|o| set.binary_search(o).is_err()).collect();
                assert!(missing.is_empty(), "{missing:?} from {at} with {settings:?}");
                hidden += usize::from(power < 8 && set.len() < world.object_bounds().len());
            }
        }
        assert!(hidden > PLACES, "only {hidden} sets lack anything");
    }
}

#[test]
fn no_thing_hides_itself_or_the_ground_from_a_cell_far_away() {
    let world = yard();
    let scenery = Scenery::of(&world);
    for reach_m in [1e3f32, 1e4, 1e5, 1e7] {
        let middle = reach_m * Vec3::new(0.62, 0.31, -0.72);
        let eye = Region::rounded(middle - 0.5, middle + 0.5);
        let mut observer = Observer::new(&scenery, Method::Conservative.proofs());
        let set = observer.visible_or_found(&eye, &[], &mut Faces(&world));
        for object in set {
            assert_eq!(observer.reasons(&eye, object, &mut Faces(&world)), None, "{reach_m} m");
        }
        let ground = observer.reasons(&eye, 0, &mut Faces(&world));
        assert_eq!(ground, None, "the ground is in sight from {reach_m} m");
    }
}
