//! How does one cell look around? Casts its rays, notes what they see and follows every discovery.

use glam::{Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
    ray::Ray,
};

use super::{
    random::Random,
    solid::Solid,
    targets::{Lookout, facing, on_object},
};
use crate::{
    occluders::Region,
    world::{Hit, World},
};

/// Rays to perturbed sight lines after each discovery.
const MUTATIONS: usize = 10;
/// Rays past the outline of each discovered object's box.
const OUTLINE_RAYS: usize = 10;
/// Rays per object that measure its fraction.
const FRACTION_RAYS: u32 = 32;
/// A segment arrives when it is blocked only this share of its length before its end: that is rounding.
const ARRIVED: f32 = 1e-5;

/// What all cells share.
pub(super) struct Scenery<'a> {
    pub(super) world: &'a World,
    pub(super) lookouts: Vec<Lookout>,
    /// Objects whose boxes meet each cell, or meet none and this is the nearest, rising.
    pub(super) objects_in: Vec<Vec<u32>>,
    cells: CellTree,
}

/// Which cells does a sight line pass through?
struct CellTree {
    boxes: Vec<CellBox>,
    tree: Bvh2,
}

struct CellBox(Aabb);

impl Boundable for CellBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl CellTree {
    fn over(lookouts: &[Lookout]) -> Self {
        let boxes: Vec<_> = lookouts
            .iter()
            .map(|l| CellBox(Aabb::new(Vec3A::from(l.min), Vec3A::from(l.max))))
            .collect();
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default());
        Self { boxes, tree }
    }

    fn mark(&self, lookouts: &[Lookout], eye: Vec3, direction: Vec3, reach: f32, marks: &mut [bool]) {
        let ray = Ray::new(eye.into(), direction.into(), 0.0, reach);
        self.tree.ray_traverse_anyhit(ray, |ray, index| {
            let cell = self.tree.primitive_indices[index] as usize;
            let passes = |solid: &Solid| solid.meets(eye, direction, reach);
            if !marks[cell]
                && self.boxes[cell].0.intersect_ray(ray) < reach
                && lookouts[cell].solid.as_ref().is_none_or(passes)
            {
                marks[cell] = true;
            }
        });
    }
}

impl<'a> Scenery<'a> {
    pub(super) fn new(world: &'a World, lookouts: Vec<Lookout>) -> Self {
        let boxes: Vec<_> = world
            .object_bounds()
            .iter()
            .map(|b| (!b.is_empty()).then(|| (world.relative(b.min), world.relative(b.max))))
            .collect();
        let meets = |l: &Lookout, (min, max): &(Vec3, Vec3)| {
            let margin = 0.01 * (l.max - l.min);
            min.cmple(l.max + margin).all() && max.cmpge(l.min - margin).all()
        };
        let mut objects_in: Vec<Vec<u32>> = lookouts
            .iter()
            .map(|l| {
                let met = |b: &Option<_>| b.as_ref().is_some_and(|b| meets(l, b));
                (0u32..)
                    .zip(&boxes)
                    .filter(|(_, b)| met(b))
                    .map(|(object, _)| object)
                    .collect()
            })
            .collect();
        // What meets no cell, in a niche or in the air, is looked for by those who see into the nearest one.
        let mut met = vec![false; boxes.len()];
        for object in objects_in.iter().flatten() {
            met[*object as usize] = true;
        }
        for (object, (min, max)) in boxes.iter().enumerate().filter_map(|(i, b)| Some((i, (*b)?))) {
            let away_m = |l: &Lookout| (l.min - max).max(min - l.max).max(Vec3::ZERO).length();
            if met[object] {
                continue;
            }
            let nearest = (0..lookouts.len()).min_by(|a, b| away_m(&lookouts[*a]).total_cmp(&away_m(&lookouts[*b])));
            if let Some(nearest) = nearest {
                let list = &mut objects_in[nearest];
                list.insert(list.partition_point(|known| *known < object as u32), object as u32);
            }
        }
        Self {
            world,
            cells: CellTree::over(&lookouts),
            lookouts,
            objects_in,
        }
    }

    /// Marks the cells that a sight line passes.
    fn mark(&self, eye: Vec3, direction: Vec3, reach: f32, marks: &mut [bool]) {
        self.cells.mark(&self.lookouts, eye, direction, reach, marks);
    }
}

/// One sight line to an object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sighting {
    pub(super) object: u32,
    pub(super) eye: Vec3,
    pub(super) target: Vec3,
    triangle: Option<u32>,
}

/// What one cell knows so far.
pub(super) struct CellState {
    pub(super) random: Random,
    /// In order of discovery, each object once.
    pub(super) seen: Vec<Sighting>,
    /// For each cell whether a sight line passes through.
    pub(super) cells: Vec<bool>,
    /// For each cell whether its portals and objects were searched.
    pub(super) searched: Vec<bool>,
    /// Objects that were searched for on a neighbour's word, rising.
    pub(super) tried: Vec<u32>,
    pub(super) rays: u64,
}

/// What one thread needs besides, whichever cell it works on.
pub(super) struct Scratch {
    known: Vec<bool>,
    hits: Vec<u32>,
    passed: Vec<Hit>,
    fresh: Vec<Sighting>,
}

impl Scratch {
    pub(super) fn new(objects: usize) -> Self {
        Self {
            known: vec![false; objects],
            hits: vec![0; objects],
            passed: Vec::new(),
            fresh: Vec::new(),
        }
    }
}

/// Casts rays for one cell.
pub(super) struct Sampler<'a> {
    scenery: &'a Scenery<'a>,
    cell: usize,
    pub(super) state: &'a mut CellState,
    scratch: &'a mut Scratch,
}

/// Forgets on the way out what is known only of this cell.
impl Drop for Sampler<'_> {
    fn drop(&mut self) {
        for sighting in &self.state.seen {
            self.scratch.known[sighting.object as usize] = false;
        }
        self.scratch.fresh.clear();
    }
}

/// What uniform rays measured.
pub(super) struct Measured {
    /// For each sighting: share of sight lines that arrive, mean solid angle in steradians.
    pub(super) seen: Vec<[f32; 2]>,
    /// Rays that showed something unknown.
    pub(super) surprises: u32,
}

impl<'a> Sampler<'a> {
    pub(super) fn new(
        scenery: &'a Scenery<'a>,
        cell: usize,
        state: &'a mut CellState,
        scratch: &'a mut Scratch,
    ) -> Self {
        for sighting in &state.seen {
            scratch.known[sighting.object as usize] = true;
        }
        Self {
            scenery,
            cell,
            state,
            scratch,
        }
    }

    fn lookout(&self) -> &'a Lookout {
        &self.scenery.lookouts[self.cell]
    }

    /// Whether a sight line to the object is known.
    pub(super) fn knows(&self, object: u32) -> bool {
        self.scratch.known[object as usize]
    }

    fn note(&mut self, sighting: Sighting) {
        if !std::mem::replace(&mut self.scratch.known[sighting.object as usize], true) {
            self.state.seen.push(sighting);
            self.scratch.fresh.push(sighting);
        }
    }

    /// Casts one ray in a unit direction; what it saw before its end is left in `passed`.
    fn shoot(&mut self, eye: Vec3, direction: Vec3) -> Option<Hit> {
        self.state.rays += 1;
        let end = self
            .scenery
            .world
            .cast(eye, direction, f32::MAX, &mut self.scratch.passed);
        for index in 0..self.scratch.passed.len() + usize::from(end.is_some()) {
            if let Some(hit) = self.scratch.passed.get(index).copied().or(end)
                && !self.knows(hit.object)
            {
                self.note(Sighting {
                    object: hit.object,
                    eye,
                    target: eye + hit.t * direction,
                    triangle: Some(hit.triangle),
                });
            }
        }
        end
    }

    /// Casts one ray and marks the cells that it passes.
    fn explore(&mut self, eye: Vec3, direction: Vec3) {
        let end = self.shoot(eye, direction);
        let reach = end.map_or(f32::MAX, |hit| hit.t);
        self.scenery.mark(eye, direction, reach, &mut self.state.cells);
    }

    fn explore_towards(&mut self, eye: Vec3, target: Vec3) {
        if let Some(direction) = (target - eye).try_normalize() {
            self.explore(eye, direction);
        }
    }

    /// Looks at a point of an object; whether a sight line to it is known now.
    fn look_at(&mut self, object: u32, eye: Vec3, target: Vec3) -> bool {
        let distance_m = (target - eye).length();
        let direction = (target - eye) / distance_m;
        if direction.is_finite() {
            let end = self.shoot(eye, direction);
            let arrived = end.is_none_or(|hit| hit.t >= distance_m * (1.0 - ARRIVED));
            if arrived && !self.knows(object) {
                self.note(Sighting {
                    object,
                    eye,
                    target,
                    triangle: None,
                });
            }
        }
        self.knows(object)
    }

    /// Casts random rays until few objects were hit by just one of them (Good & Turing's estimate of what is still
    /// unseen), or the budget is spent.
    pub(super) fn look_around(&mut self, budget: u32) {
        const BATCH: u32 = 1024;
        const FEW: f64 = 5e-4;
        let lookout = self.lookout();
        let mut cast = 0;
        while cast < budget {
            for i in 0..BATCH {
                let random = &mut self.state.random;
                let eye = if i % 3 == 0 {
                    lookout.surface(random)
                } else {
                    lookout.uniform(random)
                };
                let direction = random.direction();
                let end = self.shoot(eye, direction);
                if i % 4 == 0 {
                    let reach = end.map_or(f32::MAX, |hit| hit.t);
                    self.scenery.mark(eye, direction, reach, &mut self.state.cells);
                }
                for hit in self.scratch.passed.iter().chain(&end) {
                    self.scratch.hits[hit.object as usize] += 1;
                }
            }
            cast += BATCH;
            let singles = self
                .state
                .seen
                .iter()
                .filter(|s| self.scratch.hits[s.object as usize] == 1);
            if (singles.count() as f64) < FEW * f64::from(cast) {
                break;
            }
        }
        self.forget_hits();
        self.follow();
    }

    /// Casts random rays and leaves it at that.
    pub(super) fn glance(&mut self, rays: u32) {
        let lookout = self.lookout();
        for i in 0..rays {
            let random = &mut self.state.random;
            let eye = if i % 3 == 0 {
                lookout.surface(random)
            } else {
                lookout.uniform(random)
            };
            let direction = random.direction();
            self.explore(eye, direction);
        }
    }

    /// Looks from here and there at what another cell has seen.
    pub(super) fn try_from_here(&mut self, other: &Sighting, tries: u32) {
        let lookout = self.lookout();
        for i in 0..tries {
            let random = &mut self.state.random;
            let eye = if i == 0 {
                lookout.clamp(other.eye)
            } else {
                lookout.uniform(random)
            };
            if self.look_at(other.object, eye, other.target) {
                break;
            }
        }
    }

    fn forget_hits(&mut self) {
        for sighting in &self.state.seen {
            self.scratch.hits[sighting.object as usize] = 0;
        }
    }

    /// Follows fresh discoveries until there are none: past the edges of the triangle and the outline of the object
    /// that was hit, where more is behind it, and along sight lines a little beside (Wonka et al., *Guided visibility
    /// sampling*, 2006).
    pub(super) fn follow(&mut self) {
        while let Some(found) = self.scratch.fresh.pop() {
            let lookout = self.lookout();
            let bounds = self.scenery.world.object_bounds()[found.object as usize];
            let (min, max) = (
                self.scenery.world.relative(bounds.min),
                self.scenery.world.relative(bounds.max),
            );
            if let Some(triangle) = found.triangle {
                let corners = self.scenery.world.triangles()[triangle as usize].corners;
                let center = (corners[0] + corners[1] + corners[2]) / 3.0;
                for i in 0..3 {
                    let grow = 0.02 + 0.2 * self.state.random.unit();
                    let middle = corners[i].midpoint(corners[(i + 1) % 3]);
                    for point in [corners[i], middle] {
                        self.explore_towards(found.eye, point + grow * (point - center));
                    }
                }
            }
            for _ in 0..OUTLINE_RAYS {
                let random = &mut self.state.random;
                let mut at = random.around_zero();
                at[random.below(3)] = (random.below(2) as f32 * 2.0 - 1.0) * (1.0 + 0.05 * random.unit());
                let target = 0.5 * (min + max) + at * (0.5 * (max - min));
                let eye = if random.unit() < 0.5 {
                    found.eye
                } else {
                    lookout.searching(random)
                };
                self.explore_towards(eye, target);
            }
            for i in 0..MUTATIONS {
                let scale = 0.5f32.powi(1 + i as i32 % 5);
                let random = &mut self.state.random;
                let eye = lookout.clamp(found.eye + scale * random.around_zero() * (lookout.max - lookout.min));
                let target = found.target + scale * random.around_zero() * (max - min);
                self.explore_towards(eye, target);
            }
        }
    }

    /// Looks through the openings of every cell that sight lines reach, and from there on into the next, like down an
    /// enfilade; then searches for every object there that was not seen yet.
    pub(super) fn search_cells(&mut self, portal_budget: u32, object_budget: u32) {
        let scenery = self.scenery;
        let mut fresh_cells = Vec::new();
        let mut portal_budget = i64::from(portal_budget);
        loop {
            let next: Vec<_> = (0..self.state.cells.len())
                .filter(|cell| self.state.cells[*cell] && !self.state.searched[*cell])
                .collect();
            if next.is_empty() {
                break;
            }
            let portals: usize = next.iter().map(|cell| scenery.lookouts[*cell].portals.len()).sum();
            let each = (portal_budget.max(0) / 2 / portals.max(1) as i64).clamp(6, 512);
            for cell in next {
                self.state.searched[cell] = true;
                fresh_cells.push(cell);
                for portal in &scenery.lookouts[cell].portals {
                    for _ in 0..each {
                        let eye = scenery.lookouts[self.cell].searching(&mut self.state.random);
                        let target = portal.point(&mut self.state.random);
                        self.explore_towards(eye, target);
                    }
                    portal_budget -= each;
                }
            }
            self.follow();
        }
        let mut wanted: Vec<_> = fresh_cells
            .iter()
            .flat_map(|cell| &scenery.objects_in[*cell])
            .copied()
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|object| !self.knows(*object));
        let each = (object_budget / wanted.len().max(1) as u32).clamp(64, 2048);
        for object in wanted {
            self.search_for(object, each);
        }
    }

    /// Tries sight lines to one object until one arrives.
    pub(super) fn search_for(&mut self, object: u32, tries: u32) {
        for _ in 0..tries {
            if self.knows(object) {
                break;
            }
            let random = &mut self.state.random;
            let eye = self.scenery.lookouts[self.cell].searching(random);
            let Some(target) = on_object(self.scenery.world, object, random) else {
                break;
            };
            self.look_at(object, eye, target);
        }
        self.follow();
    }

    /// What the cell has seen so far, in order of discovery.
    pub(super) fn seen(&self) -> Vec<u32> {
        self.state.seen.iter().map(|sighting| sighting.object).collect()
    }

    /// Looks for an object from a part of the cell: from its corners, edges, faces and inside. Whether a sight line to it
    /// is known now.
    pub(super) fn look_from(&mut self, part: &Region, object: u32) -> bool {
        const RAYS: u32 = 192;
        const ROUNDED: f32 = 0.4;
        for _ in 0..RAYS {
            if self.knows(object) {
                break;
            }
            let random = &mut self.state.random;
            let place = random
                .cube()
                .to_array()
                .map(|x| if random.unit() < ROUNDED { x.round() } else { x });
            let eye = part.min + Vec3::from(place) * (part.max - part.min);
            let Some(target) = on_object(self.scenery.world, object, random) else {
                break;
            };
            let eye = self.lookout().clamp(eye);
            self.look_at(object, eye, target);
        }
        self.knows(object)
    }

    /// Tries sight lines beside one that another cell has.
    pub(super) fn search_beside(&mut self, other: &Sighting, tries: u32) {
        let lookout = self.lookout();
        let bounds = self.scenery.world.object_bounds()[other.object as usize];
        let size = (self.scenery.world.relative(bounds.max) - self.scenery.world.relative(bounds.min)).abs();
        let back = (other.eye - other.target).normalize_or_zero();
        for _ in 0..tries {
            if self.knows(other.object) {
                break;
            }
            let random = &mut self.state.random;
            let scale = 0.5f32.powi(random.below(6) as i32);
            let target = other.target + 0.2 * scale * random.around_zero() * size;
            // The sight line, drawn on beyond the other's eye, or the place nearest to that eye.
            let beyond = lookout.distance_m(other.eye) + random.unit() * (lookout.max - lookout.min).length();
            let eye = other.eye + if random.unit() < 0.5 { beyond * back } else { Vec3::ZERO };
            let eye = lookout.clamp(eye + 0.5 * scale * random.around_zero() * (lookout.max - lookout.min));
            self.look_at(other.object, eye, target);
        }
        self.follow();
    }

    /// Measures what is seen with rays that are uniform in place and direction.
    pub(super) fn measure(&mut self, rays: u32) -> Measured {
        let (lookout, world) = (self.lookout(), self.scenery.world);
        let mut surprises = 0;
        for _ in 0..rays {
            let before = self.state.seen.len();
            let eye = lookout.uniform(&mut self.state.random);
            let direction = self.state.random.direction();
            let end = self.shoot(eye, direction);
            surprises += u32::from(self.state.seen.len() > before);
            // An object counts once for each ray.
            let passed = &mut self.scratch.passed;
            passed.extend(end);
            passed.sort_unstable_by_key(|hit| hit.object);
            passed.dedup_by_key(|hit| hit.object);
            for hit in passed.iter() {
                self.scratch.hits[hit.object as usize] += 1;
            }
        }
        let per_ray = 4.0 * std::f32::consts::PI / rays.max(1) as f32;
        let angles: Vec<_> = self
            .state
            .seen
            .iter()
            .map(|s| per_ray * self.scratch.hits[s.object as usize] as f32)
            .collect();
        self.forget_hits();
        self.follow();
        let mut seen = Vec::with_capacity(self.state.seen.len());
        let mut index = 0;
        while let Some(sighting) = self.state.seen.get(index).copied() {
            let mut arrived = 0;
            for _ in 0..FRACTION_RAYS {
                let eye = lookout.uniform(&mut self.state.random);
                let Some(target) = facing(world, sighting.object, eye, &mut self.state.random) else {
                    break;
                };
                let distance_m = (target - eye).length();
                let direction = (target - eye) / distance_m;
                if direction.is_finite() {
                    let end = self.shoot(eye, direction);
                    let mut met = self.scratch.passed.iter().chain(&end);
                    let blocked = end.is_some_and(|hit| hit.t < distance_m * (1.0 - ARRIVED));
                    arrived += u32::from(!blocked || met.any(|hit| hit.object == sighting.object));
                }
            }
            let fraction = (arrived as f32).max(0.5) / FRACTION_RAYS as f32;
            // Too small for random rays: what its box would cover, as far as it is visible.
            let bounds = world.object_bounds()[sighting.object as usize];
            let away = lookout
                .distance_m(world.relative(bounds.center()))
                .max(f32::MIN_POSITIVE);
            let covered = (bounds.diagonal_m() as f32 / away)
                .powi(2)
                .min(4.0 * std::f32::consts::PI);
            let floor = (fraction * covered).clamp(1e-9, 0.5 * per_ray);
            let angle = angles.get(index).copied().unwrap_or(0.0).max(floor);
            seen.push([fraction, angle]);
            index += 1;
        }
        self.follow();
        seen.resize(self.state.seen.len(), [0.5 / FRACTION_RAYS as f32, 1e-9]);
        Measured { seen, surprises }
    }
}
