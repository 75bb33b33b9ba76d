//! How does one cell look around? Casts its rays, notes what they see and follows every discovery.
//!
//! Follows Wonka et al., *Guided visibility sampling* (2006): random rays, then rays guided by what was found, past the
//! borders of what was hit and a little beside known sight lines. Random rays alone miss what shows through narrow
//! openings; so what no proof hides and no ray has seen is hunted: sight lines to it that got far are tried again, changed
//! a little ([`super::hunt`]).
//!
//! Stopping: uniform rays end when the share of them that would show something new, were it not for all that is done besides,
//! is small for certain: the number of objects hit by just one of them, over their number, estimates it (Good & Turing;
//! Good, *The population frequencies of species and the estimation of population parameters*, 1953), and is bounded at 95 %
//! confidence after so many rays. That ends them the first time that it is low enough, so where the share is just above what is
//! wanted, the bound is too low more often than that: `docs/VISIBILITY.md` says how often.
//!
//! Guarantee: whatever is noted was seen by a ray. Results depend on the random stream and on the objects that rays can
//! meet.

use glam::Vec3;

use super::{random::Random, sights::Sights, targets::Lookout};
use crate::world::Hit;

/// Uniform rays are enough when less than this share of them would show something new.
const FEW_UNSEEN: f64 = 1e-4;
/// Rays to perturbed sight lines after each discovery.
const MUTATIONS: usize = 10;
/// Rays past the outline of each discovered object's box.
const OUTLINE_RAYS: usize = 10;
/// A segment arrives when it is blocked only this share of its length before its end: that is rounding.
const ARRIVED: f32 = 1e-5;

/// One sight line to an object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sighting {
    pub(super) object: u32,
    pub(super) eye: Vec3,
    pub(super) target: Vec3,
    /// The triangle that a ray met there, where it did.
    pub(super) triangle: Option<u32>,
}

/// What one cell knows so far.
pub(super) struct CellState {
    pub(super) random: Random,
    /// In order of discovery, each object once.
    pub(super) seen: Vec<Sighting>,
    /// Cells that a sight line passes through, each once; nothing where nobody asks.
    pub(super) cells: Vec<u32>,
    pub(super) rays: u64,
}

impl CellState {
    /// Knows nothing, and asks for objects alone.
    pub(super) fn new(random: Random) -> Self {
        Self {
            random,
            seen: Vec::new(),
            cells: Vec::new(),
            rays: 0,
        }
    }

    /// Knows nothing but itself, and asks which cells it sees into.
    pub(super) fn with_cells(cell: usize, random: Random) -> Self {
        Self {
            cells: vec![cell as u32],
            ..Self::new(random)
        }
    }

    /// Cells that a sight line passes through, rising.
    pub(super) fn cells_passed(&self) -> Vec<u32> {
        let mut cells = self.cells.clone();
        cells.sort_unstable();
        cells
    }
}

/// What came of a ray at a place.
pub(super) struct Aimed {
    pub(super) end: Option<Hit>,
    /// From the eye to the place.
    distance_m: f32,
}

impl Aimed {
    /// Whether nothing blocked it before its place.
    pub(super) fn arrived(&self) -> bool {
        self.end.is_none_or(|hit| hit.t >= self.distance_m * (1.0 - ARRIVED))
    }

    /// The share of the way behind where it was blocked.
    pub(super) fn left(&self) -> f32 {
        1.0 - self.end.map_or(1.0, |hit| (hit.t / self.distance_m).min(1.0))
    }
}

/// What uniform rays say.
pub(super) struct Uniform {
    pub(super) rays: u32,
    /// How many of them met each object, in the order of sightings; nothing for what others found later.
    pub(super) hits: Vec<u32>,
    /// Upper bound of the share of such rays that would show something new.
    pub(super) miss_bound: f64,
}

/// What one thread needs besides, whichever cell it works on.
pub(super) struct Scratch {
    /// Objects that rays can meet, …
    here: Vec<bool>,
    /// … which are these, if they are not all.
    only: Option<Vec<u32>>,
    known: Vec<bool>,
    /// Cells that a sight line passes through.
    passing: Vec<bool>,
    hits: Vec<u32>,
    pub(super) passed: Vec<Hit>,
    fresh: Vec<Sighting>,
}

impl Scratch {
    pub(super) fn new(sights: &Sights<'_>) -> Self {
        let objects = sights.world.object_bounds().len();
        Self {
            here: vec![true; objects],
            only: None,
            known: vec![false; objects],
            passing: vec![false; sights.lookouts.len()],
            hits: vec![0; objects],
            passed: Vec::new(),
            fresh: Vec::new(),
        }
    }

    /// From now on rays meet these objects and no others.
    pub(super) fn meet_only(&mut self, objects: &[u32]) {
        match self.only.take() {
            Some(before) => before.iter().for_each(|object| self.here[*object as usize] = false),
            None => self.here.fill(false),
        }
        for object in objects {
            self.here[*object as usize] = true;
        }
        self.only = Some(objects.to_vec());
    }
}

/// Casts rays for one cell.
pub(super) struct Sampler<'a> {
    pub(super) sights: &'a Sights<'a>,
    cell: usize,
    pub(super) state: &'a mut CellState,
    pub(super) scratch: &'a mut Scratch,
}

/// Forgets on the way out what is known only of this cell.
impl Drop for Sampler<'_> {
    fn drop(&mut self) {
        for sighting in &self.state.seen {
            self.scratch.known[sighting.object as usize] = false;
        }
        for cell in &self.state.cells {
            self.scratch.passing[*cell as usize] = false;
        }
        self.scratch.fresh.clear();
    }
}

impl<'a> Sampler<'a> {
    pub(super) fn new(sights: &'a Sights<'a>, cell: usize, state: &'a mut CellState, scratch: &'a mut Scratch) -> Self {
        for sighting in &state.seen {
            scratch.known[sighting.object as usize] = true;
        }
        for cell in &state.cells {
            scratch.passing[*cell as usize] = true;
        }
        Self {
            sights,
            cell,
            state,
            scratch,
        }
    }

    pub(super) fn lookout(&self) -> &'a Lookout {
        &self.sights.lookouts[self.cell]
    }

    /// Whether a sight line to the object is known.
    pub(super) fn knows(&self, object: u32) -> bool {
        self.scratch.known[object as usize]
    }

    /// What the cell has seen so far, in order of discovery.
    pub(super) fn seen(&self) -> impl Iterator<Item = u32> {
        self.state.seen.iter().map(|sighting| sighting.object)
    }

    fn note(&mut self, sighting: Sighting) {
        if !std::mem::replace(&mut self.scratch.known[sighting.object as usize], true) {
            self.state.seen.push(sighting);
            self.scratch.fresh.push(sighting);
        }
    }

    /// Casts one ray in a unit direction; what it saw before its end is left in `passed`.
    pub(super) fn shoot(&mut self, eye: Vec3, direction: Vec3) -> Option<Hit> {
        self.state.rays += 1;
        let Scratch { here, passed, .. } = &mut *self.scratch;
        let among = |object: u32| here[object as usize];
        let end = self.sights.world.cast_among(eye, direction, f32::MAX, among, passed);
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

    /// Casts one ray and marks the cells that it passes, where somebody asks for them.
    fn explore(&mut self, eye: Vec3, direction: Vec3) {
        let end = self.shoot(eye, direction);
        if !self.state.cells.is_empty() {
            let reach = end.map_or(f32::MAX, |hit| hit.t);
            let (passing, cells) = (&mut self.scratch.passing[..], &mut self.state.cells);
            self.sights.mark(eye, direction, reach, (passing, cells));
        }
    }

    fn explore_towards(&mut self, eye: Vec3, target: Vec3) {
        if let Some(direction) = (target - eye).try_normalize() {
            self.explore(eye, direction);
        }
    }

    /// Casts so many rays that are uniform in place and direction, then some along known sight lines and beside them, as if these had
    /// just been discovered.
    pub(super) fn retrace(&mut self, rays: u32, known: &[Sighting]) {
        let lookout = self.lookout();
        for _ in 0..rays {
            let eye = lookout.uniform(&mut self.state.random);
            let direction = self.state.random.direction();
            self.explore(eye, direction);
        }
        for sighting in known {
            self.explore_towards(sighting.eye, sighting.target);
            // Where rounding keeps that ray from it.
            self.note(Sighting {
                triangle: None,
                ..*sighting
            });
        }
        self.follow();
    }

    /// Casts a ray at a place; `None` when there is no way to it.
    pub(super) fn aim(&mut self, eye: Vec3, target: Vec3) -> Option<Aimed> {
        let distance_m = (target - eye).length();
        let direction = (target - eye) / distance_m;
        direction.is_finite().then(|| Aimed {
            end: self.shoot(eye, direction),
            distance_m,
        })
    }

    /// Casts a ray at a point of an object, which is seen when it arrives there.
    pub(super) fn look_at(&mut self, object: u32, eye: Vec3, target: Vec3) -> Option<Aimed> {
        let aimed = self.aim(eye, target)?;
        if aimed.arrived() && !self.knows(object) {
            self.note(Sighting {
                object,
                eye,
                target,
                triangle: None,
            });
        }
        Some(aimed)
    }

    /// Casts rays that are uniform in place and direction until few are likely to show something new, or as many as there
    /// may be.
    pub(super) fn look_around(&mut self, most: u32) -> Uniform {
        const BATCH: u32 = 1024;
        let lookout = self.lookout();
        let (mut rays, mut miss_bound) = (0, 1.0);
        while rays == 0 || (rays < most && miss_bound > FEW_UNSEEN) {
            for _ in 0..BATCH {
                let eye = lookout.uniform(&mut self.state.random);
                let direction = self.state.random.direction();
                let end = self.shoot(eye, direction);
                // An object counts once for each ray.
                let passed = &mut self.scratch.passed;
                passed.extend(end);
                passed.sort_unstable_by_key(|hit| hit.object);
                passed.dedup_by_key(|hit| hit.object);
                for hit in passed.iter() {
                    self.scratch.hits[hit.object as usize] += 1;
                }
            }
            rays += BATCH;
            let once = |object: &u32| self.scratch.hits[*object as usize] == 1;
            miss_bound = poisson_bound(self.seen().filter(once).count()) / f64::from(rays);
        }
        let hits: Vec<_> = self.seen().map(|object| self.scratch.hits[object as usize]).collect();
        for sighting in &self.state.seen {
            self.scratch.hits[sighting.object as usize] = 0;
        }
        self.follow();
        Uniform {
            rays,
            hits,
            miss_bound: miss_bound.min(1.0),
        }
    }

    /// Casts random rays, from eyes that may be there, and leaves it at that.
    pub(super) fn glance(&mut self, rays: u32, may_be: &impl Fn(Vec3) -> bool) {
        let lookout = self.lookout();
        for i in 0..rays {
            let random = &mut self.state.random;
            let eye = if i % 3 == 0 {
                lookout.surface(random)
            } else {
                lookout.uniform(random)
            };
            let direction = random.direction();
            if may_be(eye) {
                self.explore(eye, direction);
            }
        }
    }

    /// Looks from here and there, as far as an eye may be there, at what another cell has seen.
    pub(super) fn try_from_here(&mut self, other: &Sighting, tries: u32, may_be: &impl Fn(Vec3) -> bool) {
        let lookout = self.lookout();
        for i in 0..tries {
            let random = &mut self.state.random;
            let eye = if i == 0 {
                lookout.clamp(other.eye)
            } else {
                lookout.uniform(random)
            };
            if !may_be(eye) {
                continue;
            }
            self.look_at(other.object, eye, other.target);
            if self.knows(other.object) {
                break;
            }
        }
    }

    /// Follows fresh discoveries until there are none: past the edges of the triangle and the outline of the object
    /// that was hit, where more is behind it, and along sight lines a little beside (Wonka et al., *Guided visibility
    /// sampling*, 2006).
    pub(super) fn follow(&mut self) {
        while let Some(found) = self.scratch.fresh.pop() {
            let lookout = self.lookout();
            let bounds = self.sights.world.object_bounds()[found.object as usize];
            let (min, max) = (
                self.sights.world.relative(bounds.min),
                self.sights.world.relative(bounds.max),
            );
            if let Some(triangle) = found.triangle {
                let corners = self.sights.world.triangle(triangle).corners;
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
}

/// The largest mean that is still 95 % sure to give more than this count: Wilson and Hilferty's approximation of the
/// chi-square quantile (1931), within 1 %; 3.0 for a count of 0.
fn poisson_bound(count: usize) -> f64 {
    const QUANTILE_95: f64 = 1.645;
    let n = count as f64 + 1.0;
    n * (1.0 - 1.0 / (9.0 * n) + QUANTILE_95 / (3.0 * n.sqrt())).powi(3)
}
