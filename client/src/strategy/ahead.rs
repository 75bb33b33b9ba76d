//! Which cells may be entered soon, and when at the earliest? In three steps (Marvie & Bouatouch, *A VRML97-X3D extension
//! for massive scenery management in virtual worlds*, 2004, §6.1): where one heads, the other cells next door, and those
//! beyond where one heads.
//!
//! One heads for the cell behind the nearest opening that lies ahead in the direction of travel, as
//! `viewer/core/strategy/ahead.ts` has it, which need not be hit exactly. Who turns round on the spot may be in any other cell
//! next door as soon as the way to its opening takes; so every cell has a time, and what there is no hurry for can wait.

use std::collections::HashSet;

use belvedere_scene::{CellId, index::CellEntry, record::Portal};

use super::motion::{dot, length};

/// Who stands may start to walk at this speed.
const WALKING_MPS: f64 = 1.4;
/// An opening further away than this is not what one heads for.
const RANGE_M: f64 = 30.0;
/// Who would have to turn for a cell is there later by so much.
const TURN_S: f64 = 1.0;

/// What lies ahead is due so many seconds before it could be needed …
const MARGIN_S: f64 = 3.0;
/// … and this many times as long as fetching it takes.
const CAUTION: f64 = 2.0;
/// What cannot be needed sooner than this waits although the line rests.
pub(super) const HORIZON_S: f64 = 30.0;

/// What is known of cells.
pub trait Cells {
    /// What the index knows of a cell.
    fn entry(&self, cell: CellId) -> Option<&CellEntry>;
    /// Its openings; none while its record is unknown.
    fn portals(&self, cell: CellId) -> &[Portal];
}

/// A cell that may be entered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// The cell.
    pub cell: CellId,
    /// Where one heads (1), next door (2), or beyond where one heads (3).
    pub step: u8,
    /// One may be there after so long.
    pub in_s: f64,
}

/// The cells that may be entered, in the order in which to care for them, each once.
#[must_use]
pub fn approaches(here: CellId, cells: &impl Cells, position: [f64; 3], velocity_mps: [f64; 3]) -> Vec<Approach> {
    let Some(entry) = cells.entry(here) else {
        return Vec::new();
    };
    let speed_mps = length(velocity_mps);
    let is_walking = speed_mps > 0.0;
    let pace_mps = if is_walking { speed_mps } else { WALKING_MPS };
    let mut ways: Vec<Way> = entry
        .adjacent
        .iter()
        .map(|cell| Way::to(*cell, here, cells, position))
        .collect();
    for way in &mut ways {
        way.is_ahead = is_walking && dot(velocity_mps, way.direction) > 0.0;
    }
    ways.sort_by(|a, b| a.away_m.total_cmp(&b.away_m).then(a.cell.cmp(&b.cell)));
    let heading = ways.iter().find(|way| way.is_ahead && way.away_m <= RANGE_M).copied();
    let mut found: Vec<Approach> = Vec::new();
    if let Some(way) = heading {
        found.push(Approach {
            cell: way.cell,
            step: 1,
            in_s: way.away_m / pace_mps,
        });
    }
    found.extend(
        ways.iter()
            .filter(|way| Some(way.cell) != heading.map(|h| h.cell))
            .map(|way| Approach {
                cell: way.cell,
                step: 2,
                in_s: way.away_m / pace_mps + if is_walking && !way.is_ahead { TURN_S } else { 0.0 },
            }),
    );
    let mut named: HashSet<CellId> = found.iter().map(|approach| approach.cell).chain([here]).collect();
    if let Some(way) = heading
        && let Some(next) = cells.entry(way.cell)
    {
        for cell in next.adjacent.iter().filter(|cell| named.insert(**cell)) {
            let beyond = Way::to(*cell, way.cell, cells, way.at);
            found.push(Approach {
                cell: *cell,
                step: 3,
                in_s: (way.away_m + beyond.away_m) / pace_mps,
            });
        }
    }
    found
}

/// Whether there is just time enough to fetch so many bytes before one could be there.
#[must_use]
pub fn is_due(in_s: f64, bytes: f64, bytes_per_s: f64) -> bool {
    in_s <= MARGIN_S + CAUTION * bytes / bytes_per_s
}

/// Whether it is time to learn what can be seen from a cell: before any of that could be due.
#[must_use]
pub fn is_worth_knowing(in_s: f64, bytes_per_s: f64) -> bool {
    in_s <= HORIZON_S || is_due(in_s, 64.0 * 1024.0, bytes_per_s)
}

/// The way to the nearest opening that leads to a cell.
#[derive(Debug, Clone, Copy)]
struct Way {
    cell: CellId,
    away_m: f64,
    /// Where the opening is, and the direction of its middle.
    at: [f64; 3],
    direction: [f64; 3],
    is_ahead: bool,
}

impl Way {
    fn to(cell: CellId, from: CellId, cells: &impl Cells, position: [f64; 3]) -> Self {
        let openings = cells.portals(from).iter().filter(|portal| portal.to == cell);
        let boxes = openings.map(|portal| belvedere_scene::Bounds::around(portal.polygon.iter().copied()));
        let nearest = boxes
            .filter(|bounds| !bounds.is_empty())
            .min_by(|a, b| a.distance_m(position).total_cmp(&b.distance_m(position)));
        let bounds = nearest.or_else(|| cells.entry(cell).map(|entry| entry.bounds));
        let away_m = bounds.map_or(f64::INFINITY, |bounds| bounds.distance_m(position));
        let at = bounds.map_or(position, |bounds| bounds.center());
        Self {
            cell,
            away_m,
            at,
            direction: std::array::from_fn(|a| at[a] - position[a]),
            is_ahead: false,
        }
    }
}
