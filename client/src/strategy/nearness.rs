//! In how many steps from here is a model needed? Counted from cell to adjacent cell, breadth first, over what is known of
//! the cells around; what no known cell near by sees is infinitely far (`viewer/core/strategy/nearness.ts`).

use std::collections::{HashMap, HashSet};

use belvedere_scene::{CellId, ModelId};

use super::{ahead::Cells, sight::Seen};

/// What is visible from here, and in how many steps the rest is needed.
#[derive(Debug, Clone, Default)]
pub struct Nearness {
    visible: HashSet<ModelId>,
    steps: HashMap<ModelId, u32>,
}

impl Nearness {
    /// As [`steps_to_models`] counts them, beside what is visible.
    #[must_use]
    pub fn new(visible: HashSet<ModelId>, steps: HashMap<ModelId, u32>) -> Self {
        Self { visible, steps }
    }

    /// What is visible.
    #[must_use]
    pub fn visible(&self) -> &HashSet<ModelId> {
        &self.visible
    }

    /// In how many steps a model is needed; 0 for what is visible, and for nothing else.
    #[must_use]
    pub fn steps_to(&self, model: ModelId) -> u32 {
        match self.visible.contains(&model) {
            true => 0,
            false => self.steps.get(&model).map_or(u32::MAX, |steps| (*steps).max(1)),
        }
    }

    /// Whether the cell or one adjacent to it sees a model.
    #[must_use]
    pub fn is_near(&self, model: ModelId) -> bool {
        self.steps_to(model) <= 1
    }
}

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
