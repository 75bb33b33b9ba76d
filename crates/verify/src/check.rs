//! What do eyes in all cells see that the records do not list?
//!
//! Each eye draws one [`Cube`]. Objects in it that the cell's record lacks are claims, which [`sight`](crate::sight)
//! confirms or does not; both are counted. Eyes with confirmed misses are drawn once more at [`FINE_PX`], so that a miss
//! has the same size whatever the size of the first picture. What was seen at all bounds how tight the sets are.
//!
//! The same is done with doors closed ([`closed`](crate::closed)): a record says which of its entries vanish then.
//!
//! The outcome depends on scene, cells and settings only, not on the number of threads.

use std::collections::BTreeMap;

use belvedere_scene::{
    CellId, ObjectId,
    record::{CellRecord, Guarantee},
};
use glam::DVec3;
use rayon::prelude::*;

use crate::{
    block::Block,
    cube::{Cube, Sighting},
    eyes::{Eye, Room},
    leaf::Leaf,
    scene::Scene,
    sight::{Doubt, point_seen},
};

mod closely;
mod outcome;

pub use self::outcome::{Miss, Outcome, Tightness};
use closely::look_closely;
use outcome::summary;

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
    /// Objects that its record lists, each with the doors that hide it when one of them is closed.
    pub listed: Vec<(ObjectId, Vec<ObjectId>)>,
}

/// Eyes in a cell while some doors are closed.
#[derive(Debug)]
pub(crate) struct Situation<'a> {
    pub(crate) cell: &'a Cell,
    /// Rising.
    pub(crate) closed: Vec<ObjectId>,
    pub(crate) eyes: Vec<Eye>,
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
            listed: record.visible().iter().map(|v| (v.object, v.doors.clone())).collect(),
        }
    }

    /// Objects of the record that no door hides which is closed.
    fn listed_behind(&self, closed: &[ObjectId]) -> impl Iterator<Item = ObjectId> {
        let is_left = |doors: &[ObjectId]| !doors.iter().any(|door| closed.contains(door));
        let left = self.listed.iter().filter(move |(_, doors)| is_left(doors));
        left.map(|(object, _)| *object)
    }

    /// Says of each object whether the record lists it while the doors of the scene that are closed are.
    #[must_use]
    pub fn expected(&self, scene: &Scene) -> Vec<bool> {
        let mut expected = vec![false; scene.objects.len()];
        for object in self.listed_behind(scene.closed()) {
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
        self.room
            .eye(seed, self.id.0, number, &|place| scene.error_near_m(&Block::at(place)))
    }
}

/// How many eyes stand in a cell, or look at a door.
pub(crate) fn eyes_in(position: usize, cells: usize, eyes: u64) -> u64 {
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
    /// Pixels that show it through a gap that counts as closed.
    excused: u64,
}

struct View {
    situation: usize,
    eye: Eye,
    covered: u64,
    seen: Vec<u32>,
    claims: Vec<Claim>,
}

/// Looks from all eyes, all doors open; `advance` hears of each.
pub fn check(scene: &Scene, cells: &[Cell], settings: &Settings, advance: &(dyn Fn() + Sync)) -> Outcome {
    let situation = |(position, cell): (usize, &'_ Cell)| {
        let count = eyes_in(position, cells.len(), settings.eyes);
        (0..count)
            .map(|number| cell.eye(scene, settings.seed, number))
            .collect()
    };
    let eyes: Vec<Vec<Eye>> = cells.iter().enumerate().map(situation).collect();
    let situations = cells.iter().zip(eyes).map(|(cell, eyes)| Situation {
        cell,
        closed: Vec::new(),
        eyes,
    });
    look_from(scene, &situations.collect::<Vec<_>>(), settings.size_px, advance)
}

/// Looks from all eyes of some situations.
pub(crate) fn look_from(
    scene: &Scene,
    situations: &[Situation<'_>],
    size_px: usize,
    advance: &(dyn Fn() + Sync),
) -> Outcome {
    let eyes = situations.iter().enumerate();
    let eyes: Vec<_> = eyes
        .flat_map(|(number, situation)| situation.eyes.iter().map(move |eye| (number, *eye)))
        .collect();
    let mut views: Vec<View> = eyes
        .par_iter()
        .map_init(
            || Cube::new(size_px),
            |cube, (number, eye)| {
                let (seen, claims) = look(scene, &situations[*number], *eye, cube);
                advance();
                View {
                    situation: *number,
                    eye: *eye,
                    covered: cube.covered(),
                    seen,
                    claims,
                }
            },
        )
        .collect();
    look_closely(scene, situations, &mut views, size_px);
    let fine = measured_finely(scene, situations, &views, size_px);
    summary(situations, &views, &fine, size_px)
}

/// What an eye sees of what is expected, and what else.
fn look(scene: &Scene, situation: &Situation<'_>, eye: Eye, cube: &mut Cube) -> (Vec<u32>, Vec<Claim>) {
    let scene = &scene.with_closed(&situation.closed);
    let expected = drawn(scene, situation, eye, cube);
    let shown = cube.pixels().iter().zip(&expected).enumerate();
    let seen = shown
        .filter(|(_, (pixels, expected))| **pixels > 0 && **expected)
        .map(|(object, _)| object as u32);
    let most = |objects: usize| (RAYS_A_VIEW / objects.max(1)).clamp(1, RAYS_A_CLAIM);
    (seen.collect(), claims(scene, eye.position, cube, |_| true, most))
}

/// Draws what an eye sees in a scene whose doors are as they are; says of each object whether it is expected.
fn drawn(scene: &Scene, situation: &Situation<'_>, eye: Eye, cube: &mut Cube) -> Vec<bool> {
    let expected = situation.cell.expected(scene);
    cube.draw(scene, eye.position, &expected);
    expected
}

/// Some of the unexpected objects of a view, confirmed as far as they can be, each by at most so many rays if they are so many.
fn claims(
    scene: &Scene,
    eye: DVec3,
    cube: &Cube,
    asked: impl Fn(u32) -> bool,
    most: impl Fn(usize) -> usize,
) -> Vec<Claim> {
    let by_object = cube.unexpected().chunk_by(|a, b| a.object == b.object);
    let by_object: Vec<&[Sighting]> = by_object.filter(|sightings| asked(sightings[0].object)).collect();
    let most = most(by_object.len());
    let doors = scene.closed().iter().filter(|_| !by_object.is_empty());
    let leaves: Vec<_> = doors.filter_map(|door| Leaf::of(scene, *door)).collect();
    let gaps: Vec<_> = leaves.iter().map(|leaf| leaf.gap(scene)).collect();
    by_object
        .iter()
        .map(|sightings| {
            let rays = sightings.len().min(most);
            let tried = (0..rays).map(|ray| &sightings[ray * sightings.len() / rays]);
            let seen = tried.filter_map(|at| {
                let point = point_seen(scene, eye, towards(cube, at), at.object, Doubt::Hides)?;
                Some((at, gaps.iter().any(|gap| gap.is_passed(eye, point))))
            });
            let (excused, sure): (Vec<_>, Vec<_>) = seen.partition(|(_, by_gap)| *by_gap);
            let example = sure.first().map_or(&sightings[0], |(at, _)| *at);
            let share = |some: usize| (some * sightings.len()).div_ceil(rays) as u64;
            let confirmed = share(sure.len());
            Claim {
                object: example.object,
                direction: towards(cube, example).normalize(),
                pixels: sightings.len() as u64,
                confirmed,
                excused: share(excused.len()).min(sightings.len() as u64 - confirmed),
            }
        })
        .collect()
}

fn towards(cube: &Cube, at: &Sighting) -> DVec3 {
    cube.direction(at.face.into(), at.x.into(), at.y.into())
}

/// Confirmed pixels on faces of [`FINE_PX`] of the objects missed in some views, by view and object.
fn measured_finely(
    scene: &Scene,
    situations: &[Situation<'_>],
    views: &[View],
    size_px: usize,
) -> BTreeMap<(usize, u32), u64> {
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
    let measure = |cube: &mut Cube, number: usize| -> Vec<((usize, u32), u64)> {
        let view = &views[number];
        let (_, fine) = look(scene, &situations[view.situation], view.eye, cube);
        let of = |object| fine.iter().find(|f| f.object == object).map_or(0, |f| f.confirmed);
        let sure = view.claims.iter().filter(|claim| claim.confirmed > 0);
        // What was confirmed once is seen, even when it falls between the middles of all fine pixels.
        sure.map(|claim| ((number, claim.object), of(claim.object).max(1)))
            .collect()
    };
    missing
        .par_iter()
        .map_init(|| Cube::new(FINE_PX), |cube, (_, view)| measure(cube, *view))
        .flatten_iter()
        .collect()
}

#[cfg(test)]
mod tests;
