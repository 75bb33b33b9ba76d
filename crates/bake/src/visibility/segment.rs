//! Which boxes of a tree does a segment meet, nearest first? Stops as soon as the asker has what it needs, so that a long
//! segment costs no more than what stands at its beginning.

use std::ops::ControlFlow;

use glam::{Vec3, Vec3A};
use obvhs::{aabb::Aabb, bvh2::Bvh2};

use crate::{
    occluders::Region,
    world::{each_near, tree_over},
};

/// Deepest path of a tree that is followed; a tree over 2³² boxes that halves is half as deep.
const DEPTH: usize = 64;

/// The inverse of a direction that does not lead along an axis at all.
const STEEP: f32 = 1e30;

/// A tree over boxes, each grown by so much.
pub(super) fn tree(boxes: impl Iterator<Item = [Vec3; 2]>, pad_m: f32) -> Bvh2 {
    let boxes: Vec<_> = boxes
        .map(|[min, max]| Aabb::new(Vec3A::from(min - pad_m), Vec3A::from(max + pad_m)))
        .collect();
    tree_over(&boxes)
}

/// The same over boxes of which each has a number, which is what leaves then hold; several may have one.
pub(super) fn numbered_tree(boxes: impl Iterator<Item = (u32, [Vec3; 2])>, pad_m: f32) -> Bvh2 {
    let (numbers, boxes): (Vec<u32>, Vec<_>) = boxes.unzip();
    let mut tree = tree(boxes.into_iter(), pad_m);
    for index in &mut tree.primitive_indices {
        *index = numbers[*index as usize];
    }
    tree
}

/// Visits what the leaves hold whose boxes a segment meets, nearest first: all of a leaf, met or not.
pub(super) fn along(tree: &Bvh2, from: Vec3, to: Vec3, visit: &mut dyn FnMut(u32) -> ControlFlow<()>) {
    if tree.nodes.is_empty() {
        return;
    }
    let (from, to) = (Vec3A::from(from), Vec3A::from(to));
    // Finite, so that a segment in the plane of a side meets it instead of giving 0 · ∞.
    let inverse = (1.0 / (to - from)).clamp(Vec3A::splat(-STEEP), Vec3A::splat(STEEP));
    let enters = |index: u32| {
        let node = &tree.nodes[index as usize];
        let (a, b) = ((node.aabb().min - from) * inverse, (node.aabb().max - from) * inverse);
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element().min(1.0);
        (enter <= leave).then_some(enter)
    };
    let mut stack = Vec::with_capacity(DEPTH);
    stack.extend(enters(0).map(|_| 0));
    while let Some(index) = stack.pop() {
        let node = &tree.nodes[index as usize];
        if node.is_leaf() {
            for at in node.first_index..node.first_index + node.prim_count {
                if visit(tree.primitive_indices[at as usize]).is_break() {
                    return;
                }
            }
            continue;
        }
        let [a, b] = [node.first_index, node.first_index + 1];
        match (enters(a), enters(b)) {
            (Some(enter_a), Some(enter_b)) => stack.extend(if enter_a <= enter_b { [b, a] } else { [a, b] }),
            (a_enters, b_enters) => stack.extend(a_enters.map(|_| a).or(b_enters.map(|_| b))),
        }
    }
}

/// Visits at least what the leaves hold whose boxes meet a region's.
pub(super) fn each_in(tree: &Bvh2, region: &Region, visit: impl FnMut(u32)) {
    each_near(tree, Aabb::new(Vec3A::from(region.min), Vec3A::from(region.max)), visit);
}

#[cfg(test)]
mod tests {
    use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2};

    use super::*;

    fn row() -> Bvh2 {
        let cube = |i: u32| Vec3A::X * (3 * i) as f32;
        let cubes: Vec<_> = (0..40).map(|i| Aabb::new(cube(i), cube(i) + 1.0)).collect();
        // One box a leaf, so that what a leaf holds is what a segment meets.
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..BvhBuildParams::medium_build()
        };
        build_bvh2(&cubes, params, &mut Default::default())
    }

    fn met(from: Vec3, to: Vec3, most: usize) -> Vec<u32> {
        let mut met = Vec::new();
        along(&row(), from, to, &mut |index| {
            met.push(index);
            if met.len() == most {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        met
    }

    #[test]
    fn boxes_come_nearest_first_and_no_more_than_wanted() {
        let (left, right) = (Vec3::new(-5.0, 0.5, 0.5), Vec3::new(200.0, 0.5, 0.5));
        assert_eq!(met(left, right, 3), [0, 1, 2]);
        assert_eq!(met(right, left, 2), [39, 38]);
        assert_eq!(met(left, right, 99), (0..40).collect::<Vec<_>>());
    }

    #[test]
    fn a_segment_ends_where_it_ends() {
        assert_eq!(met(Vec3::new(-5.0, 0.5, 0.5), Vec3::new(3.5, 0.5, 0.5), 99), [0, 1]);
        assert!(met(Vec3::new(-5.0, 2.0, 0.5), Vec3::new(200.0, 2.0, 0.5), 99).is_empty());
        assert_eq!(met(Vec3::new(6.5, -9.0, 0.5), Vec3::new(6.5, 9.0, 0.5), 99), [2]);
    }
}
