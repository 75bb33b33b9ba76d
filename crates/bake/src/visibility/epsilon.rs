//! What can be seen from an ε-neighbourhood, exactly as the paper computes it?
//!
//! Cohen-Or & Zadicario, *Visibility streaming for network-based walkthroughs* (1998): an object is hidden from a
//! region when one convex occluder meets every ray between the corners of both. This is their algorithm with each of
//! its accelerations as a switch, so that their tables can be made again and what each saves can be measured; the bake
//! itself asks a tree and fuses occluders ([`super::conservative`]).
//!
//! Guarantee: conservative, with any switches. Those marked *exact* change cost and no answer; the others give supersets
//! of one another. Positions are relative to the world's origin, in metres.

mod grid;

use glam::Vec3;

use self::grid::Grid;
use crate::{
    occluders::{Body, Region},
    world::World,
};

/// Which of the paper's accelerations (*Ray shooting*) are used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accelerations {
    /// The box of an object is asked about before its triangles. Exact but for rounding.
    pub boxes_first: bool,
    /// Occluders that are hidden hide nothing that others do not hide.
    pub redundant_occluders: bool,
    /// Only the first ray looks for occluders; the others ask those that it found. Exact.
    pub first_ray_traverses: bool,
    /// Of two boxes only the rays on the convex hull of both are cast: eight of 64. Exact.
    pub hull_rays_only: bool,
    /// Rays find occluders in a grid, instead of asking all of them. Exact.
    pub grid: bool,
    /// Coarse to fine: what is not hidden from the region is asked about from each half of it, so many times over.
    pub subcells: u32,
    /// Occluders that fill less than this solid angle, seen from the middle of the region, in steradians, are left out.
    pub least_occluder_sr: f32,
    /// Super-conservative: the nearest occluder of every ray must be the same one, as a depth buffer would tell.
    pub first_hit: bool,
}

impl Accelerations {
    /// Rays in a grid and nothing else: where the paper's second table starts.
    pub const NONE: Self = Self {
        boxes_first: false,
        redundant_occluders: false,
        first_ray_traverses: false,
        hull_rays_only: false,
        grid: true,
        subcells: 0,
        least_occluder_sr: 0.0,
        first_hit: false,
    };
    /// The last column of that table.
    pub const ALL: Self = Self {
        boxes_first: true,
        redundant_occluders: true,
        first_ray_traverses: true,
        hull_rays_only: true,
        ..Self::NONE
    };
}

/// What was counted on the way to an answer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays that looked for occluders.
    pub traversals: u64,
    /// Occluders that such a ray came upon.
    pub visited: u64,
    /// Tests of one ray against one occluder, for boxes of objects.
    pub box_tests: u64,
    /// … and for triangles.
    pub triangle_tests: u64,
}

/// A superset of what can be seen from a region.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Superset {
    /// Objects that may be seen, rising.
    pub objects: Vec<u32>,
    /// Triangles that may be seen: `(object, index among its triangles)`, rising.
    pub triangles: Vec<(u32, u32)>,
    /// Objects whose boxes one occluder hides.
    pub hidden_boxes: u32,
    /// … the first that was tried.
    pub first_occluders: u32,
    /// What it took.
    pub tally: Tally,
}

/// A scene for such questions.
pub struct Neighbourhoods<'a> {
    world: &'a World,
    bodies: &'a [Body],
    boxes: Vec<Option<Region>>,
    grid: Grid,
}

/// One question in progress.
struct Question<'a> {
    scene: &'a Neighbourhoods<'a>,
    use_of: Accelerations,
    /// Occluders that take part.
    active: Vec<bool>,
    tally: Tally,
    hidden_boxes: u32,
    first_occluders: u32,
}

impl<'a> Neighbourhoods<'a> {
    /// Prepares a world and convex bodies that lie inside its objects.
    #[must_use]
    pub fn new(world: &'a World, bodies: &'a [Body]) -> Self {
        let boxes = world.object_bounds().iter();
        Self {
            world,
            bodies,
            boxes: boxes
                .map(|b| (!b.is_empty()).then(|| Region::around(world, b)))
                .collect(),
            grid: Grid::new(bodies),
        }
    }

    /// What may be seen from a region.
    #[must_use]
    pub fn superset(&self, eye: &Region, accelerations: Accelerations) -> Superset {
        let large = |body: &Body| {
            Region::of_box(body.min, body.max).solid_angle_sr(eye.center()) >= accelerations.least_occluder_sr
        };
        let mut question = Question {
            scene: self,
            use_of: accelerations,
            active: self.bodies.iter().map(large).collect(),
            tally: Tally::default(),
            hidden_boxes: 0,
            first_occluders: 0,
        };
        let objects: Vec<_> = (0..self.boxes.len() as u32)
            .filter(|o| self.boxes[*o as usize].is_some())
            .collect();
        let triangles = question.not_hidden(eye, &objects, accelerations.subcells);
        let mut objects: Vec<_> = triangles.iter().map(|(object, _)| *object).collect();
        objects.dedup();
        Superset {
            objects,
            triangles,
            hidden_boxes: question.hidden_boxes,
            first_occluders: question.first_occluders,
            tally: question.tally,
        }
    }
}

impl Question<'_> {
    /// Triangles of these objects that one occluder does not hide, rising.
    fn not_hidden(&mut self, eye: &Region, objects: &[u32], subcells: u32) -> Vec<(u32, u32)> {
        let open = self.open_objects(eye, objects);
        if subcells > 0 {
            let mut triangles: Vec<_> = eye
                .halves()
                .iter()
                .flat_map(|half| self.not_hidden(half, &open, subcells - 1))
                .collect();
            triangles.sort_unstable();
            triangles.dedup();
            return triangles;
        }
        let mut triangles = Vec::new();
        for object in open {
            for (index, triangle) in self.scene.world.triangles_of(object).iter().enumerate() {
                if self
                    .occluder(eye, &Region::hull(triangle.corners.to_vec()), false)
                    .is_none()
                {
                    triangles.push((object, index as u32));
                }
            }
        }
        triangles
    }

    fn open_objects(&mut self, eye: &Region, objects: &[u32]) -> Vec<u32> {
        if !self.use_of.boxes_first {
            return objects.to_vec();
        }
        let mut open = Vec::new();
        let mut taken_out = Vec::new();
        for object in objects {
            let Some(target) = &self.scene.boxes[*object as usize] else {
                continue;
            };
            if self.occluder(eye, target, true).is_none() {
                open.push(*object);
            } else if self.use_of.redundant_occluders {
                let bodies = self.scene.bodies;
                let first = bodies.partition_point(|b| b.object < *object);
                let end = bodies.partition_point(|b| b.object <= *object);
                taken_out.extend((first..end).filter(|i| std::mem::replace(&mut self.active[*i], false)));
            }
        }
        // Hidden from this part of the region is not hidden from the next.
        if self.use_of.subcells > 0 {
            for index in taken_out {
                self.active[index] = true;
            }
        }
        open
    }

    /// An occluder that every ray between corners of both meets.
    fn occluder(&mut self, eye: &Region, target: &Region, is_box: bool) -> Option<u32> {
        if eye.overlaps(target) {
            return None;
        }
        let reaches = |body: &Body| eye.min.y.min(target.min.y) >= body.stands_m;
        let bodies = self.scene.bodies;
        let enters = |index: u32, [from, to]: [Vec3; 2]| {
            let body = &bodies[index as usize];
            if !body.hides || (body.open_below && !reaches(body)) {
                return None;
            }
            body.enters(from, to, reaches(body))
        };
        let rays = rays(eye, target, self.use_of.hull_rays_only);
        let mut left: Vec<(f64, u32)> = Vec::new();
        let mut first = None;
        for (number, ray) in rays.into_iter().enumerate() {
            let looks = number == 0 || !self.use_of.first_ray_traverses || self.use_of.first_hit;
            let mut tests = 0;
            let mut met: Vec<(f64, u32)> = Vec::new();
            if looks {
                let mut ask = |index: u32| {
                    tests += 1;
                    met.extend(enters(index, ray).map(|at| (at, index)));
                };
                self.tally.traversals += 1;
                if self.use_of.grid {
                    self.scene.grid.along(ray, &self.active, &mut ask);
                } else {
                    (0..bodies.len() as u32)
                        .filter(|i| self.active[*i as usize])
                        .for_each(&mut ask);
                }
                self.tally.visited += tests;
                met.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                if self.use_of.first_hit {
                    met.truncate(1);
                }
            }
            if number == 0 {
                first = met.first().map(|(_, index)| *index);
                left = met;
            } else if looks {
                left.retain(|(_, index)| met.iter().any(|(_, other)| other == index));
            } else {
                tests += left.len() as u64;
                left.retain(|(_, index)| enters(*index, ray).is_some());
            }
            *(if is_box {
                &mut self.tally.box_tests
            } else {
                &mut self.tally.triangle_tests
            }) += tests;
            if left.is_empty() {
                return None;
            }
        }
        let found = left[0].1;
        if is_box {
            self.hidden_boxes += 1;
            self.first_occluders += u32::from(first == Some(found));
        }
        Some(found)
    }
}

/// Rays between the corners of two regions.
fn rays(eye: &Region, target: &Region, hull_rays_only: bool) -> Vec<[Vec3; 2]> {
    if hull_rays_only && eye.points.is_empty() && target.points.is_empty() {
        (0..8).map(|i| [eye.corner(i), target.corner(i)]).collect()
    } else {
        let all = eye
            .corners()
            .flat_map(|from| target.corners().map(move |to| [from, to]));
        all.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{city::City, occluders::Occluders};

    const CITY: City = City {
        blocks: [9, 8],
        ..City::DENSE
    };

    fn with_scene(check: impl Fn(&Neighbourhoods<'_>, &[Region])) {
        let world = World::new(&CITY.scene()).unwrap();
        let occluders = Occluders::of(&world);
        let relative = |p: glam::DVec3| world.relative(p.to_array());
        let eyes: Vec<_> = CITY
            .street_cells(6)
            .iter()
            .map(|[min, max]| Region::of_box(relative(*min), relative(*max)))
            .collect();
        check(&Neighbourhoods::new(&world, &occluders.bodies), &eyes);
    }

    fn is_subset(a: &Superset, b: &Superset) -> bool {
        a.triangles.iter().all(|t| b.triangles.binary_search(t).is_ok())
    }

    #[test]
    fn exact_accelerations_change_no_answer() {
        let switches: [fn(&mut Accelerations); 3] = [
            |a| a.first_ray_traverses = true,
            |a| a.hull_rays_only = true,
            |a| a.grid = false,
        ];
        with_scene(|scene, eyes| {
            for eye in eyes {
                for start in [
                    Accelerations::NONE,
                    Accelerations {
                        boxes_first: true,
                        ..Accelerations::NONE
                    },
                ] {
                    let plain = scene.superset(eye, start);
                    for switch in switches {
                        let mut accelerated = start;
                        switch(&mut accelerated);
                        assert!(
                            scene.superset(eye, accelerated).triangles == plain.triangles,
                            "{accelerated:?}"
                        );
                    }
                }
            }
        });
    }

    #[test]
    fn the_other_switches_trade_cost_for_a_superset() {
        with_scene(|scene, eyes| {
            for eye in eyes {
                let with = |change: fn(&mut Accelerations)| {
                    let mut switches = Accelerations::ALL;
                    change(&mut switches);
                    scene.superset(eye, switches)
                };
                let all = with(|_| ());
                assert!(is_subset(&with(|a| a.redundant_occluders = false), &all));
                assert!(is_subset(&all, &with(|a| a.least_occluder_sr = 0.05)));
                assert!(is_subset(&all, &with(|a| a.first_hit = true)));
                assert!(is_subset(
                    &with(|a| a.subcells = 2),
                    &with(|a| a.redundant_occluders = false)
                ));
            }
        });
    }

    #[test]
    fn accelerations_save_work() {
        with_scene(|scene, eyes| {
            let tests = |a: Accelerations| -> u64 {
                let tallies = eyes.iter().map(|eye| scene.superset(eye, a).tally);
                tallies.map(|t| t.box_tests + t.triangle_tests).sum()
            };
            let none = tests(Accelerations::NONE);
            let boxes = tests(Accelerations {
                boxes_first: true,
                ..Accelerations::NONE
            });
            assert!(boxes < none && tests(Accelerations::ALL) < boxes);
            assert!(
                tests(Accelerations {
                    grid: false,
                    ..Accelerations::NONE
                }) > none
            );
        });
    }
}
