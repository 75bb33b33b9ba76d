//! Where do many stand? A quadtree over the ground whose leaves know what stands in them, how solid that is, and which leaves are
//! beside them (§3.1).
//!
//! A leaf is quartered while many stand in it, people and squares of foliage alike, down to the size of a few people, and four
//! become one again when they are nearly empty. Only then neighbours change; when somebody moves, only the solidity of the leaves that he touches does, and it is found
//! when somebody looks: once for all who moved meanwhile.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{Bounds, ObjectId, foliage::Foliage};

use super::{
    Disc, Spot, Square,
    foliage::Plants,
    node::{Leaf, Node},
    solidity::solidity,
};

/// A leaf in which more stand is quartered …
const MOST: usize = 6;
/// … unless it would be smaller.
const SMALLEST_M: f64 = 2.0;

/// All movers of a scene among its foliage, seen from above.
#[derive(Debug)]
pub struct Crowd {
    pub(super) nodes: Vec<Node>,
    free: Vec<usize>,
    plants: Plants,
    discs: BTreeMap<ObjectId, (Disc, Leaf)>,
    /// Whose solidity is not known any more.
    stirred: BTreeSet<Leaf>,
}

impl Crowd {
    /// Nobody is there yet. `bounds` is where everybody will be.
    #[must_use]
    pub fn new(bounds: &Bounds) -> Self {
        let size = bounds.size_m();
        let side_m = size[0].max(size[2]).max(SMALLEST_M);
        let square = Square {
            min: [bounds.min[0], bounds.min[2]],
            side_m,
        };
        Self {
            nodes: vec![Node::leaf(square, None)],
            free: Vec::new(),
            plants: Plants::default(),
            discs: BTreeMap::new(),
            stirred: BTreeSet::new(),
        }
    }

    /// Foliage stands here from now on, before anybody does.
    pub fn plant(&mut self, foliage: &Foliage) {
        self.plants = Plants::of(foliage);
        self.nodes[0].plants = self.plants.count(&self.nodes[0].square);
        self.stirred.insert(0);
        self.split(0);
    }

    /// Somebody is here now.
    pub fn put(&mut self, object: ObjectId, position: [f64; 3], radius_m: f64) {
        let disc = Disc::of(position, radius_m);
        let before = self.discs.get(&object).copied();
        if before.is_some_and(|(known, _)| known == disc) {
            return;
        }
        let leaf = self.leaf_at(disc.middle);
        self.discs.insert(object, (disc, leaf));
        match before {
            Some((_, old)) if old == leaf => _ = self.stirred.insert(leaf),
            Some((_, old)) => {
                self.nodes[old].standing.remove(&object);
                self.stirred.insert(old);
                self.stand(object, leaf);
                self.join(old);
            }
            None => self.stand(object, leaf),
        }
    }

    /// Somebody has gone.
    pub fn take(&mut self, object: ObjectId) {
        if let Some((_, leaf)) = self.discs.remove(&object) {
            self.nodes[leaf].standing.remove(&object);
            self.stirred.insert(leaf);
            self.join(leaf);
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.discs.len()
    }

    /// Whether nobody is there.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.discs.is_empty()
    }

    /// The leaf at a point, or the nearest.
    pub(super) fn leaf_at(&self, point: [f64; 2]) -> Leaf {
        let mut at = 0;
        while let Some(children) = self.nodes[at].children {
            let square = &self.nodes[at].square;
            let upper = |axis: usize| usize::from(point[axis] >= square.min[axis] + 0.5 * square.side_m);
            at = children[upper(0) + 2 * upper(1)];
        }
        at
    }

    /// Where this is, for [`View::of`](super::View::of).
    #[must_use]
    pub fn spot(&self, [x, height_m, z]: [f64; 3]) -> Spot {
        let leaf = self.leaf_at([x, z]);
        Spot {
            leaf,
            square: self.nodes[leaf].square,
            height_m,
        }
    }

    fn stand(&mut self, object: ObjectId, leaf: Leaf) {
        self.nodes[leaf].standing.insert(object);
        self.stirred.insert(leaf);
        self.split(leaf);
    }

    /// Finds out how solid the leaves are in which somebody has moved.
    pub(super) fn settle(&mut self) {
        // A number that is no leaf's any more is that of an empty node, or of one that was quartered.
        for leaf in std::mem::take(&mut self.stirred) {
            if self.nodes[leaf].children.is_none() {
                self.measure(leaf);
            }
        }
    }

    fn measure(&mut self, leaf: Leaf) {
        let node = &self.nodes[leaf];
        let discs = node.standing.iter().map(|object| self.discs[object].0);
        let solidity = solidity(&node.square, discs.clone());
        let heights = discs.fold([f64::NEG_INFINITY, f64::INFINITY], |all, disc| {
            [all[0].max(disc.heights[0]), all[1].min(disc.heights[1])]
        });
        let node = &mut self.nodes[leaf];
        (node.solidity, node.heights) = (solidity, heights);
        node.slabs.get_or_insert_with(|| self.plants.slabs(&node.square));
    }

    fn split(&mut self, leaf: Leaf) {
        let square = self.nodes[leaf].square;
        let half_m = 0.5 * square.side_m;
        if self.nodes[leaf].things() <= MOST || half_m < SMALLEST_M {
            return;
        }
        let standing = std::mem::take(&mut self.nodes[leaf].standing);
        let children = [0, 1, 2, 3].map(|i| {
            let offset = [f64::from(i & 1) * half_m, f64::from(i >> 1) * half_m];
            let quarter = Square {
                min: [square.min[0] + offset[0], square.min[1] + offset[1]],
                side_m: half_m,
            };
            let plants = self.plants.count(&quarter);
            self.add(Node {
                plants,
                ..Node::leaf(quarter, Some(leaf))
            })
        });
        let around = std::mem::take(&mut self.nodes[leaf].beside);
        self.nodes[leaf].children = Some(children);
        (self.nodes[leaf].solidity, self.nodes[leaf].slabs) = (0.0, None);
        self.meet(&children, around, leaf);
        for object in standing {
            let disc = self.discs[&object].0;
            let quarter = self.leaf_at(disc.middle);
            self.discs.insert(object, (disc, quarter));
            self.nodes[quarter].standing.insert(object);
        }
        for child in children {
            self.stirred.insert(child);
            self.split(child);
        }
    }

    /// Makes four leaves one again when there are few in all of them.
    fn join(&mut self, leaf: Leaf) {
        let Some(parent) = self.nodes[leaf].parent else { return };
        let Some(children) = self.nodes[parent].children else {
            return;
        };
        let quarters = children.map(|child| &self.nodes[child]);
        let all_leaves = quarters.iter().all(|quarter| quarter.children.is_none());
        let things: usize = quarters.iter().map(|quarter| quarter.things()).sum();
        if !all_leaves || things > MOST / 2 {
            return;
        }
        let mut around: Vec<Leaf> = Vec::new();
        for child in children {
            let empty = Node::leaf(self.nodes[parent].square, None);
            let gone = std::mem::replace(&mut self.nodes[child], empty);
            around.extend(gone.beside.iter().copied().filter(|other| !children.contains(other)));
            for object in gone.standing {
                if let Some((_, leaf)) = self.discs.get_mut(&object) {
                    *leaf = parent;
                }
                self.nodes[parent].standing.insert(object);
            }
            self.free.push(child);
        }
        around.sort_unstable();
        around.dedup();
        self.nodes[parent].children = None;
        for other in &around {
            self.nodes[*other].beside.retain(|leaf| !children.contains(leaf));
        }
        self.meet(&[parent], around, usize::MAX);
        self.stirred.insert(parent);
        self.join(parent);
    }

    /// Says which of these are beside which of those and of each other, in the place of one that is gone.
    fn meet(&mut self, new: &[Leaf], around: Vec<Leaf>, gone: Leaf) {
        for other in &around {
            self.nodes[*other].beside.retain(|leaf| *leaf != gone);
        }
        for (i, a) in new.iter().enumerate() {
            for b in around.iter().chain(&new[i + 1..]) {
                if self.nodes[*a].square.borders(&self.nodes[*b].square) {
                    self.nodes[*a].beside.push(*b);
                    self.nodes[*b].beside.push(*a);
                }
            }
        }
    }

    fn add(&mut self, node: Node) -> usize {
        if let Some(at) = self.free.pop() {
            self.nodes[at] = node;
            return at;
        }
        self.nodes.push(node);
        self.nodes.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use belvedere_scene::foliage::{FoliageSquare, Slab};
    use proptest::prelude::*;

    use super::*;

    fn leaves(crowd: &Crowd) -> Vec<Leaf> {
        let mut open = vec![0];
        let mut leaves = Vec::new();
        while let Some(at) = open.pop() {
            match crowd.nodes[at].children {
                Some(children) => open.extend(children),
                None => leaves.push(at),
            }
        }
        leaves
    }

    proptest! {
        #[test]
        fn leaves_know_what_stands_in_them_and_what_is_beside_them(
            plants in prop::collection::btree_set([0..16i64, 0..16i64], 0..40),
            steps in prop::collection::vec((0..40u32, 0.0..64.0f64, 0.0..64.0f64, prop::bool::weighted(0.8)), 1..200)
        ) {
            let ground = Bounds { min: [0.0; 3], max: [64.0, 3.0, 64.0] };
            let mut crowd = Crowd::new(&ground);
            let slab = Slab { from_m: 0.0, to_m: 2.0, solidity: 0.3 };
            let squares = plants.into_iter().map(|at| FoliageSquare { at, slabs: vec![slab] }).collect();
            crowd.plant(&Foliage { side_m: 4.0, squares });
            let mut there = BTreeMap::new();
            for (who, x, z, stays) in steps {
                let object = ObjectId(who);
                if stays {
                    crowd.put(object, [x, 1.5, z], 0.3);
                    there.insert(object, [x, z]);
                } else {
                    crowd.take(object);
                    there.remove(&object);
                }
                crowd.settle();
                let leaves = leaves(&crowd);
                let standing: usize = leaves.iter().map(|leaf| crowd.nodes[*leaf].standing.len()).sum();
                prop_assert_eq!(standing, there.len());
                for (object, place) in &there {
                    let leaf = crowd.leaf_at(*place);
                    prop_assert!(crowd.nodes[leaf].standing.contains(object) && crowd.nodes[leaf].square.holds(*place));
                }
                for a in &leaves {
                    let node = &crowd.nodes[*a];
                    let mut beside = node.beside.clone();
                    beside.sort_unstable();
                    let mut expected: Vec<_> = leaves.iter().copied()
                        .filter(|b| b != a && crowd.nodes[*b].square.borders(&node.square)).collect();
                    expected.sort_unstable();
                    prop_assert_eq!(beside, expected);
                    let discs = node.standing.iter().map(|object| crowd.discs[object].0);
                    prop_assert_eq!(node.solidity, solidity(&node.square, discs));
                    prop_assert_eq!(&node.slabs, &Some(crowd.plants.slabs(&node.square)));
                    prop_assert!(node.things() <= MOST || node.square.side_m < 2.0 * SMALLEST_M);
                }
            }
        }
    }
}
