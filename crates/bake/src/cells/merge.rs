//! Which cuts were not worth it?
//!
//! A partition by walls alone cuts open country into pieces that all see the same, and cannot know where a set is so
//! large or uneven that another cut pays. So space is cut finer than needed, what each piece sees is estimated with a
//! few rays, and from the leaves up a subtree becomes one cell again unless its pieces see clearly less than it does, or
//! pieces of a good part of it do. While there are still too many cells, the subtree that gains least for each of its cells
//! becomes one: the pruning of Breiman, Friedman, Olshen & Stone, *Classification and Regression Trees* (1984), §3.3 (weakest
//! links), with the mean size of the visible set for the cost. A cut along a wall stays however little differs: a cell must
//! not lead through walls.

use glam::DVec3;

use super::partition::{Node, Tree, filled_m3};

/// The pieces of a cell together must see less on average than it does by at least this share of what it sees.
const MIN_GAIN: f64 = 0.25;
/// A subtree stays as it is when parts of it that see clearly less in pieces take this share of it: a town in its fields …
const MIN_UNEVEN: f64 = 0.1;
/// … or as much as so many rooms have: a town in very wide fields.
const UNEVEN_ROOMS: f64 = 20.0;
/// The volume of a room in cubic metres, in [`Grid::metre`](super::grid::Grid::metre).
const ROOM_M3: f64 = 300.0;
/// The walls along cuts inside a cell may be as large as this share of half its surface: more of them and it stays cut.
const MAX_WALL_SHARE: f64 = 0.02;
/// … and as these, in square metres, in [`Grid::metre`](super::grid::Grid::metre): houses in very wide fields are no fences.
const MAX_WALL_M2: f64 = 200.0;
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

/// A node as a place to prune.
#[derive(Clone, Copy)]
struct Link {
    /// How many objects are seen from all of it, times its weight.
    as_one: f64,
    /// Whether it may be one cell.
    whole: bool,
    /// Whether it is one.
    merged: bool,
}

/// Takes back cuts that are not worth it, and more of them while there are more than so many cells. `seen` is what each
/// leaf sees, rising, in the order of the leaves. What each leaf that is left sees, and whether there are few enough now.
pub(super) fn merge(tree: &mut Tree, seen: &[Vec<u32>], max_cells: usize) -> (Vec<Vec<u32>>, bool) {
    let mut of_leaf = vec![Vec::new(); tree.nodes.len()];
    for (leaf, seen) in tree.leaves().into_iter().zip(seen) {
        of_leaf[leaf].clone_from(seen);
    }
    let mut links = prune(tree, &of_leaf);
    let cells = prune_weakest(tree, &mut links, max_cells);
    for index in (0..tree.nodes.len()).rev().filter(|index| links[*index].merged) {
        if let Some([low, high]) = tree.nodes[index].children.take() {
            of_leaf[index] = union(&of_leaf[low], &of_leaf[high]);
        }
    }
    let seen = tree.leaves().into_iter().map(|leaf| std::mem::take(&mut of_leaf[leaf]));
    (seen.collect(), cells <= max_cells)
}

/// For each node whether it becomes one cell. Children stand after their parents.
fn prune(tree: &Tree, of_leaf: &[Vec<u32>]) -> Vec<Link> {
    let metre = f64::from(tree.voxels.grid.metre());
    let mut links: Vec<Option<Link>> = vec![None; tree.nodes.len()];
    let mut summaries: Vec<Option<Summary>> = tree.nodes.iter().map(|_| None).collect();
    for index in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[index];
        let [min, max] = tree.voxels.grid.bounds(&node.voxels);
        let size = (max - min).as_dvec3();
        let children = node
            .children
            .map(|children| children.map(|child| summaries[child].take()));
        let (summary, whole, merged) = match children {
            Some([Some(low), Some(high)]) => joined([low, high], node, size, metre),
            _ => {
                let summary = Summary {
                    mean_seen: of_leaf[index].len() as f64,
                    seen: of_leaf[index].clone(),
                    wall_m2: 0.0,
                    boxes_m3: size.element_product(),
                    peopled_m3: filled_m3(&tree.voxels, &node.voxels),
                    uneven_m3: 0.0,
                };
                (summary, true, false)
            }
        };
        links[index] = Some(Link {
            as_one: node.weight() * summary.peopled_m3 * summary.seen.len() as f64,
            whole,
            merged,
        });
        summaries[index] = Some(summary);
    }
    links.into_iter().flatten().collect()
}

/// A subtree as it is cut now.
#[derive(Clone, Copy)]
struct Subtree {
    cells: usize,
    /// What its cells see, each times its weight, together.
    in_cells: f64,
}

/// Makes one cell of the subtree that gains least for each of its cells, again and again while there are more than so many.
/// How many there are then.
fn prune_weakest(tree: &Tree, links: &mut [Link], max_cells: usize) -> usize {
    loop {
        let mut subtrees = vec![
            Subtree {
                cells: 1,
                in_cells: 0.0
            };
            tree.nodes.len()
        ];
        // What lies in one cell is no place to prune any more.
        for index in 0..tree.nodes.len() {
            if links[index].merged {
                let children = tree.nodes[index].children.into_iter().flatten();
                children.for_each(|child| links[child].merged = true);
            }
        }
        let mut weakest: Option<(f64, usize)> = None;
        for index in (0..tree.nodes.len()).rev() {
            let node = &tree.nodes[index];
            subtrees[index].in_cells = links[index].as_one;
            let Some([low, high]) = node.children.filter(|_| !links[index].merged) else {
                continue;
            };
            let cells = subtrees[low].cells + subtrees[high].cells;
            // Nobody is in what lies over heads.
            let above = if node.at_eye_level {
                0.0
            } else {
                subtrees[high].in_cells
            };
            let in_cells = subtrees[low].in_cells + above;
            subtrees[index] = Subtree { cells, in_cells };
            let gain = (links[index].as_one - in_cells) / (cells - 1) as f64;
            if links[index].whole && weakest.is_none_or(|(least, _)| gain < least) {
                weakest = Some((gain, index));
            }
        }
        let cells = subtrees[0].cells;
        match weakest {
            Some((_, index)) if cells > max_cells => links[index].merged = true,
            _ => return cells,
        }
    }
}

/// Two subtrees together, whether they may become one cell, and whether they do.
fn joined([low, high]: [Summary; 2], node: &Node, size: DVec3, metre: f64) -> (Summary, bool, bool) {
    let (boxes_m3, box_m3) = (low.boxes_m3 + high.boxes_m3, size.element_product());
    let people_above = if node.at_eye_level { 0.0 } else { 1.0 };
    let sum = |low: f64, high: f64| low + people_above * high;
    let peopled_m3 = sum(low.peopled_m3, high.peopled_m3);
    let mean_seen =
        sum(low.mean_seen * low.peopled_m3, high.mean_seen * high.peopled_m3) / peopled_m3.max(f64::MIN_POSITIVE);
    let seen = union(&low.seen, &high.seen);
    let wall_m2 = low.wall_m2 + high.wall_m2 + node.wall_m2;
    let whole = wall_m2 <= most_wall_of(size, metre) && boxes_m3 >= MIN_FILL_KEPT * box_m3;
    let gain = (seen.len() as f64 - mean_seen) / (seen.len() as f64).max(1.0);
    let uneven_m3 = if gain > MIN_GAIN {
        peopled_m3
    } else {
        sum(low.uneven_m3, high.uneven_m3)
    };
    let one = whole && is_even(uneven_m3, peopled_m3, metre);
    let summary = Summary {
        seen,
        mean_seen,
        wall_m2,
        boxes_m3: if one { box_m3 } else { boxes_m3 },
        peopled_m3,
        uneven_m3: if one { 0.0 } else { uneven_m3 },
    };
    (summary, whole, one)
}

/// Whether so much that is uneven is no good part of what it is in, in m³.
pub(super) fn is_even(uneven_m3: f64, peopled_m3: f64, metre: f64) -> bool {
    uneven_m3 <= (MIN_UNEVEN * peopled_m3).min(UNEVEN_ROOMS * ROOM_M3 * metre.powi(3))
}

/// The walls along cuts inside a box may be as large as this, in m².
fn most_wall_of(size: DVec3, metre: f64) -> f64 {
    let half_m2 = size.x * size.y + size.y * size.z + size.z * size.x;
    (MAX_WALL_SHARE * half_m2).min(MAX_WALL_M2 * metre.powi(2))
}

/// The same for a node.
pub(super) fn most_wall_m2(tree: &Tree, node: usize) -> f64 {
    let [min, max] = tree.voxels.grid.bounds(&tree.nodes[node].voxels);
    most_wall_of((max - min).as_dvec3(), f64::from(tree.voxels.grid.metre()))
}

pub(super) fn union(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut all: Vec<_> = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
