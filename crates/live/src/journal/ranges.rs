//! What rules and what ground may a recording tell of? Nothing that no server has, so that work stays as small as there.

use belvedere_scene::Bounds;

use super::{Ground, replay::ReplayError};
use crate::{Ms, crowd::Crowding, world::Rules};

/// No time of the rules is longer: an hour.
const LONGEST_MS: Ms = 3_600_000;
/// No session is sent more.
const MOST_BYTES_PER_S: f64 = 1e12;
/// Nothing of a scene is further from zero, along each axis.
const MOST_M: f64 = 1e9;

pub(super) fn check_rules(rules: &Rules) -> Result<(), ReplayError> {
    let times = [
        ("tick_ms", rules.tick_ms, 1),
        ("round_trip_ms", rules.round_trip_ms, 0),
        ("shortest_stay_ms", rules.shortest_stay_ms, 0),
        ("longest_tbv_ms", rules.longest_tbv_ms, 0),
        ("longest_unheard_tbv_ms", rules.longest_unheard_tbv_ms, 0),
        ("grace_ms", rules.grace_ms, 0),
    ];
    for (what, time_ms, least_ms) in times {
        within(what, time_ms as f64, least_ms as f64, LONGEST_MS as f64)?;
    }
    within("bytes_per_s", rules.bytes_per_s, 0.0, MOST_BYTES_PER_S)?;
    rules.crowd.as_ref().map_or(Ok(()), check_crowding)
}

pub(super) fn check_ground(ground: &Ground) -> Result<(), ReplayError> {
    let boxes = ground.cells.iter().map(|cell| ("the box of a cell", &cell.bounds));
    for (what, bounds) in boxes.chain([("the box around the scene", &ground.bounds)]) {
        check_box(what, bounds)?;
    }
    let sound = ground.foliage.is_sound();
    sound
        .then_some(())
        .ok_or(ReplayError::Impossible("foliage is where none can be"))
}

fn check_crowding(crowding: &Crowding) -> Result<(), ReplayError> {
    within("crowd.moved_m", crowding.moved_m, 0.0, MOST_M)?;
    within("crowd.lasts_ms", crowding.lasts_ms as f64, 0.0, LONGEST_MS as f64)?;
    within("crowd.cull_below", crowding.cull_below, 0.0, 1.0)
}

fn check_box(what: &'static str, bounds: &Bounds) -> Result<(), ReplayError> {
    for axis in 0..3 {
        within(what, bounds.min[axis], -MOST_M, MOST_M)?;
        within(what, bounds.max[axis], bounds.min[axis], MOST_M)?;
    }
    Ok(())
}

fn within(what: &'static str, value: f64, least: f64, most: f64) -> Result<(), ReplayError> {
    let inside = (least..=most).contains(&value);
    let error = ReplayError::OutOfRange {
        what,
        value,
        least,
        most,
    };
    inside.then_some(()).ok_or(error)
}
