//! What do eyes in all cells see that the records do not list?
//!
//! Each eye draws one [`Cube`]. Objects in it that the cell's record lacks are claims, which [`sight`](crate::sight)
//! confirms or does not; both are counted. Eyes with confirmed misses are drawn once more at [`FINE_PX`], so that a miss
//! has the same size whatever the size of the first picture. What was seen at all bounds how tight the sets are.
//!
//! The outcome depends on scene, cells and settings only, not on the number of threads.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{
    CellId, ObjectId,
    record::{CellRecord, Guarantee},
};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    cube::{Cube, Sighting},
    eyes::{Eye, Place, Room},
    scene::Scene,
    sight::{Doubt, sees, sees_thin},
};

/// Misses are measured on cube faces of so many pixels a side.
pub const FINE_PX: usize = 1024;
/// At most so many eyes are drawn once more; the sizes of all other misses are scaled.
const FINE_EYES: usize = 256;
/// At most so many of the pixels of one object from one eye are confirmed one by one; the share holds for the others.
const RAYS_A_CLAIM: usize = 64;
/// … and at most so many of all objects from one eye, but at least one of each, so that a scene whose sets are all
/// wrong is told so in good time.
const RAYS_A_VIEW: usize = 1024;

/// A cell whose record is checked.
#[derive(Debug)]
pub struct Cell {
    /// Its id.
    pub id: CellId,
    /// What its record promises.
    pub guarantee: Guarantee,
    /// Where eyes may stand.
    pub room: Room,
    /// What leads to other cells, and to which.
    pub openings: Vec<(CellId, Vec<DVec3>)>,
    /// Objects that its record lists.
    pub listed: Vec<ObjectId>,
}

/// How hard to look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Eyes in all cells together; each cell has at least one, and all have equally many but for one.
    pub eyes: u64,
    /// Pixels along the side of a cube face.
    pub size_px: usize,
    /// Other eyes for another number.
    pub seed: u64,
}

/// An object that an eye sees and the record of its cell does not list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// The cell.
    pub cell: CellId,
    /// Where the eye stands, in world space, metres.
    pub eye: [f64; 3],
    /// What kind of place that is.
    pub place: Place,
    /// Where from there one sees it, a unit vector.
    pub direction: [f64; 3],
    /// What it sees.
    pub object: ObjectId,
    /// In how many pixels of faces of [`FINE_PX`]² pixels; for what is not confirmed, as many as that would be.
    pub pixels: u64,
    /// Whether the record says that nothing can be missing.
    pub conservative: bool,
}

/// How many objects a cell's record lists, and how many were seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Tightness {
    /// The cell.
    pub cell: CellId,
    /// Entries of its record.
    pub listed: u64,
    /// Listed objects that an eye has seen.
    pub seen: u64,
    /// Eyes in the cell.
    pub eyes: u64,
}

/// What came out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outcome {
    /// Eyes.
    pub eyes: u64,
    /// Pixels that show an object, in all views.
    pub pixels: u64,
    /// Pixels that show a missing object, confirmed.
    pub missed_pixels: u64,
    /// Pixels that seem to show a missing object, but so narrowly that rounding decides.
    pub unconfirmed_pixels: u64,
    /// Each confirmed miss of an object in a cell's record, from the eye that sees most of it, largest first.
    pub misses: Vec<Miss>,
    /// Objects that seem to be missing from a cell's record, but never surely.
    pub unconfirmed: Vec<Miss>,
    /// One for each cell.
    pub cells: Vec<Tightness>,
}

impl Outcome {
    /// The share of pixels that show an object which show a missing one.
    #[must_use]
    pub fn false_negative_rate(&self) -> f64 {
        self.missed_pixels as f64 / self.pixels.max(1) as f64
    }

    /// Mean over the cells of how many times more objects are listed than were seen; above the true overestimate,
    /// because eyes are finite. Cells from which nothing was seen do not count.
    #[must_use]
    pub fn tightness_mean(&self) -> f64 {
        let ratios: Vec<_> = self.cells.iter().filter_map(Tightness::ratio).collect();
        ratios.iter().sum::<f64>() / ratios.len().max(1) as f64
    }

    /// All entries of all records over all that were seen: the same, cells with large sets counting more.
    #[must_use]
    pub fn tightness_of_entries(&self) -> f64 {
        let sum = |count: fn(&Tightness) -> u64| self.cells.iter().map(count).sum::<u64>();
        sum(|c| c.listed) as f64 / sum(|c| c.seen).max(1) as f64
    }

    /// The cell whose set is least tight.
    #[must_use]
    pub fn loosest(&self) -> Option<Tightness> {
        let ratio = |cell: &Tightness| cell.ratio().unwrap_or(0.0);
        self.cells.iter().copied().max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
    }
}

impl Tightness {
    /// Listed over seen; `None` when nothing was seen.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        (self.seen > 0).then(|| self.listed as f64 / self.seen as f64)
    }
}

impl Cell {
    /// The cell of a record.
    #[must_use]
    pub fn of(record: &CellRecord) -> Self {
        Self {
            id: record.cell,
            guarantee: record.guarantee,
            room: Room::of(record),
            openings: record
                .portals
                .iter()
                .filter(|portal| !portal.polygon.is_empty())
                .map(|portal| (portal.to, portal.polygon.iter().copied().map(DVec3::from).collect()))
                .collect(),
            listed: record.visible().iter().map(|v| v.object).collect(),
        }
    }

    /// Says of each object whether the record lists it.
    #[must_use]
    pub fn expected(&self, scene: &Scene) -> Vec<bool> {
        let mut expected = vec![false; scene.objects.len()];
        for object in &self.listed {
            if let Some(slot) = expected.get_mut(object.0 as usize) {
                *slot = true;
            }
        }
        expected
    }

    /// Eye `number` of this cell. Kinds of places are tried from another one on in each cell, so that all kinds occur
    /// even with one eye a cell.
    pub(crate) fn eye(&self, scene: &Scene, seed: u64, number: u64) -> Eye {
        let number = number + u64::from(self.id.0);
        self.room.eye(seed, self.id.0, number, scene.error_m())
    }
}

/// How many eyes stand in a cell.
fn eyes_in(position: usize, cells: usize, eyes: u64) -> u64 {
    let cells = cells.max(1) as u64;
    let more = u64::from((position as u64) < eyes % cells);
    (eyes / cells + more).max(1)
}

/// How many eyes there will be: as many as [`check`] advances by, before it measures misses once more.
#[must_use]
pub fn eyes_of(cells: usize, eyes: u64) -> u64 {
    eyes.max(cells as u64)
}

/// What one eye claims of one object.
struct Claim {
    object: u32,
    /// Towards a pixel, confirmed if any is.
    direction: DVec3,
    pixels: u64,
    confirmed: u64,
}

struct View {
    cell: usize,
    eye: Eye,
    covered: u64,
    seen: Vec<u32>,
    claims: Vec<Claim>,
}

/// Looks from all eyes; `advance` hears of each.
pub fn check(scene: &Scene, cells: &[Cell], settings: &Settings, advance: &(dyn Fn() + Sync)) -> Outcome {
    let eyes: Vec<(usize, Eye)> = (0..cells.len())
        .flat_map(|position| {
            let cell = &cells[position];
            let count = eyes_in(position, cells.len(), settings.eyes);
            (0..count).map(move |number| (position, cell.eye(scene, settings.seed, number)))
        })
        .collect();
    let views: Vec<View> = eyes
        .par_iter()
        .map_init(
            || Cube::new(settings.size_px),
            |cube, (cell, eye)| {
                let view = look(scene, cells, *cell, *eye, cube);
                advance();
                view
            },
        )
        .collect();
    let fine = measured_finely(scene, cells, &views, settings.size_px);
    summary(cells, &views, &fine, settings.size_px)
}

fn look(scene: &Scene, cells: &[Cell], cell: usize, eye: Eye, cube: &mut Cube) -> View {
    let expected = cells[cell].expected(scene);
    cube.draw(scene, eye.position, &expected);
    let shown = cube.pixels().iter().zip(&expected).enumerate();
    let seen = shown
        .filter(|(_, (pixels, expected))| **pixels > 0 && **expected)
        .map(|(object, _)| object as u32);
    View {
        cell,
        eye,
        covered: cube.covered(),
        seen: seen.collect(),
        claims: claims(scene, eye.position, cube),
    }
}

/// The unexpected objects of a view, confirmed as far as they can be.
fn claims(scene: &Scene, eye: DVec3, cube: &Cube) -> Vec<Claim> {
    let by_object: Vec<&[Sighting]> = cube.unexpected().chunk_by(|a, b| a.object == b.object).collect();
    let most = (RAYS_A_VIEW / by_object.len().max(1)).clamp(1, RAYS_A_CLAIM);
    by_object
        .iter()
        .map(|sightings| {
            let rays = sightings.len().min(most);
            let tried = (0..rays).map(|ray| &sightings[ray * sightings.len() / rays]);
            let sure: Vec<_> = tried.filter(|at| confirmed(scene, eye, cube, at)).collect();
            let example = sure.first().map_or(&sightings[0], |at| *at);
            Claim {
                object: example.object,
                direction: towards(cube, example).normalize(),
                pixels: sightings.len() as u64,
                confirmed: (sure.len() * sightings.len()).div_ceil(rays) as u64,
            }
        })
        .collect()
}

/// Whether the object surely shows at a pixel.
fn confirmed(scene: &Scene, eye: DVec3, cube: &Cube, at: &Sighting) -> bool {
    let direction = towards(cube, at);
    sees(scene, eye, direction, at.object, Doubt::Hides) || sees_thin(scene, eye, direction, at.object, Doubt::Hides)
}

fn towards(cube: &Cube, at: &Sighting) -> DVec3 {
    cube.direction(at.face.into(), at.x.into(), at.y.into())
}

/// Confirmed pixels on faces of [`FINE_PX`] of the objects missed in some views, by view and object.
fn measured_finely(scene: &Scene, cells: &[Cell], views: &[View], size_px: usize) -> BTreeMap<(usize, u32), u64> {
    let largest = |view: &View| view.claims.iter().map(|claim| claim.confirmed).max().unwrap_or(0);
    let mut missing: Vec<_> = (0..views.len())
        .map(|view| (largest(&views[view]), view))
        .filter(|(pixels, _)| *pixels > 0)
        .collect();
    missing.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    missing.truncate(FINE_EYES);
    if size_px == FINE_PX {
        missing.clear();
    }
    let measure = |cube: &mut Cube, view: usize| -> Vec<((usize, u32), u64)> {
        let View {
            cell,
            eye,
            claims: coarse,
            ..
        } = &views[view];
        cube.draw(scene, eye.position, &cells[*cell].expected(scene));
        let fine = claims(scene, eye.position, cube);
        let of = |object| fine.iter().find(|f| f.object == object).map_or(0, |f| f.confirmed);
        let sure = coarse.iter().filter(|claim| claim.confirmed > 0);
        // What was confirmed once is seen, even when it falls between the middles of all fine pixels.
        sure.map(|claim| ((view, claim.object), of(claim.object).max(1)))
            .collect()
    };
    missing
        .par_iter()
        .map_init(|| Cube::new(FINE_PX), |cube, (_, view)| measure(cube, *view))
        .flatten_iter()
        .collect()
}

fn summary(cells: &[Cell], views: &[View], fine: &BTreeMap<(usize, u32), u64>, size_px: usize) -> Outcome {
    let scale = (FINE_PX as f64 / size_px as f64).powi(2);
    let mut outcome = Outcome::default();
    let mut seen = vec![BTreeSet::new(); cells.len()];
    let mut eyes = vec![0; cells.len()];
    let mut worst: [BTreeMap<(CellId, u32), Miss>; 2] = Default::default();
    for (number, view) in views.iter().enumerate() {
        let cell = &cells[view.cell];
        outcome.eyes += 1;
        eyes[view.cell] += 1;
        outcome.pixels += view.covered;
        seen[view.cell].extend(view.seen.iter().copied());
        for claim in &view.claims {
            outcome.missed_pixels += claim.confirmed;
            outcome.unconfirmed_pixels += claim.pixels - claim.confirmed;
            let sure = claim.confirmed > 0;
            let coarse = if sure { claim.confirmed } else { claim.pixels };
            let miss = Miss {
                cell: cell.id,
                eye: view.eye.position.to_array(),
                place: view.eye.place,
                direction: claim.direction.to_array(),
                object: ObjectId(claim.object),
                pixels: fine
                    .get(&(number, claim.object))
                    .map_or((coarse as f64 * scale).ceil() as u64, |pixels| *pixels),
                conservative: cell.guarantee == Guarantee::Conservative,
            };
            let known = worst[usize::from(sure)].entry((cell.id, claim.object));
            let known = known.or_insert_with(|| miss.clone());
            if miss.pixels > known.pixels {
                *known = miss;
            }
        }
    }
    let [mut doubtful, sure] = worst;
    doubtful.retain(|key, _| !sure.contains_key(key));
    let largest_first = |misses: BTreeMap<_, Miss>| {
        let mut misses: Vec<_> = misses.into_values().collect();
        misses.sort_by_key(|miss| (std::cmp::Reverse(miss.pixels), miss.cell, miss.object));
        misses
    };
    outcome.misses = largest_first(sure);
    outcome.unconfirmed = largest_first(doubtful);
    let tightness = |(position, cell): (usize, &Cell)| Tightness {
        cell: cell.id,
        listed: cell.listed.len() as u64,
        seen: seen[position].len() as u64,
        eyes: eyes[position],
    };
    outcome.cells = cells.iter().enumerate().map(tightness).collect();
    outcome
}

#[cfg(test)]
mod tests;
