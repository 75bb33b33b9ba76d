//! Which cuts tell nobody anything?
//!
//! Cuts are chosen by what rays see ([`merge`](super::merge)), but what is published is what proofs do not hide. Among vines, trees, statues
//! and rocks proofs hide nothing: whoever crosses a cut there fetches another record that says the same. So a subtree becomes one
//! cell when from its cells on average nearly as much is published as from all of them together, in objects and in bytes, and no
//! good part of it does better. Sets that all cells have, as those of a first look, decide that at once. Where a set is dear, a few cells
//! of a large subtree are looked from first; where these differ, its halves are asked about.
//!
//! Nobody walks through walls for that: what is built along the cuts counts, ground, rocks and leaves do not, as long as what is
//! left is one place with one floor.
//!
//! As a regression tree is pruned by what held-out samples say, not by those that grew it (Breiman, Friedman, Olshen & Stone,
//! *Classification and Regression Trees*, 1984, §3.4).

use std::collections::BTreeMap;

use super::{
    CellGraph, eye_level, graph_of,
    merge::{is_even, most_wall_m2, union},
    partition::{Tree, filled_m3},
};
use crate::{progress::Cancelled, world::World};

/// From the pieces of a cell so much less must be published on average than from all of it, as a share of that.
const LEAST_GAIN: f64 = 0.1;
/// From no cell that was looked from may so much less be published: a yard in a field.
const MOST_GAIN: f64 = 0.25;
/// Subtrees of fewer cells are not asked about: looking from a few of them is no cheaper than from all …
const FEW: usize = 16;
/// … and from so many cells of a larger one it is seen what proofs hide there.
const LOOKS: usize = 6;

/// How space is cut, and what is known of what is seen.
#[derive(Clone)]
pub struct Partition {
    tree: Tree,
    /// What each leaf sees at a glance, rising.
    seen: Vec<Vec<u32>>,
}

/// Gives the sets that would be published for some cells, rising.
pub type Look<'a> = dyn FnMut(&[usize]) -> Result<Vec<Vec<u32>>, Cancelled> + 'a;

/// What is published: objects, and bytes of what draws them.
type Size = [f64; 2];

/// What is published of a subtree.
struct Summary {
    /// From anywhere in it, rising.
    all: Vec<u32>,
    /// From one of its cells where people are, on average by volume.
    mean: Size,
    built_m2: f64,
    /// What can be reached where people are, in m³ …
    peopled_m3: f64,
    /// … and of the largest parts in it where cuts spare something.
    uneven_m3: f64,
}

impl Partition {
    pub(super) fn new(tree: Tree, seen: Vec<Vec<u32>>) -> Self {
        Self { tree, seen }
    }

    /// Its cells, with the openings between them.
    #[must_use]
    pub fn graph(&self, world: &World) -> CellGraph {
        graph_of(world, &self.tree)
    }

    /// Whether so many cells that looking from some of them may tell something.
    #[must_use]
    pub fn is_fine(&self) -> bool {
        self.seen.len() >= FEW
    }

    /// Without the cuts that tell nobody anything when these sets, rising, are published for its cells. `bytes` are those of each
    /// object.
    #[must_use]
    pub fn rejoined(&self, sets: &[Vec<u32>], bytes: &[f64]) -> Self {
        let idle = self.idle(sets, bytes);
        let mut topmost = Vec::new();
        self.topmost(0, &idle, &mut topmost);
        self.without(&topmost)
    }

    /// As [`rejoined`](Self::rejoined) when nobody has these sets yet. `rough` are larger ones, that are had without looking.
    ///
    /// # Errors
    /// When cancelled.
    pub fn tried(&self, rough: &[Vec<u32>], bytes: &[f64], look: &mut Look<'_>) -> Result<Self, Cancelled> {
        let idle = self.idle(rough, bytes);
        let mut known: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        let mut joined = Vec::new();
        let mut open = Vec::new();
        self.topmost(0, &idle, &mut open);
        loop {
            let cells_of: Vec<_> = open.iter().map(|node| (*node, self.tree.leaves_of(*node))).collect();
            let mut asked: Vec<_> = cells_of.into_iter().filter(|(_, cells)| cells.len() >= FEW).collect();
            if asked.is_empty() {
                return Ok(self.without(&joined));
            }
            let number = self.numbers();
            let mut wanted: Vec<usize> = Vec::new();
            for (node, cells) in &mut asked {
                *cells = cells.iter().map(|leaf| number[leaf]).collect();
                wanted.extend(self.samples(*node, cells));
            }
            wanted.sort_unstable();
            wanted.retain(|cell| !known.contains_key(cell));
            known.extend(wanted.iter().copied().zip(look(&wanted)?));
            open.clear();
            for (node, cells) in asked {
                if self.is_idle_by(&cells, &self.samples(node, &cells), &known, bytes) {
                    joined.push(node);
                } else {
                    let children = self.tree.nodes[node].children.into_iter().flatten();
                    children.for_each(|child| self.topmost(child, &idle, &mut open));
                }
            }
        }
    }

    /// The number of the cell that each leaf is.
    fn numbers(&self) -> BTreeMap<usize, usize> {
        self.tree.leaves().into_iter().zip(0..).collect()
    }

    /// The cells of a subtree, given by their numbers, that are looked from: some all over it, where people are.
    fn samples(&self, node: usize, cells: &[usize]) -> Vec<usize> {
        let leaves = self.tree.leaves();
        let over_heads = self.tree.nodes[node].over_heads;
        let peopled = cells
            .iter()
            .filter(|cell| over_heads || !self.tree.nodes[leaves[**cell]].over_heads);
        let mut peopled: Vec<usize> = peopled.copied().collect();
        if peopled.is_empty() {
            peopled = cells.to_vec();
        }
        let count = peopled.len().min(LOOKS);
        (0..count)
            .map(|look| peopled[(2 * look + 1) * peopled.len() / (2 * count)])
            .collect()
    }

    /// Whether nearly as much is published from each of these samples of some cells as may be from all the cells.
    fn is_idle_by(&self, cells: &[usize], samples: &[usize], known: &BTreeMap<usize, Vec<u32>>, bytes: &[f64]) -> bool {
        let sets: Vec<_> = samples.iter().map(|cell| &known[cell]).collect();
        let mut all: Vec<u32> = sets.iter().copied().flatten().copied().collect();
        all.extend(cells.iter().flat_map(|cell| &self.seen[*cell]));
        all.sort_unstable();
        all.dedup();
        let all = size(&all, bytes);
        let gains: Vec<_> = sets.iter().map(|set| gain(all, size(set, bytes))).collect();
        gains.iter().sum::<f64>() <= LEAST_GAIN * gains.len() as f64 && gains.iter().all(|gain| *gain <= MOST_GAIN)
    }

    /// The highest nodes of a subtree that are marked and have children.
    fn topmost(&self, from: usize, marked: &[bool], into: &mut Vec<usize>) {
        if let Some([low, high]) = self.tree.nodes[from].children {
            if marked[from] {
                into.push(from);
            } else {
                self.topmost(low, marked, into);
                self.topmost(high, marked, into);
            }
        }
    }

    /// With one cell for each of these nodes.
    fn without(&self, nodes: &[usize]) -> Self {
        let number = self.numbers();
        let mut tree = self.tree.clone();
        let mut seen: BTreeMap<usize, Vec<u32>> = number
            .iter()
            .map(|(leaf, cell)| (*leaf, self.seen[*cell].clone()))
            .collect();
        for node in nodes {
            let below = self.tree.leaves_of(*node).into_iter();
            let all = below.filter_map(|leaf| seen.remove(&leaf)).reduce(|a, b| union(&a, &b));
            seen.insert(*node, all.unwrap_or_default());
            tree.nodes[*node].children = None;
        }
        let seen = tree
            .leaves()
            .iter()
            .map(|leaf| seen.remove(leaf).unwrap_or_default())
            .collect();
        Self { tree, seen }
    }

    /// For each node whether all its cuts tell nobody anything, by the sets of the cells. Children stand after their parents.
    fn idle(&self, sets: &[Vec<u32>], bytes: &[f64]) -> Vec<bool> {
        let (tree, number) = (&self.tree, self.numbers());
        let metre = f64::from(tree.voxels.grid.metre());
        let mut idle = vec![false; tree.nodes.len()];
        let mut summaries: Vec<Option<Summary>> = tree.nodes.iter().map(|_| None).collect();
        for index in (0..tree.nodes.len()).rev() {
            let node = &tree.nodes[index];
            let children = node
                .children
                .map(|children| children.map(|child| summaries[child].take()));
            summaries[index] = match children {
                Some([Some(low), Some(high)]) => {
                    let mut both = joined([low, high], node.at_eye_level, bytes);
                    both.built_m2 += node.built_m2;
                    idle[index] = is_even(both.uneven_m3, both.peopled_m3, metre)
                        && both.built_m2 <= most_wall_m2(tree, index)
                        && eye_level::is_one_place(&tree.voxels, &node.voxels, node.over_heads);
                    Some(both)
                }
                _ => number.get(&index).map(|cell| Summary {
                    mean: size(&sets[*cell], bytes),
                    all: sets[*cell].clone(),
                    built_m2: 0.0,
                    peopled_m3: filled_m3(&tree.voxels, &node.voxels),
                    uneven_m3: 0.0,
                }),
            };
        }
        idle
    }
}

/// Two subtrees together.
fn joined([low, high]: [Summary; 2], at_eye_level: bool, bytes: &[f64]) -> Summary {
    // Nobody is in what lies over heads.
    let people_above = if at_eye_level { 0.0 } else { 1.0 };
    let sum = |low: f64, high: f64| low + people_above * high;
    let peopled_m3 = sum(low.peopled_m3, high.peopled_m3);
    let weighted = |i: usize| sum(low.mean[i] * low.peopled_m3, high.mean[i] * high.peopled_m3);
    let mean = [0, 1].map(|i| weighted(i) / peopled_m3.max(f64::MIN_POSITIVE));
    let all = union(&low.all, &high.all);
    let uneven_m3 = if gain(size(&all, bytes), mean) > LEAST_GAIN {
        peopled_m3
    } else {
        sum(low.uneven_m3, high.uneven_m3)
    };
    Summary {
        all,
        mean,
        built_m2: low.built_m2 + high.built_m2,
        peopled_m3,
        uneven_m3,
    }
}

fn size(set: &[u32], bytes: &[f64]) -> Size {
    [set.len() as f64, set.iter().map(|object| bytes[*object as usize]).sum()]
}

/// The share of all that is not in a part of it, in objects or in bytes, whichever is more.
fn gain(all: Size, part: Size) -> f64 {
    let share = |i: usize| (all[i] - part[i]) / all[i].max(f64::MIN_POSITIVE);
    share(0).max(share(1))
}
