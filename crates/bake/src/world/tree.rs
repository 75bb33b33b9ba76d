//! Which tree over boxes answers quickly, whatever the boxes?
//!
//! A bounding volume hierarchy by parallel locally-ordered clustering (Meister & Bittner 2018, crate `obvhs`): neighbours are
//! joined whose common box has the least surface. Where many boxes are equal, or so small that their surface is nothing in
//! single precision, no pair is better than another, and the tree becomes a chain as deep as there are boxes. Such sets get a
//! balanced tree along a Z-order curve instead.

use glam::{DVec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2, node::Bvh2Node},
};

use crate::morton;

/// So many boxes that cannot be told apart make no chain that is worth a look.
const MOST_ALIKE: usize = 256;
/// Boxes with less surface than this are as good as points: sums and products of theirs are lost in single precision.
const LEAST_SURFACE: f32 = 1e-30;
/// Boxes in a leaf of a balanced tree.
const LEAF: usize = 4;

/// A tree over boxes; empty for none.
pub(crate) fn tree_over(boxes: &[Aabb]) -> Bvh2 {
    if boxes.is_empty() {
        Bvh2::default()
    } else if most_alike(boxes) > MOST_ALIKE {
        balanced(boxes)
    } else {
        build_bvh2(boxes, BvhBuildParams::medium_build(), &mut Default::default())
    }
}

/// Visits at least what the leaves hold whose boxes meet one.
pub(crate) fn each_near(tree: &Bvh2, around: Aabb, mut visit: impl FnMut(u32)) {
    if !tree.nodes.is_empty() {
        tree.aabb_traverse(around, |tree, leaf| {
            let node = &tree.nodes[leaf as usize];
            let held = node.first_index..node.first_index + node.prim_count;
            held.for_each(|at| visit(tree.primitive_indices[at as usize]));
            true
        });
    }
}

/// How many boxes are equal, or as good as points.
fn most_alike(boxes: &[Aabb]) -> usize {
    if boxes.len() <= MOST_ALIKE {
        return 0;
    }
    let points = boxes.iter().filter(|b| b.half_area() < LEAST_SURFACE).count();
    let mut places: Vec<[u32; 6]> = boxes
        .iter()
        .map(|b| {
            let ([a, b, c], [d, e, f]) = (b.min.to_array(), b.max.to_array());
            [a, b, c, d, e, f].map(f32::to_bits)
        })
        .collect();
    places.sort_unstable();
    let equal = places.chunk_by(|a, b| a == b).map(<[_]>::len).max();
    points.max(equal.unwrap_or(0))
}

/// A tree of the least depth, whose leaves lie along a Z-order curve.
fn balanced(boxes: &[Aabb]) -> Bvh2 {
    let order = z_order(boxes);
    let around = |some: &[u32]| {
        some.iter()
            .fold(Aabb::empty(), |all, index| all.union(&boxes[*index as usize]))
    };
    let nothing = Bvh2Node::new(Aabb::new(Vec3A::ZERO, Vec3A::ZERO), 0, 0);
    let mut nodes = vec![nothing];
    let mut waiting = vec![(0, 0..order.len())];
    while let Some((node, range)) = waiting.pop() {
        let aabb = around(&order[range.clone()]);
        if range.len() <= LEAF {
            nodes[node] = Bvh2Node::new(aabb, range.len() as u32, range.start as u32);
            continue;
        }
        let (first, middle) = (nodes.len(), range.start + range.len() / 2);
        nodes[node] = Bvh2Node::new(aabb, 0, first as u32);
        nodes.extend([nothing; 2]);
        waiting.extend([(first, range.start..middle), (first + 1, middle..range.end)]);
    }
    let mut tree = Bvh2 {
        nodes,
        primitive_indices: order,
        ..Bvh2::default()
    };
    tree.max_depth = tree.max_depth.max(tree.depth(0));
    tree
}

/// Boxes by where their middles lie along a Z-order curve; of equal places the first comes first.
fn z_order(boxes: &[Aabb]) -> Vec<u32> {
    const CELLS: f64 = ((1 << 21) - 1) as f64;
    let middle = |b: &Aabb| b.min.midpoint(b.max).as_dvec3();
    let low = boxes.iter().map(middle).fold(DVec3::INFINITY, DVec3::min);
    let high = boxes.iter().map(middle).fold(DVec3::NEG_INFINITY, DVec3::max);
    let size = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
    let code = |b: &Aabb| {
        let cell = (middle(b) - low) / size * CELLS;
        morton::code(cell.to_array().map(|x| x as u64))
    };
    let mut order: Vec<(u64, u32)> = boxes.iter().map(code).zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(step: f32) -> Vec<Aabb> {
        let corner = |i: u32| step * Vec3A::new((i % 100) as f32, (i / 100) as f32, 0.0);
        (0..10_000).map(|i| Aabb::new(corner(i), corner(i) + step)).collect()
    }

    fn met(tree: &Bvh2, around: Aabb) -> Vec<u32> {
        let mut met = Vec::new();
        each_near(tree, around, |index| met.push(index));
        met.sort_unstable();
        met
    }

    #[test]
    fn boxes_that_cannot_be_told_apart_make_no_chain() {
        let mut with_something_large = grid(1e-25);
        with_something_large.push(Aabb::new(Vec3A::ZERO, Vec3A::ONE));
        let alike = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 10_000];
        for boxes in [grid(1e-25), with_something_large, alike] {
            let tree = tree_over(&boxes);
            assert!(tree.depth(0) < 20, "{}", tree.depth(0));
            let all = met(&tree, Aabb::new(Vec3A::splat(-1.0), Vec3A::splat(2.0)));
            assert_eq!(all, (0..boxes.len() as u32).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_balanced_tree_finds_what_the_other_finds() {
        let boxes = grid(1.0);
        assert!(most_alike(&boxes) <= MOST_ALIKE);
        let tree = balanced(&boxes);
        tree.validate(&boxes, false, false);
        for at in [[3.2, 7.7], [99.5, 0.5], [50.0, 50.0]] {
            let place = Vec3A::new(at[0], at[1], 0.5);
            let holds = |index: &u32| {
                let b = &boxes[*index as usize];
                b.min.cmple(place).all() && b.max.cmpge(place).all()
            };
            let found =
                |tree: &Bvh2| -> Vec<u32> { met(tree, Aabb::new(place, place)).into_iter().filter(holds).collect() };
            assert_eq!(found(&tree), found(&tree_over(&boxes)));
            assert!(!found(&tree).is_empty());
        }
    }
}
