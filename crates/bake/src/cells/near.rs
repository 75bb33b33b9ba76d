//! Which boxes come near another? A tree over boxes in world space, so that nobody compares each with each.
//!
//! The tree is in single precision, relative to the middle of all and rounded outwards; what it finds is asked again in double
//! precision. So what is found is exact, in whatever order the tree stands.

use belvedere_scene::Bounds;
use glam::Vec3A;
use obvhs::{aabb::Aabb, bvh2::Bvh2};

use crate::world::{each_near, tree_over};

/// Boxes that can be found by place.
pub(crate) struct Boxes {
    tree: Bvh2,
    middle: [f64; 3],
    boxes: Vec<Bounds>,
}

impl Boxes {
    /// Makes boxes ready; an empty one is near nothing.
    pub(crate) fn of(boxes: Vec<Bounds>) -> Self {
        let around = boxes.iter().fold(Bounds::EMPTY, |all, one| all.union(one));
        let middle = if around.is_empty() { [0.0; 3] } else { around.center() };
        let mut boxes = Self {
            tree: Bvh2::default(),
            middle,
            boxes,
        };
        let numbered = (0u32..).zip(&boxes.boxes).filter(|(_, bounds)| !bounds.is_empty());
        let (numbers, rounded): (Vec<u32>, Vec<Aabb>) =
            numbered.map(|(number, bounds)| (number, boxes.rounded(bounds))).unzip();
        let mut tree = tree_over(&rounded);
        for index in &mut tree.primitive_indices {
            *index = numbers[*index as usize];
        }
        boxes.tree = tree;
        boxes
    }

    /// Those that share a point with a box, rising.
    pub(crate) fn meeting(&self, bounds: &Bounds) -> Vec<u32> {
        let mut found = Vec::new();
        if bounds.is_empty() {
            return found;
        }
        each_near(&self.tree, self.rounded(bounds), |number| {
            if self.boxes[number as usize].intersects(bounds) {
                found.push(number);
            }
        });
        found.sort_unstable();
        found
    }

    /// Those that hold a point, rising.
    pub(crate) fn holding(&self, point: [f64; 3]) -> Vec<u32> {
        self.meeting(&Bounds { min: point, max: point })
    }

    /// Those after one of them that share a point with it, rising.
    pub(crate) fn after(&self, number: u32) -> impl Iterator<Item = u32> {
        let near = self.meeting(&self.boxes[number as usize]).into_iter();
        near.filter(move |other| *other > number)
    }

    /// A box as the tree holds it: no smaller.
    fn rounded(&self, bounds: &Bounds) -> Aabb {
        let side = |at: &[f64; 3]| [0, 1, 2].map(|axis| (at[axis] - self.middle[axis]) as f32);
        let outwards = |at: [f32; 3], next: fn(f32) -> f32| Vec3A::from(at.map(next));
        Aabb::new(
            outwards(side(&bounds.min), f32::next_down),
            outwards(side(&bounds.max), f32::next_up),
        )
    }
}

/// A box that is larger by so much on every side.
pub(crate) fn grown(bounds: &Bounds, by_m: f64) -> Bounds {
    Bounds {
        min: bounds.min.map(|x| x - by_m),
        max: bounds.max.map(|x| x + by_m),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Boxes far out, many of which touch.
    fn boxes() -> impl Strategy<Value = Vec<Bounds>> {
        let one = (prop::array::uniform3(0i32..12), prop::array::uniform3(-1i32..5));
        prop::collection::vec(one, 0..60).prop_map(|all| {
            let place = |x: i32| 1e7 + 0.1 * f64::from(x);
            let bounds = |(low, size): ([i32; 3], [i32; 3])| Bounds {
                min: low.map(place),
                max: [0, 1, 2].map(|axis| place(low[axis] + size[axis])),
            };
            all.into_iter().map(bounds).collect()
        })
    }

    proptest! {
        #[test]
        fn what_a_tree_finds_is_what_comparing_each_with_each_finds(boxes in boxes()) {
            let tree = Boxes::of(boxes.clone());
            let of_one = |a: u32| tree.after(a).map(move |b| [a, b]);
            let found: Vec<_> = (0..boxes.len() as u32).flat_map(of_one).collect();
            let is_pair = |[a, b]: &[u32; 2]| {
                let [a, b] = [a, b].map(|number| &boxes[*number as usize]);
                !a.is_empty() && !b.is_empty() && a.intersects(b)
            };
            let count = boxes.len() as u32;
            let each = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
            prop_assert_eq!(found, each.filter(is_pair).collect::<Vec<_>>());
        }
    }
}
