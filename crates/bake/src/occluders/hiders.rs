//! What hides among some objects? Everything that hides in a world, found once, from which the occluders of any part of
//! it are taken.
//!
//! What a cell sees depends only on what is near enough to be seen from it. So that this is also true of how it is found,
//! its occluders are made from just these objects: a plane that many houses share makes another wall for each cell, from
//! the faces of those houses that matter there. Where these are very many, as in large buildings, the plane is taken as it is.

use std::{
    collections::BTreeMap,
    ops::Range,
    sync::{Arc, Mutex},
};

use super::{
    Body, Occluders, Tolerance, Wall,
    leaf::leaves,
    planes::{self, Face, Group},
    solids, tolerance_of,
};
use crate::{
    digest::{Digest, Digester},
    progress::{Cancelled, Portion, Progress, Silent},
    world::World,
};

/// A plane in which more faces than this matter makes the wall that it makes for all: another would take longer than it is worth.
const MOST_FACES: usize = 4096;
/// Walls that were made for a part of the world are kept for the next that asks, up to so many bytes. Then all are
/// forgotten: neighbours ask one after the other, and who asks next is elsewhere.
const MOST_KEPT_BYTES: usize = 256 << 20;

/// What each takes besides, also where there is no wall.
const ENTRY_BYTES: usize = 128;

/// Steps of progress that the leaves of doors take.
const LEAVES: u64 = 500;

/// Everything that hides in a world.
pub struct Hiders<'a> {
    world: &'a World,
    tolerance: Tolerance,
    /// By object.
    bodies: Vec<Body>,
    /// Those of them that were found in the geometry.
    found: Vec<Body>,
    groups: Vec<Group>,
    /// The walls of the first groups.
    walls: Vec<Known>,
    /// Objects that have a face in each group, rising, and where their faces end there.
    objects_of: Vec<Vec<(u32, u32)>>,
    /// Groups that have a face of each object, rising.
    groups_of: Vec<Vec<u32>>,
    leaves: Vec<Known>,
    /// Places of the leaves of each door among them.
    leaves_of: BTreeMap<u32, Vec<usize>>,
    made: Mutex<Made>,
}

/// A wall, and a digest of all that it is.
#[derive(Clone)]
struct Known {
    wall: Arc<Wall>,
    digest: Digest,
}

/// Walls of parts of groups, by group and objects.
#[derive(Default)]
struct Made {
    walls: BTreeMap<(u32, Vec<u32>), Option<Known>>,
    bytes: usize,
}

impl Known {
    fn new(wall: Wall) -> Self {
        Self {
            digest: wall.digest(),
            wall: Arc::new(wall),
        }
    }
}

impl<'a> Hiders<'a> {
    /// Steps of progress that finding it takes.
    pub const STEPS: u64 = solids::STEPS + planes::STEPS + LEAVES;

    /// Finds what hides in a world. `authored` are bodies that its author drew.
    ///
    /// # Panics
    /// Never: nobody cancels it.
    #[must_use]
    pub fn of(world: &'a World, authored: Vec<Body>) -> Self {
        Self::told(world, authored, &Silent).expect("nobody cancels it")
    }

    /// The same in [`STEPS`](Self::STEPS) steps of a stage.
    ///
    /// # Errors
    /// When cancelled.
    pub fn told(world: &'a World, authored: Vec<Body>, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let tolerance = tolerance_of(world);
        let found = solids::bodies(world, tolerance, progress)?;
        let mut bodies = [&found[..], &authored].concat();
        bodies.sort_by_key(|body| body.object);
        let mut groups = planes::groups_by_area(world, tolerance, progress)?;
        let walls = planes::walls(&mut groups, world, tolerance, progress)?;
        let object = |(face, _): &Face| world.triangle(*face).object;
        let objects_of: Vec<Vec<(u32, u32)>> = groups
            .iter()
            .map(|group| {
                let mut end = 0;
                let of_one = group.faces.chunk_by(|a, b| object(a) == object(b)).map(|faces| {
                    end += faces.len() as u32;
                    (object(&faces[0]), end)
                });
                of_one.collect()
            })
            .collect();
        let mut groups_of = vec![Vec::new(); world.object_bounds().len()];
        for (group, objects) in (0u32..).zip(&objects_of) {
            for (object, _) in objects {
                groups_of[*object as usize].push(group);
            }
        }
        let leaves = {
            let portion = Portion::of(progress, LEAVES, world.doors().len() as u64);
            leaves(world, tolerance, &portion)?
        };
        let leaves: Vec<_> = leaves.into_iter().map(Known::new).collect();
        let mut leaves_of: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (place, known) in leaves.iter().enumerate() {
            if let Some(door) = known.wall.door {
                leaves_of.entry(door).or_default().push(place);
            }
        }
        Ok(Self {
            world,
            tolerance,
            bodies,
            found,
            groups,
            walls: walls.into_iter().map(Known::new).collect(),
            objects_of,
            groups_of,
            leaves,
            leaves_of,
            made: Mutex::default(),
        })
    }

    /// All of it, but for what hides on an author's word alone.
    pub(crate) fn found(&self) -> Occluders {
        self.with(&self.found)
    }

    /// All of it.
    #[must_use]
    pub fn occluders(&self) -> Occluders {
        self.with(&self.bodies)
    }

    /// All walls, and these bodies.
    fn with(&self, bodies: &[Body]) -> Occluders {
        let walls = self.walls.iter().chain(&self.leaves);
        Occluders {
            bodies: bodies.to_vec(),
            walls: walls.map(|known| known.wall.clone()).collect(),
            tolerance: self.tolerance,
        }
    }

    /// What hides among some objects, rising, which are numbered from 0 on in it. `digester` takes all that it is.
    pub(crate) fn among(&self, objects: &[u32], digester: &mut Digester) -> Occluders {
        let mut bodies = Vec::new();
        for (number, object) in (0u32..).zip(objects) {
            bodies.extend(self.bodies[self.bodies_of(*object)].iter().map(|body| Body {
                object: number,
                ..body.clone()
            }));
        }
        digester.count(bodies.len());
        bodies.iter().for_each(|body| body.feed(digester));
        let of_object = |object: u32| {
            let groups = self.groups_of[object as usize].iter();
            groups.map(move |group| (*group, object))
        };
        let mut pairs: Vec<(u32, u32)> = objects.iter().copied().flat_map(of_object).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let by_group = pairs.chunk_by(|a, b| a.0 == b.0);
        let mut walls: Vec<Known> = by_group.filter_map(|pairs| self.wall(pairs)).collect();
        // In an order that nothing else in the world decides.
        walls.sort_by_key(|known| known.digest);
        let doors = (0u32..).zip(objects);
        let of_door = |(number, door): (u32, &u32)| Some((number, self.leaves_of.get(door)?));
        let leaves = doors.filter_map(of_door).flat_map(|(number, places)| {
            places.iter().map(move |place| {
                let mut leaf = (*self.leaves[*place].wall).clone();
                leaf.door = Some(number);
                Known::new(leaf)
            })
        });
        walls.extend(leaves);
        digester.count(walls.len());
        for known in &walls {
            digester.add(known.digest);
        }
        digester.floats(&[self.tolerance.plane_m, self.tolerance.hole_m]);
        Occluders {
            bodies,
            walls: walls.into_iter().map(|known| known.wall).collect(),
            tolerance: self.tolerance,
        }
    }

    /// Bodies of an object.
    fn bodies_of(&self, object: u32) -> Range<usize> {
        let first = self.bodies.partition_point(|body| body.object < object);
        first..self.bodies.partition_point(|body| body.object <= object)
    }

    /// The wall that a group makes of some objects of its own, rising, each with the group's number, if any.
    fn wall(&self, pairs: &[(u32, u32)]) -> Option<Known> {
        let index = pairs.first()?.0;
        let whole = || self.walls.get(index as usize).cloned();
        let all = &self.objects_of[index as usize];
        let place = |(_, object): &(u32, u32)| all.binary_search_by_key(object, |(known, _)| *known).ok();
        let places: Vec<usize> = pairs.iter().filter_map(place).collect();
        let faces = |place: &usize| {
            let first = place.checked_sub(1).map_or(0, |before| all[before].1);
            &self.groups[index as usize].faces[first as usize..all[*place].1 as usize]
        };
        let count: usize = places.iter().map(|place| faces(place).len()).sum();
        if places.len() == all.len() || count > MOST_FACES {
            return whole();
        }
        let here: Vec<u32> = places.iter().map(|place| all[*place].0).collect();
        let key = (index, here);
        let known = self
            .made
            .lock()
            .expect("nobody panics while holding this lock")
            .walls
            .get(&key)
            .cloned();
        known.unwrap_or_else(|| {
            let faces = places.iter().flat_map(faces).copied().collect();
            let part = Group::of_some(faces, self.world, self.tolerance);
            let large = part.filter(|part| part.area_m2 >= planes::min_area_m2(self.world));
            let wall = large.map(|part| part.wall(self.world, self.tolerance));
            let wall = wall.filter(|wall| wall.is_wide(planes::min_width_m(self.world)));
            let wall = wall.map(Known::new);
            let held = wall.as_ref().map_or(0, |known| known.wall.bytes());
            let bytes = ENTRY_BYTES + size_of_val(&key.1[..]) + held;
            let mut made = self.made.lock().expect("nobody panics while holding this lock");
            if made.bytes + bytes > MOST_KEPT_BYTES {
                *made = Made::default();
            }
            if made.walls.insert(key, wall.clone()).is_none() {
                made.bytes += bytes;
            }
            wall
        })
    }
}
