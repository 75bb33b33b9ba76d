//! Are conservative sets right, and how tight are they?

use glam::Vec3;

use super::{
    conservative::{ConservativeSettings, Observer, Scenery},
    prover::Proofs,
    random::Random,
};
use crate::{city::City, occluders::Region, world::World};

const ALL: ConservativeSettings = ConservativeSettings {
    proofs: Proofs {
        bodies: true,
        walls: false,
    },
    fusion: true,
    halvings: 3,
};

/// Cells of the paper's size in the streets of a city: at least so far from every building.
fn street_cells(city: &City, count: usize) -> Vec<[Vec3; 2]> {
    let mut random = Random::stream(7, 7);
    let houses = city.buildings();
    let size = City::CELL_M as f32;
    let mut cells = Vec::new();
    while cells.len() < count {
        let at = random.cube()
            * Vec3::new(
                (city.blocks[0] as f64 * city.spacing_m) as f32,
                0.0,
                (city.blocks[1] as f64 * city.spacing_m) as f32,
            );
        let cell = [at, at + Vec3::splat(size)];
        let free = houses.iter().all(|boxes| {
            let [min, max] = boxes[0].map(|p| p.as_vec3());
            cell[0].x > max.x || cell[1].x < min.x || cell[0].z > max.z || cell[1].z < min.z
        });
        if free {
            cells.push(cell);
        }
    }
    cells
}

#[test]
fn table_of_the_city() {
    for (name, city) in [("dense", City::DENSE), ("sparse", City::SPARSE)] {
        let world = World::new(&city.scene()).unwrap();
        let start = std::time::Instant::now();
        let scenery = Scenery::of(&world);
        println!(
            "{name}: {} bodies {} walls, {:?}",
            scenery.blocker.occluders.bodies.len(),
            scenery.blocker.occluders.walls.len(),
            start.elapsed()
        );
        let cells = street_cells(&city, 24);
        let origin = world.origin().as_vec3();
        let mut random = Random::stream(1, 2);
        let mut passed = Vec::new();
        let seen: Vec<Vec<u32>> = cells
            .iter()
            .map(|[min, max]| {
                let mut seen = std::collections::BTreeSet::new();
                for _ in 0..400_000 {
                    let eye = *min + random.cube() * (*max - *min) - origin;
                    if let Some(hit) = world.cast(eye, random.direction(), f32::MAX, &mut passed) {
                        seen.insert(hit.object);
                    }
                }
                let region = Region::of_box(*min - origin, *max - origin);
                let rays = seen.len();
                let open = Observer::new(&scenery, ALL).visible(&region, &[]);
                for object in open {
                    if seen.contains(&object) {
                        continue;
                    }
                    for _ in 0..20_000 {
                        let mut at = random.cube();
                        for axis in 0..3 {
                            if random.unit() < 0.5 {
                                at[axis] = at[axis].round();
                            }
                        }
                        let eye = *min + (at * 0.9998 + 0.0001) * (*max - *min) - origin;
                        let Some(target) = crate::visibility::targets::on_object(&world, object, &mut random) else {
                            break;
                        };
                        if let Some(hit) = world.cast(eye, target - eye, f32::MAX, &mut passed)
                            && hit.object == object
                        {
                            seen.insert(object);
                            break;
                        }
                    }
                }
                if rays != seen.len() {
                    print!("{rays}->{} ", seen.len());
                }
                seen.into_iter().collect()
            })
            .collect();
        for (label, settings) in [
            (
                "one body",
                ConservativeSettings {
                    fusion: false,
                    halvings: 0,
                    ..ALL
                },
            ),
            (
                "one body, halved 3 times",
                ConservativeSettings { fusion: false, ..ALL },
            ),
            ("fused", ConservativeSettings { halvings: 0, ..ALL }),
            ("fused, halved 3 times", ALL),
            ("fused, halved 5 times", ConservativeSettings { halvings: 5, ..ALL }),
            (
                "walls too, fused, halved 3",
                ConservativeSettings {
                    proofs: Proofs {
                        bodies: true,
                        walls: true,
                    },
                    ..ALL
                },
            ),
        ] {
            let mut observer = Observer::new(&scenery, settings);
            let start = std::time::Instant::now();
            let mut visible = 0;
            let mut missing = 0;
            for ([min, max], seen) in cells.iter().zip(&seen) {
                let found = observer.visible(&Region::of_box(*min - origin, *max - origin), &[]);
                visible += found.len();
                for o in seen.iter().filter(|o| found.binary_search(o).is_err()) {
                    missing += 1;
                    println!(
                        "dense-or-sparse missing {o} from {min} at {:?}",
                        scenery.targets[*o as usize]
                    );
                }
            }
            println!(
                "{name} {label}: visible {:.1}, seen by rays {:.1}, missing {missing}, {:?} per cell",
                visible as f64 / 24.0,
                seen.iter().map(Vec::len).sum::<usize>() as f64 / 24.0,
                start.elapsed() / 24
            );
        }
    }
}
