//! What is known of a place in the quadtree?

use std::collections::BTreeSet;

use belvedere_scene::{ObjectId, foliage::Slab};

use super::Square;

/// A leaf, by its number.
pub(super) type Leaf = usize;

/// A place in the tree.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) square: Square,
    pub(super) parent: Option<usize>,
    /// None of a leaf.
    pub(super) children: Option<[usize; 4]>,
    pub(super) standing: BTreeSet<ObjectId>,
    /// Of who stands here.
    pub(super) solidity: f64,
    /// Heights that all who stand here have; empty when from is above to.
    pub(super) heights: [f64; 2],
    /// How many squares of foliage have their middle in here.
    pub(super) plants: usize,
    /// How solid it is because of foliage; none until somebody looks.
    pub(super) slabs: Option<Vec<Slab>>,
    pub(super) beside: Vec<Leaf>,
}

/// What a leaf hides of what is behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hiding {
    pub(super) solidity: f64,
    /// For eyes and targets at these heights.
    pub(super) heights: [f64; 2],
}

impl Node {
    pub(super) fn leaf(square: Square, parent: Option<usize>) -> Self {
        Self {
            square,
            parent,
            children: None,
            standing: BTreeSet::new(),
            solidity: 0.0,
            heights: [f64::NEG_INFINITY, f64::INFINITY],
            plants: 0,
            slabs: None,
            beside: Vec::new(),
        }
    }

    /// How many people and squares of foliage there are.
    pub(super) fn things(&self) -> usize {
        self.standing.len() + self.plants
    }

    /// What it hides at a height: who stands in it and the foliage there, as if the one were spread evenly before the other.
    pub(super) fn hides_at(&self, height_m: f64) -> Option<Hiding> {
        let reaches = |heights: &[f64; 2]| heights[0] <= height_m && height_m <= heights[1];
        let people = Hiding {
            solidity: self.solidity,
            heights: self.heights,
        };
        let slabs = self.slabs.iter().flatten();
        let leaves = slabs.map(|slab| Hiding {
            solidity: slab.solidity,
            heights: [slab.from_m, slab.to_m],
        });
        let here = [people].into_iter().chain(leaves);
        here.filter(|hiding| hiding.solidity > 0.0 && reaches(&hiding.heights))
            .reduce(|a, b| Hiding {
                solidity: 1.0 - (1.0 - a.solidity) * (1.0 - b.solidity),
                heights: [a.heights[0].max(b.heights[0]), a.heights[1].min(b.heights[1])],
            })
    }
}
