//! What may be seen from a region? Everything that cannot be proved hidden.
//!
//! Works down the tree of object boxes, nearest first: a box of the tree that is hidden takes all it holds with it (boxes
//! before primitives; Cohen-Or & Zadicario 1998, *Ray shooting*), so cost grows with what is visible. What is left is
//! asked about once more with bodies fused ([`super::fusion`]); bodies of hidden objects take no part (occluded
//! occluders are redundant). What is still left is asked about from halves of the region, coarse to fine: seen from the
//! region is what is seen from one of its halves.
//!
//! Guarantee: never misses an object, see [`super::prover`] and [`super::fusion`] for what is assumed.

use glam::Vec3;
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
};

use super::{
    fusion::Shadows,
    prover::{Blocker, Proofs, Prover, Witness},
};
use crate::{
    occluders::{Occluders, Region},
    world::World,
};

/// Which proofs are used, and how finely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConservativeSettings {
    /// One body, or walls with openings, or both.
    pub proofs: Proofs,
    /// Whether bodies may hide together.
    pub fusion: bool,
    /// How often a region is halved for what could not be proved hidden from all of it.
    pub halvings: u32,
}

/// All objects as boxes, and what hides them.
pub struct Scenery {
    /// What hides.
    pub blocker: Blocker,
    /// The box around each object; `None` for one without geometry, which nobody sees.
    pub targets: Vec<Option<Region>>,
    tree: Bvh2,
    /// Bodies of each object.
    bodies_of: Vec<std::ops::Range<u32>>,
}

struct TargetBox(Aabb);

impl Boundable for TargetBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Scenery {
    /// Prepares a world for questions.
    #[must_use]
    pub fn of(world: &World) -> Self {
        Self::with(world, Occluders::of(world))
    }

    /// Prepares a world in which just these hide.
    #[must_use]
    pub fn with(world: &World, occluders: Occluders) -> Self {
        let targets = world
            .object_bounds()
            .iter()
            .map(|b| (!b.is_empty()).then(|| Region::around(world, b)))
            .collect();
        Self::new(occluders, targets)
    }

    /// Prepares occluders, whose bodies stand in the order of their objects, and the boxes of objects.
    #[must_use]
    pub fn new(occluders: Occluders, targets: Vec<Option<Region>>) -> Self {
        let boxes: Vec<_> = targets
            .iter()
            .map(|t| {
                // An object without geometry is in the tree as a box that nothing meets.
                let nowhere = Region::of_box(Vec3::INFINITY, Vec3::INFINITY);
                let t = t.as_ref().unwrap_or(&nowhere);
                TargetBox(Aabb::new(t.min.into(), t.max.into()))
            })
            .collect();
        let known: Vec<_> = (0..targets.len()).filter(|i| targets[*i].is_some()).collect();
        let boxes: Vec<_> = known.iter().map(|i| TargetBox(boxes[*i].0)).collect();
        let mut tree = if boxes.is_empty() {
            Bvh2::default()
        } else {
            build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default())
        };
        for index in &mut tree.primitive_indices {
            *index = known[*index as usize] as u32;
        }
        let bodies_of = (0..targets.len() as u32)
            .map(|object| {
                let first = occluders.bodies.partition_point(|b| b.object < object) as u32;
                let end = occluders.bodies.partition_point(|b| b.object <= object) as u32;
                first..end
            })
            .collect();
        Self {
            blocker: Blocker::new(occluders),
            targets,
            tree,
            bodies_of,
        }
    }
}

/// Asks what can be seen from regions of one scenery.
pub struct Observer<'a> {
    scenery: &'a Scenery,
    settings: ConservativeSettings,
    prover: Prover<'a>,
    shadows: Shadows,
    /// Objects that are known to be visible, whatever is proved.
    known: Vec<bool>,
}

impl<'a> Observer<'a> {
    /// An observer that knows nothing yet.
    #[must_use]
    pub fn new(scenery: &'a Scenery, settings: ConservativeSettings) -> Self {
        Self {
            scenery,
            settings,
            prover: Prover::new(&scenery.blocker, settings.proofs),
            shadows: Shadows::default(),
            known: vec![false; scenery.targets.len()],
        }
    }

    /// Objects that may be seen from a region, rising. `seen` are known to be visible: nobody has to ask about them.
    pub fn visible(&mut self, eye: &Region, seen: &[u32]) -> Vec<u32> {
        for object in seen {
            self.known[*object as usize] = true;
        }
        let mut open = self.not_hidden_by_one(eye);
        // Asked again from halves, objects that are already known to be visible are no question any more; but they still
        // take part in hiding others.
        let mut visible: Vec<u32> = open.iter().copied().filter(|o| self.known[*o as usize]).collect();
        visible.extend(seen.iter().filter(|o| open.binary_search(o).is_err()));
        self.refine(eye, &mut open, self.settings.halvings, &mut visible);
        for object in &visible {
            self.known[*object as usize] = false;
        }
        for object in seen {
            self.known[*object as usize] = false;
        }
        visible.sort_unstable();
        visible.dedup();
        visible
    }

    /// Why an object cannot be seen from a region, if that can be proved for the region as a whole.
    pub fn witness(&mut self, eye: &Region, object: u32) -> Option<Witness> {
        let target = self.scenery.targets[object as usize].as_ref()?;
        if let Some(witness) = self.prover.hides(eye, target) {
            return Some(witness);
        }
        let mut open = self.not_hidden_by_one(eye);
        self.fuse(eye, &mut open);
        (open.binary_search(&object).is_err()).then_some(Witness::Fused)
    }

    /// Objects that no single proof hides from all of the region, rising.
    fn not_hidden_by_one(&mut self, eye: &Region) -> Vec<u32> {
        let tree = &self.scenery.tree;
        let mut open = Vec::new();
        if tree.nodes.is_empty() {
            return open;
        }
        let region = |index: u32| {
            let aabb = tree.nodes[index as usize].aabb();
            Region::of_box(Vec3::from(aabb.min), Vec3::from(aabb.max))
        };
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let node = &tree.nodes[index as usize];
            if node.is_leaf() {
                for at in node.first_index..node.first_index + node.prim_count {
                    let object = tree.primitive_indices[at as usize];
                    let target = self.scenery.targets[object as usize].as_ref();
                    if self.known[object as usize]
                        || target.is_some_and(|target| self.prover.hides(eye, target).is_none())
                    {
                        open.push(object);
                    }
                }
            } else if self.prover.hides(eye, &region(index)).is_none() {
                // The nearer child last, so that it is looked at first.
                let children = [node.first_index, node.first_index + 1];
                let [a, b] = children.map(|child| region(child).distance_m(eye));
                stack.extend(if a <= b { [children[1], children[0]] } else { children });
            }
        }
        open.sort_unstable();
        open
    }

    /// Takes out what bodies of the others hide together. Objects that are known to be visible stay.
    fn fuse(&mut self, eye: &Region, open: &mut Vec<u32>) {
        let scenery = self.scenery;
        let occluders = &scenery.blocker.occluders;
        let target = |object: u32| scenery.targets[object as usize].as_ref();
        let lowest = |objects: &[u32]| {
            objects
                .iter()
                .filter_map(|o| target(*o))
                .map(|t| t.min.y)
                .fold(f32::MAX, f32::min)
        };
        let mut hidden: Vec<u32> = Vec::new();
        // What lies below the eyes has its own floor.
        let (level, below): (Vec<u32>, Vec<u32>) = open
            .iter()
            .partition(|o| target(**o).is_none_or(|t| t.min.y >= eye.min.y));
        for (floor_m, questions) in [(eye.min.y, level), (lowest(&below), below)] {
            let questions: Vec<_> = questions.into_iter().filter(|o| !self.known[*o as usize]).collect();
            if questions.is_empty() {
                continue;
            }
            let bodies = open.iter().flat_map(|o| scenery.bodies_of[*o as usize].clone());
            let bodies = bodies.map(|index| &occluders.bodies[index as usize]);
            self.shadows.draw(eye, floor_m, bodies);
            hidden.extend(
                questions
                    .iter()
                    .filter(|o| target(**o).is_some_and(|t| self.shadows.hide(t))),
            );
        }
        hidden.sort_unstable();
        open.retain(|object| hidden.binary_search(object).is_err());
    }

    /// Adds to `visible` what of `open` may be seen from this part of the region.
    fn refine(&mut self, eye: &Region, open: &mut Vec<u32>, halvings: u32, visible: &mut Vec<u32>) {
        if self.settings.fusion {
            self.fuse(eye, open);
        }
        let questions = open.iter().filter(|o| !self.known[**o as usize]).count();
        if questions == 0 {
            return;
        }
        if halvings == 0 {
            for object in open
                .iter()
                .filter(|o| !self.known[**o as usize])
                .copied()
                .collect::<Vec<_>>()
            {
                self.known[object as usize] = true;
                visible.push(object);
            }
            return;
        }
        for half in halves(eye) {
            let mut left: Vec<u32> = Vec::with_capacity(open.len());
            for object in open.iter() {
                let target = self.scenery.targets[*object as usize].as_ref();
                if self.known[*object as usize] || target.is_some_and(|t| self.prover.hides(&half, t).is_none()) {
                    left.push(*object);
                }
            }
            self.refine(&half, &mut left, halvings - 1, visible);
        }
    }
}

/// Two boxes that together are the box around a region, cut across its longest edge.
fn halves(region: &Region) -> [Region; 2] {
    let size = region.max - region.min;
    let axis = size.max_position();
    let middle = region.center()[axis];
    let (mut low, mut high) = (region.max, region.min);
    low[axis] = middle;
    high[axis] = middle;
    [Region::of_box(region.min, low), Region::of_box(high, region.max)]
}
