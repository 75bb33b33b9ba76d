//! Does a straight way meet anything that hides? For many questions about one scene.
//!
//! All faces in world space under a tree of boxes that are halved at the median of the longest side (Goldsmith and Salmon,
//! *Automatic Creation of Object Hierarchies for Ray Tracing*, 1987, without their cost). The semantics are those of
//! [`crate::scene`], but that doors may be closed: then their faces hide as any other's do. Cost: a few dozen boxes and faces for a
//! question.

use std::collections::BTreeSet;

use belvedere_scene::ObjectId;
use glam::DVec3;

use crate::{block::Block, scene::Scene};

/// So many faces in a leaf.
const LEAF: usize = 4;
/// Ways end this share before what they lead to and begin so far from where they come from.
const CLEARANCE: f64 = 1e-9;

/// All that may hide.
#[derive(Debug)]
pub struct Blockade {
    faces: Vec<Face>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) corners: [DVec3; 3],
    /// It hides from its front only, where the corners go round counter-clockwise.
    front_only: bool,
    /// The door that it belongs to: it hides while that is closed.
    door: Option<ObjectId>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Of a leaf the first face, else the second child; the first child is the next node.
    at: usize,
    /// How many faces; zero of an inner node.
    count: usize,
}

impl Blockade {
    /// What hides in a scene, and what its doors hide when they are closed.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let mut faces = Vec::new();
        for object in scene.objects.iter() {
            let (model, mirrored) = (&scene.models[object.model], object.mirrored());
            for patch in model.patches.iter().filter(|patch| !patch.surface.see_through) {
                let placed = patch.triangles.iter().map(|triangle| {
                    let mut corners = triangle.map(|i| object.world_from_object.transform_point3(model.position(i)));
                    if mirrored {
                        corners.swap(1, 2);
                    }
                    Face {
                        corners,
                        front_only: !patch.surface.double_sided,
                        door: object.door.then_some(object.id),
                    }
                });
                // Rounding to a lattice makes lines and points of slivers, which hide nothing.
                faces.extend(placed.filter(|face| face.plane().is_some()));
            }
        }
        let mut nodes = Vec::new();
        if !faces.is_empty() {
            let end = faces.len();
            grow(&mut nodes, &mut faces, 0, end);
        }
        Self { faces, nodes }
    }

    /// Whether one sees straight from one point to another while these doors are closed and the others open.
    #[must_use]
    pub fn sees(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>) -> bool {
        let mut free = true;
        self.meet(from, to, closed, &mut |_| {
            free = false;
            None
        });
        free
    }

    /// How far one sees on that way: the share of it before anything hides the rest, 1 for all of it.
    #[must_use]
    pub fn reach(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>) -> f64 {
        let mut nearest = 1.0f64;
        self.meet(from, to, closed, &mut |share| {
            nearest = nearest.min(share);
            Some(nearest)
        });
        nearest
    }

    /// Whether `wanted` takes a face that hides on the way from one point to another.
    pub(crate) fn faces_along(
        &self,
        from: DVec3,
        to: DVec3,
        closed: &BTreeSet<ObjectId>,
        wanted: &mut dyn FnMut(&Face) -> bool,
    ) -> bool {
        let way = to - from;
        self.visit(&|node| node.entered(from, way, 1.0).is_some(), &mut |face| {
            face.hides_at(from, way, closed).is_some() && wanted(face)
        })
    }

    /// Calls with faces that may meet a box, until it is done.
    pub(crate) fn faces_in(&self, around: &Block, done: &mut dyn FnMut(&Face) -> bool) {
        self.visit(
            &|node| node.min.cmple(around.max).all() && around.min.cmple(node.max).all(),
            done,
        );
    }

    fn visit(&self, meets: &dyn Fn(&Node) -> bool, done: &mut dyn FnMut(&Face) -> bool) -> bool {
        let mut open = if self.nodes.is_empty() { vec![] } else { vec![0] };
        while let Some(number) = open.pop() {
            let node = &self.nodes[number];
            if !meets(node) {
                continue;
            }
            if node.count == 0 {
                open.extend([number + 1, node.at]);
            } else if self.faces[node.at..node.at + node.count].iter().any(&mut *done) {
                return true;
            }
        }
        false
    }

    /// Calls with the share of the way at each face that hides, for the share up to which others are wanted, if any is.
    fn meet(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>, found: &mut dyn FnMut(f64) -> Option<f64>) {
        let (way, mut wanted) = (to - from, 1.0);
        let mut open = Vec::with_capacity(64);
        let enters = |number: usize, before: f64| Some((self.nodes.get(number)?.entered(from, way, before)?, number));
        open.extend(enters(0, wanted));
        while let Some((enter, number)) = open.pop() {
            if enter > wanted {
                continue;
            }
            let node = &self.nodes[number];
            if node.count == 0 {
                // The nearer one first: what it holds may spare the other.
                match (enters(number + 1, wanted), enters(node.at, wanted)) {
                    (Some(a), Some(b)) => open.extend(if a.0 <= b.0 { [b, a] } else { [a, b] }),
                    (a, b) => open.extend(a.or(b)),
                }
                continue;
            }
            let faces = &self.faces[node.at..node.at + node.count];
            for share in faces.iter().filter_map(|face| face.hides_at(from, way, closed)) {
                match found(share) {
                    Some(up_to) => wanted = up_to,
                    None => return,
                }
            }
        }
    }
}

/// Adds the tree over some faces, which it sorts.
fn grow(nodes: &mut Vec<Node>, faces: &mut [Face], first: usize, end: usize) {
    let some = &mut faces[first..end];
    let around = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p), max.max(p))
        })
    };
    let (min, max) = around(&mut some.iter().flat_map(|face| face.corners));
    let number = nodes.len();
    let count = if some.len() <= LEAF { some.len() } else { 0 };
    let at = first;
    nodes.push(Node { min, max, at, count });
    if count > 0 {
        return;
    }
    let (low, high) = around(&mut some.iter().map(Face::middle));
    let axis = (high - low).max_position();
    let half = some.len() / 2;
    some.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    grow(nodes, faces, first, first + half);
    nodes[number].at = nodes.len();
    grow(nodes, faces, first + half, end);
}

impl Node {
    /// The share of a way at which it enters, if that is not beyond another one.
    fn entered(&self, from: DVec3, way: DVec3, before: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0f64, before);
        for axis in 0..3 {
            if way[axis] == 0.0 {
                if from[axis] < self.min[axis] || from[axis] > self.max[axis] {
                    return None;
                }
                continue;
            }
            let inverse = 1.0 / way[axis];
            let (a, b) = (
                (self.min[axis] - from[axis]) * inverse,
                (self.max[axis] - from[axis]) * inverse,
            );
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
            if enter > leave {
                return None;
            }
        }
        Some(enter)
    }
}

impl Face {
    /// Its unit normal and how far that leads from zero to its plane; none of a face without an area.
    pub(crate) fn plane(&self) -> Option<(DVec3, f64)> {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some((normal, normal.dot(a)))
    }

    /// Whether it hides from the side from which another one, which lies in its plane, hides.
    pub(crate) fn hides_like(&self, other: &Self, closed: &BTreeSet<ObjectId>) -> bool {
        let shuts = self.door.is_none_or(|door| closed.contains(&door));
        let same_side = || match (self.plane(), other.plane()) {
            (Some((ours, _)), Some((theirs, _))) => ours.dot(theirs) > 0.0,
            _ => false,
        };
        shuts && (!self.front_only || (other.front_only && same_side()))
    }

    fn middle(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    /// The share of a way at which it hides the rest.
    fn hides_at(&self, from: DVec3, way: DVec3, closed: &BTreeSet<ObjectId>) -> Option<f64> {
        if self.door.is_some_and(|door| !closed.contains(&door)) {
            return None;
        }
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let approach = normal.dot(way);
        if approach == 0.0 || (self.front_only && approach > 0.0) {
            return None;
        }
        let share = normal.dot(a - from) / approach;
        if !(CLEARANCE..=1.0 - CLEARANCE).contains(&share) {
            return None;
        }
        let point = from + share * way;
        let inside = |from: DVec3, to: DVec3| normal.dot((to - from).cross(point - from)) >= 0.0;
        (inside(a, b) && inside(b, c) && inside(c, a)).then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::{
        scene::Object,
        testing::{BOTH_SIDES, GLASS, OPAQUE, object, quad, scene},
    };

    const NONE: BTreeSet<ObjectId> = BTreeSet::new();

    fn z(z: f64) -> DVec3 {
        DVec3::new(0.1, 0.2, z)
    }

    #[test]
    fn a_face_hides_where_it_is_drawn_and_glass_never_does() {
        let of = |surface| Blockade::of(&scene(vec![quad([-1.0; 2], [1.0; 2], 0.0, surface)]));
        for (surface, from_front, from_back) in [(OPAQUE, false, true), (BOTH_SIDES, false, false), (GLASS, true, true)]
        {
            let blockade = of(surface);
            assert_eq!(blockade.sees(z(1.0), z(-1.0), &NONE), from_front);
            assert_eq!(blockade.sees(z(-1.0), z(1.0), &NONE), from_back);
            assert!(blockade.sees(z(2.0), z(1.0), &NONE), "before it");
            assert!(
                blockade.sees(DVec3::new(2.0, 0.0, 1.0), DVec3::new(2.0, 0.0, -1.0), &NONE),
                "beside it"
            );
        }
        assert!(Blockade::of(&scene(vec![])).sees(z(1.0), z(-1.0), &NONE));
    }

    #[test]
    fn a_door_hides_while_it_is_closed_and_a_mirror_turns_faces() {
        let model = quad([-1.0; 2], [1.0; 2], 0.0, OPAQUE);
        let place = |transform| Object {
            world_from_object: transform,
            ..object(0, transform)
        };
        let door = Object {
            door: true,
            ..place(DMat4::IDENTITY)
        };
        let blockade = Blockade::of(&Scene::new(vec![model.clone()], vec![door]));
        assert!(blockade.sees(z(1.0), z(-1.0), &NONE));
        assert!(!blockade.sees(z(1.0), z(-1.0), &BTreeSet::from([ObjectId(0)])));
        let mirrored = place(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        let blockade = Blockade::of(&Scene::new(vec![model], vec![mirrored]));
        assert!(!blockade.sees(z(1.0), z(-1.0), &NONE), "the front is still in front");
    }

    #[test]
    fn a_tree_of_many_faces_says_what_each_face_says() {
        let quads = (0..250u8).map(f32::from).map(|i| {
            let [x, y] = [(i * 0.37).sin() * 4.0, (i * 0.73).cos() * 4.0];
            quad([x, y], [x + 0.8, y + 0.6], (i * 0.11).sin() * 5.0, BOTH_SIDES)
        });
        let blockade = Blockade::of(&scene(quads.collect()));
        let mut random = crate::random::Random::of([1, 2, 3]);
        let mut point = |z: f64| DVec3::new(10.0 * random.unit() - 5.0, 10.0 * random.unit() - 5.0, z);
        let mut seen = 0;
        for _ in 0..500 {
            let (from, to) = (point(-6.0), point(6.0));
            let hits = blockade
                .faces
                .iter()
                .filter_map(|face| face.hides_at(from, to - from, &NONE));
            let plainly = hits.fold(1.0, f64::min);
            assert_eq!(blockade.reach(from, to, &NONE), plainly);
            assert_eq!(blockade.sees(from, to, &NONE), plainly == 1.0);
            seen += usize::from(plainly == 1.0);
        }
        assert!((50..450).contains(&seen), "{seen}");
    }
}
