//! Which cuts were not worth it?
//!
//! A partition by walls alone cuts open country into pieces that all see the same, and cannot know where a set is so
//! large or uneven that another cut pays. So space is cut finer than needed, what each piece sees is estimated with a
//! few rays, and from the leaves up a subtree becomes one cell again unless its pieces see clearly less than it does, or
//! pieces of a good part of it do: the pruning of Breiman, Friedman, Olshen & Stone, *Classification and Regression Trees* (1984), with the mean size of
//! the visible set for the cost. A cut along a wall stays however little differs: a cell must
//! not lead through walls.

use glam::DVec3;

use super::partition::{Node, Tree, filled_m3};

/// The pieces of a cell together must see less on average than it does by at least this share of what it sees.
const MIN_GAIN: f64 = 0.25;
/// A subtree stays as it is when parts of it that see clearly less in pieces take this share of it: a town in its fields.
const MIN_UNEVEN: f64 = 0.1;
/// When there are too many cells, so many times more, again and again.
const STRICTER: f64 = 1.5;
/// The walls along cuts inside a cell may be as large as this share of half its surface: more of them and it stays cut.
const MAX_WALL_SHARE: f64 = 0.02;
/// What can be reached of a box together must be at least this share of what can be reached of its pieces.
const MIN_FILL_KEPT: f64 = 0.98;

/// What is known of a subtree.
struct Summary {
    /// What is seen from anywhere in it, rising.
    seen: Vec<u32>,
    /// The mean number of objects that are seen from its finest pieces where people are, by volume.
    mean_seen: f64,
    /// The walls along all its cuts, in m².
    wall_m2: f64,
    /// Volume of the boxes, in m³ …
    boxes_m3: f64,
    /// … what can be reached of them where people are …
    peopled_m3: f64,
    /// … and of the largest parts in it that see clearly less in pieces than together.
    uneven_m3: f64,
}

/// Takes back cuts that are not worth it, and more of them while there are more than so many cells. `seen` is what each
/// leaf sees, rising, in the order of the leaves. Whether there are few enough now.
pub(super) fn merge(tree: &mut Tree, seen: &[Vec<u32>], max_cells: usize) -> bool {
    let mut min_gain = MIN_GAIN;
    let seen: Vec<_> = tree
        .leaves()
        .into_iter()
        .zip(seen)
        .map(|(leaf, seen)| (leaf, seen.clone()))
        .collect();
    let mut of_leaf = vec![Vec::new(); tree.nodes.len()];
    for (leaf, seen) in seen {
        of_leaf[leaf] = seen;
    }
    loop {
        let merged = prune(tree, &of_leaf, min_gain);
        let cells = count(tree, &merged);
        if cells <= max_cells || min_gain > 1.0 {
            for (node, merged) in tree.nodes.iter_mut().zip(merged) {
                if merged {
                    node.children = None;
                }
            }
            return cells <= max_cells;
        }
        min_gain *= STRICTER;
    }
}

/// How many cells are left.
fn count(tree: &Tree, merged: &[bool]) -> usize {
    let mut cells = 0;
    let mut stack = vec![0];
    while let Some(node) = stack.pop() {
        match tree.nodes[node].children {
            Some(children) if !merged[node] => stack.extend(children),
            _ => cells += 1,
        }
    }
    cells
}

/// For each node whether it becomes one cell. Children stand after their parents.
fn prune(tree: &Tree, of_leaf: &[Vec<u32>], min_gain: f64) -> Vec<bool> {
    let mut merged = vec![false; tree.nodes.len()];
    let mut summaries: Vec<Option<Summary>> = tree.nodes.iter().map(|_| None).collect();
    for index in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[index];
        let [min, max] = tree.voxels.grid.bounds(&node.voxels);
        let size = (max - min).as_dvec3();
        let children = node
            .children
            .map(|children| children.map(|child| summaries[child].take()));
        summaries[index] = match children {
            Some([Some(low), Some(high)]) => {
                let (summary, one) = joined([low, high], node, size, min_gain);
                merged[index] = one;
                Some(summary)
            }
            _ => Some(Summary {
                mean_seen: of_leaf[index].len() as f64,
                seen: of_leaf[index].clone(),
                wall_m2: 0.0,
                boxes_m3: size.element_product(),
                peopled_m3: filled_m3(tree.voxels, &node.voxels),
                uneven_m3: 0.0,
            }),
        };
    }
    merged
}

/// Two subtrees together, and whether they become one cell.
fn joined([low, high]: [Summary; 2], node: &Node, size: DVec3, min_gain: f64) -> (Summary, bool) {
    let (boxes_m3, box_m3) = (low.boxes_m3 + high.boxes_m3, size.element_product());
    let people_above = if node.at_eye_level { 0.0 } else { 1.0 };
    let sum = |low: f64, high: f64| low + people_above * high;
    let peopled_m3 = sum(low.peopled_m3, high.peopled_m3);
    let mean_seen =
        sum(low.mean_seen * low.peopled_m3, high.mean_seen * high.peopled_m3) / peopled_m3.max(f64::MIN_POSITIVE);
    let seen = union(&low.seen, &high.seen);
    let wall_m2 = low.wall_m2 + high.wall_m2 + node.wall_m2;
    let half_m2 = size.x * size.y + size.y * size.z + size.z * size.x;
    let whole = wall_m2 <= MAX_WALL_SHARE * half_m2 && boxes_m3 >= MIN_FILL_KEPT * box_m3;
    let gain = (seen.len() as f64 - mean_seen) / (seen.len() as f64).max(1.0);
    let uneven_m3 = if gain > min_gain {
        peopled_m3
    } else {
        sum(low.uneven_m3, high.uneven_m3)
    };
    let one = whole && uneven_m3 <= MIN_UNEVEN * peopled_m3;
    let summary = Summary {
        seen,
        mean_seen,
        wall_m2,
        boxes_m3: if one { box_m3 } else { boxes_m3 },
        peopled_m3,
        uneven_m3: if one { 0.0 } else { uneven_m3 },
    };
    (summary, one)
}

fn union(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut all: Vec<_> = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
