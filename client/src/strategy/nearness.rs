//! In how many steps from here is a model needed? Counted from cell to adjacent cell, breadth first, over what is known of
//! the cells around; what no known cell near by sees is infinitely far (`viewer/core/nearness.ts`).

use std::collections::{HashMap, HashSet};

use belvedere_scene::{CellId, ModelId};

use super::{ahead::Cells, sight::Seen};

/// Cells further than this are not asked.
const FURTHEST_STEPS: u32 = 6;

/// Steps to each model that a known cell near by sees.
#[must_use]
pub fn steps_to_models<'a>(
    here: CellId,
    cells: &impl Cells,
    seen_from: impl Fn(CellId) -> &'a [Seen],
) -> HashMap<ModelId, u32> {
    let (mut found, mut met, mut ring) = (HashMap::new(), HashSet::from([here]), vec![here]);
    for steps in 0..=FURTHEST_STEPS {
        for seen in ring.iter().flat_map(|cell| seen_from(*cell)) {
            found.entry(seen.model).or_insert(steps);
        }
        let next = ring
            .iter()
            .filter_map(|cell| cells.entry(*cell))
            .flat_map(|entry| &entry.adjacent);
        ring = next.copied().filter(|cell| met.insert(*cell)).collect();
        if ring.is_empty() {
            break;
        }
    }
    found
}
