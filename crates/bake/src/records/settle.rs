//! Which of two roundings? Records round solid angles and fractions to powers of two. Where a value lies between two of
//! them, neighbours would take one or the other by chance, and every such change costs bytes in a step. So a cell takes
//! what a neighbour before it has taken, where that is right within a factor of two.

use std::collections::BTreeMap;

use belvedere_scene::{
    ObjectId,
    record::{CellRecord, Visible},
};

/// No value that was rounded is wrong by a larger factor.
const FACTOR: f32 = 2.0;

/// Rounds all records; what is visible stays. The records stand in the order of their ids.
pub(super) fn settle(records: &mut [CellRecord]) {
    for id in 0..records.len() {
        let (before, rest) = records.split_at_mut(id);
        let Some(record) = rest.first_mut() else { return };
        let mut taken: BTreeMap<ObjectId, Vec<&Visible>> = BTreeMap::new();
        for neighbour in record.adjacent.iter().filter_map(|cell| before.get(cell.index())) {
            for visible in neighbour.lpvs.iter().chain(&neighbour.opvs) {
                taken.entry(visible.object).or_default().push(visible);
            }
        }
        let exact = std::mem::replace(record, record.rounded());
        let exact: BTreeMap<_, _> = exact.lpvs.iter().chain(&exact.opvs).map(|v| (v.object, v)).collect();
        for visible in record.lpvs.iter_mut().chain(&mut record.opvs) {
            let (Some(exact), Some(taken)) = (exact.get(&visible.object), taken.get(&visible.object)) else {
                continue;
            };
            let angles = taken.iter().map(|other| other.solid_angle_sr);
            visible.solid_angle_sr = nearest(angles, exact.solid_angle_sr, visible.solid_angle_sr);
            let fractions = taken.iter().map(|other| other.fraction);
            visible.fraction = nearest(fractions, exact.fraction, visible.fraction);
        }
    }
}

/// The one of these values that is nearest to the exact one by ratio, if it is near enough.
fn nearest(values: impl Iterator<Item = f32>, exact: f32, otherwise: f32) -> f32 {
    let ratio = |value: f32| (value / exact).max(exact / value);
    let near = values.filter(|value| ratio(*value) <= FACTOR);
    near.min_by(|a, b| ratio(*a).total_cmp(&ratio(*b))).unwrap_or(otherwise)
}

#[cfg(test)]
mod tests {
    use belvedere_scene::{
        Bounds, CellId,
        record::{Guarantee, Hull},
    };

    use super::*;

    fn record(cell: u32, adjacent: &[u32], solid_angle_sr: f32, fraction: f32) -> CellRecord {
        CellRecord {
            cell: CellId(cell),
            hull: Hull::of_box(&Bounds {
                min: [0.0; 3],
                max: [1.0; 3],
            }),
            adjacent: adjacent.iter().map(|cell| CellId(*cell)).collect(),
            portals: Vec::new(),
            cpvs: Vec::new(),
            opvs: vec![Visible {
                object: ObjectId(3),
                fraction,
                solid_angle_sr,
                doors: Vec::new(),
            }],
            lpvs: Vec::new(),
            method: "sampled".to_owned(),
            guarantee: Guarantee::Sampled,
            miss_bound: 0.0,
            visible_level0_bytes: 0,
            visible_coarsest_bytes: 0,
        }
    }

    #[test]
    fn neighbours_agree_where_that_is_right_within_a_factor_of_two() {
        let sphere = 4.0 * std::f32::consts::PI;
        let mut records = [
            record(0, &[1], sphere / 7.0, 0.30),
            record(1, &[0, 2], sphere / 5.0, 0.40),
            record(2, &[1], sphere / 3.0, 0.80),
            record(3, &[], sphere / 5.0, 0.40),
        ];
        settle(&mut records);
        let found = records.map(|record| {
            let visible = &record.opvs[0];
            (sphere / visible.solid_angle_sr, visible.fraction)
        });
        assert_eq!(found, [(8.0, 0.25), (8.0, 0.25), (4.0, 1.0), (4.0, 0.5)]);
    }
}
