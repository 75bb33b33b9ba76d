//! What came out of all eyes, put together.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{CellId, ObjectId, record::Guarantee};
use serde::Serialize;

use super::{FINE_PX, Situation, View};
use crate::eyes::Place;

/// An object that an eye sees and the record of its cell does not list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// The cell.
    pub cell: CellId,
    /// The doors that are closed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub closed: Vec<ObjectId>,
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Tightness {
    /// The cell.
    pub cell: CellId,
    /// The doors that are closed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub closed: Vec<ObjectId>,
    /// Entries of its record that these do not hide.
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
    /// Pixels that show a missing object, but through a gap around a closed door that counts as closed, …
    pub gap_pixels: u64,
    /// … and how many objects of a cell's record with these doors closed that is.
    pub gap_objects: u64,
    /// Cells, rising, from which no eye saw a pixel of anything.
    pub blind: Vec<CellId>,
    /// One for each cell, and for the doors that were closed together.
    pub cells: Vec<Tightness>,
}

impl Outcome {
    /// The share of pixels that show an object which show a missing one.
    #[must_use]
    pub fn false_negative_rate(&self) -> f64 {
        self.missed_pixels as f64 / self.pixels.max(1) as f64
    }

    /// Mean over the cells of how many times more objects are listed than were seen; above the true overestimate,
    /// because eyes are finite. Cells from which nothing was seen do not count; `None` when there are no others.
    #[must_use]
    pub fn tightness_mean(&self) -> Option<f64> {
        let ratios: Vec<_> = self.cells.iter().filter_map(Tightness::ratio).collect();
        (!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64)
    }

    /// All entries of all records over all that were seen: the same, cells with large sets counting more. `None` when nothing was
    /// seen.
    #[must_use]
    pub fn tightness_of_entries(&self) -> Option<f64> {
        let sum = |count: fn(&Tightness) -> u64| self.cells.iter().map(count).sum::<u64>();
        let seen = sum(|c| c.seen);
        (seen > 0).then(|| sum(|c| c.listed) as f64 / seen as f64)
    }

    /// The cell whose set is least tight.
    #[must_use]
    pub fn loosest(&self) -> Option<Tightness> {
        let ratio = |cell: &Tightness| cell.ratio().unwrap_or(0.0);
        self.cells.iter().cloned().max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
    }
}

impl Tightness {
    /// Listed over seen; `None` when nothing was seen.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        (self.seen > 0).then(|| self.listed as f64 / self.seen as f64)
    }
}

/// Puts views together; `fine` says how large misses are on fine faces, by view and object.
pub(super) fn summary(
    situations: &[Situation<'_>],
    views: &[View],
    fine: &BTreeMap<(usize, u32), u64>,
    size_px: usize,
) -> Outcome {
    let scale = (FINE_PX as f64 / size_px as f64).powi(2);
    let mut outcome = Outcome::default();
    let mut seen = vec![BTreeSet::new(); situations.len()];
    let mut excused = BTreeSet::new();
    let mut blind: BTreeSet<CellId> = situations.iter().map(|situation| situation.cell.id).collect();
    let mut worst: [BTreeMap<(usize, u32), Miss>; 2] = Default::default();
    for (number, view) in views.iter().enumerate() {
        let Situation { cell, closed, .. } = &situations[view.situation];
        outcome.eyes += 1;
        outcome.pixels += view.covered;
        if view.covered > 0 {
            blind.remove(&cell.id);
        }
        seen[view.situation].extend(view.seen.iter().copied());
        for claim in &view.claims {
            outcome.missed_pixels += claim.confirmed;
            outcome.gap_pixels += claim.excused;
            outcome.unconfirmed_pixels += claim.pixels - claim.confirmed - claim.excused;
            let key = (view.situation, claim.object);
            if claim.excused > 0 {
                excused.insert(key);
            }
            let sure = claim.confirmed > 0;
            if !sure && claim.excused == claim.pixels {
                continue;
            }
            let coarse = if sure { claim.confirmed } else { claim.pixels };
            let miss = Miss {
                cell: cell.id,
                closed: closed.clone(),
                eye: view.eye.position.to_array(),
                place: view.eye.place,
                direction: claim.direction.to_array(),
                object: ObjectId(claim.object),
                pixels: fine
                    .get(&(number, claim.object))
                    .map_or((coarse as f64 * scale).ceil() as u64, |pixels| *pixels),
                conservative: cell.guarantee == Guarantee::Conservative,
            };
            let known = worst[usize::from(sure)].entry(key);
            let known = known.or_insert_with(|| miss.clone());
            if miss.pixels > known.pixels {
                *known = miss;
            }
        }
    }
    let [mut doubtful, sure] = worst;
    doubtful.retain(|key, _| !sure.contains_key(key) && !excused.contains(key));
    let largest_first = |misses: BTreeMap<_, Miss>| {
        let mut misses: Vec<_> = misses.into_values().collect();
        misses.sort_by(|a, b| {
            let order = |miss: &Miss| (std::cmp::Reverse(miss.pixels), miss.cell, miss.object);
            order(a).cmp(&order(b)).then_with(|| a.closed.cmp(&b.closed))
        });
        misses
    };
    outcome.blind = blind.into_iter().collect();
    outcome.gap_objects = excused.iter().filter(|key| !sure.contains_key(*key)).count() as u64;
    outcome.misses = largest_first(sure);
    outcome.unconfirmed = largest_first(doubtful);
    let tightness = |(situation, seen): (&Situation<'_>, &BTreeSet<u32>)| Tightness {
        cell: situation.cell.id,
        closed: situation.closed.clone(),
        listed: situation.cell.listed_behind(&situation.closed).count() as u64,
        seen: seen.len() as u64,
        eyes: situation.eyes.len() as u64,
    };
    outcome.cells = situations.iter().zip(&seen).map(tightness).collect();
    outcome
}
